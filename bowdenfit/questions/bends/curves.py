"""Curves of many draws for the figures of a cable that stretches or has preload, beside what was read.

Quantiles have the 5 %, 50 % and 95 % quantiles of the draws as first axis; one row, the least-squares line, without draws.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.draws import BATCH, for_each_value
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.kind import RopeKind
from bowdenfit.kinds.tables import PreloadTable, StretchTable
from bowdenfit.questions.bends.bent_cable import has_preload
from bowdenfit.questions.bends.preload_figure import PreloadCurve
from bowdenfit.questions.bends.stretch_figure import StretchCurve
from bowdenfit.results.record import Record, thinned_parameter_values

QUANTILES = (0.05, 0.5, 0.95)
POINTS = 61  # of a line

Values = Mapping[str, Array]


def evaluate_curves(fit: Record, curves: Callable[[Values], dict[str, Any]]) -> dict[str, np.ndarray]:
    """Evaluate curves for some of the draws (rows), or for least squares alone.

    Args:
        fit: The fit.
        curves: Function of the values of one draw.
    """
    values = thinned_parameter_values(fit, 1 if fit.sampled is None else BATCH)
    with jax.enable_x64(True):
        draws: dict[str, np.ndarray] = for_each_value(curves, values)
    return draws


def quantiles_of_draws(draws: np.ndarray) -> np.ndarray:
    """Return the 5 %, 50 % and 95 % quantiles over the draws; the one line without draws."""
    return draws if len(draws) == 1 else np.quantile(draws, QUANTILES, axis=0)


def collect_stretch(fit: Record) -> tuple[StretchCurve, ...] | None:
    """Return a curve for each wrap angle that stretch was read at; None without such readings."""
    table = fit.dataset.measurements.table(StretchTable)
    if table is None:
        return None
    angles = np.unique(table.wrap_angle)
    read = [table.load[table.wrap_angle == angle] for angle in angles]
    loads = np.array([np.linspace(f.min(), f.max(), POINTS) for f in read])

    def curves(values: Values) -> dict[str, Any]:
        elastic, load = fit.model.cable.elasticity, jnp.asarray(loads)
        angle, peak = (jnp.broadcast_to(jnp.asarray(a)[:, None], load.shape) for a in (angles, loads[:, -1]))
        stretched = {"loading": load, "unloading": peak}
        return {way: elastic.stretch(values, load, angle, highest) for way, highest in stretched.items()}

    both = {way: quantiles_of_draws(draws) for way, draws in evaluate_curves(fit, curves).items()}
    curves_by_angle, left_out = [], fit.dataset.measurements.excluded_points("stretch", "load", "stretch")
    for i, angle in enumerate(angles):
        mask = table.wrap_angle == angle
        down = table.unloading[mask]
        back = both["unloading"][:, i] if down.any() else None
        points = table.load[mask], table.stretch[mask], down
        curves_by_angle.append(StretchCurve(float(np.rad2deg(angle)), loads[i], both["loading"][:, i], back, *points))
    curves_by_angle[0] = replace(curves_by_angle[0], left_out=left_out)
    return tuple(curves_by_angle)


def collect_preload(fit: Record) -> PreloadCurve | None:
    """Return preload and slack against the wrap angle; None where preload does not depend on the wrap angle."""
    if not fit.dataset.description.preload_follows_stretch or not has_preload(fit.model):
        return None
    angles = np.linspace(*_measured_range(fit), POINTS)

    def curves(values: Values) -> dict[str, Any]:
        preload, slack = fit.model.cable.elasticity.preload(values, jnp.asarray(angles))
        return {"preload": preload, "slack": slack}

    draws, table = evaluate_curves(fit, curves), fit.dataset.measurements.table(PreloadTable)
    points = (np.zeros(0), np.zeros(0)) if table is None else (np.rad2deg(table.wrap_angle), table.preload)
    probability = np.mean(draws["slack"] > 0, axis=0)
    return PreloadCurve(
        np.rad2deg(angles),
        quantiles_of_draws(draws["preload"]),
        quantiles_of_draws(draws["slack"]),
        probability,
        points[0],
        points[1],
        fit.dataset.measurements.excluded_points("preload", "wrap_angle", "preload") * [[180 / np.pi], [1]],
    )


def _measured_range(fit: Record) -> tuple[float, float]:
    """Return the smallest and largest total wrap angle of any reading [rad]; 0 to pi without one."""
    angles = [kind.bends(table) for kind, table in iterate_tables(fit.dataset.measurements) if isinstance(kind, RopeKind)]
    every = np.concatenate([np.zeros(0), *angles])
    low, high = (float(every.min()), float(every.max())) if len(every) else (0.0, np.pi)
    return (low, high) if low < high else (0.0, high or np.pi)
