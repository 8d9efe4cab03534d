"""Where panels, labels, tick numbers and legends go, in inches.

matplotlib's constrained layout would give the same positions, but draws every label twice more to do so, which is a
quarter of the time of a figure. Tests check that nothing overlaps or leaves the page.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit import plots
from bowdenfit.errors import UsageError
from bowdenfit.plots.borrowed import is_borrowed, substitute
from bowdenfit.plots.style import LEAST, SMALL, TITLE_SIZE, VERMILLION, WIDE

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Sizes of pages are in inches, and judgements: as small as they can be without words on top of each other, which
# `tests/support/figure_words.py` looks for in every figure.
LEFT, RIGHT, BOTTOM = 0.62, 0.18, 0.45  # margins
LEGEND_ROW, LEGEND_ROOM = 0.155, 0.12  # a row of the legend, and what is around all of them
TITLE = 0.22  # room for a title of one line
LABEL_LEFT, LABEL_BELOW = 0.41, 0.25  # from the axes to its labels
EDGE = 0.08  # from words to the edge of the page
_MARK, _APART = 2.6, 2.0  # of a legend, in its font size: a mark with its gap, and from one column to the next
_LOWEST = 0.6  # of the height that suits a panel, that it may have; a judgement
_TITLE_ROWS, _TITLE_ROW, LABEL_ROW = 2, 0.15, 0.13  # most rows of a title, and one more row of a title or label


def empty_page(width: float, height: float) -> Figure:
    """Return an empty figure; sizes in inches."""
    return plots.page.Page(figsize=(width, height))


def panels(
    heights: Sequence[float], columns: int, top: float, gaps: tuple[float, float], page: float = WIDE, **sharing: object
) -> tuple[Figure, list[Axes]]:
    """Return a figure with a grid of panels, and the panels row by row.

    Args:
        heights: Heights of each row of panels.
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
    made = list(grid.subplots(**sharing, squeeze=False).flat)  # type: ignore[call-overload]
    flat = [substitute(axes) for axes in made]
    for axes in flat:
        place_labels(figure, axes)
    return figure, flat


def axes_at(figure: Figure, left: float, bottom: float, width: float, height: float, **sharing: Any) -> Axes:
    """Add a panel at a position in inches."""
    page, total = figure.get_size_inches()
    return substitute(figure.add_axes((left / page, bottom / total, width / page, height / total), **sharing))


def place_labels(figure: Figure, axes: Axes, left: float = LABEL_LEFT, below: float = LABEL_BELOW) -> None:
    """Put the axis labels at fixed distances [in], so that those of neighbors line up."""
    if is_borrowed(axes):
        return
    inches = figure.dpi_scale_trans
    axes.yaxis.set_label_coords(0.0, 0.5, axes.transAxes + plots.mpl.ScaledTranslation(-left, 0.0, inches))
    axes.xaxis.set_label_coords(0.5, 0.0, axes.transAxes + plots.mpl.ScaledTranslation(0.0, -below, inches))


def number_width(axes: Axes) -> float:
    """Return the width of the widest tick number left of a panel [in]; 0 if none is shown."""
    low, high = sorted(axes.get_ylim())
    axis = axes.yaxis
    if not axis.get_tick_params()["labelleft"]:
        return 0.0
    positions = [float(position) for position in axis.get_majorticklocs()]
    texts = axis.get_major_formatter().format_ticks(positions)
    return max((text_width(t) for t, at in zip(texts, positions, strict=True) if t and low <= at <= high), default=0.0)


def squeeze(figure: Figure, left: float, to: float) -> None:
    """Make the left margin wider, at the cost of the panels.

    Args:
        figure: The page.
        left, to: The margin as it is and as it shall be [in].
    """
    page = figure.get_size_inches()[0]
    share = (page - RIGHT - to) / (page - RIGHT - left)
    for axes in figure.axes:
        box = axes.get_position()
        axes.set_position(((to + (box.x0 * page - left) * share) / page, box.y0, box.width * share, box.height))


def drop_unused(flat: list[Axes], used: int) -> list[Axes]:
    """Remove unused panels from the figure, and return those in use."""
    for axes in flat[used:]:
        axes.remove()
    return flat[:used]


def count_columns(page: float, most: int, least: float, gap: float) -> int:
    """Return how many panels fit side by side.

    Args:
        page: Width of the figure.
        most: Panels in a row where there is room.
        least: Width of a panel that can still be read.
        gap: Between panels.
    """
    return max(1, min(most, int((page - LEFT - RIGHT + gap) / (least + gap))))


