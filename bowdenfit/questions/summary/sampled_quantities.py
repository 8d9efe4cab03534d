"""What the pair plot and the paths of the ensembles show: parameters and the optimum alike, as draws with a label."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.curves import density, limits, support
from bowdenfit.plots.style import axis_label

if TYPE_CHECKING:
    from bowdenfit.results.record import Record

BETWEEN_MOUNTINGS = "scatter between mountings"


@dataclass(frozen=True)
class SampledQuantity:
    """Draws (walkers by draws) of something between bounds, its symbol with unit, and the symbol alone with what it means."""

    label: str
    draws: np.ndarray
    bounds: tuple[float, float]
    symbol: str = ""
    meaning: str = ""

    def limits(self, share: float) -> tuple[float, float]:
        """An axis that shows the given share of the draws, within the bounds."""
        low, high = limits(self.draws, share)
        return max(low, self.bounds[0]), min(high, self.bounds[1])

    def density(self, grid: np.ndarray, draws: np.ndarray | None = None) -> np.ndarray:
        """Density of the draws, or of some of them, with its highest point at 1."""
        height = density(self.draws if draws is None else draws, grid, *self.bounds)
        return height / height.max()


def sampled_quantities(fit: Record, roles: tuple[str, ...] = ()) -> list[SampledQuantity]:
    """The sampled parameters, of the given roles in the given order, or all; none without draws."""
    from bowdenfit.description.stated_parameters import RUN_SCATTER

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


def optimum_quantities(fit: Record) -> list[SampledQuantity]:
    """The optimal length and the efficiency there [%], where there are such."""
    from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH

    route, posterior = fit.dataset.description.route, fit.sampled
    if route is None or posterior is None:
        return []
    length, efficiency = posterior.optimum[OPTIMAL_LENGTH], 100 * posterior.optimum[OPTIMAL_EFFICIENCY]
    return [
        SampledQuantity(axis_label("Optimum", route.unit), length, route.range),
        SampledQuantity("Efficiency at\noptimum (%)", efficiency, (0.0, 100.0)),
    ]
