"""What the model leaves over: measured minus predicted efficiencies, and angle readings minus their curve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit.plots.layout import RIGHT, TITLE, empty_page, legend_above, place_labels
from bowdenfit.plots.panels import short
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    GRAY,
    LEAST_SQUARES,
    MEDIAN,
    MEDIUM,
    NARROW_INTERVAL,
    SERIES_COLORS,
    SERIES_MARKERS,
    WIDE,
    WIDE_INTERVAL,
    in_paper_style,
)
from bowdenfit.questions.length.efficiency_figure import EfficiencyPoints, efficiency_points
from bowdenfit.questions.length.wrap_angles_figure import AngleCurve, angle_curves

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

ROW, LEAST, MOST = 0.155, 1.8, 8.0  # in, height of a labeled row and of the panels
CONTACT, GAP, BELOW = 0.8, 0.32, 0.6  # in, least height of a contact's panel, between two, below all
LONGEST, CHARACTER = 26, 0.064  # characters of a label, and width of one [in]


@dataclass(frozen=True)
class Residuals:
    """Efficiencies with their predictions, curves with readings that they follow, and the axis label of their route."""

    points: tuple[EfficiencyPoints, ...]
    curves: tuple[AngleCurve, ...] = ()
    route_label: str = ""


def data(fit: Record) -> Residuals | None:
    """What is shown; None where nothing measured is compared with a prediction."""
    points, curves = efficiency_points(fit), tuple(c for c in angle_curves(fit) if len(c.route))
    route = fit.dataset.description.route
    return Residuals(points, curves, route.label if route else "") if points or curves else None


@in_paper_style
def draw(data: Residuals) -> Figure:
    """Efficiencies by label with their predictive intervals, and angles against the route."""
    curves = data.curves
    labels = [short(label, LONGEST) for points in data.points for label in points.labels]
    inner = float(np.clip(max(ROW * len(labels), (CONTACT + GAP) * len(curves) - GAP), LEAST, MOST))
    width, top = (WIDE if labels and curves else MEDIUM), (TITLE if curves else 0.08)
    height = inner + BELOW + top
    figure = empty_page(width, height)
    left = 0.2 + CHARACTER * max(map(len, labels), default=0)
    middle = width / 2 - 0.1 if labels and curves else width - RIGHT
    box = {"bottom": BELOW / height, "top": 1 - top / height}
    if labels:
        axes = figure.add_subplot(figure.add_gridspec(1, 1, left=left / width, right=middle / width, **box)[0])
        _efficiencies(axes, data.points, labels, int(inner / (0.85 * ROW)))
        place_labels(figure, axes)
    if curves:
        start = middle + 0.75 if labels else 0.75
        hspace = GAP * len(curves) / (inner - GAP * (len(curves) - 1))
        grid = figure.add_gridspec(len(curves), 1, left=start / width, right=1 - RIGHT / width, hspace=hspace, **box)
        _angles(figure, grid, curves, data.route_label)
    if labels:
        legend_above(figure, figure.axes[:1], columns=4 if curves else 2)
    return figure


def _efficiencies(axes: Axes, tables: tuple[EfficiencyPoints, ...], labels: list[str], most: int) -> None:
    """One row a measurement, the first on top."""
    measured = 100 * np.concatenate([t.measured for t in tables])
    predicted = 100 * np.concatenate([t.predicted for t in tables], axis=1)
    inside = np.concatenate([t.inside for t in tables])
    row = np.arange(len(labels))
    center = predicted[len(predicted) // 2]
    if len(predicted) > 1:
        low, lower, _, upper, high = predicted - center
        axes.hlines(row, low, high, color=BLUE, linewidth=1.2, label=f"Predicted, {WIDE_INTERVAL}")
        axes.hlines(row, lower, upper, color=BLUE, linewidth=4, alpha=0.45, label=f"Predicted, {NARROW_INTERVAL}")
    off = measured - center
    axes.plot(off[inside], row[inside], "o", color=BLACK, label="Measured")
    if not inside.all():
        axes.plot(off[~inside], row[~inside], "o", color=BLACK, markerfacecolor="white", label="Outside the range")
    axes.axvline(0, color=GRAY, linewidth=0.8, zorder=0.9)
    every = -(-len(labels) // most)
    axes.set_yticks(row[::every], labels[::every])
    axes.set_ylim(len(labels) - 0.4, -0.6)
    axes.grid(visible=False, axis="y")
    axes.locator_params(axis="x", nbins=5)
    what = f"predicted {MEDIAN.lower()}" if len(predicted) > 1 else LEAST_SQUARES.lower()
    axes.set_xlabel(f"Measured efficiency minus\n{what} (percentage points)")


def _angles(figure: Figure, grid: Any, curves: tuple[AngleCurve, ...], route_label: str) -> None:
    """A panel a contact, below each other, on one route axis."""
    first: Axes | None = None
    for i, curve in enumerate(curves):
        axes = first = figure.add_subplot(grid[i, -1], sharex=first)
        middle = curve.band.quantiles[len(curve.band.quantiles) // 2]
        off = curve.angle - np.interp(curve.route, curve.band.route, middle)
        axes.plot(curve.route, off, SERIES_MARKERS[i % 8], color=SERIES_COLORS[i % 8])
        axes.axhline(0, color=GRAY, linewidth=0.8, zorder=0.9)
        axes.set_ylim(*_symmetric(off))
        axes.locator_params(axis="y", nbins=5)
        axes.set_title(f"{curve.contact}, reading minus curve")
        axes.set_ylabel("Residual (deg)")
        axes.tick_params(labelbottom=i == len(curves) - 1)
        place_labels(figure, axes)
    if first is not None:
        first.set_xlabel(route_label)


def _symmetric(off: np.ndarray) -> tuple[float, float]:
    """Limits around zero."""
    top = 1.2 * float(np.max(np.abs(off))) or 1.0
    return -top, top
