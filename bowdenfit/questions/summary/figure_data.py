"""Data of figures from the model and its draws: a table of forces beside the fitted law, and sampled quantities."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.cable.sensors import RUN_SCATTER, LoadCells
from bowdenfit.inference.interval import NORMAL_90
from bowdenfit.kinds.forces.mountings import group_numbers
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.kinds.forces.term import name_noise
from bowdenfit.kinds.row_angles import collect_row_angles, resolve_angles
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.plots.curves import choose_evenly, support
from bowdenfit.plots.style import axis_label
from bowdenfit.questions.bends.curves import evaluate_curves, quantiles_of_draws
from bowdenfit.questions.motor_gear import rope_measurements
from bowdenfit.questions.summary.forces_figure import ONE_BEND, STROKES, ForcesAtBend, ForcesData
from bowdenfit.questions.summary.pairs_figure import SampledQuantity
from bowdenfit.questions.summary.verdict import BETWEEN_MOUNTINGS, assess_fit
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Record

MOST_PLACES, MOST_READINGS = 6, 1000  # bends in color, and readings, that a figure shows
POINTS = 61  # of a line
_LEAST_ANGLE = np.deg2rad(1.0)  # below which the apparent coefficient is noise
_WIDE = 20.0  # ratio of the largest to the smallest load from which axes are logarithmic


def collect_forces(fit: Record) -> ForcesData | None:
    """Return readings and law of a table of forces; None without one."""
    table = rope_measurements(fit).table(ForceTable)
    if table is None:
        return None
    rows = np.array(choose_evenly(range(len(table.run)), MOST_READINGS))
    group, first, labels, shown = _group_rows(fit, table, rows)
    low, high = table.input_force[rows].min(), table.input_force[rows].max()
    logarithmic = bool(high > _WIDE * low)
    load = np.geomspace(0.9 * low, 1.1 * high, POINTS) if logarithmic else np.linspace(0.02 * high, 1.05 * high, POINTS)
    draws = _predict_forces(fit, table, rows, rows[first], load)
    bends = [
        _collect_forces_at_bend(table, rows, group == i, label, load, draws, i, i in shown) for i, label in enumerate(labels)
    ]
    fit_verdict = assess_fit(fit)
    spread = _estimate_spread(fit, table, load, draws) if fit.sampled is not None else np.zeros(0)
    count = len(table.run) if len(rows) < len(table.run) else 0
    reason = next(iter(fit_verdict.reasons), "")
    model = fit.dataset.description.friction_model
    left_out = fit.dataset.measurements.excluded_points("forces", "input_force", "output_force")
    return ForcesData(tuple(bends), load, spread, model, fit_verdict.trusted, reason, logarithmic, count, left_out)


def _group_rows(fit: Record, table: ForceTable, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[str], set[int]]:
    """Place of each row, first row of each place, places in words, and which are shown in color."""
    route = fit.dataset.description.route
    angle = np.rad2deg(np.nansum(table.own.angle[rows], axis=1))
    bend = ONE_BEND * np.round(angle / ONE_BEND) if len(np.unique(angle.round(1))) > MOST_PLACES else angle.round(1)
    names = list(dict.fromkeys(table.group))
    group = np.array([names.index(table.group[row]) for row in rows]) if names else np.zeros(len(rows))
    keys = np.column_stack([np.nan_to_num(table.route[rows]), bend, group])
    distinct, first, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    place, labels = place.ravel(), []
    for i, (at, _, number) in enumerate(distinct):
        length = f"{at:.4g} {route.unit}" if route is not None else ""
        own = f"{np.mean(angle[place == i]):.3g} deg" if np.isfinite(table.own.angle).any() else ""
        labels.append(", ".join(part for part in (names[int(number)] if names else "", length, own) if part))
    return place, first, labels, set(choose_evenly(range(len(distinct)), MOST_PLACES))


def _predict_forces(
    fit: Record, table: ForceTable, rows: np.ndarray, first: np.ndarray, load: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the law at each place, expected outputs of the rows, and wrap angles, of some draws or of least squares."""
    cable, friction = fit.model.cable, fit.model.cable.friction
    groups = group_numbers(friction.groups, table.group, len(table.run))
    of_rows = collect_row_angles(cable.description, table, fit.dataset.measurements.table(AngleTable))
    of_rows = replace(of_rows, group=groups)
    least, velocity = friction.conditions.least_force, table.velocity

    def output(values: Mapping[str, Any], which: np.ndarray, force: Any, stroke: Any) -> tuple[Any, Any]:
        chosen = jax.tree.map(jnp.asarray, of_rows.select(which))
        angles, _ = resolve_angles(cable, values, chosen)
        exponent = cable.friction_exponent(values, angles, chosen.group, chosen.route)
        exponent = exponent * friction.rate(values, jnp.asarray(velocity[which]))
        cells, more = replace(LoadCells.of(values), gear=None), (...,) + (None,) * (jnp.ndim(force) - 1)
        read = friction.output_force(values, cells.true_input(force, least), exponent[more], stroke)
        return cells.shown_output(read, least), jnp.sum(angles, axis=-1)

    strokes = np.array(STROKES, dtype=float)[None, :, None]
    grid = np.broadcast_to(load, (len(first), len(STROKES), len(load)))

    def curves(values: Mapping[str, Any]) -> dict[str, Any]:
        law, angle = output(values, first, jnp.asarray(grid), jnp.asarray(strokes))
        at_rows, bend = output(values, rows, jnp.asarray(table.input_force[rows]), jnp.asarray(table.stroke[rows]))
        apparent = strokes * jnp.log(grid / law) / jnp.where(angle > _LEAST_ANGLE, angle, jnp.nan)[:, None, None]
        return {"law": law, "apparent": apparent, "rows": at_rows, "bend": bend}

    return evaluate_curves(fit, curves)