def text_width(words: str, size: float = SMALL, weight: str = "normal") -> float:
    """Return the width of a text on the page, of its longest line [in]."""
    font = plots.mpl.FontProperties(family="sans-serif", size=size, weight=weight)

    def width(line: str) -> float:
        try:
            return float(plots.mpl.text_to_path.get_text_width_height_descent(line, font, line.count("$") > 1)[0])
        except ValueError:  # dollar signs without a formula between them
            return float(plots.mpl.text_to_path.get_text_width_height_descent(line, font, False)[0])

    return max(map(width, words.split("\n"))) / 72


def wrap_words(words: str, room: float, size: float = SMALL, weight: str = "normal", most: int | None = None) -> str:
    """Break a text into lines no wider than the room, at most `most` of them; the end of a longer text is cut."""
    if text_width(words, size, weight) <= room:
        return words
    letters = max(1, int(len(words) * room / text_width(words, size, weight)))
    for n in range(letters + 3, 0, -1):
        lines = textwrap.wrap(words, n, max_lines=most, placeholder=" \N{HORIZONTAL ELLIPSIS}")
        if lines and text_width("\n".join(lines), size, weight) <= room:
            return "\n".join(lines)
    return words


def line_entry(words: str, linestyle: Any = "", **style: Any) -> Artist:
    """Return an entry of a legend for lines in a style, or for words alone."""
    return plots.mpl.Line2D([], [], label=words, linestyle=linestyle, **style)


def area_entry(words: str, color: str) -> Artist:
    """Return an entry of a legend for areas of a color."""
    return plots.mpl.Patch(facecolor=color, label=words)


def legend_above(figure: Figure, axes: Iterable[Axes], columns: int) -> None:
    """Add one legend for several panels, on room added at the top of the page, where it hides no data.

    Args:
        figure: The page.
        axes: Panels whose entries are shown.
        columns: Entries in a row, fewer where they have no room.
    """
    room = figure.get_size_inches()[0] - 2 * EDGE
    entries: dict[str, Artist] = {}
    for panel in axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(wrap_words(label, room - _MARK * SMALL / 72), handle)
    if not entries:
        return
    widths = [_MARK * SMALL / 72 + text_width(label) for label in entries]
    columns = next(n for n in range(min(columns, len(entries)), 0, -1) if n == 1 or _legend_width(widths, n) <= room)
    rows = max(sum(1 + label.count("\n") for label in part) for part in np.array_split(np.array(list(entries)), columns))
    _add_room(figure, LEGEND_ROOM + LEGEND_ROW * rows)
    figure.legend(
        list(entries.values()), list(entries), loc="upper center", ncols=columns, borderaxespad=0.3,
        bbox_to_anchor=(0.5, 1.0),
    )  # fmt: skip


def _legend_width(widths: Sequence[float], columns: int) -> float:
    """Return the width of a legend with entries in columns."""
    return sum(max(part) for part in np.array_split(np.array(widths), columns)) + _APART * SMALL / 72 * columns


def title_above(figure: Figure, words: str, mark: str = "", height: float | None = None) -> None:
    """Add a title on room added above everything else.

    Args:
        figure: The page.
        words: The title.
        mark: Why nobody should rely on the figure, which stands below the title.
        height: Height of the page with its title [in], to which panels are stretched; what suits the figure if omitted.

    Raises:
        UsageError: Panels would be too low to be read.
    """
    width = figure.get_size_inches()[0]
    title = wrap_words(words, width - 2 * EDGE, TITLE_SIZE, "bold", _TITLE_ROWS)
    marked = wrap_words(mark, width - 2 * EDGE, TITLE_SIZE, "bold").split("\n") if mark else []
    above = EDGE + _TITLE_ROW * (1 + title.count("\n"))
    room = above + _TITLE_ROW * len(marked)
    if height is not None:
        _stretch_panels(figure, height, room)
    _add_room(figure, room)
    height = figure.get_size_inches()[1]
    for legend in figure.legends:
        legend.set_bbox_to_anchor((0.5, 1 - room / height), figure.transFigure)
    figure.text(
        EDGE / width, 1 - EDGE / height, title, ha="left", va="top", fontsize=TITLE_SIZE, fontweight="bold",
        parse_math=False,
    )  # fmt: skip
    for row, line in enumerate(marked):
        figure.text(
            EDGE / width, 1 - (above + _TITLE_ROW * row) / height, line, ha="left", va="top", fontsize=TITLE_SIZE,
            fontweight="bold", color=VERMILLION, parse_math=False,
        )  # fmt: skip


