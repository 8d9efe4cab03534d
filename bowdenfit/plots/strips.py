"""Panels of measurements and fit, each with a strip of residuals below it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import (
    BOTTOM,
    LEFT,
    RIGHT,
    TITLE,
    add_panel,
    count_columns,
    empty_page,
    label_across,
    number_outer,
)
from bowdenfit.plots.panels import LEAST_WIDTH, finite, set_limits, share_limits, shorten_title
from bowdenfit.plots.style import GRAY, MEDIUM, SMALL, WIDE

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure

# Sizes are judgements, as those of `layout`.
STRIP, GAP = 0.5, 0.1  # in, height of a strip, and from it to its panel
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
                number_outer(strip)

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
    figure = empty_page(page, top + rows * (main + GAP + STRIP) + (rows - 1) * down + BOTTOM)
    figure.panel_height = rows * (main + STRIP)
    grid, made = figure.add_gridspec(2 * rows, columns, height_ratios=(main, STRIP) * rows), Stripped(figure, [], [], columns)
    for i, name in enumerate(names):
        row, column = divmod(i, columns)
        made.mains.append(add_panel(figure, grid[2 * row, column], made.mains[:1] * share_x, made.mains[:1] * share_y))
        made.mains[-1].set_title(shorten_title(name, inner), fontsize=SMALL)
        made.strips.append(add_panel(figure, grid[2 * row + 1, column], made.mains[-1:], made.strips[:1]))
        inside = i % columns > 0
        made.mains[-1].tick_params(labelbottom=False, labelleft=not (share_y and inside))
        made.strips[-1].tick_params(labelbottom=not share_x, labelleft=not inside)
    set_limits(made.mains, across, "x", share_x)
    set_limits(made.mains, up, "y", share_y)
    return made
