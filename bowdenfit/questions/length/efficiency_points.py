"""Every measured efficiency with its prediction, for figures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.curves import BAND_QUANTILES

if TYPE_CHECKING:
    from bowdenfit.results.record import Record


@dataclass(frozen=True)
class EfficiencyPoints:
    """Measured efficiencies [1].

    Args:
        of_runs: Whether each is the mean of a run.
        labels: Each in words.
        route: Route value; NaN without a route.
        measured: Efficiency.
        predicted: Quantiles (`BAND_QUANTILES`, first axis) of readings drawn anew; one row, least squares', without
            draws.
        inside: Whether it lies within the range of the curves.
    """

    of_runs: bool
    labels: tuple[str, ...]
    route: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    inside: np.ndarray


def efficiency_points(fit: Record) -> tuple[EfficiencyPoints, ...]:
    """Every measured efficiency, by table."""
    from bowdenfit.kinds import readings_called
    from bowdenfit.kinds.places import route_values

    route, points = fit.dataset.description.route, []
    for term in fit.model.terms:
        called, at = readings_called(term.name), route_values(term)
        if not called.are_efficiencies:
            continue
        if route is None or at is None:
            at = np.full(len(term.labels), np.nan)
        predicted = fit.least_squares.readings[term.name][None]
        if fit.sampled is not None:
            predicted = np.quantile(fit.posterior.replicated[term.name], BAND_QUANTILES, axis=(0, 1))
        inside = (at >= route.range[0]) & (at <= route.range[1]) if route else np.ones(len(at), dtype=bool)
        points.append(EfficiencyPoints(called.are_runs, term.labels, at, term.observed(), predicted, inside))
    return tuple(points)
