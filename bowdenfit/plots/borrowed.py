"""Panels of a figure on axes that the user made, in place of those of a page of its own.

A figure is drawn twice then: once on a page, to see which panels it has, and once more on the axes in place of these; panels
beyond them are drawn on a page that nobody sees.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

_LETTER_WIDTH = 10.0  # pixels, more than a letter of a legend takes; a judgement
_ALIKE = 1e-6  # of the page, up to which panels are in one row or column; rounding


@dataclass
class _Panels:
    """Panels that a figure makes, in their order.

    Args:
        borrowed: Axes that stand in for them, by their number.
        made: The panels so far.
    """

    borrowed: Mapping[int, Axes]
    made: list[Axes] = field(default_factory=list)


_panels: ContextVar[_Panels | None] = ContextVar("panels", default=None)


@contextmanager
def _watch_panels(borrowed: Mapping[int, Axes]) -> Iterator[_Panels]:
    """Note panels as they are made, and let axes stand in for some of them."""
    panels = _Panels(borrowed)
    token = _panels.set(panels)
    try:
        yield panels
    finally:
        _panels.reset(token)


def substitute(axes: Axes) -> Axes:
    """Return the axes that stand in for a panel just made, which is then removed; the panel itself if there are none."""
    panels = _panels.get()
    if panels is None:
        return axes
    panels.made.append(axes)
    stand_in = panels.borrowed.get(len(panels.made) - 1)
    if stand_in is None:
        return axes
    for siblings, share in (
        (axes.get_shared_x_axes(), stand_in.sharex),
        (axes.get_shared_y_axes(), stand_in.sharey),
    ):
        partners = [other for other in siblings.get_siblings(axes) if other is not axes]
        if partners and len(siblings.get_siblings(stand_in)) == 1:  # the user may have it share another axis
            share(partners[0])
    axes.remove()
    return stand_in


def is_borrowed(axes: Axes) -> bool:
    """Return whether axes are the user's, who chose where they and their names stand."""
    panels = _panels.get()
    return panels is not None and any(axes is other for other in panels.borrowed.values())


def count_panels(draw: Callable[[], Figure]) -> int:
    """Return how many panels a figure has."""
    return len(_find_panels(draw)[1])


def draw_on(draw: Callable[[], Figure], axes: Sequence[Axes]) -> None:
    """Draw the first panels of a figure on axes, with numbers and names on each, and its legend on the first.

    Args:
        draw: Draws the figure.
        axes: As many as shall be drawn.
    """
    panels, numbers = _find_panels(draw)
    with _watch_panels(dict(zip(numbers, axes, strict=False))):
        page = draw()
    for one, number in zip(axes, numbers, strict=False):
        _name_axes(one, panels[number], [panels[other] for other in numbers])
    for legend in page.legends:
        move_legend(legend, axes[0], [*axes, *page.axes])


def move_legend(legend: Legend, axes: Axes, panels: Sequence[Axes]) -> None:
    """Show the legend of a page on axes, beside one that they may have.

    Args:
        legend: Legend of the page.
        axes: Where it goes.
        panels: With what it explains.
    """
    explained: dict[str, Artist] = {}
    for panel in panels:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            explained.setdefault(" ".join(label.split()), handle)
    words = [text.get_text() for text in legend.get_texts()]
    entries = zip(words, legend.legend_handles, strict=True)
    handles = [explained.get(" ".join(label.split()), handle) for label, handle in entries]
    letters = int(axes.bbox.width / _LETTER_WIDTH)
    title = "\n".join(textwrap.wrap(legend.get_title().get_text(), max(letters, 1))) or None
    of_panel = axes.get_legend()
    moved = axes.legend(handles, words, title=title, frameon=True, framealpha=0.8, edgecolor="none")  # type: ignore[arg-type]
    moved.set_in_layout(False)  # or a long one would leave no room for panels
    if of_panel is not None:
        axes.add_artist(of_panel)


def _find_panels(draw: Callable[[], Figure]) -> tuple[list[Axes], list[int]]:
    """Return all panels that a figure makes, and the numbers of those that it keeps and that have an axis, row by row."""
    with _watch_panels({}) as panels:
        kept = draw().axes

    def top_and_left(number: int) -> tuple[float, float]:
        box = panels.made[number].get_position()
        return -round(float(box.y1), 6), float(box.x0)

    numbers = [i for i, axes in enumerate(panels.made) if axes in kept and axes.axison]
    return panels.made, sorted(numbers, key=top_and_left)


def _name_axes(axes: Axes, panel: Axes, panels: Sequence[Axes]) -> None:
    """Show the numbers of axes, and the names that a neighbor of its panel on the page has for both.

    Args:
        axes: The axes.
        panel: In whose place they are drawn.
        panels: All of the page.
    """
    axes.tick_params(labelbottom=True, labelleft=True)
    box = panel.get_position()
    if not axes.get_xlabel():
        below = [other.xaxis.label for other in panels if abs(other.get_position().x0 - box.x0) < _ALIKE and other.get_xlabel()]
        axes.set_xlabel(below[-1].get_text() if below else "", fontsize=below[-1].get_fontsize() if below else None)
    if not axes.get_ylabel():
        left = [other.yaxis.label for other in panels if abs(other.get_position().y0 - box.y0) < _ALIKE and other.get_ylabel()]
        axes.set_ylabel(left[0].get_text() if left else "", fontsize=left[0].get_fontsize() if left else None)


def flatten_axes(ax: object) -> list[Any]:
    """Return axes as matplotlib hands them out (one, a list, an array in rows) one after the other."""
    array = np.empty(1, dtype=object)
    array[0] = ax
    return list(array) if not isinstance(ax, list | tuple | np.ndarray) else list(np.asarray(ax, dtype=object).ravel())
