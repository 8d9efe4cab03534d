"""A fitted loop in a device: draws of its torques at the joint, each in a new mounting, and its damping from a ring-down."""

import re
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.addons.device.description import Device, Known, missing_settings, read_device
from bowdenfit.cable.drive import LEAST_EXPONENT
from bowdenfit.cable.elasticity import PRELOAD
from bowdenfit.cable.sensors import RUN_SCATTER
from bowdenfit.errors import DatasetError, DescriptionError, UsageError
from bowdenfit.inference.draws import for_each_draw
from bowdenfit.kinds.ringdown.kind import RingDownTable
from bowdenfit.physics.loop import free_motion_loss, slack_load
from bowdenfit.questions.bends.answer import elastic_answers
from bowdenfit.questions.bends.bent_cable import BentCable, has_preload, has_stretch
from bowdenfit.questions.error_budget import with_bench_errors
from bowdenfit.results.record import Record
from bowdenfit.results.store import load
from bowdenfit.units import conversion_factor
from bowdenfit.words import listed, shown

DRAWS = 4000  # of a fit's, evenly picked; a quantile of 5 % is then known to 0.3 %
BENDS = 25  # wrap angles at which a range is looked at
SCATTER, RADIUS, STIFFNESS, SPRING = "rope.mounting_scatter", "joint.pulley_radius", "rope.stiffness", "rope.spring"
_PER_METRE = 1e-3  # N mm to N m, and N/mm times mm^2 to N m/rad
_TOLERANCE = 1e-6  # of angles and of ratios, above rounding of units
_MOUNTING_STREAM, _SPRING_STREAM = 31, 33  # numbers of the random streams, beside the seed of the fit
_ANGLE = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\W\d]\S*)", re.ASCII)


@dataclass(frozen=True)
class LoopDraws:
    """A loop at wrap angles, draws first; every draw is in a mounting of its own.

    Args:
        bends: Wrap angles [rad].
        friction: T_f, what moving the loop takes [N m].
        preload: P r [N m].
        exponent: Lambda of one side [1].
        stiffness: K of the whole loop at the joint, its springs with it [N m/rad]; None where nothing tells it.
        without_mounting: `friction` of the coefficients alone, as if every mounting did the same [N m].
        scatter: Median of the scatter from mounting to mounting [1].
        scatter_from_fit: Whether the fit determines it.
        references: Preloads at the reference angle that the cable might be given [N].
        friction_by_preload: Friction torque with each of those preloads, at the worst bend, draws by preloads [N m].
        slack_torque: Motor torque from which a side goes slack, at the worst bend, draws by preloads [N m].
    """

    bends: np.ndarray
    friction: np.ndarray
    preload: np.ndarray
    exponent: np.ndarray
    stiffness: np.ndarray | None
    without_mounting: np.ndarray
    scatter: float
    scatter_from_fit: bool
    references: np.ndarray
    friction_by_preload: np.ndarray
    slack_torque: np.ndarray


def draw_loop(fit: Record, bends: np.ndarray, device: Device | None, preloads: np.ndarray) -> LoopDraws:
    """Return draws of a loop at wrap angles.

    Args:
        fit: The fit.
        bends: Wrap angles [rad].
        device: What else is known.
        preloads: Shares of the cable's own preload that it might be given instead [1].

    Raises:
        UsageError: Nothing tells the preload of the loop.
        DescriptionError: The radius of the pulley or the scatter of mountings is known neither from the fit nor stated.
    """
    fit = with_bench_errors(fit)
    draws = fit.draws()
    if not has_preload(fit.model):
        raise UsageError(
            "nothing measured on this cable says what its preload is, and friction follows from it; add a table of preload, or "
            "of the loop, to cable.toml."
        )
    radius, (scatter, from_fit) = _pulley_radius(fit, device), _mounting_scatter(fit, device)
    references = _typical_value(fit, PRELOAD) * preloads
    n = len(draws.flat_z)
    rows = np.unique(np.linspace(0, n - 1, min(n, DRAWS)).round().astype(int))
    mounting = (
        fit.mounting()[rows]
        if RUN_SCATTER in draws.values
        else scatter * _draw_standard_normal(fit, _MOUNTING_STREAM, len(rows))
    )
    with jax.enable_x64(True):
        bent = BentCable(fit.model, elastic_answers(fit).contact, jnp.asarray(bends))
        stretches = has_stretch(fit.model)

        def implied(z_and_mounting: Array) -> dict[str, Array]:
            values = fit.model.space.constrain(z_and_mounting[:-1])
            preloads_at_bends = bent.preloads(
                values, jnp.concatenate([jnp.reshape(values[PRELOAD], 1), jnp.asarray(references)])
            )
            nominal, preload, others = bent.exponent(values), preloads_at_bends[0], preloads_at_bends[1:]
            exponent = jnp.maximum(nominal + z_and_mounting[-1], LEAST_EXPONENT)
            loop = {
                "exponent": exponent,
                "preload": preload,
                "without_mounting": free_motion_loss(preload, nominal),
            }
            loop["felt"] = jnp.max(free_motion_loss(others, exponent), axis=1)
            loop["slack_from"] = jnp.min(slack_load(others, exponent, bent.rope(values)), axis=1)
            return loop | ({"stiffness": bent.stiffness(values, 0.0)} if stretches else {})

        program = for_each_draw(implied, fit.model.space.size + 1, run_once=True)
        loop = program(np.column_stack([draws.flat_z[rows], mounting]))
    arm = radius * _PER_METRE
    stiffness = loop["stiffness"] * radius**2 * _PER_METRE if stretches else None
    shape = loop["preload"].shape
    return LoopDraws(
        bends, 2 * arm * loop["preload"] * loop["exponent"], arm * loop["preload"], loop["exponent"],
        _joint_stiffness(fit, stiffness, radius, device, shape), arm * loop["without_mounting"], scatter, from_fit, references,
        arm * loop["felt"], arm * loop["slack_from"],
    )  # fmt: skip


