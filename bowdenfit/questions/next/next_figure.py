"""What to measure next: how well the answer would be known after each candidate."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.kinds.terms import candidate_kinds
from bowdenfit.plots.curves import route_limits, shade_outside
from bowdenfit.plots.layout import LEFT, TITLE, legend_above, panels, text_width, wrap_words
from bowdenfit.plots.panels import show_plain_numbers
from bowdenfit.plots.style import BLACK, GRAY, SERIES_COLORS, SERIES_LINES, SERIES_MARKERS, axis_label, in_paper_style
from bowdenfit.questions.next.words import TITLE as NEXT_TITLE
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.next.answer import NextMeasurement

HEADING = NEXT_TITLE
WIDTH = 5.6  # in
MAX_ROWS = 14  # candidates in the figure without a route
ROW_HEIGHT = 0.19  # in, of each of them
LABEL_WIDTH = 2.8  # in, of a label


def caption(ranking: NextMeasurement) -> str:
    """Say what is drawn, in plain words."""
    best = f" Circle: {ranking.best.words}, most worth measuring." if ranking.best is not None else ""
    gray = " Gray: outside the range of the curves." if _is_along_route(ranking) and ranking.route_label else ""
    return (
        f"How well {ranking.answer.words} would be known after one more measurement, as one standard deviation, "
        "averaged over the readings that it may give; bars: two standard errors of that estimate. Dashed: the present "
        "uncertainty."
        f"{best}{gray} n = {counted(len(ranking.ranked), 'measurement')} considered."
    )


@in_paper_style
def draw(ranking: NextMeasurement) -> Figure:
    """Draw the expected standard deviation against the route, a line for each kind; without a route, a row a candidate."""
    return _draw_along_route(ranking) if _is_along_route(ranking) else _draw_rows(ranking)


def _is_along_route(ranking: NextMeasurement) -> bool:
    """Whether all candidates have places along the route, and nothing else that tells them apart."""
    along = [r for r in ranking.ranked if math.isfinite(r.candidate.route) and math.isnan(r.candidate.load)]
    return len(along) == len(ranking.ranked) and len({r.candidate.route for r in along}) > 1


def _axis_label(ranking: NextMeasurement) -> str:
    """Return what the axis shows."""
    return axis_label("Standard deviation afterwards", ranking.answer.unit)


def _set_title(axes: Axes, ranking: NextMeasurement, start: float = 0.0) -> None:
    """Write what the figure is about, from a place left of the axes on."""
    words = ranking.answer.words
    first = words[0].upper() if len(words.split()) > 1 else words[0]
    axes.set_title(f"{first}{words[1:]}: how well it would be known", loc="left", x=start)


def _limits(ranking: NextMeasurement) -> tuple[float, float]:
    """Return limits of an axis that shows what the candidates change, and does not make it look like more than it is."""
    now, smallest = ranking.answer.sd, min(r.sd for r in ranking.ranked)
    change = max(now - smallest, 0.05 * now)
    return max(0.0, smallest - 1.5 * change), now + 0.3 * change


def _draw_along_route(ranking: NextMeasurement) -> Figure:
    along = ranking.ranked
    figure, (axes,) = panels([2.4], 1, TITLE, (0, 0), WIDTH)
    kinds = [kind for kind in candidate_kinds().values() if any(r.candidate.kind == kind.name for r in along)]
    for i, kind in enumerate(kinds):
        here = sorted((r for r in along if r.candidate.kind == kind.name), key=lambda r: r.candidate.route)
        route, sd, error = (
            np.array(v) for v in zip(*((r.candidate.route, r.sd, 2 * r.sd_error) for r in here), strict=True)
        )
        axes.errorbar(
            route, sd, error, marker=SERIES_MARKERS[i], linestyle=SERIES_LINES[i % len(SERIES_LINES)],
            color=SERIES_COLORS[i], capsize=2, linewidth=1.1, elinewidth=0.7, label=f"{kind.heading} measured here next",
        )  # fmt: skip
    shade_outside(
        axes, ranking.route_range, route_limits(ranking.route_range, np.array([r.candidate.route for r in along]))
    )
    _draw_reference(axes, ranking, horizontal=True)
    axes.set(xlabel=ranking.route_label, ylabel=_axis_label(ranking))
    axes.set_ylim(*_limits(ranking))
    show_plain_numbers(axes, "y")
    _set_title(axes, ranking)
    legend_above(figure, [axes], columns=2)
    return figure


def _draw_reference(axes: Axes, ranking: NextMeasurement, horizontal: bool) -> None:
    """Draw the standard deviation as things are, and the best candidate."""
    line = axes.axhline if horizontal else axes.axvline
    line(ranking.answer.sd, color=GRAY, linestyle="--", linewidth=1.0, label="Present uncertainty")
    best = ranking.best
    if best is not None:
        point = (best.candidate.route, best.sd) if horizontal else (best.sd, 0)
        axes.plot(
            *point, "o", markersize=10, markerfacecolor="none", color=BLACK, zorder=4, label="Most worth measuring"
        )


def _draw_rows(ranking: NextMeasurement) -> Figure:
    """Draw a row for each of the best candidates."""
    best = ranking.ranked[:MAX_ROWS]
    names = [wrap_words(r.words, LABEL_WIDTH, most=1) for r in best]
    room = max(LEFT, 0.15 + max(map(text_width, names)))
    figure, (axes,) = panels([max(1.0, ROW_HEIGHT * (len(best) + 1))], 1, TITLE, (0, 0), WIDTH)
    box = axes.get_position()
    axes.set_position((room / WIDTH, box.y0, box.x1 - room / WIDTH, box.height))
    rows = np.arange(len(best))
    axes.errorbar(
        [r.sd for r in best], rows, xerr=[2 * r.sd_error for r in best], fmt="o", color=SERIES_COLORS[0], capsize=2,
        markersize=4, label="Expected after this measurement",
    )  # fmt: skip
    _draw_reference(axes, ranking, horizontal=False)
    axes.set_yticks(rows, names)
    axes.set_ylim(len(best) - 0.4, -0.6)
    axes.set_xlim(*_limits(ranking))
    show_plain_numbers(axes, "x")
    axes.locator_params(axis="x", nbins=4)
    axes.set_xlabel(_axis_label(ranking))
    _set_title(axes, ranking, -0.9 * room / (WIDTH * axes.get_position().width))
    axes.grid(visible=False, axis="y")
    legend_above(figure, [axes], columns=2)
    return figure
