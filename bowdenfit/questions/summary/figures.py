"""From a fit to what its figures show."""

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.inference.draws import curves_of
from bowdenfit.kinds import readings_called
from bowdenfit.model import Model
from bowdenfit.questions.bends.figures import elastic_figures
from bowdenfit.questions.check.answer import checks_of
from bowdenfit.questions.check.figure_tables import checked_tables
from bowdenfit.questions.check.residual_places import route_values
from bowdenfit.questions.recorded.traces import dependences, traces, velocity_unit
from bowdenfit.questions.summary.figure_data import (
    BAND_QUANTILES,
    AngleCurve,
    Band,
    EfficiencyPoints,
    FigureData,
    ParameterDraws,
)
from bowdenfit.results.optimum import route_grid
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Record

_BAND_DRAWS = 5000  # enough for a line's width of accuracy


def figure_data(fit: Record) -> FigureData:
    """What the figures of a fit show."""
    description, posterior, model = fit.dataset.description, fit.posterior, fit.model
    route = description.route
    bands = _bands(fit, model) if route is not None else {}
    drawn = posterior is not None and route is not None
    return FigureData(
        fit.name,
        route.label if route else "",
        route.range if route else (0.0, 0.0),
        tuple(_angle_curve(fit, column, bands[column]) for column in model.cable.curves),
        bands.get("efficiency"),
        _points(fit),
        fit.optimal_length() if drawn else None,
        posterior.optimum[OPTIMAL_LENGTH] if posterior is not None and drawn else None,
        posterior.optimum[OPTIMAL_EFFICIENCY] if posterior is not None and drawn else None,
        tuple(_parameter(fit, p.name) for p in model.space.free),
        posterior.n_ensembles if posterior is not None else 0,
        traces(fit),
        velocity_unit(fit),
        dependences(fit),
        elastic_figures(fit),
        checked_tables(checks_of(fit)),
    )


def _bands(fit: Record, model: Model) -> dict[str, Band]:
    if fit.posterior is not None:
        grid, curves = fit.curves()
        every = max(1, len(fit.posterior.flat_z) // _BAND_DRAWS)
        return {name: Band(grid, np.quantile(d[::every], BAND_QUANTILES, axis=0)) for name, d in curves.items()}
    grid = route_grid(model)
    with jax.enable_x64(True):
        curves = jax.jit(curves_of(model, grid))(jnp.asarray(fit.least_squares.z))
    return {name: Band(grid, np.asarray(line)[None]) for name, line in curves.items()}


def _angle_curve(fit: Record, column: str, band: Band) -> AngleCurve:
    table, route = fit.dataset.measurements.angles, fit.dataset.description.route
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
    )


def _points(fit: Record) -> tuple[EfficiencyPoints, ...]:
    route, points = fit.dataset.description.route, []
    for term in fit.model.terms:
        if not readings_called(term.name).are_efficiencies:
            continue
        at = route_values(term)
        if route is None or at is None:
            at = np.full(len(term.labels), np.nan)
        predicted = fit.least_squares.readings[term.name][None]
        if fit.posterior is not None:
            predicted = np.quantile(fit.posterior.replicated[term.name], BAND_QUANTILES, axis=(0, 1))
        inside = (at >= route.range[0]) & (at <= route.range[1]) if route else np.ones(len(at), dtype=bool)
        points.append(EfficiencyPoints(term.name, term.labels, at, term.observed(), predicted, inside))
    return tuple(points)


def _parameter(fit: Record, name: str) -> ParameterDraws:
    parameter = next(p for p in fit.model.space.free if p.name == name)
    estimate = fit.least_squares.estimates.get(name)
    drawn = fit.posterior
    return ParameterDraws(
        name,
        parameter.symbol,
        parameter.unit,
        parameter.role,
        drawn.values[name] if drawn else None,
        drawn.prior[name] if drawn else None,
        estimate.value if estimate else float("nan"),
        estimate.standard_error if estimate else float("nan"),
    )
