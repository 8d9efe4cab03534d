"""Tables of a fitted cable, from which every format is written: friction by position and level.

A level is an amount of friction: the 5 %, 50 % or 95 % quantile of the mean, the same of any one mounting, or one draw.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.cable.drive import LEAST_EXPONENT
from bowdenfit.cable.friction import FrictionModel
from bowdenfit.cable.friction_options import (
    BRISTLE_DAMPING,
    DRAG,
    LOAD_EXPONENT,
    PRESLIDING_STIFFNESS,
    STRIBECK,
    STRIBECK_SPEED,
    VISCOUS,
)
from bowdenfit.errors import UsageError
from bowdenfit.inference.draws import for_each_draw
from bowdenfit.models import Model
from bowdenfit.physics.friction import force_scale
from bowdenfit.questions.bends.answer import elastic_answers
from bowdenfit.questions.bends.bent_cable import BentCable, find_bent_contact, has_stretch
from bowdenfit.questions.error_budget import with_bench_errors
from bowdenfit.questions.export.sensors import SensorErrors, estimate_sensors
from bowdenfit.questions.predict.measured_range import find_measured_range
from bowdenfit.results.record import Record

QUANTILES = {"q05": 0.05, "q50": 0.5, "q95": 0.95}
MOUNTING = "mounting_"
LEVELS = (*QUANTILES, f"{MOUNTING}q05", f"{MOUNTING}q95")
DRAW = "draw_"
# Options of friction that tables can express.
SUPPORTED_OPTIONS = ("drag", "load-dependent", "rate-dependent", "stroke-dependent", "by-group", "play", "dahl", "lugre")
_LEAST_BEND = 1e-3  # rad that a range of bends has at least; a judgement
_LEAST_SHARE = 1e-9  # of the reference force, which is left of it at least, so that its logarithm is finite
# What stands for each parameter where friction does not depend on speed.
_RATE = {STRIBECK: 0.0, STRIBECK_SPEED: 1.0, VISCOUS: 0.0}
_PRESLIDING = {PRESLIDING_STIFFNESS: 0.0, BRISTLE_DAMPING: 0.0}  # where friction is there at once after a turn
LoadLaw = tuple[float, float]
Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class FitLabel:
    """Label of the fit that a file was written from.

    Args:
        cable: Name of the cable.
        seed: Seed of the fit.
        version: Version of bowdenfit.
        created: When it was fitted, UTC.
        measured: Conditions of the measurements, in words.
        group: Group of readings that it is for; empty without groups.
        distrust: Why the fit is not to be trusted; empty where it is.
    """

    cable: str
    seed: int
    version: str
    created: str
    measured: tuple[str, ...]
    group: str = ""
    distrust: str = ""


@dataclass(frozen=True)
class TablePoints:
    """Positions at which friction is tabulated.

    Args:
        variable: What is varied: the route variable, or "wrap_angle"; "place" where nothing is.
        unit: Its unit; empty where nothing is varied.
        values: Values from the smallest to the largest; one where nothing is varied.
    """

    variable: str
    unit: str
    values: np.ndarray

    @property
    def words(self) -> str:
        """'cable_length 430 to 530 mm'"""
        ends = f"{self.values[0]:.6g} to {self.values[-1]:.6g}" if len(self.values) > 1 else f"{self.values[0]:.6g}"
        return f"{self.variable} {ends} {self.unit}" if self.unit else "one place: nothing is varied"


@dataclass(frozen=True)
class FrictionLevel:
    """Friction at one level, such as its median.

    Args:
        name: One of `LEVELS`, or of a draw.
        exponent: Friction exponent while pulling and while returning (rows) by place [1].
        taut_loss: Force that a loop loses while both sides are taut, 2 P Lambda, by place [N]; 0 of a single rope.
        load_exponent: p of the scale g, see `bowdenfit.physics.friction.force_scale` [1].
        drag: D of that scale [N].
        rate: Stribeck rise [1], Stribeck speed and viscous coefficient, see `bowdenfit.physics.friction.rate_factor`.
        stiffness: Of a taut loop, or of a rope under the reference force, seen at the load side with the motor held, by place
            [N/mm]; empty where nothing tells it.
        presliding: Presliding stiffness [1], 0 of a play operator, and damping of the bristles over their stiffness [s].
    """

    name: str
    exponent: np.ndarray
    taut_loss: np.ndarray
    load_exponent: float = 0.0
    drag: float = 0.0
    rate: tuple[float, ...] = (0.0, 1.0, 0.0)
    stiffness: np.ndarray = field(default_factory=lambda: np.zeros(0))
    presliding: tuple[float, ...] = (0.0, 0.0)


@dataclass(frozen=True)
class TransmissionTables:
    """A fitted cable as tables.

    Args:
        about: Which fit.
        points: Where friction is tabled; between them it is on straight lines.
        levels: Quantiles, then draws.
        is_loop: Whether it is a pull-pull loop.
        options: Options of the friction model.
        reference_force: At which the coefficients hold, and the quantiles where friction depends on the load [N].
        reference_speed: At which the coefficients hold, in `speed_unit`.
        speed_unit: "mm/s" or "rad/s"; empty where friction does not depend on speed.
        interpolation_error: Largest error of the median exponent between two places [1].
        radii: Radii of the pulleys at the motor and at the load side [mm]; 0 where none is stated.
        sensors: What an online estimator assumes of the sensors.
    """

    about: FitLabel
    points: TablePoints
    levels: tuple[FrictionLevel, ...]
    is_loop: bool
    options: tuple[str, ...]
    reference_force: float
    reference_speed: float
    speed_unit: str
    interpolation_error: float
    radii: tuple[float, float] = (0.0, 0.0)
    sensors: SensorErrors = field(default_factory=SensorErrors)

    @property
    def median(self) -> FrictionLevel:
        """The median level."""
        return self.levels[LEVELS.index("q50")]

    @property
    def depends_on_load(self) -> bool:
        """Whether the share of the force that arrives depends on the load, other than in a loop."""
        return any(level.load_exponent or level.drag for level in self.levels)

    @property
    def depends_on_rate(self) -> bool:
        """Whether friction depends on speed."""
        return bool(self.speed_unit)

    @property
    def builds_up(self) -> bool:
        """Whether friction builds up after a turn of the motion."""
        return any(level.presliding[0] for level in self.levels)

    @property
    def sentences(self) -> list[str]:
        """Sentences at the top of every file."""
        about, n = self.about, len(self.levels) - len(LEVELS)
        kind = "pull-pull loop" if self.is_loop else "single rope"
        sentences = [
            f"Cable: {about.cable} ({kind})." + (f" Group: {about.group}." if about.group else ""),
            f"Fitted by bowdenfit {about.version}, seed {about.seed}, {about.created or 'date unknown'}.",
            f"Range: {self.points.words}. Outside it the value at the nearest end is used, and a flag says so.",
            *(f"Measured: {words}." for words in about.measured),
            f"Levels: {', '.join(LEVELS)} of friction" + (f", and {n} draws." if n else "."),
        ]
        if len(self.points.values) > 1:
            sentences.append(
                f"Straight lines between the places miss the median exponent by at most {self.interpolation_error:.1e}."
            )
        if self.depends_on_load:
            sentences.append(
                f"Quantiles hold at an input force of {self.reference_force:g} N, as friction depends on the load."
            )
        if self.depends_on_rate:
            sentences.append(f"Quantiles hold at a speed of {self.reference_speed:g} {self.speed_unit}.")
        return [*sentences, *([f"Warning: this fit is {about.distrust}."] if about.distrust else [])]


def tabulate_transmission(fit: Record, points: int = 101, draws: int = 0, distrust: str = "") -> TransmissionTables:
    """Tabulate the transmission of a fit.

    Args:
        fit: The fit.
        points: Number of places.
        draws: Number of draws beside the quantiles, each of another mounting.
        distrust: Why the fit is not to be trusted; empty where it is.

    Raises:
        UsageError: There is no posterior, or it has not so many draws.
    """
    cable, conditions = fit.model.cable, fit.model.cable.friction.conditions
    available = len(fit.draws().flat_z)
    if draws > available:
        raise UsageError(f"--draws {draws}: this fit has {available} draws; ask for at most that many.")
    table_points, bent = _choose_points(fit, points)
    with_errors = with_bench_errors(fit)
    middle, refined = _median_load_law(with_errors), _add_midpoints(table_points.values)
    mean_tables = _tabulate_draws(with_errors, refined, bent, middle, np.zeros(available))
    draw_tables = _tabulate_draws(with_errors, table_points.values, bent, middle, with_errors.mounting())
    coarse = {name: values[..., ::2] if values.ndim > 1 else values for name, values in mean_tables.items()}
    levels = [
        *_quantile_levels(coarse, middle),
        *_quantile_levels(draw_tables, middle, MOUNTING),
        *_draw_levels(draw_tables, draws, fit.provenance.seed),
    ]
    group, provenance = next(iter(cable.friction.groups), ""), fit.provenance
    version = provenance.versions.get("bowdenfit", "of unknown version")
    return TransmissionTables(
        FitLabel(fit.name, provenance.seed, version, provenance.created, _describe_ranges(fit, bent), group, distrust),
        table_points,
        tuple(levels),
        cable.is_loop,
        cable.friction.options,
        conditions.reference_force,
        conditions.reference_speed,
        conditions.velocity_unit or "mm/s" if cable.friction.depends_on_rate else "",
        _measure_interpolation_error(np.median(mean_tables["effective"][:, 0], axis=0)),
        _pulley_radii(fit),
        estimate_sensors(fit),
    )


def _pulley_radii(fit: Record) -> tuple[float, float]:
    """Return the radii of the pulleys at the motor and at the load side [mm]; 0 where none is stated."""
    cable = fit.dataset.description.cable
    at_motor, at_load = (
        0.0 if stated is None else stated.to("length")
        for stated in (cable.input_pulley_radius, cable.output_pulley_radius)
    )
    return at_motor, at_load


def _choose_points(fit: Record, points: int) -> tuple[TablePoints, bool]:
    """Choose route positions, wrap angles, or one point; return also whether they are wrap angles."""
    route = fit.dataset.description.route
    if route is not None:
        return TablePoints(route.variable, route.unit, np.linspace(*route.range, points)), False
    try:
        find_bent_contact(fit.model)
    except UsageError:
        return TablePoints("place", "", np.zeros(1)), False
    bends = elastic_answers(fit).measured_bends
    if not len(bends):
        return TablePoints("place", "", np.zeros(1)), False
    if bends[-1] - bends[0] < _LEAST_BEND:
        return TablePoints("wrap_angle", "rad", bends[:1]), True
    return TablePoints("wrap_angle", "rad", np.linspace(bends[0], bends[-1], points)), True


def _add_midpoints(points: np.ndarray) -> np.ndarray:
    """Return points with the midpoints between them."""
    return np.interp(np.arange(2 * len(points) - 1) / 2, np.arange(len(points)), points)


def _measure_interpolation_error(curve: np.ndarray) -> float:
    """Return the largest error of linear interpolation between every other point of a curve."""
    return float(np.max(np.abs(curve[1::2] - (curve[:-2:2] + curve[2::2]) / 2), initial=0.0))


def _describe_ranges(fit: Record, bent: bool) -> tuple[str, ...]:
    """Describe the loads, lengths and wrap angles of the measurements in words."""
    limits, ranges = find_measured_range(fit), []
    if bent:
        bends = np.rad2deg(elastic_answers(fit).measured_bends)
        ranges.append(f"wrap angles {bends[0]:.4g} to {bends[-1]:.4g} deg")
    for quantity, span, unit in (("loads", limits.loads, "N"), ("lengths", limits.lengths, limits.unit)):
        ranges += [f"{quantity} {span[0]:.4g} to {span[1]:.4g} {unit}"] if span is not None and unit else []
    return tuple(ranges)


def _tabulate_draws(
    fit: Record, points: np.ndarray, bent: bool, middle: LoadLaw, mounting: np.ndarray
) -> dict[str, np.ndarray]:
    """Tabulate friction of every draw (first axis) at all points (last axis), in a mounting each.

    Args:
        fit: The fit.
        points: Places.
        bent: Whether they are wrap angles.
        middle: Load exponent and drag for which "effective" exponents are meant.
        mounting: Effect of each draw's mounting on the friction exponent [1].
    """
    model, friction = fit.model, fit.model.cable.friction

    def tabulate_draw(z_and_mounting: Array, points: Array, middle: Array) -> dict[str, Any]:
        values = model.space.constrain(z_and_mounting[:-1])
        exponent, preload = _compute_exponent_and_preload(model, values, points, bent)
        exponent = jnp.maximum(exponent + z_and_mounting[-1], LEAST_EXPONENT)
        own = jnp.stack(friction.shifts(values, exponent))
        load_exponent, drag, _ = friction.scale(values)
        rate = {name: values[name] for name in (*_RATE, *_PRESLIDING) if name in values}
        return {
            "own": own,
            "effective": _compute_effective_exponents(friction, values, own, middle) if friction.depends_on_load else own,
            "taut_loss": 2 * preload * exponent,
            "load_exponent": load_exponent,
            "drag": drag,
            **rate,
            "stiffness": _compute_stiffness(model, values, points, bent),
        }

    with jax.enable_x64(True):
        program = for_each_draw(
            tabulate_draw, model.space.size + 1, jnp.asarray(points), jnp.asarray(middle), run_once=True
        )
        tables: dict[str, np.ndarray] = program(np.column_stack([fit.draws().flat_z, mounting]))
    return tables


def _compute_exponent_and_preload(model: Model, values: Mapping[str, Array], points: Array, bent: bool) -> tuple[Array, Array]:
    """Return exponent [1] and preload [N] of one draw at wrap angles or route positions."""
    if bent:
        cable = BentCable(model, find_bent_contact(model), points)
        return cable.exponent(values), cable.preload(values)[0]
    angles = model.cable.wrap_angles(values, points)
    preload = model.cable.elasticity.preload_or_none(values, jnp.sum(angles, axis=-1))
    return model.cable.friction_exponent(values, angles, route=points), preload


def _compute_stiffness(model: Model, values: Mapping[str, Array], points: Array, bent: bool) -> Array:
    """Return stiffness at wrap angles [N/mm], of an unloaded loop or a rope under the reference force; empty if unknown."""
    if not (bent and has_stretch(model)):
        return jnp.zeros(0)
    load = 0.0 if model.cable.is_loop else model.cable.friction.conditions.reference_force
    return BentCable(model, find_bent_contact(model), points).stiffness(values, load)


def _compute_effective_exponents(friction: FrictionModel, values: Mapping[str, Array], own: Array, middle: Array) -> Array:
    """Return exponents that give the same loss at the reference force under a common load exponent and drag."""
    reference = friction.conditions.reference_force
    force, (load_exponent, drag) = jnp.asarray(reference), middle
    signs = jnp.array([[1.0], [-1.0]])
    output = friction.force(values, friction.scaled(values, force) - signs * own)
    output = jnp.maximum(output, _LEAST_SHARE * reference)
    common = force_scale(force, load_exponent, drag, reference)
    return signs * (common - force_scale(output, load_exponent, drag, reference))


def _median_load_law(fit: Record) -> LoadLaw:
    """Return medians of the load exponent [1] and the drag [N]; 0 where the model has none."""
    names = {p.name: p for p in fit.model.space.parameters}

    def median_of(name: str) -> float:
        if name not in names:
            return 0.0
        fixed = names[name].fixed
        return float(np.median(fit.draws().values[name]) / names[name].shown_scale) if fixed is None else fixed

    return median_of(LOAD_EXPONENT), median_of(DRAG)


def _median_of(tables: Arrays, which: slice, names: Mapping[str, float]) -> tuple[float, ...]:
    """Return medians of parameters over some of the draws; what stands for them where there are none."""
    return tuple(float(np.median(tables[name][which])) if name in tables else default for name, default in names.items())


def _quantile_levels(tables: Arrays, middle: LoadLaw, before: str = "") -> list[FrictionLevel]:
    """Return levels at quantiles over the draws."""
    effective, taut_loss = tables["effective"], tables["taut_loss"]
    rate, presliding = (_median_of(tables, slice(None), names) for names in (_RATE, _PRESLIDING))
    shared = (*middle, rate, np.median(tables["stiffness"], axis=0), presliding)
    return [
        FrictionLevel(before + name, np.quantile(effective, q, axis=0), np.quantile(taut_loss, q, axis=0), *shared)
        for name, q in QUANTILES.items()
        if before + name in LEVELS
    ]


def _draw_levels(tables: Arrays, n: int, seed: int) -> list[FrictionLevel]:
    """Return levels of single draws."""
    picked = np.random.default_rng([seed, 17]).choice(len(tables["drag"]), n, replace=False)
    return [
        FrictionLevel(
            f"{DRAW}{i + 1}",
            tables["own"][k],
            tables["taut_loss"][k],
            float(tables["load_exponent"][k]),
            float(tables["drag"][k]),
            _median_of(tables, slice(k, k + 1), _RATE),
            tables["stiffness"][k],
            _median_of(tables, slice(k, k + 1), _PRESLIDING),
        )
        for i, k in enumerate(picked)
    ]
