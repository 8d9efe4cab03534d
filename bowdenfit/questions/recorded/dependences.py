"""Dependence of efficiency on load and speed: curves of the draws, and measured efficiencies."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.inference.draws import for_each_value
from bowdenfit.inference.interval import NORMAL_90
from bowdenfit.questions.recorded.dependence_figure import Dependence
from bowdenfit.questions.recorded.friction_effects import SHOWN_SPEED, choose_recorded_length, compute_lost_force
from bowdenfit.questions.recorded.traces import QUANTILES
from bowdenfit.recordings.recording import Recording, Recordings
from bowdenfit.results.record import Record, thinned_parameter_values

GRID, BINS = 60, 12  # places of a curve, and points a run that are shown against the load
CURVES = 4000  # draws of a curve
Points = tuple[np.ndarray, np.ndarray, np.ndarray, list[str]]  # x, efficiencies, half their intervals, runs


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
