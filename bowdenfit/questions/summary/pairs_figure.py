"""Corner plot of the draws: joint credible regions of every two parameters, and the marginals on the diagonal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.pages.section import Chart, Series, SeriesGroup, Span
from bowdenfit.parameters.symbols import to_plain_text
from bowdenfit.plots.captions import explain_symbols
from bowdenfit.plots.curves import density, limits
from bowdenfit.plots.layout import (
    EDGE,
    area_entry,
    axes_at,
    empty_page,
    line_entry,
    number_below,
    number_left,
    place_labels,
    text_width,
    ticks_below,
    ticks_left,
    wrap_words,
)
from bowdenfit.plots.style import BLUE, LEAST, MEDIAN, SMALL, WIDE, in_paper_style
from bowdenfit.questions import summary
from bowdenfit.words import decimals

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Corner plot: which parameters are correlated"
MOST_QUANTITIES = 8  # a judgement: more panels are too small to read
SHARE = 0.996  # of the draws, within the axes
ROLES = ("friction", "elastic", "friction_model", "angle", "sensor", "noise")
FILLS = {0.68: "#5E9FCB", 0.95: "#C3DCEE"}
LEFT, BOTTOM, GAP = 0.62, 0.62, 0.09  # in, margins at least, and between panels
NAMES = 0.38  # in, of the left margin, for names in two lines and the marks of the axis
UPRIGHT = 0.07  # in, height of a number that does not stand upright
LARGEST, SMALLEST = 1.45, 0.66  # in, of a panel with its gap
HEADROOM, LINE_ROOM = 1.55, 0.3  # height of a panel on the diagonal over its highest bar's, of two lines and more for a third
MARK = 0.26  # in, of a color in the key, with the gap to its words
BINS = 32  # of each axis, in two dimensions
FINER = 2  # so many bins of a chart, which has no contours between them, for one of these
SMOOTHING = 6.5  # bins, of one draw; less of n by the rate of the best kernel in two dimensions, n to the power of -1/6


@dataclass(frozen=True)
class SampledQuantity:
    """Draws of a parameter, or of the optimum.

    Args:
        label: Symbol with unit.
        draws: The draws (walkers by draws).
        bounds: Lowest and highest possible value.
        symbol: Symbol alone, in matplotlib's math notation.
        meaning: Meaning in words.
    """

    label: str
    draws: np.ndarray
    bounds: tuple[float, float]
    symbol: str = ""
    meaning: str = ""

    def limits(self, share: float) -> tuple[float, float]:
        """Return limits of an axis that shows the given share of the draws, within the bounds."""
        low, high = limits(self.draws, share)
        return max(low, self.bounds[0]), min(high, self.bounds[1])

    def density(self, grid: np.ndarray, draws: np.ndarray | None = None) -> np.ndarray:
        """Return the density of the draws, or of some of them, with its highest point at 1."""
        height = density(self.draws if draws is None else draws, grid, *self.bounds)
        return height / height.max()


@dataclass(frozen=True)
class Pairs:
    """Draws of what is shown, and what the optimum is the best of, such as "cable length"; empty without one."""

    quantities: list[SampledQuantity]
    best: str = ""


def data(fit: Record) -> Pairs | None:
    """Return coefficients and the rope first, what may be confounded with them next, then noise; eight with the optimum.

    None where there are no two to draw against each other.
    """
    from bowdenfit.questions.error_budget import with_bench_errors  # here, as drawing again needs no JAX

    fit = with_bench_errors(fit)
    answer, route = summary.collect_optimum_quantities(fit), fit.dataset.description.route
    quantities = summary.collect_sampled_quantities(fit, ROLES)[: MOST_QUANTITIES - len(answer)] + answer
    best = route.variable.replace("_", " ") if route is not None and answer else ""
    return Pairs(quantities, best) if len(quantities) > 1 else None


def caption(data: Pairs) -> str:
    """Describe what is drawn, in plain words."""
    return (
        "Every two parameters of the posterior, bench errors included, against each other, and the distribution of each on "
        "the diagonal. Dark and light blue: the smallest areas that hold the truth with 68 % and 95 % probability; a long "
        "slanted area means that two parameters are correlated: the measurements determine a combination of them better than "
        "either. Dashed, and written above: median and 90 % interval. "
        f"{explain_symbols((q.symbol, q.meaning) for q in data.quantities)}"
        f"n = {data.quantities[0].draws.size} draws from the posterior."
    )


@in_paper_style
def draw(data: Pairs, width: float | None = None) -> Figure:
    """Return the corner plot of coefficients, noise and optimum."""
    page = width or WIDE
    quantities = _select_quantities(data, int((page - LEFT - GAP) / SMALLEST))
    n = len(quantities)
    left = _left_margin(quantities, (page - LEFT - GAP) / n - GAP)
    size = (page - left - GAP) / n
    size = size if width else min(LARGEST, size)
    upright = _height_of_upright_numbers(quantities, size - GAP)
    bottom = BOTTOM + max(0.0, upright - UPRIGHT)
    figure = empty_page(left + GAP + size * n, bottom + GAP + size * n)
    panels = {}
    for row, column in np.argwhere(np.tri(n)).tolist():
        axes = panels[row, column] = axes_at(
            figure, left + size * column, bottom + size * (n - 1 - row), size - GAP, size - GAP
        )
        axes.set_xlim(quantities[column].limits(SHARE))
        axes.grid(visible=False)
        axes.xaxis.set_visible(row == n - 1)
        axes.yaxis.set_visible(row > column == 0)
        if row == column:
            _draw_marginal(axes, quantities[row], size - GAP)
        else:
            axes.set_ylim(quantities[row].limits(SHARE))
            _draw_credible_regions(axes, quantities[column], quantities[row])
    for i, quantity in enumerate(quantities):
        label = wrap_words(quantity.label, size - 0.2 * GAP, most=2)
        _label_axes(figure, panels[n - 1, i], panels[i, 0] if i else None, label, left - 0.16, upright)
    _draw_legend(panels[0, 0], _remarks(data, n), figure.get_size_inches()[0] - left - size - GAP - MARK - EDGE)
    return figure


def _left_margin(quantities: list[SampledQuantity], height: float) -> float:
    """Return the left margin in which names stand beside the widest number of panels of some height [in]."""
    texts = [text for q in quantities[1:] for text in ticks_left(q.limits(SHARE), height)[1]]
    return max(LEFT, NAMES + max((text_width(text, LEAST) for text in texts), default=0.0))


def _height_of_upright_numbers(quantities: list[SampledQuantity], width: float) -> float:
    """Return the height of the numbers below panels of some width [in]; 0 where two of each fit side by side."""
    if all(len(ticks_below(q.limits(SHARE), width)[1]) > 1 for q in quantities):
        return 0.0
    return max(text_width(text, LEAST) for q in quantities for text in ticks_left(q.limits(SHARE), width)[1])


def _draw_marginal(axes: Axes, quantity: SampledQuantity, width: float) -> None:
    """Draw the histogram of a quantity, and above it its median and 90 % interval, which takes two lines in a narrow panel."""
    n_bins = round(2 * quantity.draws.size ** (1 / 3))  # Rice's rule
    axes.hist(
        quantity.draws.ravel(), n_bins, range=axes.get_xlim(), histtype="stepfilled", facecolor=FILLS[0.95], edgecolor=BLUE
    )
    low, median, high = np.quantile(quantity.draws, (0.05, 0.5, 0.95))
    digits = decimals(high - low, median)
    middle, *ends = (f"{value:z.{digits}f}" for value in (median, low, high))
    interval = " to ".join(ends)
    texts = [middle, interval] if text_width(interval, LEAST) < width else [middle, f"{ends[0]} to", ends[1]]
    room = HEADROOM + LINE_ROOM * (len(texts) - 2)
    for value in (low, median, high):
        axes.axvline(value, 0, 1 / room, color=BLUE, linewidth=0.7, linestyle="--")
    axes.set_ylim(0, room * axes.get_ylim()[1])
    axes.text(0.5, 0.97, "\n".join(texts), transform=axes.transAxes, ha="center", va="top", fontsize=LEAST, linespacing=1.1)


def _draw_credible_regions(axes: Axes, across: SampledQuantity, up: SampledQuantity) -> None:
    """Fill the smallest areas that hold 68 % and 95 % of the draws of two quantities."""
    from corner import hist2d

    hist2d(
        across.draws.ravel(),
        up.draws.ravel(),
        BINS,
        (across.limits(SHARE), up.limits(SHARE)),
        levels=tuple(FILLS),
        smooth=SMOOTHING * across.draws.size ** (-1 / 6),
        ax=axes,
        color=BLUE,
        quiet=True,
        plot_datapoints=False,
        plot_density=False,
        fill_contours=True,
        no_fill_contours=True,  # under those that are filled
        contour_kwargs={"linewidths": 0.6},
        contourf_kwargs={"colors": ["white", *reversed(FILLS.values())]},
    )


def _label_axes(figure: Figure, below: Axes, left: Axes | None, label: str, apart: float, upright: float) -> None:
    """Write numbers and a name below a column of panels, and left of a row.

    Args:
        figure: The page.
        below: The lowest panel of the column.
        left: The first panel of the row; None on the first row.
        label: The name.
        apart: From the axis to a name on its left [in].
        upright: Height of the numbers below, where they stand upright, else 0 [in].
    """
    under = 0.2 + max(0.0, upright - UPRIGHT)
    number_below(below, upright=upright > 0)
    below.set_xlabel(label, fontsize=SMALL, va="top")
    if left:
        number_left(left)
        left.set_ylabel(label, fontsize=SMALL, va="center")
        place_labels(figure, left, apart, under)
    place_labels(figure, below, apart, under)


def _remarks(data: Pairs, shown: int) -> list[str]:
    """Return what the key says beside the colors."""
    remarks = ["Dashed: median and 90 % interval"]
    if data.best:
        remarks.append(f"Optimum: best {data.best}")
    if shown < len(data.quantities):
        remarks.append(f"{shown} of {len(data.quantities)} parameters shown")
    return remarks


def _draw_legend(first: Axes, remarks: list[str], room: float) -> None:
    """Write the key into the empty corner right of the first panel."""
    entries = [area_entry(f"{100 * share:.0f} % probability", color) for share, color in FILLS.items()]
    entries += [line_entry(wrap_words(remark, room)) for remark in remarks]
    first.legend(handles=entries, loc="upper left", bbox_to_anchor=(1.1, 1.0), borderaxespad=0, labelspacing=0.25)


def _select_quantities(data: Pairs, most: int) -> list[SampledQuantity]:
    """Return at most so many quantities, the optimum among them."""
    every, last = data.quantities, 2 if data.best and most > 2 else 0
    return every if len(every) <= most else every[: most - last] + every[len(every) - last :]


def make_pair_charts(data: Pairs) -> tuple[Chart, ...]:
    """Return the chart of each pair of quantities, the most correlated first.

    Args:
        data: Data of the figure.
    """
    draws = np.stack([quantity.draws.ravel() for quantity in data.quantities])
    with np.errstate(invalid="ignore", divide="ignore"):  # of one that never moves
        correlation = np.nan_to_num(np.corrcoef(draws))
    rows, columns = np.tril_indices(len(draws), -1)
    order = np.argsort(-np.abs(correlation[rows, columns]), kind="stable")
    return tuple(
        _make_pair_chart(data.quantities[column], data.quantities[row], float(correlation[row, column]))
        for row, column in zip(rows[order].tolist(), columns[order].tolist(), strict=True)
    )


def describe_pair_charts(data: Pairs) -> str:
    """Describe the charts, two quantities at a time."""
    return (
        "Two parameters of the posterior, bench errors included, against each other, the most correlated first. Dark and "
        "light: the smallest areas that hold the truth with 68 % and 95 % probability; a long slanted area means that the "
        "measurements determine a combination of the two better than either. Upright line: median. "
        f"{explain_symbols((q.symbol, q.meaning) for q in data.quantities)}"
        f"n = {data.quantities[0].draws.size} draws from the posterior."
    )


def _make_pair_chart(across: SampledQuantity, up: SampledQuantity, correlation: float) -> Chart:
    """Return the chart of two quantities, with the smallest areas that hold 68 % and 95 % of their draws."""
    x, edges = find_region_edges(across, up)
    series = []
    for share in reversed(FILLS):
        words = f"{100 * share:.0f} % probability"
        series += [Series(words, "low", "blue", edges[share][0]), Series(words, "high", "blue", edges[share][1])]
    labels = [" ".join(to_plain_text(quantity.label).split()) for quantity in (across, up)]
    names = [to_plain_text(quantity.symbol) or label for quantity, label in zip((across, up), labels, strict=True)]
    median = float(np.median(across.draws))
    line = Span(f"{MEDIAN} of {names[0]}", "vermillion", median, median)
    name = f"{names[0]} and {names[1]}, correlation {correlation:.2f}".replace("-", "\N{MINUS SIGN}")
    return Chart(name, labels[0], labels[1], (SeriesGroup(x, tuple(series)),), (line,))


def find_region_edges(
    across: SampledQuantity, up: SampledQuantity
) -> tuple[np.ndarray, dict[float, tuple[np.ndarray, np.ndarray]]]:
    """Return the lower and upper edge of the smallest areas that hold a share of the draws of two quantities.

    Like those of the corner plot they are cut out of a smoothed histogram, here where they hold that share of the draws
    themselves. An area with a gap in it is shown without.

    Args:
        across: The quantity along the axis.
        up: The other.

    Returns:
        Places along the axis, and lower and upper edge there by share (`FILLS`); NaN where the area is not.
    """
    n = across.draws.size
    counts, x_edges, y_edges = np.histogram2d(
        across.draws.ravel(), up.draws.ravel(), FINER * BINS, (across.limits(SHARE), up.limits(SHARE))
    )
    width = FINER * SMOOTHING * n ** (-1 / 6)
    reach = round(4 * width)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    smooth = np.pad(counts, reach, mode="symmetric")
    for axis in (0, 1):
        smooth = np.apply_along_axis(np.convolve, axis, smooth, kernel / kernel.sum(), mode="valid")
    x, y = ((edges[1:] + edges[:-1]) / 2 for edges in (x_edges, y_edges))
    falling = np.argsort(-smooth, axis=None)
    held = np.cumsum(counts.ravel()[falling]) / counts.sum()
    levels = {share: smooth.ravel()[falling[int(np.searchsorted(held, share))]] for share in FILLS}
    return x, {share: _edges_along(smooth, y, level) for share, level in levels.items()}


def _edges_along(counts: np.ndarray, y: np.ndarray, level: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest place at which each row of smoothed counts crosses a level; NaN where it does not."""
    edges = np.full((2, len(counts)), np.nan)
    for i, row in enumerate(counts):
        above = np.flatnonzero(row >= level)
        if len(above):
            edges[:, i] = _cross(row, y, level, above[0], -1), _cross(row, y, level, above[-1], 1)
    return edges[0], edges[1]


def _cross(row: np.ndarray, y: np.ndarray, level: float, inside: int, step: int) -> float:
    """Return where a row falls below a level beyond a place inside, between that place and the next."""
    outside = inside + step
    if not 0 <= outside < len(row):
        return float(y[inside])
    part = (row[inside] - level) / (row[inside] - row[outside])
    return float(y[inside] + part * (y[outside] - y[inside]))
