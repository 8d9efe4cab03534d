"""What friction does beside the capstan equation, where it was fitted: efficiency by load and speed, stick-slip, lost force."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from bowdenfit.cable.friction_options import DRAG, STRIBECK, STRIBECK_SPEED, VISCOUS
from bowdenfit.inference.draws import for_each_value, output_force_at
from bowdenfit.inference.interval import NORMAL_90, Interval
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.kind import FrictionKind
from bowdenfit.physics.friction import rate_slope
from bowdenfit.questions.error_budget import with_bench_errors
from bowdenfit.questions.recorded.dependence_figure import Dependence
from bowdenfit.questions.recorded.traces import QUANTILES
from bowdenfit.recordings.recording import Recording, Recordings
from bowdenfit.results.record import OPTIMAL_LENGTH, Record, cached_per_fit, parameter_values, thinned_parameter_values
from bowdenfit.words import decimals, percent, significant

_CLEAR = 0.99  # probability from which a dependence on speed is stated rather than hinted at; a judgement
SHOWN_SPEED = {"rad/s": ("r/min", 30 / np.pi), "mm/s": ("mm/s", 1.0), "": ("", 1.0)}  # shown unit and factor, by unit
_N_SPEEDS = 5  # speeds at which the probability of stick-slip is computed
GRID, BINS = 60, 12  # places of a curve, and points of a run that are shown against the load
CURVES = 4000  # draws of a curve, so that a quantile of 5 % is known to 0.3 %
Points = tuple[np.ndarray, np.ndarray, np.ndarray, list[str]]  # x, efficiencies, half their intervals, runs


@dataclass(frozen=True)
class RateEffect:
    """Efficiency at the highest speed minus that at the lowest.

    Args:
        slow, fast: The speeds, in `unit`.
        unit: "r/min" or "mm/s".
        place: Route value in words; empty without a route.
        difference: Efficiency at `fast` minus that at `slow` [1].
        probability_lower: Probability that efficiency is lower at `fast`.
    """

    slow: float
    fast: float
    unit: str
    place: str
    difference: Interval
    probability_lower: float

    def sentence(self) -> str:
        """Return the answer in words."""
        low, high = 100 * self.difference.q05, 100 * self.difference.q95
        way, sure = ("falls", self.probability_lower) if high < 0 else ("rises", 1 - self.probability_lower)
        verdict = (
            "so the data show no dependence on speed"
            if low <= 0 <= high
            else f"so efficiency {way} with speed"
            if sure > _CLEAR
            else f"a hint that efficiency {way} with speed, and no more than that"
        )
        place = f" {self.place}" if self.place else ""
        return (
            f"Efficiency{place} at {significant(self.fast)} {self.unit} minus that at {significant(self.slow)} {self.unit}: "
            f"{100 * self.difference.median:+.2f} points (90 % interval {low:+.2f} to {high:+.2f}), {verdict}."
        )


@cached_per_fit
def compare_speeds(fit: Record) -> RateEffect | None:
    """Return the effect of speed on efficiency; None where the fit has none, or no draws."""
    friction = fit.model.cable.friction
    if fit.sampled is None or not friction.depends_on_rate:
        return None
    unit, scale = SHOWN_SPEED[friction.conditions.velocity_unit]
    slow, fast = find_speed_range(fit)
    at, place = choose_recorded_length(fit)
    with jax.enable_x64(True):
        difference = _efficiency_differences(with_bench_errors(fit), at, slow, fast)
    interval = Interval.of(difference)
    return RateEffect(slow * scale, fast * scale, unit, place, interval, float(np.mean(difference < 0)))


def find_speed_range(fit: Record) -> tuple[float, float]:
    """Return the lowest and the highest typical speed of a recording or run, internal unit."""
    friction = [(kind, table) for kind, table in iterate_tables(fit.dataset.measurements) if isinstance(kind, FrictionKind)]
    speeds = [speed for kind, table in friction for speed in kind.typical_speeds(table)]
    return min(speeds), max(speeds)


def choose_recorded_length(fit: Record) -> tuple[float, str]:
    """Return the length with most recordings inside the range, else its middle, and its words."""
    route, recordings = fit.dataset.description.route, fit.dataset.measurements.table(Recordings)
    if route is None:
        return 0.0, ""
    recorded = recordings.items if recordings is not None else ()
    values = [r.route for r in recorded if route.range[0] <= r.route <= route.range[1]]
    at = max(set(values), key=values.count) if values else route.middle
    return at, f"at {at:g} {route.unit}"


def _efficiency_differences(fit: Record, at: float, slow: float, fast: float) -> np.ndarray:
    """Return draws of the efficiency at the fast speed minus that at the slow one."""
    model, friction = fit.model, fit.model.cable.friction

    def difference(values: Mapping[str, jax.Array]) -> jax.Array:
        force = jnp.asarray(friction.conditions.reference_force)
        exponent = model.cable.exponent_at(values, jnp.asarray([at]))[0]
        shifts = exponent * friction.rate(values, jnp.asarray([slow, fast]))
        output = friction.output_force(values, force, shifts, jnp.ones(())) / force
        return output[1] - output[0]

    differences: np.ndarray = for_each_value(difference, parameter_values(fit))
    return differences


@dataclass(frozen=True)
class StickSlip:
    r"""Probability that friction falls with speed, from the lowest speed measured to the highest.

    Args:
        speeds: In `unit`.
        unit: "r/min" or "mm/s".
        probabilities: That :math:`d\mu/dv < 0` there, by speed.
    """

    speeds: tuple[float, ...]
    unit: str
    probabilities: tuple[float, ...]

    def sentence(self) -> str:
        """'Probability that friction falls with speed, ...: 84 % at 3 r/min, 2 % at 60 r/min.'"""
        ends = dict.fromkeys((0, len(self.speeds) - 1))
        probabilities = ", ".join(
            f"{percent(self.probabilities[i], 0)} at {significant(self.speeds[i])} {self.unit}" for i in ends
        )
        return (
            f"Probability that friction falls with speed, so that a compliant drive sticks and slips: {probabilities}."
        )


@cached_per_fit
def predict_stick_slip(fit: Record) -> StickSlip | None:
    """Return the probability of stick-slip from the lowest to the highest speed; None without rate dependence, or draws."""
    friction = fit.model.cable.friction
    if fit.sampled is None or not friction.depends_on_rate:
        return None
    unit, scale = SHOWN_SPEED[friction.conditions.velocity_unit]
    slow, fast = find_speed_range(fit)
    speeds = np.unique(np.geomspace(max(slow, 1e-9), max(fast, 1e-9), _N_SPEEDS))
    falls = np.mean(compute_friction_slopes(with_bench_errors(fit), speeds) < 0, axis=0)
    return StickSlip(tuple(float(speed * scale) for speed in speeds), unit, tuple(float(p) for p in falls))


def compute_friction_slopes(fit: Record, speeds: np.ndarray) -> np.ndarray:
    """Return the slope of the friction coefficient against speed, relative to speed 0 without Stribeck's rise, draws by speeds.

    Args:
        fit: A fit whose friction depends on the rate.
        speeds: In the internal unit of its velocities.
    """

    def slope(values: dict[str, Array], at: Float[Array, " speeds"]) -> Float[Array, " speeds"]:
        return rate_slope(at, *(values[name] for name in (STRIBECK, STRIBECK_SPEED, VISCOUS)))

    with jax.enable_x64(True):
        slope_draws: np.ndarray = for_each_value(slope, parameter_values(fit), np.asarray(speeds, dtype=float))
    return slope_draws


@dataclass(frozen=True)
class LostForce:
    """Force lost to drag: a hidden tension that the load cells do not show, and the force that it costs while pulling.

    Args:
        place: Where on the route, in words; empty without a route.
        hidden_tension: D [N].
        lost: D (1 - exp(-Lambda)), by which the output is below that of the capstan equation at any load; with a load
            exponent, at no load [N].
        at_any_load: Whether it is the same at any load.
    """

    place: str
    hidden_tension: Interval
    lost: Interval
    at_any_load: bool

    JSON: ClassVar = (
        ("at", "place"), ("hidden_tension_N", "hidden_tension"), ("lost_force_N", "lost"), "at_any_load",
        ("in_words", "sentence"),
    )  # fmt: skip

    def sentence(self) -> str:
        """Return both numbers in a sentence."""
        place = f" {self.place}" if self.place else ""
        load = "at any load" if self.at_any_load else "even at the smallest load"
        return (
            f"Drag: while pulling{place}, {_format_interval(self.lost)} of the force is lost {load}, as if "
            f"{_format_interval(self.hidden_tension)} of tension did not show at the cells."
        )

    def explanation(self) -> str:
        """Return the sentence with the formula that relates both numbers."""
        return (
            f"{self.sentence()} The parameter drag is that hidden tension D; it costs D (1 - exp(-Lambda)), Lambda being the "
            "sum of friction coefficient times wrap angle."
        )

    def short(self) -> str:
        """Return both medians, for a figure."""
        lost, hidden = (f"{of.median:z.{decimals(of.sd)}f} N" for of in (self.lost, self.hidden_tension))
        return (
            f"{lost} lost at any load,\nby {hidden} of hidden tension"
            if self.at_any_load
            else f"{hidden} of hidden tension"
        )


@cached_per_fit
def compute_lost_force(fit: Record) -> LostForce | None:
    """Return the hidden tension and the force that it costs, at the best length if there is one; None without drag or draws.

    From F_out = (F_in + D) exp(-Lambda) - D: the output is F_in exp(-Lambda) less D (1 - exp(-Lambda)), which is minus the
    output at no input.
    """
    friction = fit.model.cable.friction
    if fit.sampled is None or DRAG not in friction.options:
        return None
    fit = with_bench_errors(fit)
    at, place = choose_recorded_length(fit)
    route, best = fit.dataset.description.route, fit.posterior.optimum.get(OPTIMAL_LENGTH)
    if route is not None and best is not None:
        at = float(np.median(best))
        place = f"at {at:.4g} {route.unit}"
    z = fit.posterior.flat_z
    with jax.enable_x64(True):
        lost = -output_force_at(fit.model, z, np.array([at]), 0.0, 1, (np.zeros(len(z)),))[0][:, 0]
    fixed = {p.name: np.full(len(z), p.fixed) for p in fit.model.space.fixed if p.fixed is not None}
    tension = (fit.posterior.values | fixed)[DRAG]
    return LostForce(place, Interval.of(tension), Interval.of(lost), "load-dependent" not in friction.options)


def _format_interval(known: Interval) -> str:
    """Format a median with its 90 % interval [N]."""
    digits = decimals(known.sd)
    return f"{known.median:z.{digits}f} N (90 % interval {known.range_text(digits)} N)"


def collect_dependences(fit: Record) -> tuple[Dependence, ...] | None:
    """Return the dependence on load and on speed, as far as the friction model has them; None where it has neither."""
    friction, recordings = fit.model.cable.friction, fit.dataset.measurements.table(Recordings)
    if recordings is None or not friction.options:
        return None
    (at, place), collected = choose_recorded_length(fit), []
    recordings_here = [r for r in recordings.items if not place or r.route == at]
    if friction.depends_on_load:
        points = [_average_by_load(r) for r in recordings_here if _is_pulling(r).any()]
        forces = np.concatenate([r.blocks.input_force[_is_pulling(r)] for r in recordings_here])
        low, high = (forces.min(), forces.max()) if len(forces) else (10.0, 100.0)
        grid = np.linspace(max(low, 1e-3), high, GRID)
        quantiles, constant, new_run = _compute_curves(fit, at, grid, None)
        x, efficiency, half, runs = _join_points(points)
        lost = compute_lost_force(fit)
        note = lost.short() if lost is not None else ""
        fields = "load", "Input force (N)", grid, quantiles, constant, x, efficiency, runs, place, note, half, new_run
        collected.append(Dependence(*fields))
    if friction.depends_on_rate:
        (unit, scale), (low, high) = SHOWN_SPEED[recordings.velocity_unit], friction.conditions.speeds
        grid = np.linspace(low, high, GRID)
        quantiles, constant, new_run = _compute_curves(fit, at, None, grid)
        x, efficiency, half, runs = _join_points([_average_by_speed(r, scale) for r in recordings_here])
        label = f"Speed ({unit})"
        fields = "speed", label, grid * scale, quantiles, constant, x, efficiency, runs, place, "", half, new_run
        collected.append(Dependence(*fields))
    return tuple(collected) or None


def _is_pulling(recording: Recording) -> np.ndarray:
    """Return a mask of the blocks that are used and in which the motor pulls."""
    return recording.strokes.used_sliding & (recording.strokes.stroke > 0)


def _average_by_load(recording: Recording) -> Points:
    """Return the mean input force and mean efficiency of blocks of similar load, with half its 90 % interval."""
    used = _is_pulling(recording)
    force = recording.blocks.input_force[used]
    efficiency = recording.blocks.output_force[used] / force
    order = np.array_split(np.argsort(force), min(BINS, len(force)))
    means = [np.array([values[part].mean() for part in order]) for values in (force, efficiency)]
    half = np.array([_half_interval(efficiency[part]) for part in order])
    return means[0], means[1], half, [recording.run] * len(order)


def _half_interval(values: np.ndarray) -> float:
    """Return half the 90 % interval of a mean, from the scatter of its values; NaN of a single one."""
    return float(NORMAL_90 * values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else float("nan")


def _average_by_speed(recording: Recording, scale: float) -> Points:
    """Return the mean speed in the unit that is shown, and mean efficiency with half its 90 % interval."""
    blocks = recording.blocks
    used = _is_pulling(recording) & np.isfinite(blocks.velocity)
    ratio = np.log(blocks.output_force[used] / blocks.input_force[used])
    speed = np.abs(blocks.velocity[used]).mean() * scale
    efficiency = np.exp([ratio.mean()])
    return np.array([speed]), efficiency, efficiency * _half_interval(ratio), [recording.run]


def _join_points(points: list[Points]) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[str, ...]]:
    """Join the points of several runs."""
    x, y, half, runs = zip((np.zeros(0), np.zeros(0), np.zeros(0), []), *points, strict=True)
    return np.concatenate(x), np.concatenate(y), np.concatenate(half), tuple(run for labels in runs for run in labels)


def _compute_curves(
    fit: Record, at: float, forces: np.ndarray | None, speeds: np.ndarray | None
) -> tuple[np.ndarray, float, np.ndarray]:
    """Return quantiles of the efficiency against load or speed, the efficiency at the reference, and the interval of a run."""
    model, friction = fit.model, fit.model.cable.friction

    def efficiency(values: Mapping[str, jax.Array]) -> tuple[jax.Array, jax.Array]:
        exponent = model.cable.exponent_at(values, jnp.array([at]))[0]
        reference = friction.efficiency(values, exponent)
        if forces is not None:
            x = jnp.asarray(forces)
            return friction.output_force(values, x, exponent, jnp.ones(())) / x, reference
        x = jnp.asarray(friction.conditions.reference_force)
        shift = exponent * friction.rate(values, jnp.asarray(speeds))
        return friction.output_force(values, x, shift, jnp.ones(())) / x, reference

    with jax.enable_x64(True):
        curves, reference = for_each_value(efficiency, thinned_parameter_values(fit, CURVES))
    constant = float(np.median(reference))
    if fit.sampled is None:
        return curves[:1], constant, np.zeros((0, len(curves[0])))
    mounting = fit.mounting()[np.linspace(0, len(fit.mounting()) - 1, CURVES).astype(int)]
    mounted = curves * np.exp(-mounting[:, None])
    new_run = np.quantile(mounted, (QUANTILES[0], QUANTILES[-1]), axis=0)
    return np.quantile(curves, QUANTILES, axis=0), constant, new_run