def _typical_value(fit: Record, name: str) -> float:
    """Return the median of a parameter, or what it is fixed at, in its internal unit."""
    parameter = next(p for p in fit.model.space.parameters if p.name == name)
    if parameter.fixed is not None:
        return float(parameter.fixed)
    return float(np.median(fit.draws().values[name]) / parameter.shown_scale)


def _draw_standard_normal(fit: Record, number: int, n: int) -> np.ndarray:
    """Draw standard normal values from a stream of random numbers of their own."""
    return np.random.default_rng([fit.provenance.seed, number]).standard_normal(n)


def _pulley_radius(fit: Record, device: Device | None) -> float:
    """Return the radius of the pulley at the joint [mm]: of cable.toml, else of device.toml."""
    cable_radius = fit.dataset.description.cable.output_pulley_radius
    stated = device.known(RADIUS).get(RADIUS) if device is not None else None
    if cable_radius is None and stated is None:
        raise missing_settings("the torque at the joint", [RADIUS])
    if cable_radius is None and stated is not None:
        return stated.value * 1e3
    assert cable_radius is not None
    radius = cable_radius.to("length")
    if stated is not None and abs(stated.value * 1e3 / radius - 1) > _TOLERANCE:
        raise DescriptionError(
            f"device.toml, {RADIUS}: {stated.value * 1e3:g} mm, but cable.toml of this fit has an output_pulley_radius of "
            f"{radius:g} mm; leave it out, or correct one of them."
        )
    return radius


def _mounting_scatter(fit: Record, device: Device | None) -> tuple[float, bool]:
    """Return the median scatter of the friction exponent between mountings, and whether the fit determines it."""
    if RUN_SCATTER in {p.name for p in fit.model.space.parameters}:
        return _typical_value(fit, RUN_SCATTER), True
    if device is None or not device.states(SCATTER):
        raise missing_settings(
            "this fit has one mounting of the cable and cannot say how the next one will differ; what is safe in the next",
            [SCATTER],
        )
    return device.known(SCATTER)[SCATTER].value, False


def _joint_stiffness(
    fit: Record, fitted: np.ndarray | None, radius: float, device: Device | None, shape: tuple[int, ...]
) -> np.ndarray | None:
    """Return the stiffness at the joint with its springs, draws by wrap angles [N m/rad]: of the fit, else of device.toml."""
    stated = device.known(STIFFNESS, SPRING) if device is not None else {}
    noise = _draw_standard_normal(fit, _SPRING_STREAM, shape[0])
    if fitted is None:
        if STIFFNESS not in stated:
            return None
        known = stated[STIFFNESS]
        fitted = np.repeat(np.maximum(known.value + known.sd * noise, known.value / 100)[:, None], shape[1], axis=1)
    elif STIFFNESS in stated:
        raise DescriptionError(
            f"device.toml, {STIFFNESS}: this fit determines it already, from its table of stretch under load; leave it out."
        )
    if SPRING not in stated:
        return fitted
    spring = np.maximum(stated[SPRING].value + stated[SPRING].sd * noise, stated[SPRING].value / 100)
    return 1 / (1 / fitted + 1 / (2 * spring[:, None] * (radius * 1e-3) ** 2))


def read_bends(fit: Record, stated: str | tuple[tuple[float, str], tuple[float, str]] | None) -> np.ndarray:
    """Return wrap angles across a stated range [rad], or across all that was measured.

    Args:
        fit: The fit.
        stated: From and to, such as "45deg:180deg", or a number with its unit each.

    Raises:
        UsageError: The fit is not of a loop, or this is no range, or leaves what was measured.
    """
    if not fit.model.cable.is_loop:
        raise UsageError(
            'a device moves its joint both ways by a pull-pull loop; this cable has no kind = "loop" under [cable] of '
            "cable.toml."
        )
    measured = elastic_answers(fit).measured_bends
    if stated is None and not len(measured):
        raise UsageError("nothing was measured at a wrap angle of its own; name a range, as --wrap-angle 45deg:180deg.")
    low, high = (float(measured[0]), float(measured[-1])) if stated is None else _read_range(stated)
    if len(measured) and not measured[0] - _TOLERANCE <= low <= high <= measured[-1] + _TOLERANCE:
        ends = np.rad2deg([low, high, measured[0], measured[-1]])
        raise UsageError(
            f"--wrap-angle {ends[0]:.4g}deg:{ends[1]:.4g}deg leaves the wrap angles measured, {ends[2]:.4g} to {ends[3]:.4g} "
            "deg, and the friction there is not known; measure there too, or name a narrower range."
        )
    return np.linspace(low, high, BENDS) if high > low else np.array([low])


