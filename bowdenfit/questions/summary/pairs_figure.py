"""How the unknowns hang together: every two of them, and each alone on the diagonal."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import symbol_words
from bowdenfit.plots.densities import BINS, bin_numbers, enclosed_share
from bowdenfit.plots.layout import EDGE, wrapped
from bowdenfit.plots.sheet import Panel, PanelSheet
from bowdenfit.plots.style import BLUE, SMALL, WIDE, in_paper_style
from bowdenfit.questions.summary.quantities import SampledQuantity, optimum, sampled_quantities

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure
    from bowdenfit.results.record import Record

HEADING = "Which unknowns hang together"
MOST = 8
SHARE = 0.996  # of the draws, within the axes
ROLES = ("friction", "elastic", "friction_model", "angle", "sensor", "noise")
FILLS = {0.68: "#5E9FCB", 0.95: "#C3DCEE"}
MARGIN, GAP, LARGEST, SMALLEST = 0.62, 0.09, 1.45, 0.66  # in
KEY_ROW = 0.135  # in


@dataclass(frozen=True)
class Pairs:
    """Draws of what is shown, and what the optimum is the best of, such as "cable length"; empty without one."""

    quantities: list[SampledQuantity]
    best: str = ""


def data(fit: Record) -> Pairs | None:
    """Coefficients and the rope first, what may be confounded with them next, then noise; at most eight with the optimum.

    None where there are no two to draw against each other.
    """
    answer, route = optimum(fit), fit.dataset.description.route
    quantities = sampled_quantities(fit, ROLES)[: MOST - len(answer)] + answer
    best = route.variable.replace("_", " ") if route is not None and answer else ""
    return Pairs(quantities, best) if len(quantities) > 1 else None


def caption(data: Pairs) -> str:
    """What is drawn, in plain words."""
    return (
        "Every two unknowns against each other, and each alone on the diagonal. Dark and light: the smallest areas that "
        "hold the truth with 68 % and 95 % probability; a long slanted area means that the measurements tell a combination of "
        "the two better than either alone. Dashed: median and 90 % interval. "
        f"{symbol_words((q.symbol, q.meaning) for q in data.quantities)}"
        f"n = {data.quantities[0].draws.size} sampled values."
    )


@in_paper_style
def draw(data: Pairs, width: float | None = None) -> Figure:
    """Joint and marginal posterior of coefficients, noise and optimum."""
    quantities = _with_room(data, int(((width or WIDE) - MARGIN - GAP) / SMALLEST))
    size = ((width or WIDE) - MARGIN - GAP) / len(quantities)
    size = size if width else min(LARGEST, size)
    sheet = PanelSheet(MARGIN + GAP + size * len(quantities), MARGIN + 2 * GAP + size * len(quantities))
    panels = _panels(quantities, size)
    _marginals(sheet, quantities, panels)
    _regions(sheet, quantities, panels)
    _axes(sheet, quantities, panels)
    _words(sheet, data, panels, len(quantities))
    return sheet.finished()


def _with_room(data: Pairs, most: int) -> list[SampledQuantity]:
    """So many quantities at most, the optimum among them."""
    every, last = data.quantities, 2 if data.best and most > 2 else 0
    return every if len(every) <= most else every[: most - last] + every[len(every) - last :]


def _panels(quantities: list[SampledQuantity], size: float) -> dict[tuple[int, int], Panel]:
    """The lower triangle, by row and column."""
    shown, last = [q.limits(SHARE) for q in quantities], len(quantities) - 1
    return {
        (row, column): Panel(
            MARGIN + column * size, MARGIN + (last - row) * size, size - GAP, size - GAP,
            shown[column], shown[row] if row != column else (0.0, 1.12),
        )
        for row in range(len(quantities)) for column in range(row + 1)
    }  # fmt: skip


def _marginals(sheet: PanelSheet, quantities: list[SampledQuantity], panels: dict[tuple[int, int], Panel]) -> None:
    """Density of each quantity alone, with its median and 90 % interval."""
    outlines, curves, middles = [], [], []
    for i, quantity in enumerate(quantities):
        panel = panels[i, i]
        grid = np.linspace(*panel.x_limits, 2 * BINS)
        height = quantity.density(grid)
        outlines.append(panel.path(np.r_[grid[0], grid, grid[-1]], np.r_[0.0, height, 0.0]))
        curves.append(panel.path(grid, height))
        middles += [
            panel.path(np.full(2, q), np.array([0.0, np.interp(q, grid, height)]))
            for q in np.quantile(quantity.draws, (0.05, 0.5, 0.95))
        ]
    sheet.areas(outlines, facecolor=FILLS[0.95])
    sheet.lines(middles, color=BLUE, linewidth=0.7, linestyle=(0, (2.5, 1.5)))
    sheet.lines(curves, color=BLUE, linewidth=1.0)


def _regions(sheet: PanelSheet, quantities: list[SampledQuantity], panels: dict[tuple[int, int], Panel]) -> None:
    """The smallest areas that hold 68 % and 95 % of the draws, of all pairs in one go."""
    if len(quantities) < 2:
        return
    numbers = [bin_numbers(q.draws, panels[i, i].x_limits) for i, q in enumerate(quantities)]
    share = np.full((len(quantities) * (BINS + 1),) * 2, np.nan)
    for column, row in combinations(range(len(quantities)), 2):
        y, x = (slice(place * (BINS + 1), place * (BINS + 1) + BINS) for place in (row, column))
        share[y, x] = enclosed_share(numbers[column], numbers[row])
    last = len(quantities) - 1
    places = (np.arange(BINS + 1) + 0.5) / BINS
    across = np.concatenate([panels[last, i].left + panels[last, i].width * places for i in range(last + 1)])
    up = np.concatenate([panels[i, 0].bottom + panels[i, 0].height * places for i in range(last + 1)])
    share = np.ma.masked_invalid(share)
    sheet.axes.contourf(across, up, share, [0.0, *FILLS], colors=list(FILLS.values()), zorder=1)
    sheet.axes.contour(across, up, share, list(FILLS), colors=[BLUE], linewidths=0.6, zorder=1.1)


def _axes(sheet: PanelSheet, quantities: list[SampledQuantity], panels: dict[tuple[int, int], Panel]) -> None:
    last = len(quantities) - 1
    sheet.frames(panels.values())
    for i, quantity in enumerate(quantities):
        below, left = panels[last, i], panels[i, 0]
        sheet.ticks_below(below)
        label = wrapped(quantity.label, below.width + 0.8 * GAP, most=2)
        sheet.text(below.left + below.width / 2, MARGIN - 0.2, label, ha="center", va="top", fontsize=SMALL)
        if i > 0:
            sheet.ticks_left(left)
            middle = left.bottom + left.height / 2
            sheet.text(0.16, middle, label, ha="center", va="center", rotation=90, fontsize=SMALL)


def _words(sheet: PanelSheet, data: Pairs, panels: dict[tuple[int, int], Panel], shown: int) -> None:
    """The key, in the empty corner right of the first panel."""
    first = panels[0, 0]
    room = sheet.figure.get_size_inches()[0] - first.left - first.width - 2.5 * GAP - EDGE
    x, y = first.left + first.width + 2.5 * GAP, first.bottom + first.height
    entries = [(FILLS[share], f"{100 * share:.0f} % probability") for share in FILLS]
    for i, (color, words) in enumerate(entries):
        top = y - KEY_ROW * i
        sheet.areas([np.array([(x, top), (x + 0.2, top), (x + 0.2, top - 0.1), (x, top - 0.1)])], facecolor=color)
        sheet.text(x + 0.26, top - 0.05, words, va="center_baseline", fontsize=SMALL)
    lines = ["Dashed: median and 90 % interval"]
    if data.best:
        lines.append(f"Optimum: best {data.best}")
    if shown < len(data.quantities):
        lines.append(f"{shown} of {len(data.quantities)} unknowns shown")
    lines = [line for words in lines for line in wrapped(words, room).split("\n")]
    for i, words in enumerate(lines, start=len(entries)):
        sheet.text(x, y - KEY_ROW * i - 0.05, words, va="center_baseline", fontsize=SMALL)
