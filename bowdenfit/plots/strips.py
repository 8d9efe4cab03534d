"""Panels of what was measured and fitted, each with a strip of residuals below it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit.plots.layout import BOTTOM, RIGHT, TITLE, axes_at, columns_within, empty_page, place_labels
from bowdenfit.plots.panels import CHARACTER, LEAST_WIDTH, alike, finite, set_limits, short
from bowdenfit.plots.style import GRAY, MEDIUM, SMALL, WIDE

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure

STRIP, GAP = 0.5, 0.1  # in, height of a strip, and from it to its panel
LEFT, LABEL = 0.68, 0.42  # in, margin, and from the axes to their names
TALL = 0.85  # height over width of a panel
_ROOM = 1.2


@dataclass(frozen=True)
class Stripped:
    """A figure of panels, row by row, each with its strip.

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
        """Names and units on the outer panels.

        Args:
            x_label: Of all panels and strips.
            y_label: Of the panels.
            unit: Of the residuals.
        """
        for i, (main, strip) in enumerate(zip(self.mains, self.strips, strict=True)):
            if i % self.columns == 0:
                main.set_ylabel(y_label)
                strip.set_ylabel(f"Residual\n({unit})", fontsize=SMALL, linespacing=1.0)
            if i + self.columns >= len(self.mains):
                strip.set_xlabel(x_label)
                strip.tick_params(labelbottom=True)

    def finish_strips(self) -> None:
        """A zero line on every strip, and the same limits around it on all."""
        points = [line.get_ydata() for strip in self.strips for line in strip.get_lines()]
        ends = [part for strip in self.strips for area in strip.collections for part in _heights(area)]
        off = finite([np.asarray(part, dtype=float) for part in (*points, *ends)])
        limit = _ROOM * float(np.max(np.abs(off), initial=0.0)) or 1.0
        for strip in self.strips:
            strip.axhline(0.0, color=GRAY, linewidth=0.8, zorder=0.9)
            strip.set_ylim(-limit, limit)
            strip.locator_params(axis="y", nbins=3)


def _heights(area: Any) -> list[np.ndarray]:
    """Of the lines in a collection."""
    return [np.asarray(path.vertices)[:, 1] for path in area.get_paths()]


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
    """A panel under its name with a strip below, in a grid without more columns than it needs.

    Args:
        names: Of the panels; empty ones have no title.
        across: Limits of each x axis, which are those of all where they are alike.
        up: Limits of each y axis, likewise.
        most_columns: Panels in a row.
        height: Of a panel [in]; from its width if omitted.
        width: Of the page, whatever is on it [in].
        least: Width of a panel that can still be read [in].
        usual: Width of the page for a single column [in].
    """
    share_x, share_y = alike(across), alike(up)
    gap = 0.16 if share_y else 0.42
    rows = -(-len(names) // columns_within(width or WIDE, most_columns, least, gap))
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
        made.mains[-1].set_title(short(name, int(inner / CHARACTER)), fontsize=SMALL)
        sharing = {"sharex": made.mains[-1], "sharey": made.strips[0] if made.strips else None}
        made.strips.append(axes_at(figure, left, bottom, inner, STRIP, **sharing))
        inside = i % columns > 0
        made.mains[-1].tick_params(labelbottom=False, labelleft=not (share_y and inside))
        made.strips[-1].tick_params(labelbottom=not share_x, labelleft=not inside)
        for axes, far in ((made.mains[-1], LABEL), (made.strips[-1], LABEL - 0.05)):
            place_labels(figure, axes)
            axes.yaxis.set_label_coords(-far / inner, 0.5)
    set_limits(made.mains, across, "x", share_x)
    set_limits(made.mains, up, "y", share_y)
    return made
