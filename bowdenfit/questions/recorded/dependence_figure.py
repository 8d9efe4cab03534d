"""How efficiency depends on the load and on the speed, against the capstan equation, for which it does not."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import describe_curve
from bowdenfit.plots.curves import NEW_RUN
from bowdenfit.plots.layout import TITLE, count_columns, drop_unused, legend_above, panels
from bowdenfit.plots.panels import shorten_name, span
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    EFFICIENCY,
    LEAST_SQUARES,
    MEDIAN,
    MEDIUM,
    SERIES_COLORS,
    SERIES_MARKERS,
    SMALL,
    VERMILLION,
    WIDE,
    WIDE_INTERVAL,
    in_paper_style,
)
from bowdenfit.questions import recorded as room
from bowdenfit.words import capitalized, counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Efficiency by load and speed"
MOST_COLUMNS, LEAST_WIDTH = 2, 2.2  # panels in a row, and width of one [in]
MOST_NAMES, LONGEST = 8, 34  # runs that have a mark each, and characters of their names
WIDE_RANGE = 30.0  # highest over lowest x, beyond which the axis is logarithmic
POINT_COLORS = (BLACK, *SERIES_COLORS[2:4], *SERIES_COLORS[5:8], BLACK, BLACK)  # not those of the curves


@dataclass(frozen=True)
class Dependence:
    """How efficiency depends on the load or the speed, where the fit allows it to.

    Args:
        what: "load" or "speed".
        label: Axis label with unit.
        x: Loads [N] or speeds (shown unit).
        quantiles: Efficiency there, 5 %, 50 % and 95 % quantiles (first axis); one row without draws.
        constant: Efficiency by the capstan equation alone at the reference, for comparison [1].
        points_x, points_efficiency: Measured efficiencies, by load or speed.
        points_label: Run of each point.
        place: Where on the route, in words, such as "at 470 mm"; empty without a route.
        note: A note for the panel; empty without one.
        points_half: Half the 90 % interval of each measured efficiency, from the scatter of its blocks alone.
        new_run: Ends of the interval that holds the efficiency of a run on a new mounting with 90 % probability; empty
            without draws.
    """

    what: str
    label: str
    x: np.ndarray
    quantiles: np.ndarray
    constant: float
    points_x: np.ndarray
    points_efficiency: np.ndarray
    points_label: tuple[str, ...]
    place: str
    note: str = ""
    points_half: np.ndarray = field(default_factory=lambda: np.zeros(0))
    new_run: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))


def data(fit: Record) -> tuple[Dependence, ...] | None:
    """Return the dependence on load and on speed; None where the friction model has neither."""
    return room.collect_dependences(fit)


def caption(dependences: tuple[Dependence, ...]) -> str:
    """Describe what is drawn, in plain words."""
    words, n = " and ".join(one.what for one in dependences), max(len(set(one.points_label)) for one in dependences)
    return (
        f"Efficiency against {words}. {describe_curve(len(dependences[0].quantiles) > 1)} Dashed: the capstan equation, by "
        f"which it is the same everywhere. Marks: measured, with the intervals that hold them with 90 % probability by the "
        f"scatter of their own readings; nine of ten runs lie between the dotted lines, as no two mountings are "
        f"alike. n = {counted(n, 'run')}."
    )


@in_paper_style
def draw(dependences: tuple[Dependence, ...], width: float | None = None) -> Figure:
    """Draw efficiency [%] against load and speed, a panel each on one efficiency axis."""
    columns = count_columns(width or WIDE, min(MOST_COLUMNS, len(dependences)), LEAST_WIDTH, 0.2)
    rows = -(-len(dependences) // columns)
    page = width or (WIDE if columns > 1 else MEDIUM)
    figure, flat = panels([2.1] * rows, columns, TITLE, (0.2, TITLE + 0.45), page, sharey=True)
    flat = drop_unused(flat, len(dependences))
    runs = list(dict.fromkeys(label for d in dependences for label in d.points_label))
    for i, (axes, one) in enumerate(zip(flat, dependences, strict=True)):
        _draw_curve(axes, one)
        _draw_points(axes, one, runs)
        axes.set_xlabel(one.label)
        if one.note:
            axes.text(0.97, 0.05, one.note, transform=axes.transAxes, ha="right", va="bottom", fontsize=SMALL)
        axes.set_title(" ".join(filter(None, (capitalized(one.what), one.place))))
        if i % columns == 0:
            axes.set_ylabel(EFFICIENCY)
    low, high = span(
        [v for d in dependences for v in (d.quantiles, d.new_run, d.points_efficiency, np.array(d.constant))]
    )
    flat[0].set_ylim(100 * low, 100 * high)
    legend_above(figure, flat, columns=3 if columns > 1 else 2)
    return figure


def _draw_curve(axes: Axes, one: Dependence) -> None:
    """Draw the median with 90 % interval, or the least-squares line; and the constant efficiency for comparison."""
    quantiles, has_draws = 100 * one.quantiles, len(one.quantiles) > 1
    middle = quantiles[len(quantiles) // 2]
    axes.plot(one.x, middle, color=BLUE, label=MEDIAN if has_draws else LEAST_SQUARES)
    if has_draws:
        low, high = quantiles[0], quantiles[-1]
        axes.fill_between(one.x, low, high, color=BLUE, alpha=0.18, linewidth=0, label=WIDE_INTERVAL)
    for end in one.new_run:
        axes.plot(one.x, 100 * end, color=BLUE, linewidth=0.8, linestyle=(0, (1, 1.2)), label=NEW_RUN)
    constant, words = 100 * one.constant, "Capstan equation alone"
    axes.axhline(constant, color=VERMILLION, linestyle="--", linewidth=1.1, label=words)
    everywhere = np.concatenate([one.x, one.points_x])
    everywhere = everywhere[np.isfinite(everywhere)]
    if everywhere.min() > 0 and everywhere.max() > WIDE_RANGE * everywhere.min():
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")


def _draw_points(axes: Axes, one: Dependence, runs: list[str]) -> None:
    """Draw the measured efficiencies, with a marker for each run unless there are too many."""
    labels = np.array(one.points_label, dtype=str)
    if len(runs) > MOST_NAMES:
        _draw_measured(axes, one, np.ones(len(labels), dtype=bool), 0, f"Measured in {len(runs)} runs")
        return
    for i, run in enumerate(runs):
        _draw_measured(axes, one, labels == run, i, shorten_name(run, LONGEST))


def _draw_measured(axes: Axes, one: Dependence, here: np.ndarray, number: int, label: str) -> None:
    """Draw the measured efficiencies of one run with their intervals."""
    if here.any():
        half = 100 * one.points_half[here] if len(one.points_half) else None
        axes.errorbar(
            one.points_x[here], 100 * one.points_efficiency[here], half, fmt=SERIES_MARKERS[number],
            color=POINT_COLORS[number], markersize=3.6, markerfacecolor="white" if number > 5 else POINT_COLORS[number],
            elinewidth=0.8, zorder=3, label=label,
        )  # fmt: skip
