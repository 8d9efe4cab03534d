"""Curves with credible bands, shading outside the route, legends of how many are shown, and smooth densities of draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit.plots.style import BLUE, GRAY, LEAST_SQUARES, LIGHT, MEDIAN, NARROW_INTERVAL, WIDE_INTERVAL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BAND_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # ends of the 90 % and 50 % intervals of every answer, and the median
OUTSIDE = "Outside the range of the curves"
NEW_RUN = "90 % of runs, each on a new mounting"


@dataclass(frozen=True)
class Band:
    """Quantiles of a curve against the route: `BAND_QUANTILES` along the first axis, or one least-squares row."""

    route: np.ndarray
    quantiles: np.ndarray

    @property
    def is_line(self) -> bool:
        """Whether there is only the least-squares line."""
        return len(self.quantiles) == 1


def draw_band(axes: Axes, band: Band, scale: float = 1.0) -> None:
    """Draw the median with 50 % and 90 % intervals, or the least-squares line if there are no draws."""
    quantiles = scale * band.quantiles
    if band.is_line:
        axes.plot(band.route, quantiles[0], color=BLUE, label=LEAST_SQUARES)
        return
    low, lower, median, upper, high = quantiles
    axes.plot(band.route, median, color=BLUE, label=MEDIAN)
    axes.fill_between(band.route, lower, upper, color=BLUE, alpha=0.38, linewidth=0, label=NARROW_INTERVAL)
    axes.fill_between(band.route, low, high, color=BLUE, alpha=0.18, linewidth=0, label=WIDE_INTERVAL)


def route_limits(route_range: tuple[float, float], *readings: np.ndarray) -> tuple[float, float]:
    """Return axis limits that show the range and every reading."""
    everything = np.concatenate([np.asarray(route_range), *readings])
    everything = everything[np.isfinite(everything)]
    room = 0.025 * (everything.max() - everything.min())
    return float(everything.min() - room), float(everything.max() + room)


def shade_outside(axes: Axes, route_range: tuple[float, float], shown: tuple[float, float]) -> None:
    """Set the limits of the route axis, and shade what lies outside the range where readings do."""
    low, high = route_range
    margin = 0.03 * (shown[1] - shown[0])
    for start, stop in ((shown[0], low), (high, shown[1])):
        if stop - start > margin:
            axes.axvspan(start, stop, facecolor=LIGHT, linewidth=0, zorder=0.4, label=OUTSIDE)
    axes.set_xlim(*shown)


def draw_quantiles(axes: Axes, x: np.ndarray, quantiles: np.ndarray, color: Any, **line: Any) -> None:
    """Draw the median with a band from the lowest to the highest quantile, or one line if there are no draws.

    Args:
        axes: Panel to draw on.
        x: Horizontal positions of the line.
        quantiles: First axis from low to high, such as 5 %, 50 % and 95 %; or one row.
        color: Color of the line and the band.
        line: Label and looks of the line.
    """
    axes.plot(x, middle(quantiles), color=color, **line)
    if len(quantiles) > 1:
        axes.fill_between(x, quantiles[0], quantiles[-1], color=color, alpha=0.18, linewidth=0)


def middle(quantiles: np.ndarray) -> np.ndarray:
    """Return the median row, or the only row."""
    row: np.ndarray = quantiles[len(quantiles) // 2]
    return row


def name_band(axes: Axes, quantiles: np.ndarray, color: Any = GRAY) -> None:
    """Add a legend entry for bands of several colors; none without draws."""
    if len(quantiles) > 1:
        axes.fill_between([], [], [], color=color, alpha=0.3, linewidth=0, label=WIDE_INTERVAL)


def choose_evenly(items: Sequence[Any], most: int) -> list[Any]:
    """Return at most `most` evenly spaced items of a sequence, the first and the last included."""
    indices = np.linspace(0, len(items) - 1, min(len(items), most)).round().astype(int)
    return [items[i] for i in indices.tolist()]


def note_shown_count(axes: Axes, count: int, total: int, noun: str = "") -> None:
    """Add a legend entry such as '8 of 12 runs shown' if not all are drawn."""
    if count < total:
        axes.plot([], [], " ", label=" ".join(filter(None, (f"{count} of {total}", noun, "shown"))))


GRID_POINTS = 160  # of a density; a judgement: two of them are less than a line's width apart
ENOUGH = 40_000  # draws, beyond which more do not change a picture; a judgement


def thin_draws(draws: np.ndarray) -> np.ndarray:
    """Return all draws in one row, or evenly thinned to about `ENOUGH`."""
    return np.ravel(draws)[:: -(-np.size(draws) // ENOUGH)]


def limits(draws: np.ndarray, share: float = 0.996) -> tuple[float, float]:
    """Return axis limits that show a share of the draws with a little room; never below zero if no draw is.

    Draws that are all the same get some width all the same.
    """
    low, high = (float(q) for q in np.quantile(draws, (0.5 - share / 2, 0.5 + share / 2)))
    room = 0.08 * (high - low) or 0.05 * abs(high) or 0.5
    return (max(low - room, 0.0) if np.min(draws) >= 0 else low - room), high + room


def support(*samples: np.ndarray) -> float:
    """Return the lower bound of the support: zero if no draw is below it, else minus infinity."""
    return 0.0 if all(np.min(sample) >= 0 for sample in samples) else -np.inf


def density(draws: np.ndarray, grid: np.ndarray, lower: float = -np.inf, upper: float = np.inf) -> np.ndarray:
    """Return the kernel density of draws on an even grid.

    A Gaussian is folded over a histogram whose bins are the grid's; draws near a bound are
    mirrored at it, so that a density that does not vanish there is not smoothed away.

    Args:
        draws: Draws of any shape.
        grid: Equally spaced points.
        lower, upper: Bounds of the quantity.

    Returns:
        Density, per unit of the draws; zero outside the bounds.
    """
    draws, step = thin_draws(draws), float(grid[1] - grid[0])
    width = bandwidth(draws, step)
    near = int(np.ceil(4 * width / step))
    everything = np.concatenate([draws, *(2 * bound - draws for bound in (lower, upper) if np.isfinite(bound))])
    edges = grid[0] + step * (np.arange(-near, len(grid) + near + 1) - 0.5)
    counts, _ = np.histogram(everything, edges)
    kernel = np.exp(-0.5 * (step / width * np.arange(-near, near + 1)) ** 2)
    smooth = np.convolve(counts, kernel / kernel.sum(), mode="valid") / (len(draws) * step)
    return np.where((grid >= lower) & (grid <= upper), smooth, 0.0)


def bandwidth(draws: np.ndarray, least: float) -> float:
    """Return Silverman's bandwidth, a third wider because draws of a chain are correlated, and at least `least`."""
    low, high = np.quantile(draws, (0.25, 0.75))
    spread = min((s for s in (float(np.std(draws)), float(high - low) / 1.34) if s > 0), default=0.0)
    return max(1.2 * spread * len(draws) ** -0.2, least)
