"""Trace plot: the path of every independent ensemble through the draws, which shows whether they agree."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit.plots.captions import explain_symbols
from bowdenfit.plots.layout import (
    EDGE,
    axes_at,
    empty_page,
    line_entry,
    number_below,
    number_left,
    place_labels,
    wrap_words,
)
from bowdenfit.plots.style import SERIES_COLORS, SERIES_LINES, SMALL, WIDE, WIDE_INTERVAL, in_paper_style
from bowdenfit.questions import summary
from bowdenfit.questions.summary.pairs_figure import SampledQuantity

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Trace plot: whether the sampling has converged"
MOST_DRAWS = 40  # shown of each walker
STRETCHES = 20  # that the path of a chain without other walkers is cut into
SHARE = 0.98  # of the draws, within the axes
GRID, MOST_NAMES = 48, 6  # points of a density, and entries of the legend
NAME, KEY_ROW, LEAST_COLUMN = 0.9, 0.13, 2.6  # in, an entry of the legend, a row of it, and a column of panels
LEFT, RIGHT, BOTTOM, TOP = 0.66, 0.08, 0.42, 0.5  # in, margins; LEFT of each of the two columns
PANEL, ROW, MARGINAL = 0.68, 0.84, 0.5  # in, height of a panel, of a row, width of a marginal


@dataclass(frozen=True)
class Traces:
    """Draws (walkers, ordered by ensemble, first) of every sampled parameter and of the optimal length.

    Args:
        quantities: The draws.
        n_ensembles: Number of independent ensembles.
        first_step: Step of the sampler after which the first draw was stored.
        last_step: The same of the last draw; the others are evenly between.
    """

    quantities: list[SampledQuantity]
    n_ensembles: int
    first_step: int
    last_step: int


def data(fit: Record) -> Traces | None:
    """Return the draws of every quantity; None where no walker has a path."""
    quantities = summary.collect_sampled_quantities(fit) + summary.collect_optimum_quantities(fit)[:1]
    if fit.sampled is None or all(q.draws.shape[1] == 1 for q in quantities):
        return None
    return Traces(quantities, fit.posterior.n_ensembles, *fit.posterior.stored_steps)


def caption(data: Traces) -> str:
    """Describe what is drawn, in plain words."""
    return (
        "The path of every parameter over the steps of the sampler, a color and line style for each independent start "
        "(chain). Where the sampling has converged, the paths lie on top of each other and drift neither up nor "
        f"down. Right of each panel: the density of each. {explain_symbols((q.symbol, q.meaning) for q in data.quantities)}"
        f"n = {data.n_ensembles} independent starts, {data.quantities[0].draws.size} draws from the posterior."
    )


@in_paper_style
def draw(data: Traces, width: float | None = None) -> Figure:
    """Return trace plots: median and 90 % of the walkers of each ensemble against the draw, and its marginal.

    A chain that has no other walkers is summarized over stretches of its path.
    """
    quantities, page = data.quantities, width or WIDE
    columns = 2 if page >= 2 * LEAST_COLUMN and len(quantities) > 1 else 1
    rows = -(-len(quantities) // columns)
    chains = len(quantities[0].draws) == data.n_ensembles
    key = wrap_words(_legend_title(chains), page - 2 * EDGE)
    figure = empty_page(page, TOP + KEY_ROW * key.count("\n") + BOTTOM + rows * ROW - (ROW - PANEL))
    for i, quantity in enumerate(quantities):
        column, row = divmod(i, rows)
        left, bottom = LEFT + column * page / columns, BOTTOM + (rows - 1 - row) * ROW
        inner = page / columns - LEFT - RIGHT - MARGINAL
        trace = axes_at(figure, left, bottom, inner, PANEL)
        trace.set(xlim=(data.first_step, data.last_step), ylim=quantity.limits(SHARE))
        marginal = axes_at(figure, left + inner + 0.04, bottom, MARGINAL - 0.06, PANEL, sharey=trace)
        marginal.set_axis_off()
        for number, draws in enumerate(np.split(quantity.draws, data.n_ensembles)):
            _draw_ensemble(trace, marginal, quantity, draws, number)
        _label_axes(figure, trace, quantity.label, last=row == rows - 1 or i == len(quantities) - 1)
    _draw_legend(figure, data.n_ensembles, key)
    return figure


def _draw_ensemble(trace: Axes, marginal: Axes, quantity: SampledQuantity, draws: np.ndarray, number: int) -> None:
    """Draw one ensemble in the panel of a quantity, and the density of its draws beside it."""
    style = _style(number)
    shares, grouped = _group_draws(draws)
    first, last = trace.get_xlim()
    steps = first + shares * (last - first)
    low, median, high = np.quantile(grouped, (0.05, 0.5, 0.95), axis=0)
    trace.fill_between(steps, low, high, facecolor=style["color"], alpha=0.07 if len(draws) > 1 else 0.03, linewidth=0)
    if len(draws) > 1:
        trace.plot(steps, low, steps, high, linewidth=0.5, **style)
    trace.plot(steps, median, linewidth=1.0, **style)
    grid = np.linspace(*trace.get_ylim(), GRID)
    marginal.plot(quantity.density(grid, draws), grid, linewidth=1.0, **style)


def _style(number: int) -> dict[str, Any]:
    """Return color and line of an ensemble."""
    return {"color": SERIES_COLORS[number % len(SERIES_COLORS)], "linestyle": SERIES_LINES[number % len(SERIES_LINES)]}


def _group_draws(draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return places along the path (0 to 1), and draws summarized there (columns): all walkers', or a stretch of a chain."""
    n_walkers, n = draws.shape
    if n_walkers > 1 or n < 2 * STRETCHES:
        chosen = np.arange(0, n, -(-n // MOST_DRAWS))
        return chosen / max(n - 1, 1), draws[:, chosen]
    length = n // STRETCHES
    stretches = draws[0, : STRETCHES * length].reshape(STRETCHES, length)
    return length * (np.arange(STRETCHES) + 0.5) / n, stretches.T


def _label_axes(figure: Figure, trace: Axes, label: str, last: bool) -> None:
    """Write numbers and the name of a quantity left of its panel, and below it where no panel follows."""
    trace.grid(visible=False)
    number_left(trace)
    number_below(trace, whole=True)
    trace.set_ylabel(_wrap_into_two_lines(label), fontsize=SMALL, va="center")
    if last:
        trace.set_xlabel("Step of the sampler", fontsize=SMALL, va="center")
    else:
        trace.tick_params(labelbottom=False)
    place_labels(figure, trace, 0.5, 0.27)


def _wrap_into_two_lines(label: str) -> str:
    """Return a name in at most two lines; of a longer one the first and the last, which tells groups apart."""
    first, *others = wrap_words(label, ROW - 0.04).split("\n")
    between = "\N{HORIZONTAL ELLIPSIS} " if len(others) > 1 else ""
    return "\n".join([first, *(between + last for last in others[-1:])])


def _legend_title(chains: bool) -> str:
    """Return what lines and bands are."""
    if chains:
        return f"Line: median of each {STRETCHES}th of the chain; shaded: its {WIDE_INTERVAL}; right of each panel: density"
    return f"Thick: median at a step; thin: {WIDE_INTERVAL}; right of each panel: density"


def _draw_legend(figure: Figure, n_ensembles: int, key: str) -> None:
    """Write what lines and bands are, and one entry a start."""
    most = min(MOST_NAMES, int((figure.get_size_inches()[0] - EDGE) / NAME))
    named = n_ensembles if n_ensembles <= most else most - 1
    entries = [line_entry(f"Start {number + 1}", linewidth=1.2, **_style(number)) for number in range(named)]
    if named < n_ensembles:
        entries.append(line_entry(f"and {n_ensembles - named} more"))
    figure.legend(
        handles=entries, title=key, title_fontsize=SMALL, loc="upper center", ncols=len(entries), borderaxespad=0.3,
        bbox_to_anchor=(0.5, 1.0),
    )  # fmt: skip
