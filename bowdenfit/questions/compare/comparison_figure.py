"""Several fits side by side: how well each predicts readings left out, which readings tell them apart, what changes."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import TITLE, axes_at, empty_page, legend_above, place_labels, wrap_words
from bowdenfit.plots.panels import shorten_name
from bowdenfit.plots.style import (
    BLACK,
    GRAY,
    LIGHT,
    SERIES_COLORS,
    SERIES_MARKERS,
    SMALL,
    WIDE,
    WIDE_INTERVAL,
    axis_label,
    in_paper_style,
)
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.inference.interval import Interval
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.compare.answer import Comparison

MAX_LABELED = 40  # readings that are named below the axis
MAX_COLUMNS = 4  # panels of parameters side by side
MIN_LABEL_WIDTH, _APART = 0.3, 0.08  # in, of a name of a table, and to the next
MAX_NAME_LENGTH = 22  # characters of a fit's name that have room
_CHARACTER, _ROW = 0.062, 0.23  # in, of a name
_RIGHT, _BELOW = 0.18, 0.45
_MIDDLE = 1.7  # in, height of the middle panel
_GAP = 0.62


HEADING = "Fits side by side"


def caption(comparison: Comparison) -> str:
    """Say what is drawn, in plain words."""
    return (
        "Above: by how much each fit predicts worse than the best, with one and two standard errors. Middle: the same reading "
        "by reading, up where a fit predicts it better than the best one does. Below: coefficients of each fit, median and "
        "90 % interval. The score says how probable the readings were: 2.3 less is ten times less probable; "
        f"n = {counted(len(comparison.readings), 'reading')} left out, each predicted by the others."
    )


@in_paper_style
def draw(comparison: Comparison) -> Figure:
    """Draw differences of the score with standard errors, their contributions by reading, and parameters side by side."""
    cells = _parameter_cells(comparison)
    names = [shorten_name(name, MAX_NAME_LENGTH) for name in comparison.differences]
    left = max(0.66, 0.2 + _CHARACTER * max(map(len, names)))
    height_of_fits = 0.25 + _ROW * len(names)
    columns = min(MAX_COLUMNS, len(cells)) if cells else 0
    rows = -(-len(cells) // columns) if cells else 0
    below_readings = _label_room(comparison)
    parts = [TITLE, height_of_fits, _GAP + TITLE, _MIDDLE, below_readings]
    parts += [TITLE + 0.1, *([height_of_fits, _BELOW + 0.1] * rows)] if rows else []
    figure = empty_page(WIDE, sum(parts))
    _draw_differences(axes_at(figure, left, sum(parts[2:]), WIDE - left - _RIGHT, height_of_fits), comparison, names)
    middle = axes_at(figure, left, below_readings + sum(parts[5:]), WIDE - left - _RIGHT, _MIDDLE)
    _draw_by_reading(middle, comparison, names)
    flat = [_cell_axes(figure, left, parts, i, columns, height_of_fits) for i in range(len(cells))]
    for i, (axes, cell) in enumerate(zip(flat, cells, strict=True)):
        _draw_parameter(axes, cell, names, list(comparison.differences), i % columns == 0)
    if flat:
        flat[0].set_title("Parameters, median and " + WIDE_INTERVAL, loc="left")
    if len(names) > 2:
        legend_above(figure, [middle], columns=4)
    return figure


def _label_room(comparison: Comparison) -> float:
    """Return the room below the panel of readings [in]."""
    if len(comparison.readings) > MAX_LABELED:
        return _BELOW + 0.1
    return 0.25 + 0.045 * max(len(_format_plainly(label)) for _, label in comparison.readings)


def _format_plainly(label: str) -> str:
    return label.replace("_", " ")


def _cell_axes(figure: Figure, left: float, parts: list[float], i: int, columns: int, height: float) -> Axes:
    """Return the panel of a parameter."""
    width = (WIDE - left - _RIGHT - 0.22 * (columns - 1)) / columns
    row = i // columns
    bottom = sum(parts[6 + 2 * row + 1 :])
    return axes_at(figure, left + (i % columns) * (width + 0.22), bottom, width, height)


def _parameter_cells(comparison: Comparison) -> list[tuple[str, dict[str, Interval]]]:
    """Return what is shown of each fit: label of the axis, and intervals by fit."""
    cells = [(axis_label(row.symbol, row.unit), row.by_fit) for row in comparison.parameters.values()]
    lengths = {name: interval for name, (interval, _) in comparison.optimal_length.items()}
    if lengths:
        unit = next(iter(comparison.optimal_length.values()))[1]
        cells.append((axis_label("Best length", unit), lengths))
    return cells


def _draw_differences(axes: Axes, comparison: Comparison, names: list[str]) -> None:
    """Draw the difference to the best with one and two standard errors."""
    for i, (name, difference) in enumerate(comparison.differences.items()):
        color, marker = SERIES_COLORS[i % len(SERIES_COLORS)], SERIES_MARKERS[i % len(SERIES_MARKERS)]
        error = difference.standard_error
        if name != comparison.best and np.isfinite(error):
            axes.plot(-difference.elpd + np.array([-2, 2]) * error, [i, i], color=color, linewidth=0.8)
            axes.plot(-difference.elpd + np.array([-1, 1]) * error, [i, i], color=color, linewidth=2.6)
        axes.plot([-difference.elpd], [i], marker, color=color, markeredgecolor="white", markersize=6)
    axes.axvline(0.0, color=BLACK, linewidth=0.7)
    axes.set_yticks(range(len(names)), names)
    axes.set(ylim=(len(names) - 0.5, -0.5), xlabel="Score minus that of the best, with one and two standard errors")
    axes.set_title(f"Prediction of {counted(len(comparison.readings), 'reading')} left out", loc="left")
    axes.grid(axis="y", visible=False)
    place_labels(axes.figure, axes)  # type: ignore[arg-type]


def _draw_by_reading(axes: Axes, comparison: Comparison, names: list[str]) -> None:
    """Draw what each reading adds to the difference."""
    x = np.arange(len(comparison.readings))
    others = list(comparison.differences)[1:]
    width = 0.8 / len(others)
    for i, name in enumerate(others, start=1):
        centers = x + (i - 1 - (len(others) - 1) / 2) * width
        axes.bar(centers, -comparison.pointwise(name), width, color=SERIES_COLORS[i % len(SERIES_COLORS)], label=names[i])
    axes.axhline(0.0, color=BLACK, linewidth=0.7)
    axes.set(xlim=(-0.6, len(x) - 0.4), ylabel="Difference of score")
    axes.set_title("The same by reading: up where the fit predicts it better than the best one does", loc="left")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.16 * (high - low))  # room for the names of the tables
    _mark_tables(axes, comparison)
    axes.grid(axis="x", visible=False)
    if len(x) <= MAX_LABELED:
        axes.set_xticks(x, [_format_plainly(label) for _, label in comparison.readings], rotation=90, fontsize=SMALL - 1)
    else:
        axes.set_xlabel("Reading, in the order of the tables")
    page, box = axes.figure.get_size_inches(), axes.get_position()  # type: ignore[union-attr]
    axes.yaxis.set_label_coords(-0.45 / (box.width * page[0]), 0.5)


def _mark_tables(axes: Axes, comparison: Comparison) -> None:
    """Mark every other table on gray, its name above."""
    start = 0
    for number, (table, group) in enumerate(groupby(name for name, _ in comparison.readings)):
        n = len(list(group))
        if number % 2:
            axes.axvspan(start - 0.5, start + n - 0.5, color=LIGHT, linewidth=0, zorder=0)
        room = n / (np.ptp(axes.get_xlim()) or 1.0) * axes.get_position().width * WIDE - _APART
        name = wrap_words(_format_plainly(table), room, most=1) if room > MIN_LABEL_WIDTH else ""
        axes.annotate(
            name, (start - 0.4, 1.0), xycoords=("data", "axes fraction"), xytext=(0, -8),
            textcoords="offset points", fontsize=SMALL, color=GRAY,
        )  # fmt: skip
        start += n


def _draw_parameter(
    axes: Axes, cell: tuple[str, dict[str, Interval]], names: list[str], fits: list[str], named: bool
) -> None:
    """Draw median and interval of one parameter in each fit that has it."""
    label, by_fit = cell
    for i, name in enumerate(fits):
        if name in by_fit:
            color, marker = SERIES_COLORS[i % len(SERIES_COLORS)], SERIES_MARKERS[i % len(SERIES_MARKERS)]
            axes.plot([by_fit[name].q05, by_fit[name].q95], [i, i], color=color, linewidth=1.6)
            axes.plot([by_fit[name].median], [i], marker, color=color, markeredgecolor="white", markersize=6)
    axes.set(ylim=(len(fits) - 0.5, -0.5), xlabel=label)
    axes.set_yticks(range(len(fits)), names if named else [])
    axes.locator_params(axis="x", nbins=3)
    axes.grid(axis="y", visible=False)
    page, box = axes.figure.get_size_inches(), axes.get_position()  # type: ignore[union-attr]
    axes.xaxis.set_label_coords(0.5, -0.25 / (box.height * page[1]))
