"""Where panels, labels and legends go, in inches.

matplotlib's constrained layout would find the same places, but draws every label twice more to do so, which is a
quarter of the time of a figure. Tests see to it that nothing overlaps or leaves the page.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from bowdenfit.plots.style import WIDE

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEFT, RIGHT, BOTTOM = 0.62, 0.18, 0.45  # margins
LEGEND_ROW, LEGEND_ROOM = 0.155, 0.12
TITLE = 0.22  # room for a title of one line
LABEL_LEFT, LABEL_BELOW = 0.41, 0.25  # from the axes to its labels


def empty_page(width: float, height: float) -> Figure:
    """A figure of this size without anything on it; sizes in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height))


def panels(
    heights: Sequence[float], columns: int, top: float, gaps: tuple[float, float], page: float = WIDE, **sharing: object
) -> tuple[Figure, list[Axes]]:
    """A figure with a grid of panels, row by row.

    Args:
        heights: Of each row of panels.
        columns: Panels in a row.
        top: Room above the panels, for their titles.
        gaps: Between panels, across and down.
        page: Width of the figure.
        sharing: `sharex` and `sharey`, as for `Figure.subplots`.
    """
    across, down = gaps
    height = top + sum(heights) + down * (len(heights) - 1) + BOTTOM
    width = (page - LEFT - RIGHT - across * (columns - 1)) / columns
    figure = empty_page(page, height)
    grid = figure.add_gridspec(
        len(heights), columns, height_ratios=heights, left=LEFT / page, right=1 - RIGHT / page,
        bottom=BOTTOM / height, top=1 - top / height, wspace=across / width, hspace=down * len(heights) / sum(heights),
    )  # fmt: skip
    flat = list(grid.subplots(**sharing, squeeze=False).flat)  # type: ignore[call-overload]
    for axes in flat:
        place_labels(figure, axes)
    return figure, flat


def place_labels(figure: Figure, axes: Axes) -> None:
    """Put the axis labels at a fixed distance, so that those of neighbors line up."""
    page, box = figure.get_size_inches(), axes.get_position()
    axes.yaxis.set_label_coords(-LABEL_LEFT / (box.width * page[0]), 0.5)
    axes.xaxis.set_label_coords(0.5, -LABEL_BELOW / (box.height * page[1]))


def drop_unused(flat: list[Axes], used: int) -> list[Axes]:
    """The panels in use, the rest taken off the figure."""
    for axes in flat[used:]:
        axes.remove()
    return flat[:used]


def legend_above(figure: Figure, axes: Iterable[Axes], columns: int) -> None:
    """One legend for several panels, on room added at the top of the page, where it hides no data."""
    entries: dict[str, Artist] = {}
    for panel in axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    columns = min(columns, len(entries))
    _add_room(figure, LEGEND_ROOM + LEGEND_ROW * -(-len(entries) // columns))
    figure.legend(list(entries.values()), list(entries), loc="upper center", ncols=columns, borderaxespad=0.3)


def _add_room(figure: Figure, room: float) -> None:
    """Make the page higher at the top, and leave everything else where it is."""
    width, height = figure.get_size_inches()
    boxes = [axes.get_position() for axes in figure.axes]
    figure.set_size_inches(width, height + room)
    for axes, box in zip(figure.axes, boxes, strict=True):
        share = height / (height + room)
        axes.set_position((box.x0, box.y0 * share, box.width, box.height * share))
