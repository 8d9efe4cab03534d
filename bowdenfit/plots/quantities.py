"""What the pair plot and the traces show: parameters and the optimum alike, as draws with a label."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.densities import density, limits, support
from bowdenfit.plots.style import labeled

if TYPE_CHECKING:
    from bowdenfit.questions.summary.figure_data import FigureData


@dataclass(frozen=True)
class Quantity:
    """Draws (walkers by draws) of something between bounds, and its symbol with unit."""

    label: str
    draws: np.ndarray
    bounds: tuple[float, float]

    def limits(self, share: float) -> tuple[float, float]:
        """An axis that shows the given share of the draws, within the bounds."""
        low, high = limits(self.draws, share)
        return max(low, self.bounds[0]), min(high, self.bounds[1])

    def density(self, grid: np.ndarray, draws: np.ndarray | None = None) -> np.ndarray:
        """Density of the draws, or of some of them, with its highest point at 1."""
        height = density(self.draws if draws is None else draws, grid, *self.bounds)
        return height / height.max()


def sampled(data: "FigureData", roles: tuple[str, ...] = ()) -> list[Quantity]:
    """The sampled parameters, of the given roles in the given order, or all."""
    wanted = [p for role in roles for p in data.parameters if p.role == role] if roles else data.parameters
    return [
        Quantity(labeled(p.symbol, p.unit), p.draws, (support(p.draws), np.inf)) for p in wanted if p.draws is not None
    ]


def optimal_length(data: "FigureData") -> list[Quantity]:
    """The optimal length, where there is one."""
    if data.optimum is None or data.optimal_length is None:
        return []
    return [Quantity(labeled("Optimum", data.optimum.unit), data.optimal_length, data.route_range)]


def optimum(data: "FigureData") -> list[Quantity]:
    """The optimal length and the efficiency there [%], where there are such."""
    if data.optimal_efficiency is None:
        return []
    return [*optimal_length(data), Quantity("Efficiency at\noptimum (%)", 100 * data.optimal_efficiency, (0.0, 100.0))]
