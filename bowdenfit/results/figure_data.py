"""What the figures show, as plain arrays: drawing needs no model, and can be done in another process."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.models.build import Model
from bowdenfit.predictions.draws import curves_of
from bowdenfit.predictions.optimal_length import route_grid
from bowdenfit.results.fit import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Fit, OptimalLength

BAND_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
_BAND_DRAWS = 5000  # enough for a line's width of accuracy


@dataclass(frozen=True)
class Band:
    """Quantiles (`BAND_QUANTILES`, first axis) against the route; one row, the least-squares line, without draws."""

    route: np.ndarray
    quantiles: np.ndarray

    @property
    def is_line(self) -> bool:
        """Whether there is only the least-squares line."""
        return len(self.quantiles) == 1


@dataclass(frozen=True)
class AngleCurve:
    """One contact's wrap angle [deg]: the curve, and the readings by how they entered.

    Args:
        contact: Name of the contact.
        band: The curve.
        route, angle: Detected readings inside the range of the curve.
        undetected_route, limit: Readings below the detection limit inside the range.
        outside_route, outside_angle: Readings outside the range, which the curve does not use.
    """

    contact: str
    band: Band
    route: np.ndarray
    angle: np.ndarray
    undetected_route: np.ndarray
    limit: np.ndarray
    outside_route: np.ndarray
    outside_angle: np.ndarray


@dataclass(frozen=True)
class EfficiencyPoints:
    """Measured efficiencies [1], of rows or of runs.

    Args:
        what: "efficiency" or "run_efficiency".
        labels: Each in words.
        route: Route value; NaN without a route.
        measured: Efficiency.
        predicted: Quantiles (`BAND_QUANTILES`, first axis) of readings drawn anew; one row, least squares', without
            draws.
        inside: Whether it lies within the range of the curves.
    """

    what: str
    labels: tuple[str, ...]
    route: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    inside: np.ndarray


@dataclass(frozen=True)
class ParameterDraws:
    """One free parameter in its shown unit.

    Args:
        name, symbol, unit, role: As declared; `symbol` is in matplotlib's math notation.
        draws: Walkers (ordered by ensemble) by draws; None without MCMC.
        prior: Draws from the prior.
        least_squares: Estimate; NaN where not identified.
        standard_error: Its standard error.
    """

    name: str
    symbol: str
    unit: str
    role: str
    draws: np.ndarray | None
    prior: np.ndarray | None
    least_squares: float
    standard_error: float


@dataclass(frozen=True)
class FigureData:
    """Everything the figures of one fit show.

    Args:
        name: Name of the cable.
        route_label: Axis label of the route with unit, such as "Cable length (mm)"; empty without a route.
        route_range: Where the curves hold.
        angles: Curves of the curved contacts.
        efficiency: Efficiency against the route; None without a route.
        points: Measured efficiencies.
        optimum: The design answer; None without draws or route.
        optimal_length, optimal_efficiency: Draws, walkers by draws; None likewise.
        parameters: Free parameters.
        n_ensembles: Number of ensembles (walkers are ordered by ensemble).
    """

    name: str
    route_label: str
    route_range: tuple[float, float]
    angles: tuple[AngleCurve, ...]
    efficiency: Band | None
    points: tuple[EfficiencyPoints, ...]
    optimum: OptimalLength | None
    optimal_length: np.ndarray | None
    optimal_efficiency: np.ndarray | None
    parameters: tuple[ParameterDraws, ...]
    n_ensembles: int


def figure_data(fit: Fit) -> FigureData:
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
    )


def _bands(fit: Fit, model: Model) -> dict[str, Band]:
    if fit.posterior is not None:
        grid, curves = fit.curves()
        every = max(1, len(fit.posterior.flat_z) // _BAND_DRAWS)
        return {name: Band(grid, np.quantile(d[::every], BAND_QUANTILES, axis=0)) for name, d in curves.items()}
    grid = route_grid(model)
    with jax.enable_x64(True):
        curves = jax.jit(curves_of(model, grid))(jnp.asarray(fit.least_squares.z))
    return {name: Band(grid, np.asarray(line)[None]) for name, line in curves.items()}


def _angle_curve(fit: Fit, column: str, band: Band) -> AngleCurve:
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


def _points(fit: Fit) -> tuple[EfficiencyPoints, ...]:
    route, points = fit.dataset.description.route, []
    for term in fit.model.terms:
        if term.name not in {"efficiency", "run_efficiency"}:
            continue
        at = np.asarray(term.data["route"], dtype=float)
        if term.name == "run_efficiency":
            at = np.array([at[term.data["run"] == run].mean() for run in range(len(term.labels))])
        if route is None:
            at = np.full(len(at), np.nan)
        predicted = fit.least_squares.readings[term.name][None]
        if fit.posterior is not None:
            predicted = np.quantile(fit.posterior.replicated[term.name], BAND_QUANTILES, axis=(0, 1))
        inside = (at >= route.range[0]) & (at <= route.range[1]) if route else np.ones(len(at), dtype=bool)
        points.append(EfficiencyPoints(term.name, term.labels, at, term.observed(), predicted, inside))
    return tuple(points)


def _parameter(fit: Fit, name: str) -> ParameterDraws:
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