def add_mark(axes: Axes, words: str) -> None:
    """Write why nobody should rely on a figure into one of its panels.

    Args:
        axes: The panel.
        words: Why.
    """
    room = panel_size(axes)[0] - 2 * EDGE
    axes.text(
        0.02, 0.98, wrap_words(words, room, TITLE_SIZE, "bold"), transform=axes.transAxes, ha="left", va="top",
        fontsize=TITLE_SIZE, fontweight="bold", color=VERMILLION, parse_math=False, zorder=10,
    )  # fmt: skip


def label_across(axes: Axes, words: str) -> None:
    """Name the lower axis, in several lines if the name is wider than the panel and its margins."""
    if is_borrowed(axes):
        axes.set_xlabel(words)
        return
    figure = axes.figure
    assert figure is not None  # a panel is on a page
    page, box = figure.get_size_inches()[0], axes.get_position()  # type: ignore[union-attr]
    axes.set_xlabel(wrap_words(words, page * min(box.width + 0.16 / page, 2 * (1 - box.x0 - box.width / 2)), 8))


def room_for_labels(figure: Figure) -> None:
    """Make the page higher at the bottom where the names of lower axes take several lines."""
    lines = max((axes.get_xlabel().count("\n") for axes in figure.axes), default=0)
    if lines:
        _add_room(figure, 0.0, LABEL_ROW * lines)


def _add_room(figure: Figure, above: float, below: float = 0.0) -> None:
    """Make the page higher, and leave everything else where it is."""
    width, height = figure.get_size_inches()
    boxes = [axes.get_position() for axes in figure.axes]
    taller = height + above + below
    figure.set_size_inches(width, taller)
    for axes, box in zip(figure.axes, boxes, strict=True):
        axes.set_position((box.x0, (box.y0 * height + below) / taller, box.width, box.height * height / taller))


def _stretch_panels(figure: Figure, height: float, above: float) -> None:
    """Make panels higher or lower so that a page is as high as stated; what is between them stays.

    Args:
        figure: The page.
        height: Height of the page [in], with what is added above it.
        above: Height added above it [in].

    Raises:
        UsageError: Panels would be too low to be read.
    """
    width, before = figure.get_size_inches()
    boxes = [axes.get_position() for axes in figure.axes]
    edges = np.unique(np.round([0.0, before, *(before * y for box in boxes for y in (box.y0, box.y1))], 6))
    middles, rows = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
    has_panel = np.array([any(before * box.y0 < y < before * box.y1 for box in boxes) for y in middles])
    between, of_panels = float(rows[~has_panel].sum()), float(rows[has_panel].sum())
    stretch = (height - above - between) / of_panels
    if stretch < _LOWEST:
        least = math.ceil(10 * (above + between + _LOWEST * of_panels)) / 10
        raise UsageError(
            f"this figure does not fit into {height:g} in of height at {width:g} in of width; write "
            f"figsize=({width:g}, {least:g}), or more, or leave figsize out for the size that suits it."
        )
    stretched = np.concatenate([[0.0], np.cumsum(np.where(has_panel, stretch * rows, rows))])
    taller = float(stretched[-1])
    figure.set_size_inches(width, taller)
    for axes, box in zip(figure.axes, boxes, strict=True):
        low, high = np.interp([before * box.y0, before * box.y1], edges, stretched)
        axes.set_position((box.x0, low / taller, box.width, (high - low) / taller))


TICK = 0.035  # in, length of a tick: less than matplotlib's 3.5 pt; a judgement
NUMBER_SPACE, NUMBER_ROW = 0.075, 0.16  # in, from one number to the next: a character across, and a row up; judgements
LETTER = 0.053  # in, width of a character of a number: digits, dots and signs of DejaVu Sans at 7 pt, on average
LEAST_SPACE = 1.1 * LETTER / NUMBER_SPACE  # of that from one number to the next, where there would be one number else


def ticks_below(limits: tuple[float, float], width: float, whole: bool = False) -> tuple[np.ndarray, list[str]]:
    """Return the tick values of a lower axis, and their texts.

    Args:
        limits: Limits of the axis.
        width: Width of the panel [in].
        whole: Whether only whole numbers make sense.
    """
    return ticks(limits, lambda texts: width / NUMBER_SPACE / max(map(len, texts)), whole, TICK / width)


