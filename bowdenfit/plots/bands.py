"""What the figures against the route share: the curve with its intervals, and the marking of what lies outside."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from bowdenfit.plots.style import BLUE, LEAST_SQUARES, LIGHT, MEDIAN, NARROW_INTERVAL, WIDE_INTERVAL

if TYPE_CHECKING:
    from bowdenfit.results.figure_data import Band

OUTSIDE = "Outside the range of the curves"


def draw_band(axes: Axes, band: "Band", scale: float = 1.0) -> None:
    """Median with 50 % and 90 % intervals, or the least-squares line where there are no draws."""
    quantiles = scale * band.quantiles
    if band.is_line:
        axes.plot(band.route, quantiles[0], color=BLUE, label=LEAST_SQUARES)
        return
    low, lower, median, upper, high = quantiles
    axes.plot(band.route, median, color=BLUE, label=MEDIAN)
    axes.fill_between(band.route, lower, upper, color=BLUE, alpha=0.38, linewidth=0, label=NARROW_INTERVAL)
    axes.fill_between(band.route, low, high, color=BLUE, alpha=0.18, linewidth=0, label=WIDE_INTERVAL)


def route_limits(route_range: tuple[float, float], *readings: np.ndarray) -> tuple[float, float]:
    """Axis that shows the range and every reading."""
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
