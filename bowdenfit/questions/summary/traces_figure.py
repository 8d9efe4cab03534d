"""Whether independent ensembles agree and stand still: the path of each through the draws."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import symbol_words
from bowdenfit.plots.layout import EDGE, wrapped
from bowdenfit.plots.sheet import Panel, PanelSheet
from bowdenfit.plots.style import SERIES_COLORS, SERIES_LINES, SMALL, WIDE, WIDE_INTERVAL, in_paper_style
from bowdenfit.questions.summary.quantities import SampledQuantity, optimum, sampled_quantities

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure
    from bowdenfit.results.record import Record

HEADING = "Paths of the sampler"
MOST_DRAWS = 40  # shown of each walker
STRETCHES = 20  # that the path of a chain without other walkers is cut into
SHARE = 0.98  # of the draws, within the axes
GRID, MOST_NAMES = 48, 6
NAME, KEY_ROW, LEAST_COLUMN = 0.9, 0.13, 2.6  # in, an entry of the legend, a row of it, and a column of panels
LEFT, RIGHT, BOTTOM, TOP = 0.66, 0.08, 0.42, 0.5  # in, margins; LEFT of each of the two columns
PANEL, ROW, MARGINAL = 0.68, 0.84, 0.5  # in, height of a panel, of a row, width of a marginal


@dataclass(frozen=True)
class Paths:
    """Draws (walkers, ordered by ensemble, first) of every sampled parameter and of the optimal length."""

    quantities: list[SampledQuantity]
    n_ensembles: int


def data(fit: Record) -> Paths | None:
    """What is shown; None where no walker has a path."""
    quantities = sampled_quantities(fit) + optimum(fit)[:1]
    if fit.sampled is None or all(q.draws.shape[1] == 1 for q in quantities):
        return None
    return Paths(quantities, fit.posterior.n_ensembles)


def caption(data: Paths) -> str:
    """What is drawn, in plain words."""
    return (
        "Whether the sampling can be relied on: the path of every unknown through the sampling, a color for each "
        "independent start. They should lie on top of each other and go neither up nor down. Right of each panel: where "
        f"each spent its time. {symbol_words((q.symbol, q.meaning) for q in data.quantities)}"
        f"n = {data.n_ensembles} independent starts, {data.quantities[0].draws.size} sampled values."
    )


@in_paper_style
def draw(data: Paths, width: float | None = None) -> Figure:
    """Median and 90 % of the walkers of each ensemble against the draw, and the marginal of each ensemble.

    A chain that has no other walkers is summarized over stretches of its path.
    """
    quantities, page = data.quantities, width or WIDE
    columns = 2 if page >= 2 * LEAST_COLUMN and len(quantities) > 1 else 1
    rows = -(-len(quantities) // columns)
    chains = len(quantities[0].draws) == data.n_ensembles
    key = wrapped(_key(chains), page - 2 * EDGE)
    sheet = PanelSheet(page, TOP + KEY_ROW * key.count("\n") + BOTTOM + rows * ROW - (ROW - PANEL))
    panels = [_panel(q, page / columns, i // rows, rows - 1 - i % rows) for i, q in enumerate(quantities)]
    for number in range(data.n_ensembles):
        _ensemble(sheet, number, panels, quantities, data.n_ensembles)
    _axes(sheet, quantities, panels, rows, "Step of the sampling")
    _legend(sheet, data.n_ensembles, key)
    return sheet.finished()


def _panel(quantity: SampledQuantity, room: float, column: int, row: int) -> Panel:
    """The panel in a column of so much room."""
    inner, draws = room - LEFT - RIGHT - MARGINAL, quantity.draws.shape[1]
    return Panel(LEFT + column * room, BOTTOM + row * ROW, inner, PANEL, (1.0, float(draws)), quantity.limits(SHARE))


def _ensemble(sheet: PanelSheet, number: int, panels: list[Panel], quantities: list[SampledQuantity], n_ensembles: int) -> None:
    """One ensemble in all panels."""
    color, line = SERIES_COLORS[number % len(SERIES_COLORS)], SERIES_LINES[number % len(SERIES_LINES)]
    medians, bands, edges = [], [], []
    for panel, quantity in zip(panels, quantities, strict=True):
        draws = np.split(quantity.draws, n_ensembles)[number]
        at, together = _together(draws)
        low, median, high = (panel.path(at, q) for q in np.quantile(together, (0.05, 0.5, 0.95), axis=0))
        medians += [median, _marginal(panel, quantity, draws)]
        if len(draws) > 1:
            edges += [low, high]
        bands.append(np.concatenate([low, high[::-1]]))
    sheet.areas(bands, facecolor=color, alpha=0.07 if edges else 0.03)
    if edges:
        sheet.lines(edges, color=color, linestyle=line, linewidth=0.5)
    sheet.lines(medians, color=color, linestyle=line, linewidth=1.0)


def _together(draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where along the path, and which draws are summarized there (columns): all walkers', or a stretch of one chain."""
    n_walkers, n = draws.shape
    if n_walkers > 1 or n < 2 * STRETCHES:
        shown = np.arange(0, n, -(-n // MOST_DRAWS))
        return 1.0 + shown, draws[:, shown]
    length = n // STRETCHES
    stretches = draws[0, : STRETCHES * length].reshape(STRETCHES, length)
    return 1.0 + length * (np.arange(STRETCHES) + 0.5), stretches.T


def _marginal(panel: Panel, quantity: SampledQuantity, draws: np.ndarray) -> np.ndarray:
    """Density of one ensemble's draws, lying on its side right of the panel."""
    grid = np.linspace(*panel.y_limits, GRID)
    start = panel.left + panel.width + 0.04
    return np.column_stack([start + (MARGINAL - 0.06) * quantity.density(grid, draws), panel.y(grid)])


def _axes(sheet: PanelSheet, quantities: list[SampledQuantity], panels: list[Panel], rows: int, across: str) -> None:
    sheet.frames(panels)
    for i, (quantity, panel) in enumerate(zip(quantities, panels, strict=True)):
        last = i % rows == rows - 1 or i == len(quantities) - 1
        sheet.ticks_left(panel)
        sheet.ticks_below(panel, numbers=last, whole=True)
        middle = panel.bottom + PANEL / 2
        label = _in_two_lines(quantity.label)
        sheet.text(panel.left - 0.5, middle, label, ha="center", va="center", rotation=90, fontsize=SMALL)
        if last:
            middle = panel.left + panel.width / 2
            sheet.text(middle, panel.bottom - 0.27, across, ha="center", va="center", fontsize=SMALL)


def _in_two_lines(label: str) -> str:
    """A name beside a panel; of one that takes more lines the first and the last, which tells groups apart."""
    first, *others = wrapped(label, ROW - 0.04).split("\n")
    between = "\N{HORIZONTAL ELLIPSIS} " if len(others) > 1 else ""
    return "\n".join([first, *(between + last for last in others[-1:])])


def _key(chains: bool) -> str:
    """What lines and bands are."""
    if chains:
        return f"Line: median of each {STRETCHES}th of the steps; shaded: its {WIDE_INTERVAL}; right of each panel: density"
    return f"Thick: median of the values at a step; thin: their {WIDE_INTERVAL}; right of each panel: density"


def _legend(sheet: PanelSheet, n_ensembles: int, key: str) -> None:
    """One entry a start, and what line and band are."""
    width, height = sheet.figure.get_size_inches()
    most = min(MOST_NAMES, int((width - EDGE) / NAME))
    shown = n_ensembles if n_ensembles <= most else most - 1
    more, step = n_ensembles - shown, min(1.0, (width - EDGE) / most)
    for number in range(shown):
        x, y = width / 2 + step * (number - (shown + bool(more)) / 2), height - 0.14
        color, line = SERIES_COLORS[number], SERIES_LINES[number % len(SERIES_LINES)]
        sheet.lines([np.array([(x, y), (x + 0.25, y)])], color=color, linestyle=line, linewidth=1.2)
        sheet.text(x + 0.3, y, f"Start {number + 1}", va="center_baseline", fontsize=SMALL)
    if more:
        sheet.text(width / 2 + step * (shown - 1) / 2, height - 0.14, f"and {more} more", va="center_baseline", fontsize=SMALL)
    sheet.text(width / 2, height - 0.24, key, ha="center", va="top", fontsize=SMALL, linespacing=1.25)
