"""How efficiency depends on the load and on the speed, against the capstan equation, for which it does not."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import TITLE, legend_above, panels
from bowdenfit.plots.panels import short, span
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    EFFICIENCY,
    LEAST_SQUARES,
    MEDIAN,
    MEDIUM,
    SERIES_COLORS,
    SERIES_MARKERS,
    VERMILLION,
    WIDE,
    WIDE_INTERVAL,
    in_paper_style,
)

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.summary.figure_data import Dependence, FigureData

MOST_COLUMNS = 2
MOST_NAMES, LONGEST = 8, 34  # runs that have a mark each, and characters of their names
WIDE_RANGE = 30.0  # highest over lowest x, beyond which the axis is logarithmic
POINT_COLORS = (BLACK, *SERIES_COLORS[2:4], *SERIES_COLORS[5:8], BLACK, BLACK)  # not those of the curves


def has_dependence(data: FigureData) -> bool:
    """Whether the fit lets efficiency depend on load or speed."""
    return bool(data.dependences)


@in_paper_style
def dependence(data: FigureData) -> Figure:
    """Efficiency [%] against load and speed, a panel each on one efficiency axis."""
    columns = min(MOST_COLUMNS, len(data.dependences))
    rows = -(-len(data.dependences) // columns)
    page = WIDE if columns > 1 else MEDIUM
    figure, flat = panels([2.1] * rows, columns, TITLE, (0.2, TITLE + 0.45), page, sharey=True)
    for axes in flat[len(data.dependences) :]:
        axes.remove()
    flat = flat[: len(data.dependences)]
    runs = list(dict.fromkeys(label for d in data.dependences for label in d.points_label))
    for i, (axes, one) in enumerate(zip(flat, data.dependences, strict=True)):
        _curve(axes, one)
        _points(axes, one, runs)
        axes.set_xlabel(one.label)
        axes.set_title(" ".join(filter(None, (one.what.capitalize(), one.place))))
        if i % columns == 0:
            axes.set_ylabel(EFFICIENCY)
    low, high = span([v for d in data.dependences for v in (d.quantiles, d.points_efficiency, np.array(d.constant))])
    flat[0].set_ylim(100 * low, 100 * high)
    legend_above(figure, flat, columns=3 if columns > 1 else 2)
    return figure


def _curve(axes: Axes, one: Dependence) -> None:
    """Median with 90 % interval, or the least-squares line; and the constant efficiency for comparison."""
    quantiles, drawn = 100 * one.quantiles, len(one.quantiles) > 1
    middle = quantiles[len(quantiles) // 2]
    axes.plot(one.x, middle, color=BLUE, label=MEDIAN if drawn else LEAST_SQUARES)
    if drawn:
        low, high = quantiles[0], quantiles[-1]
        axes.fill_between(one.x, low, high, color=BLUE, alpha=0.18, linewidth=0, label=WIDE_INTERVAL)
    constant, words = 100 * one.constant, "Capstan equation alone"
    axes.axhline(constant, color=VERMILLION, linestyle="--", linewidth=1.1, label=words)
    everywhere = np.concatenate([one.x, one.points_x])
    everywhere = everywhere[np.isfinite(everywhere)]
    if everywhere.min() > 0 and everywhere.max() > WIDE_RANGE * everywhere.min():
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")


def _points(axes: Axes, one: Dependence, runs: list[str]) -> None:
    """What was measured, with a mark a run unless these are too many."""
    labels = np.array(one.points_label, dtype=str)
    if len(runs) > MOST_NAMES:
        _measured(axes, one, np.ones(len(labels), dtype=bool), 0, f"Measured in {len(runs)} runs")
        return
    for i, run in enumerate(runs):
        _measured(axes, one, labels == run, i, short(run, LONGEST))


def _measured(axes: Axes, one: Dependence, here: np.ndarray, number: int, label: str) -> None:
    if here.any():
        axes.plot(
            one.points_x[here], 100 * one.points_efficiency[here], SERIES_MARKERS[number], color=POINT_COLORS[number],
            markersize=3.6, markerfacecolor="white" if number > 5 else POINT_COLORS[number], zorder=3, label=label,
        )  # fmt: skip
