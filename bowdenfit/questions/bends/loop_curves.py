"""Curves of many draws for the figures of a preloaded loop, beside the forces that were read of it."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from bowdenfit.errors import UsageError
from bowdenfit.kinds.tables import LoopTable
from bowdenfit.physics.loop import free_motion_loss, loop_band, loop_output_force, slack_load
from bowdenfit.questions.bends.answer import elastic_answers, friction_arm, pick_evenly, typical_preload
from bowdenfit.questions.bends.bending_loss_figure import TIMES_COEFFICIENT, TIMES_PRELOAD, BendingLoss, EfficiencyLine
from bowdenfit.questions.bends.bent_cable import has_preload
from bowdenfit.questions.bends.curves import POINTS, QUANTILES, Values, evaluate_curves, quantiles_of_draws
from bowdenfit.questions.bends.loops_figure import MOST, RECORDED, LoopCurve
from bowdenfit.questions.bends.preload_window_figure import COARSE, FINE, PreloadWindowCurves
from bowdenfit.questions.error_budget import with_bench_errors
from bowdenfit.questions.recorded.traces import collect_loop_points
from bowdenfit.results.record import Record
from bowdenfit.words import significant

_LEAST_BEND = 0.1  # rad; a figure against the wrap angle needs a range
_NEAR, _MOST_NEAR = (
    0.6,
    3,
)  # share of a force within which readings are next to it, and how many to either side; a judgement


def collect_loops(fit: Record) -> tuple[LoopCurve, ...] | None:
    """Return a curve for each wrap angle that forces of a loop with preload were read at; None of anything else."""
    bends = measured_loop_bends(fit)
    if bends is None:
        return None
    angle, force_in, force_out, stroke = loop_readings(fit, bends)
    if not len(angle):
        return None
    angles = pick_evenly(np.unique(np.round(angle, 9)), MOST)
    read = [force_in[np.isclose(angle, bend)] for bend in angles]
    forces, bent = np.array([np.linspace(f.min(), f.max(), POINTS) for f in read]), elastic_answers(fit).bend_to(angles)

    def curves(values: Values) -> dict[str, Any]:
        exponent, preload = bent.exponent(values), bent.preload(values)[0]
        force = jnp.asarray(forces)
        forward, back = loop_band(force, preload[:, None], exponent[:, None], bent.rope(values))
        capstan = loop_band(force, jnp.zeros_like(exponent)[:, None], exponent[:, None])[0]
        return {"forward": forward, "back": back, "capstan": capstan, "slack": slack_load(preload, exponent, bent.rope(values))}

    draws, loops = evaluate_curves(fit, curves), []
    for i, bend in enumerate(angles):
        forward, back, slack = (quantiles_of_draws(draws[name][:, i]) for name in ("forward", "back", "slack"))
        mask = np.isclose(angle, bend)
        points = force_in[mask], force_out[mask], stroke[mask]
        capstan, left_out = np.median(draws["capstan"][:, i], axis=0), _find_left_out(fit, float(bend), angles)
        loops.append(LoopCurve(f"{np.rad2deg(bend):.4g} deg", forces[i], forward, back, capstan, slack, *points, left_out))
    return tuple(loops)


def _find_left_out(fit: Record, bend: float, angles: np.ndarray) -> np.ndarray:
    """Return input and output force [N] of the readings that the user leaves out, of those nearest to one of some wrap angles.

    Args:
        fit: The fit.
        bend: Which wrap angle [rad].
        angles: All of them [rad].
    """
    description = fit.dataset.description
    constant = sum(c.wrap_angle.constant.to("angle") for c in description.contact if c.wrap_angle.constant)
    forces = []
    for values in (reading.values for reading in fit.dataset.measurements.excluded.get("loop", ())):
        angle = constant + sum(values.get(column, 0.0) for column in description.angle_columns)
        if angles[np.argmin(np.abs(angles - angle))] == bend and {"input_force", "output_force"} <= {*values}:
            forces.append((values["input_force"], values["output_force"]))
    return np.array(forces).reshape(-1, 2).T


def collect_bending_loss(fit: Record) -> BendingLoss | None:
    """Return efficiency against the wrap angle; None of a cable that is not a loop with preload, or measured at no bend."""
    bends, measured = range_of_bends(fit), measured_loop_bends(fit)
    if bends is None or measured is None:
        return None
    fit = with_bench_errors(fit)
    elastic, typical = elastic_answers(fit), typical_preload(fit)
    angles, force = np.linspace(*bends, POINTS), elastic.reference_force
    preloads = np.unique([float(f"{typical * factor:.2g}") for factor in TIMES_PRELOAD])
    bent = elastic.bend_to(angles)

    def curves(values: Values) -> dict[str, Any]:
        exponent, own = bent.exponent(values), bent.preload(values)[0]

        def efficiency(preload: Any, factor: Any = 1.0) -> Any:
            bends = factor * exponent
            return loop_output_force(jnp.asarray(force), preload, bends, jnp.asarray(1.0), bent.rope(values)) / force

        return {
            "fitted": efficiency(own),
            "exponent": exponent,
            "coefficients": efficiency(own, jnp.asarray(TIMES_COEFFICIENT)[:, None]),
            "preloads": efficiency(bent.preloads(values, jnp.asarray(preloads))),
        }

    draws = evaluate_curves(fit, curves)
    lines = {name: np.median(drawn, axis=0) for name, drawn in draws.items()}
    coefficient = lines["exponent"][-1] / angles[-1]
    capstan = np.exp(-lines["exponent"])  # of a rope without preload
    return BendingLoss(
        np.rad2deg(angles),
        force,
        quantiles_of_draws(draws["fitted"]),
        capstan,
        " ".join(filter(None, (f"as fitted, preload {significant(typical)} N", describe_reference_angle(fit)))),
        tuple(
            EfficiencyLine(f"coefficient {factor * coefficient:.2g}", line, capstan**factor)
            for factor, line in zip(TIMES_COEFFICIENT, lines["coefficients"], strict=True)
        ),
        tuple(
            EfficiencyLine(f"preload {significant(preload)} N", line, capstan)
            for preload, line in zip(preloads, lines["preloads"], strict=True)
        ),
        *efficiency_between_readings(loop_readings(fit, measured), force),
    )


def collect_preload_window(fit: Record) -> PreloadWindowCurves | None:
    """Return what a preload costs and buys; None of a cable that is not a loop with preload, or measured at no bend."""
    bends = range_of_bends(fit)
    if bends is None:
        return None
    fit = with_bench_errors(fit)
    elastic = elastic_answers(fit)
    bent, coarse = (
        elastic.bend_to(np.linspace(*bends, COARSE)),
        np.linspace(0.0, max(2.5 * typical_preload(fit), 1.0), COARSE),
    )

    def curves(values: Values) -> dict[str, Any]:
        friction = free_motion_loss(bent.preloads(values, jnp.asarray(coarse)), bent.exponent(values))
        return {"friction": jnp.max(friction, axis=-1), "lowest": bent.lowest_preload(values, elastic.window_force)}

    draws, (arm, unit) = evaluate_curves(fit, curves), friction_arm(fit)
    preloads, (low, high) = np.linspace(coarse[0], coarse[-1], FINE), np.rad2deg(bends)
    return PreloadWindowCurves(
        preloads,
        describe_reference_angle(fit),
        arm * np.stack([np.interp(preloads, coarse, line) for line in quantiles_of_draws(draws["friction"])]),
        unit,
        np.mean(draws["lowest"][:, None] <= preloads, axis=0),
        np.quantile(draws["lowest"], QUANTILES),
        (float(low), float(high)),
        elastic.window_force,
    )


def measured_loop_bends(fit: Record) -> np.ndarray | None:
    """Return the wrap angles that a loop with preload was measured at [rad]; None of anything else."""
    if not fit.model.cable.is_loop or not has_preload(fit.model):
        return None
    try:
        return elastic_answers(fit).measured_bends
    except UsageError:  # no wrap angle says which of several contacts is bent
        return None


def range_of_bends(fit: Record) -> tuple[float, float] | None:
    """Return the smallest and largest measured wrap angle of a loop; None where there is no range to show."""
    bends = measured_loop_bends(fit)
    return (float(bends[0]), float(bends[-1])) if bends is not None and len(bends) and bends[-1] > _LEAST_BEND else None


def describe_reference_angle(fit: Record) -> str:
    """Return "at 0 deg", or what the preload is stated at, where it depends on the wrap angle; else empty."""
    settings, follows = fit.dataset.description.preload, fit.dataset.description.preload_follows_stretch
    return f"at {settings.wrap_angle.value:g} {settings.wrap_angle.unit}" if follows else ""


def loop_readings(fit: Record, bends: np.ndarray) -> np.ndarray:
    """Return every reading and recorded block: wrap angle [rad], input and output force [N], stroke.

    The stroke is +1 forward and -1 back, `RECORDED` times that of a recording, and 0 where it is neither.
    """
    contact, table = elastic_answers(fit).contact, fit.dataset.measurements.table(LoopTable)
    recorded = collect_loop_points(fit, contact)
    parts = [recorded * np.array([[1], [1], [1], [RECORDED]])]
    if table is not None:
        column = fit.dataset.description.contact[contact].wrap_angle.column
        angle = np.full(len(table.stroke), bends[0]) if column is None else np.nan_to_num(table.own.column(column)[0])
        parts.append(np.stack([angle, table.input_force, table.output_force, table.stroke]))
    return np.concatenate(parts, axis=1)


def efficiency_between_readings(points: np.ndarray, force: float) -> tuple[np.ndarray, np.ndarray]:
    """Return wrap angle [deg] and efficiency [1] wherever a loop was moved forward by less and by more than a force.

    Args:
        points: As `loop_readings` returns them.
        force: Input force [N].
    """
    angle, force_in, force_out = points[:3, points[3] > 0]
    angles, efficiency = [], []
    for bend in np.unique(angle.round(9)):
        mask = np.isclose(angle, bend)
        sides = [_mean_near(force_in[mask], force_out[mask], force, way) for way in (-1, 1)]
        if all(side is not None for side in sides):
            (low, out_low), (high, out_high) = sides  # type: ignore[misc]
            part = (force - low) / (high - low) if high > low else 0.0
            angles.append(np.rad2deg(bend))
            efficiency.append((out_low + part * (out_high - out_low)) / force)
    return np.array(angles), np.array(efficiency)


def _mean_near(force_in: np.ndarray, force_out: np.ndarray, force: float, way: int) -> tuple[float, float] | None:
    """Return the mean input and output force of the readings next to a force, below or above; None where none is near."""
    beyond = way * (force_in - force)
    near = np.flatnonzero((beyond >= 0) & (beyond <= _NEAR * force))
    near = near[np.argsort(beyond[near])[:_MOST_NEAR]]
    return (float(force_in[near].mean()), float(force_out[near].mean())) if len(near) else None