def _read_range(stated: str | tuple[tuple[float, str], tuple[float, str]]) -> tuple[float, float]:
    """Return both ends of a stated range [rad]."""
    parts = [_split_number_and_unit(part) for part in stated.split(":")] if isinstance(stated, str) else list(stated)
    usage = "--wrap-angle: write a range as 45deg:180deg, the lower end first, or one angle as 90deg."
    if len(parts) not in (1, 2):
        raise UsageError(usage)
    try:
        ends = [value * conversion_factor(unit, "angle") for value, unit in parts]
    except DatasetError as error:
        raise UsageError(f"--wrap-angle: {error}.") from None
    if not np.all(np.isfinite(ends)) or ends[0] < 0 or ends[-1] < ends[0]:
        raise UsageError(usage)
    return ends[0], ends[-1]


def _split_number_and_unit(part: str) -> tuple[float, str]:
    """Split a number from its unit."""
    match = _ANGLE.fullmatch(part.strip())
    if match is None:
        raise UsageError(f"--wrap-angle: {shown(part)} is not a number with its unit; write a range as 45deg:180deg.")
    return float(match[1]), match[2]


DAMPING, JOINT_DAMPING, RINGDOWN = "rope.damping", "joint.damping", "rope.ringdown"
_INERTIA, _RING_DOWN_DRAWS = "joint.inertia", 4000


def read_device_with_ring_down(fit: Record, path: Path) -> Device:
    """Read a device file; take the damping of the rope from a ring-down of the fit or of results named in the file.

    The released joint is damped by rope and joint together, so that a ring-down determines the sum of both: the known
    damping of the joint is subtracted from each draw.

    Args:
        fit: The fit of the cable.
        path: The file.

    Raises:
        DescriptionError: See `read_device`; or damping is stated and told, or less is told than the joint alone has.
        UsageError, StoreError: The results that it names cannot be read, or have no posterior.
    """
    device = read_device(path)
    folder = device.rope.ringdown
    has_ring_down = fit.dataset.measurements.table(RingDownTable) is not None
    if folder is None and not has_ring_down:
        return device
    results = path.parent / folder if folder is not None else None
    source = f"{RINGDOWN} names" if results else "the fit itself has"
    if device.states(DAMPING):
        raise DescriptionError(
            f"device.toml, {DAMPING}: {source} a ring-down, which determines it already; leave one of the two out."
        )
    ring_down = fit if results is None else load(results)
    if ring_down.dataset.measurements.table(RingDownTable) is None:
        raise DescriptionError(
            f"device.toml, {RINGDOWN}: {ring_down.name} was fitted without a table ringdown; name the results of "
            'a fit that has one, as [tables] ringdown = { file = "ringdown.csv" }.'
        )
    if not ring_down.converged:
        raise DescriptionError(
            f"device.toml, {RINGDOWN}: the fit of {ring_down.name} is not to be trusted "
            f"({listed(ring_down.reasons)}); sample longer."
        )
    return device.with_fitted(_known_from_ring_down(ring_down, device))


def _known_from_ring_down(ring_down: Record, device: Device) -> dict[str, Known]:
    """Return the damping of the rope, and the inertia of the joint where the device does not say it."""
    joint = device.needed(
        "the damping of the rope, which a ring-down determines together with that of the joint,", JOINT_DAMPING
    )[JOINT_DAMPING]
    total = _pick_draws(ring_down, "rope_damping")
    middle = float(np.median(total)) - joint.value
    if middle <= 0:
        raise DescriptionError(
            f"device.toml, {JOINT_DAMPING}: {joint.value:g} N*m*s/rad is more than the {np.median(total):.3g} N*m*s/rad "
            "that the ring-down gives for rope and joint together; correct it, or measure it with the rope taken off."
        )
    known = {DAMPING: Known(middle, float(total.std()), tuple(total.tolist()), JOINT_DAMPING)}
    if not device.states(_INERTIA) and "ring_inertia" in ring_down.draws().values:
        inertia = _pick_draws(ring_down, "ring_inertia")
        known[_INERTIA] = Known(float(np.median(inertia)), float(inertia.std()), tuple(inertia.tolist()))
    return known


def _pick_draws(fit: Record, name: str) -> np.ndarray:
    """Return draws of a parameter, evenly picked."""
    draws = np.ravel(fit.draws().values[name])
    return draws[np.linspace(0, len(draws) - 1, min(len(draws), _RING_DOWN_DRAWS)).round().astype(int)]
