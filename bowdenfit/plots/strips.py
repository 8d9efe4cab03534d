"""Panels of measurements and fit, each with a strip of residuals below it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.borrowed import is_borrowed
from bowdenfit.plots.layout import (
    BOTTOM,
    RIGHT,
    TITLE,
    axes_at,
    count_columns,
    empty_page,
    label_across,
    number_width,
    place_labels,
    room_for_labels,
    squeeze,
)
from bowdenfit.plots.panels import LEAST_WIDTH, finite, set_limits, share_limits, shorten_title
from bowdenfit.plots.style import GRAY, MEDIUM, SMALL, WIDE

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure

# Sizes are judgements, as those of `layout`.
STRIP, GAP = 0.5, 0.1  # in, height of a strip, and from it to its panel
LEFT = 0.68  # in, margin
_NUMBERS, _PAD, _TWO_LINES = 0.27, 0.11, 0.28  # in, room for numbers, for what is beside them, and for a name in two lines
NONE = 1e-9  # below which residuals are rounding, in any unit that is shown
TALL = 0.85  # height over width of a panel
_ROOM = 1.2  # limits of a strip over its largest residual, so that no mark touches its edge


@dataclass(frozen=True)
class Stripped:
    """A figure of panels, row by row, each with its strip of residuals.

    Args:
        figure: The page.
        mains: The panels.
        strips: The strip below each.
        columns: Panels in a row.
    """

    figure: Figure
    mains: list[Axes]
    strips: list[Axes]
    columns: int

    def label(self, x_label: str, y_label: str, unit: str) -> None:
        """Label the outer panels with names and units.

        Args:
            x_label: Label of the horizontal axis of all panels and strips.
            y_label: Label of the vertical axis of the panels.
            unit: Unit of the residuals.
        """
        for i, (main, strip) in enumerate(zip(self.mains, self.strips, strict=True)):
            if i % self.columns == 0:
                main.set_ylabel(y_label)
                name_strip(strip, unit)
            if i + self.columns >= len(self.mains):
                label_across(strip, x_label)
                strip.tick_params(labelbottom=True)
        room_for_labels(self.figure)
        far = max(_NUMBERS, *(number_width(axes) for axes in (*self.mains, *self.strips))) + _PAD
        squeeze(self.figure, LEFT, max(LEFT, far + _TWO_LINES))
        for main, strip in zip(self.mains, self.strips, strict=True):
            place_names(main, strip, far)

    def finish_strips(self) -> None:
        """Finish all strips; see the function `finish_strips`."""
        finish_strips(self.strips)


def finish_strips(strips: Sequence[Axes]) -> None:
    """Draw a zero line on every strip, and give all the same limits around it."""
    off = finite([np.zeros(0), *(np.asarray(line.get_ydata(), dtype=float) for strip in strips for line in strip.get_lines())])
    limit = _ROOM * float(np.max(np.abs(off), initial=0.0))
    limit = limit if limit > NONE else 1.0
    for strip in strips:
        strip.axhline(0.0, color=GRAY, linewidth=0.8, zorder=0.9)
        strip.set_ylim(-limit, limit)
        strip.locator_params(axis="y", nbins=3)


def name_strip(strip: Axes, unit: str) -> None:
    """Label a strip with the unit of its residuals, in two lines."""
    strip.set_ylabel(f"Residual\n({unit})", fontsize=SMALL, linespacing=1.0)


def place_names(main: Axes, strip: Axes, far: float | None = None) -> None:
    """Put the names of panel and strip beside their numbers, in line.

    Args:
        main: The panel.
        strip: Its strip.
        far: From the axes to the names [in]; beside the wider numbers of the two, and on the page, if omitted.
    """
    if is_borrowed(main):
        return
    figure = main.figure
    assert figure is not None  # a panel is on a page
    if far is None:
        far = max(_NUMBERS, number_width(main), number_width(strip)) + _PAD
        margin = main.get_position().x0 * figure.get_size_inches()[0]  # type: ignore[union-attr]
        squeeze(figure, margin, max(margin, far + _TWO_LINES))  # type: ignore[arg-type]
    width = figure.get_size_inches()[0] * main.get_position().width  # type: ignore[union-attr]
    for axes in (main, strip):
        axes.yaxis.set_label_coords(-far / width, 0.5)


def panels_with_strips(
    names: Sequence[str],
    across: Sequence[tuple[float, float]],
    up: Sequence[tuple[float, float]],
    most_columns: int,
    height: float | None = None,
    width: float | None = None,
    least: float = LEAST_WIDTH,
    usual: float = MEDIUM,
) -> Stripped:
    """Return a figure with titled panels, each with a strip of residuals below it.

    Args:
        names: Names of the panels; empty ones have no title.
        across: Limits of each x axis, which are those of all where they are alike.
        up: Limits of each y axis, likewise.
        most_columns: Panels in a row.
        height: Height of a panel [in]; from its width if omitted.
        width: Width of the page, whatever is on it [in].
        least: Width of a panel that can still be read [in].
        usual: Width of the page for a single column [in].
    """
    share_x, share_y = share_limits(across), share_limits(up)
    gap = 0.16 if share_y else 0.42
    rows = -(-len(names) // count_columns(width or WIDE, most_columns, least, gap))
    columns = -(-len(names) // rows)
    page = width or (usual if columns == 1 else WIDE)
    inner = (page - LEFT - RIGHT - gap * (columns - 1)) / columns
    top = TITLE if any(names) else 0.06
    main, down = height or TALL * inner, top + (0.08 if share_x else 0.2)
    row = main + GAP + STRIP
    figure = empty_page(page, top + rows * row + (rows - 1) * down + BOTTOM)
    made = Stripped(figure, [], [], columns)
    for i, name in enumerate(names):
        left, bottom = LEFT + (i % columns) * (inner + gap), BOTTOM + (rows - 1 - i // columns) * (row + down)
        first = made.mains[0] if made.mains else None
        sharing = {"sharex": first if share_x else None, "sharey": first if share_y else None}
        made.mains.append(axes_at(figure, left, bottom + STRIP + GAP, inner, main, **sharing))
        made.mains[-1].set_title(shorten_title(name, inner), fontsize=SMALL)
        sharing = {"sharex": made.mains[-1], "sharey": made.strips[0] if made.strips else None}
        made.strips.append(axes_at(figure, left, bottom, inner, STRIP, **sharing))
        inside = i % columns > 0
        made.mains[-1].tick_params(labelbottom=False, labelleft=not (share_y and inside))
        made.strips[-1].tick_params(labelbottom=not share_x, labelleft=not inside)
        place_labels(figure, made.mains[-1])
        place_labels(figure, made.strips[-1])
    set_limits(made.mains, across, "x", share_x)
    set_limits(made.mains, up, "y", share_y)
    return made
