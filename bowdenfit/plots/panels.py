"""Small multiples: which recordings are shown, in which panels, on which axes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit import plots
from bowdenfit.plots.borrowed import is_borrowed
from bowdenfit.plots.layout import (
    LEFT,
    RIGHT,
    TITLE,
    count_columns,
    drop_unused,
    label_across,
    panels,
    room_for_labels,
    text_width,
)
from bowdenfit.plots.style import GRAY, LEFT_OUT, MEDIUM, SMALL, WIDE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST = 8  # recordings in a figure; a judgement
LEAST_WIDTH = 1.2  # in, of a panel; a judgement: three numbers have room below it
ALIKE = 4.0  # ranges share an axis if all of them together are so many times the shortest at most; a judgement
LEGEND_MARK = 4.0  # pt, a little less than a letter; a judgement
LONG = 60.0  # ratio of the ends of a logarithmic axis from which only powers of ten have numbers; a judgement
MARK_GRID = (160, 60)  # across and up a panel, marks of a kind that it can show; a judgement


def finite(values: Iterable[np.ndarray]) -> np.ndarray:
    """Return all finite values in one row."""
    row = np.concatenate([np.ravel(v) for v in values])
    return row[np.isfinite(row)]


def span(values: Iterable[np.ndarray], room: float = 0.05) -> tuple[float, float]:
    """Return axis limits that show all values with some room; (0, 1) without values."""
    row = finite(values)
    if not len(row):
        return 0.0, 1.0
    low, high = float(row.min()), float(row.max())
    margin = room * (high - low) if high > low else 0.05 * abs(high) or 0.5
    return low - margin, high + margin


def share_limits(spans: Sequence[tuple[float, float]]) -> bool:
    """Return whether ranges are so much alike that each can be read on an axis that shows them all."""
    low, high = min(s[0] for s in spans), max(s[1] for s in spans)
    return high - low <= ALIKE * min(s[1] - s[0] for s in spans)


def set_limits(flat: list[Axes], spans: Sequence[tuple[float, float]], which: str, shared: bool) -> None:
    """Set the limits of the "x" or "y" axes: of each panel, or the same for all."""
    everywhere = (min(s[0] for s in spans), max(s[1] for s in spans))
    for axes, own in zip(flat, spans, strict=True):
        axes.set(**{f"{which}lim": everywhere if shared else own})


def recording_panels(
    names: Sequence[str], most_columns: int, height: float | None, share_x: bool, share_y: bool, page: float = MEDIUM,
    width: float | None = None,
) -> tuple[Figure, list[Axes], int]:  # fmt: skip
    """Return a figure with a titled panel for each recording, the panels, and the number of columns.

    Args:
        names: Names of the recordings.
        most_columns: Panels in a row.
        height: Height of a panel [in]; None for square ones.
        share_x, share_y: Whether all panels have the same axes.
        page: Width of the page for a single column [in].
        width: Width of the page, whatever is on it [in].
    """
    across, down = (0.16 if share_y else 0.42), TITLE + (0.08 if share_x else 0.2)
    rows = -(-len(names) // count_columns(width or WIDE, most_columns, LEAST_WIDTH, across))
    columns = -(-len(names) // rows)
    page = width or (page if columns == 1 else WIDE)
    inner = (page - LEFT - RIGHT - across * (columns - 1)) / columns
    heights = [inner if height is None else height] * rows
    figure, flat = panels(heights, columns, TITLE, (across, down), page, sharex=share_x, sharey=share_y)
    flat = drop_unused(flat, len(names))
    for axes, name in zip(flat, names, strict=True):
        axes.set_title(shorten_title(name, inner), fontsize=SMALL)
    return figure, flat, columns


def panels_with_limits(
    names: Sequence[str],
    across: Sequence[tuple[float, float]],
    up: Sequence[tuple[float, float]],
    most_columns: int,
    height: float | None = None,
    page: float = MEDIUM,
    width: float | None = None,
) -> tuple[Figure, list[Axes], int]:
    """Return `recording_panels` with limits: those of each panel, or common ones where ranges are similar.

    Args:
        names: Names of the panels.
        across: Limits of each x axis.
        up: Limits of each y axis.
        most_columns: Panels in a row.
        height: Height of a panel [in]; None for square ones.
        page: Width of the page for a single column [in].
        width: Width of the page, whatever is on it [in].
    """
    share_x, share_y = share_limits(across), share_limits(up)
    figure, flat, columns = recording_panels(names, most_columns, height, share_x, share_y, page, width)
    set_limits(flat, across, "x", share_x)
    set_limits(flat, up, "y", share_y)
    return figure, flat, columns


def shorten_name(name: str, longest: int) -> str:
    """Return the end of a name, which distinguishes recordings of one folder."""
    return name if len(name) <= longest else "\N{HORIZONTAL ELLIPSIS}" + name[1 - longest :]


def shorten_title(name: str, room: float) -> str:
    """Return the end of a name that fits the room [in], cut at the beginning of a word if there is one."""
    if text_width(name) <= room:
        return name
    longest = next((n for n in range(len(name) - 1, 1, -1) if text_width(shorten_name(name, n)) <= room), 1)
    cut = shorten_name(name, longest)
    return f"\N{HORIZONTAL ELLIPSIS} {cut.partition(' ')[2]}" if " " in cut else cut


def label_outer(flat: list[Axes], columns: int, x_label: str, y_label: str) -> None:
    """Label the outer panels; a panel with nothing below it is an outer one."""
    for i, axes in enumerate(flat):
        if i % columns == 0:
            axes.set_ylabel(y_label)
        if i + columns >= len(flat):
            label_across(axes, x_label)
            axes.tick_params(labelbottom=True)
    if not is_borrowed(flat[0]):
        room_for_labels(flat[0].figure)  # type: ignore[arg-type]


def enlarge_marks(figure: Figure) -> None:
    """Make the small marks of many blocks large enough to be told apart in the legend."""
    for handle in figure.legends[0].legend_handles:
        if isinstance(handle, plots.mpl.Line2D) and handle.get_linestyle() == "None":
            handle.set_markersize(max(handle.get_markersize(), LEGEND_MARK))


def make_logarithmic(axes: Axes, which: str, ratio: float) -> None:
    """Make an axis logarithmic with plain numbers at 1, 2 and 5, or at powers of ten only if it is long.

    Args:
        axes: Panel; its limits may come later.
        which: "x" or "y".
        ratio: Ratio of its largest to its smallest value.
    """
    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(plots.mpl.LogLocator(subs=(1.0, 2.0, 5.0) if ratio < LONG else (1.0,), numticks=6))
    axis.set_major_formatter(plots.mpl.FuncFormatter(lambda value, _: f"{value:,.6g}"))
    axis.set_minor_formatter(plots.mpl.NullFormatter())


def show_plain_numbers(axes: Axes, which: str) -> None:
    """Show tick numbers without a power of ten beside the axis.

    Args:
        axes: Panel.
        which: "x" or "y".
    """
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_formatter(plots.mpl.FuncFormatter(lambda value, _: f"{value:,.6g}".replace("-", "\N{MINUS SIGN}")))


def draw_marks(
    axes: Axes, x: np.ndarray, y: np.ndarray, mark: tuple[str, str], label: str, fill: str | None = None, size: float = 3.0
) -> None:
    """Draw as many markers as can be distinguished; those beyond the limits or not finite are drawn at the edge.

    Args:
        axes: Panel to draw on.
        x, y: Positions of the marks.
        mark: Marker and color.
        label: Entry of the legend.
        fill: Color of the inside, if another.
        size: Size of a mark [pt].
    """
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    y = np.clip(np.where(np.isfinite(y), y, low), low, high)
    across, up = MARK_GRID
    column, row = np.round(across * (x - left) / (right - left)), np.round(up * (y - low) / (high - low))
    _, first = np.unique(column * (up + 1) + row, return_index=True)
    marker, color = mark
    axes.plot(
        x[first], y[first], marker, color=color, markersize=size, markerfacecolor=fill or color, markeredgewidth=0.8,
        clip_on=False, zorder=4, label=label, rasterized=len(first) > MARK_GRID[1],
    )  # fmt: skip


def extremes(values: np.ndarray, most: int) -> np.ndarray:
    """Return indices of the lowest and highest value in each of `most` stretches, in order; all if there are few."""
    size = -(-len(values) // most)
    if size <= 2:
        return np.arange(len(values))
    padded = np.append(values, np.full(-len(values) % size, values[-1])).reshape(-1, size)
    start = size * np.arange(len(padded))
    indices = np.concatenate([start + padded.argmin(axis=1), start + padded.argmax(axis=1)])
    return np.unique(np.minimum(indices, len(values) - 1))


def draw_left_out(axes: Axes, points: np.ndarray) -> None:
    """Draw readings that the user leaves out gray and open; those beyond the limits, which must be set, at the edge.

    Args:
        axes: Panel to draw on.
        points: Their places, x in the first row and y in the second.
    """
    if points.size:
        x, y = points
        limits = axes.get_xlim()
        draw_marks(axes, np.clip(x, min(limits), max(limits)), y, ("o", GRAY), LEFT_OUT, "white", LEGEND_MARK)
