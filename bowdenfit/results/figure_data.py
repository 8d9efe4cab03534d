"""What the figures show, as plain arrays: drawing needs no model, and can be done in another process.

Loads no JAX, and must not: the process that draws would pay for it.
"""

from dataclasses import dataclass

import numpy as np

from bowdenfit.results.answers import OptimalLength

BAND_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


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
