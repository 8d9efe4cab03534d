"""Every measured efficiency beside its prediction, row by row, and how far it is off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.pages.section import Chart, Series, SeriesGroup
from bowdenfit.plots.captions import count_shown
from bowdenfit.plots.curves import choose_evenly
from bowdenfit.plots.layout import EDGE, RIGHT, axes_at, empty_page, legend_above, text_width
from bowdenfit.plots.panels import shorten_name
from bowdenfit.plots.strips import NONE
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    GRAY,
    LEAST_SQUARES,
    MEDIAN,
    NARROW_INTERVAL,
    WIDE,
    WIDE_INTERVAL,
    in_paper_style,
)
from bowdenfit.questions import length
from bowdenfit.questions.length.efficiency_figure import EfficiencyPoints
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Measured and predicted efficiencies"
ROW, LEAST, MOST = 0.155, 0.6, 8.0  # in, height of a labeled row and of the panels
GAP, BELOW, ABOVE = 0.2, 0.6, 0.08  # in, between the panels, below and above them
LONGEST, LABELS = 34, 0.3  # characters of a label, and share of the page that labels take at most
STRIP = 0.42  # of the rest, for the residuals
MOST_POINTS = 500  # rows that a chart shows; a judgement
OUTSIDE = "Outside the range of the curves"


@dataclass(frozen=True)
class Residuals:
    """Efficiencies with their predictions."""

    points: tuple[EfficiencyPoints, ...]


def data(fit: Record) -> Residuals | None:
    """Return measured and predicted efficiencies; None where no efficiency was measured."""
    points = length.collect_efficiency_points(fit)
    return Residuals(points) if points else None


def caption(data: Residuals) -> str:
    """Describe what is drawn, in plain words."""
    n, bars = sum(len(points.labels) for points in data.points), _describe_bars(data)
    return (
        f"Left: every measured efficiency next to its prediction; {bars} Right: measured minus predicted, in percentage "
        f"points. n = {counted(n, 'efficiency', 'efficiencies')}."
    )


def _describe_bars(data: Residuals) -> str:
    """Return the clause that explains how predictions are drawn."""
    if len(data.points[0].predicted) == 1:
        return "the line is the least-squares prediction."
    return (
        "bars: where a reading would lie with 50 % and 90 % probability if it were taken again, on a new mounting where "
        "readings are runs; about one reading in ten may lie outside the longer one."
    )


@in_paper_style
def draw(data: Residuals, width: float | None = None) -> Figure:
    """Draw efficiencies by label beside their predictive intervals, and measured minus predicted."""
    page = width or WIDE
    labels = _shorten_labels(data.points, LABELS * page)
    inner = float(np.clip(ROW * len(labels), LEAST, MOST))
    figure = empty_page(page, inner + BELOW + ABOVE)
    left = EDGE + 0.08 + max(map(text_width, labels))
    room = page - left - RIGHT - GAP
    main = axes_at(figure, left, BELOW, (1 - STRIP) * room, inner)
    strip = axes_at(figure, left + (1 - STRIP) * room + GAP, BELOW, STRIP * room, inner, sharey=main)
    what = f"predicted {MEDIAN.lower()}" if len(data.points[0].predicted) > 1 else LEAST_SQUARES.lower()
    _draw_rows(main, data.points, residual=False)
    _draw_rows(strip, data.points, residual=True)
    main.set_xlabel("Efficiency (%)")
    strip.set_xlabel(f"Measured minus {what}\n(percentage points)" if page > WIDE / 2 else "Residual\n(percentage points)")
    every = -(-len(labels) // int(inner / (0.85 * ROW)))
    main.set_yticks(range(0, len(labels), every), labels[::every])
    main.set_ylim(len(labels) - 0.4, -0.6)
    strip.tick_params(labelleft=False)
    legend_above(figure, [main], columns=4)
    return figure


def _shorten_labels(tables: tuple[EfficiencyPoints, ...], room: float) -> list[str]:
    """Return the labels, their beginning left out where they are too long."""
    labels = [label for points in tables for label in points.labels]
    longest = LONGEST
    while longest > 4 and max(text_width(shorten_name(label, longest)) for label in labels) > room:
        longest -= 1
    return [shorten_name(label, longest) for label in labels]


def _draw_rows(axes: Axes, tables: tuple[EfficiencyPoints, ...], residual: bool) -> None:
    """Draw one row a measurement, the first on top."""
    measured = 100 * np.concatenate([t.measured for t in tables])
    predicted = 100 * np.concatenate([t.predicted for t in tables], axis=1)
    inside = np.concatenate([t.inside for t in tables])
    row, center = np.arange(len(measured)), predicted[len(predicted) // 2]
    zero = center if residual else 0.0
    if len(predicted) > 1:
        low, lower, _, upper, high = predicted - zero
        axes.hlines(row, low, high, color=BLUE, linewidth=1.2, label=f"Predicted, {WIDE_INTERVAL}")
        axes.hlines(row, lower, upper, color=BLUE, linewidth=4, alpha=0.45, label=f"Predicted, {NARROW_INTERVAL}")
    elif not residual:
        axes.plot(center, row, "|", color=BLUE, markersize=7, label=f"Predicted, {LEAST_SQUARES.lower()}")
    offset = measured - zero
    axes.plot(offset[inside], row[inside], "o", color=BLACK, markersize=3.6, label="Measured")
    if not inside.all():
        axes.plot(
            offset[~inside], row[~inside], "o", color=BLACK, markersize=3.6, markerfacecolor="white",
            label=OUTSIDE,
        )  # fmt: skip
    if residual:
        axes.axvline(0, color=GRAY, linewidth=0.8, zorder=0.9)
        if np.ptp(axes.get_xlim()) < NONE:
            axes.set_xlim(-1, 1)
    axes.grid(visible=False, axis="y")
    axes.locator_params(axis="x", nbins=5 if not residual else 4)


def make_residual_charts(data: Residuals) -> tuple[Chart, Chart]:
    """Return the charts of measured efficiencies beside predicted ones, and of their differences, a place for each row.

    Args:
        data: Data of the figure.
    """
    labels = [label for table in data.points for label in table.labels]
    rows = np.array(choose_evenly(range(len(labels)), MOST_POINTS))
    measured = 100 * np.concatenate([table.measured for table in data.points])[rows]
    predicted = 100 * np.concatenate([table.predicted for table in data.points], axis=1)[:, rows]
    inside = np.concatenate([table.inside for table in data.points])[rows]
    names, center = tuple(labels[row] for row in rows), predicted[len(predicted) // 2]
    beside = _series_of_rows(measured, predicted, inside)
    off = _series_of_rows(measured - center, predicted - center, inside)
    places, row_label = np.arange(1.0, len(rows) + 1), "Reading"
    return (
        Chart("Measured and predicted", row_label, "Efficiency (%)", (SeriesGroup(places, beside),), place_names=names),
        Chart(
            "Measured minus predicted", row_label, "Difference (points)", (SeriesGroup(places, off),),
            place_names=names,
        ),
    )  # fmt: skip


def _series_of_rows(measured: np.ndarray, predicted: np.ndarray, inside: np.ndarray) -> tuple[Series, ...]:
    """Return measured values and their predictive intervals.

    Args:
        measured: One a row.
        predicted: `BAND_QUANTILES` of each row along the first axis, or one least-squares row.
        inside: Whether each row lies within the range of the curves.
    """
    if len(predicted) > 1:
        low, lower, _, upper, high = predicted
        wide, narrow = (f"Predicted, {interval}" for interval in (WIDE_INTERVAL, NARROW_INTERVAL))
        series = [Series(wide, "from", "blue", low), Series(wide, "to", "blue", high)]
        series += [Series(narrow, "from", "blue", lower), Series(narrow, "to", "blue", upper)]
    else:
        series = [Series(f"Predicted, {LEAST_SQUARES.lower()}", "line", "blue", predicted[0])]
    series.append(Series("Measured", "points", "black", np.where(inside, measured, np.nan)))
    if not inside.all():
        series.append(Series(OUTSIDE, "hollow", "black", np.where(inside, np.nan, measured)))
    return tuple(series)


def describe_residual_charts(data: Residuals) -> str:
    """Describe the charts."""
    n, bars = sum(len(table.labels) for table in data.points), _describe_bars(data)
    counting = count_shown(min(n, MOST_POINTS), n, "efficiency", "efficiencies")
    return f"Every measured efficiency next to its prediction, or minus it, in percentage points; {bars} n = {counting}."