def _collect_forces_at_bend(
    table: ForceTable, rows: np.ndarray, selected: np.ndarray, label: str, load: np.ndarray, draws: Mapping[str, np.ndarray],
    number: int, shown: bool,
) -> ForcesAtBend:  # fmt: skip
    """Return the readings at one place, and the law there."""
    force_in, force_out = table.input_force[rows[selected]], table.output_force[rows[selected]]
    stroke = table.stroke[rows[selected]]
    expected, bend = (np.median(draws[name][:, selected], axis=0) for name in ("rows", "bend"))
    slides = stroke != 0
    off = np.where(slides, 100 * (force_out / expected - 1), np.nan)
    bent = np.where(slides & (bend > _LEAST_ANGLE), bend, np.nan)
    apparent = stroke * np.log(force_in / force_out) / bent
    weight = np.where(np.isfinite(apparent), 1 / (force_in**-2 + force_out**-2), 0.0)
    capstan = float(weight @ np.nan_to_num(apparent) / weight.sum()) if weight.sum() else float("nan")
    law, apparent_law = (quantiles_of_draws(draws[name][:, number]) for name in ("law", "apparent"))
    lines = load, law, apparent_law, capstan, shown
    return ForcesAtBend(label, force_in, force_out, stroke, off, apparent, *lines, np.rad2deg(bend))


def _estimate_spread(fit: Record, table: ForceTable, load: np.ndarray, draws: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return how far single readings scatter from the law, by their mountings and by the noise of the load cells."""
    values = {name: float(np.median(sampled)) for name, sampled in fit.draws().values.items()}
    fixed = {p.name: float(p.fixed or 0.0) for p in fit.model.space.fixed}
    tau, noise = ((values | fixed)[name] for name in (RUN_SCATTER, name_noise(table)))
    ratio, share = np.median(table.noises(fit.dataset.description.sensors.noise_ratio), axis=0)
    output = np.median(draws["law"][:, :, 0], axis=(0, 1))
    return np.asarray(100 * NORMAL_90 * np.sqrt(tau**2 + noise**2 * (ratio**2 / load**2 + share**2 / output**2)))


def collect_sampled_quantities(fit: Record, roles: tuple[str, ...] = ()) -> list[SampledQuantity]:
    """Return the sampled parameters, of the given roles in the given order, or all; none without draws."""
    if fit.sampled is None:
        return []
    free, values = fit.model.space.free, fit.sampled.values
    wanted = [p for role in roles for p in free if p.role == role] if roles else free
    quantities = []
    for p in wanted:
        words = BETWEEN_MOUNTINGS if p.name == RUN_SCATTER else p.meaning
        bounds = support(values[p.name]), np.inf
        quantities.append(SampledQuantity(axis_label(p.symbol, p.unit), values[p.name], bounds, p.symbol, words))
    return quantities


def collect_optimum_quantities(fit: Record) -> list[SampledQuantity]:
    """Return the optimal length and the efficiency there [%]; none without a route or draws."""
    route, posterior = fit.dataset.description.route, fit.sampled
    if route is None or posterior is None:
        return []
    length, efficiency = posterior.optimum[OPTIMAL_LENGTH], 100 * posterior.optimum[OPTIMAL_EFFICIENCY]
    return [
        SampledQuantity(axis_label("Optimum", route.unit), length, route.range),
        SampledQuantity("Efficiency at\noptimum (%)", efficiency, (0.0, 100.0)),
    ]