def ticks_left(limits: tuple[float, float], height: float) -> tuple[np.ndarray, list[str]]:
    """Return the tick values of a left axis, and their texts.

    Args:
        limits: Limits of the axis.
        height: Height of the panel [in].
    """
    return ticks(limits, lambda _: height / NUMBER_ROW)


def number_below(axes: Axes, whole: bool = False, upright: bool = False) -> None:
    """Put tick numbers on the lower axis of a panel.

    Args:
        axes: The panel, with its limits and in its place.
        whole: Whether only whole numbers make sense.
        upright: Whether numbers stand upright, where two of them are too wide for the panel.
    """
    width = panel_size(axes)[0]
    low, high = axes.get_xlim()
    values, texts = ticks_left((low, high), width) if upright else ticks_below((low, high), width, whole)
    axes.set_xticks(values, texts)
    turn = 90 if upright else 0
    axes.tick_params(axis="x", length=72 * TICK, pad=72 * 0.8 * TICK, width=0.6, labelsize=LEAST, labelrotation=turn)
    if upright:
        return
    for label, value in zip(axes.get_xticklabels(), values, strict=True):  # at the ends they are moved inwards
        half, position = LETTER * len(label.get_text()) / 2, width * (value - low) / (high - low)
        inwards = float(np.clip(position, half - TICK, max(width - half + TICK, half - TICK))) - position
        label.set_transform(label.get_transform() + plots.mpl.ScaledTranslation(inwards, 0.0, axes.figure.dpi_scale_trans))


def number_left(axes: Axes) -> None:
    """Put tick numbers on the left axis of a panel that has its limits and position."""
    height = panel_size(axes)[1]
    axes.set_yticks(*ticks_left(axes.get_ylim(), height))
    axes.tick_params(axis="y", length=72 * TICK, pad=72 * 0.6 * TICK, width=0.6, labelsize=LEAST, labelrotation=0)


def panel_size(axes: Axes) -> tuple[float, float]:
    """Return width and height of a panel [in], on a page or in a part of one."""
    figure = axes.figure
    assert figure is not None  # a panel is on a page
    return axes.bbox.width / figure.dpi, axes.bbox.height / figure.dpi


def ticks(
    limits: tuple[float, float], room: Callable[[list[str]], float], whole: bool = False, over: float = 0.0
) -> tuple[np.ndarray, list[str]]:
    """Return as many round tick values as there is room for, and their texts.

    Args:
        limits: Limits of the axis.
        room: How many of the given texts fit next to each other along the axis.
        whole: Whether only whole numbers make sense.
        over: How far a number may stand beyond an end, as a share of the axis.
    """
    low, high = limits

    def round_values(most: int) -> tuple[np.ndarray, float]:
        locator = plots.mpl.MaxNLocator(most, steps=[1, 2, 4, 5, 10], min_n_ticks=1, integer=whole)
        candidates = np.asarray(locator.tick_values(low, high))
        return candidates[(candidates >= low) & (candidates <= high)], float(candidates[1] - candidates[0])

    def apart(values: np.ndarray, texts: list[str]) -> bool:
        """Return whether numbers keep apart that are moved inwards at the ends of the axis."""
        share = LEAST_SPACE / room(texts)  # of the axis that a number takes
        positions = np.clip((values - low) / (high - low), share / 2 - over, 1 - share / 2 + over)
        return bool(np.all(np.diff(positions) >= share))

    for most in (4, 3, 2, 1):
        values, step = round_values(most)
        texts = _texts(values, step)
        if texts and (high - low) / step <= room(texts):
            if len(texts) == 1:
                break
            if apart(values, texts):
                return values, texts
    for most in (2, 3, 4, 6, 8):  # one number is no scale: the outermost two of a finer step
        finer, step = round_values(most)
        if len(finer) < 2:
            continue
        outer = finer[[0, -1]]
        words = _texts(outer, step)
        if apart(outer, words):
            return outer, words
    return values, texts


def _texts(values: np.ndarray, step: float) -> list[str]:
    """Return numbers as text with the decimals of their step."""
    decimals = next((d for d in range(7) if abs(round(step, d) - step) < 1e-6 * step), None)
    shown = [f"{v + 0.0:.3g}" if decimals is None or step >= 1e5 else f"{v + 0.0:.{decimals}f}" for v in values]
    return [text.replace("-", "\N{MINUS SIGN}") for text in shown]
