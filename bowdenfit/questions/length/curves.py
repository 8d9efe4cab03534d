"""Efficiency and wrap angles along the route with their uncertainty."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.draws import curve_function
from bowdenfit.kinds import find_readings
from bowdenfit.kinds.covariates import route_values
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.plots.curves import BAND_QUANTILES, Band
from bowdenfit.questions.length.efficiency_figure import EfficiencyPoints
from bowdenfit.questions.length.wrap_angles_figure import AngleCurve
from bowdenfit.questions.motor_gear import gear_factors
from bowdenfit.results.along_route import route_grid
from bowdenfit.results.record import OPTIMAL_LENGTH, Record, cached_per_fit, thinned_parameter_values

_FAMILY_DRAWS = 400  # of the family's curve without its departure, of which only the median is drawn
_DRAWS = 5000  # from so many draws a quantile is off by less than the width of a line on paper


@cached_per_fit
def compute_curves(fit: Record) -> dict[str, Band]:
    """Return the efficiency [1] and every curved wrap angle [deg], by name; empty without a route."""
    if fit.dataset.description.route is None:
        return {}
    if fit.sampled is not None:
        grid, draws = fit.along_route.grid, fit.along_route.curves
        step = max(1, len(fit.posterior.flat_z) // _DRAWS)
        return {name: Band(grid, np.quantile(d[::step], BAND_QUANTILES, axis=0)) for name, d in draws.items()}
    grid = route_grid(fit.model)
    with jax.enable_x64(True):
        z = np.asarray(fit.least_squares.z)
        lines = compile_program(curve_function(fit.model, grid), z, run_once=True)(z)
    return {name: Band(grid, np.asarray(line)[None]) for name, line in lines.items()}


def compute_new_run_interval(fit: Record) -> np.ndarray:
    """Return quantiles of the efficiency of a run along the route, whose mounting shifts the friction exponent."""
    efficiency, thinned = fit.along_route.curves["efficiency"], slice(None, None, max(1, len(fit.mounting()) // _DRAWS))
    mounted = efficiency[thinned] * np.exp(-fit.mounting()[thinned, None])
    return np.quantile(mounted, (BAND_QUANTILES[0], BAND_QUANTILES[-1]), axis=0)


def collect_optimal_lengths(fit: Record) -> np.ndarray:
    """Return draws of the optimal length, in the unit of the route."""
    return np.asarray(fit.posterior.optimum[OPTIMAL_LENGTH])


def collect_efficiency_points(fit: Record) -> tuple[EfficiencyPoints, ...]:
    """Return every measured efficiency, by table."""
    route, points = fit.dataset.description.route, []
    for term in fit.model.terms:
        reading_kind, position = find_readings(term.name), route_values(term)
        if not reading_kind.are_efficiencies:
            continue
        if route is None or position is None:
            position = np.full(len(term.labels), np.nan)
        factors = gear_factors(fit, term)
        predicted, observed = factors * fit.least_squares.readings[term.name][None], factors * term.observed()
        if fit.sampled is not None:
            predicted = factors * np.quantile(fit.posterior.replicated[term.name], BAND_QUANTILES, axis=(0, 1))
        inside = (position >= route.range[0]) & (position <= route.range[1]) if route else np.ones(len(position), dtype=bool)
        points.append(EfficiencyPoints(reading_kind.are_runs, term.labels, position, observed, predicted, inside))
    return tuple(points)


def collect_angle_curves(fit: Record) -> tuple[AngleCurve, ...]:
    """Return the curve and the readings of each curved contact."""
    return tuple(_collect_angle_curve(fit, column, compute_curves(fit)[column]) for column in fit.model.cable.curves)


def _collect_angle_curve(fit: Record, column: str, band: Band) -> AngleCurve:
    """Return the curve of a column of wrap angles, and its readings by how they entered."""
    table, route = fit.dataset.measurements.table(AngleTable), fit.dataset.description.route
    assert table is not None and route is not None  # a curve has both
    angle, limit = table.column(column)
    inside, detected = (table.route >= route.range[0]) & (table.route <= route.range[1]), np.isfinite(angle)
    contact = next(c.name for c in fit.dataset.description.curved if c.wrap_angle.column == column)
    return AngleCurve(
        contact,
        band,
        table.route[inside & detected],
        np.rad2deg(angle[inside & detected]),
        table.route[inside & ~detected],
        np.rad2deg(limit[inside & ~detected]),
        table.route[~inside & detected],
        np.rad2deg(angle[~inside & detected]),
        _compute_family_alone(fit, column, band.route),
        fit.dataset.measurements.excluded_points("angles", route.variable, column) * [[1], [180 / np.pi]],
    )


def _compute_family_alone(fit: Record, column: str, route: np.ndarray) -> np.ndarray:
    """Median of the family's curve without its departure [deg] along the route; empty where it does not depart."""
    curve = fit.model.cable.curves[column]
    if not curve.departs:
        return np.empty(0)
    values = thinned_parameter_values(fit, _FAMILY_DRAWS)
    with jax.enable_x64(True):
        z = jnp.asarray((route - curve.middle) / curve.half_width)
        angles = jax.vmap(partial(curve.at, z))(*(jnp.asarray(values[name]) for name in curve.names))
    return np.rad2deg(np.median(np.asarray(angles), axis=0))
