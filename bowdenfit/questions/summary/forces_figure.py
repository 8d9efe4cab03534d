"""Output against input force with the law that was fitted, what readings are off it, and the apparent friction by the load."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.curves import draw_quantiles, name_band
from bowdenfit.plots.layout import BOTTOM, RIGHT, axes_at, empty_page, legend_above, place_labels, wrap_words
from bowdenfit.plots.panels import make_logarithmic
from bowdenfit.plots.style import (
    GRAY,
    GREEN,
    LEAST_SQUARES,
    LIGHT,
    SMALL,
    VERMILLION,
    WIDE,
    WRAP_ANGLE,
    in_paper_style,
)
from bowdenfit.questions.summary.apparent_friction import beyond_the_axis, draw_apparent
from bowdenfit.questions.summary.forces_by_bend import draw_by_bend, limits_of_bends
from bowdenfit.questions.summary.forces_marks import MARK, RETURN_DASHES, colored_places, draw_readings, where_read
from bowdenfit.questions.summary.forces_shown import STROKES, Forces, forces_shown
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Forces at both ends of the cable"
MAIN, STRIP, GAP, ACROSS, LEFT = 2.3, 0.85, 0.12, 0.88, 0.78  # in
LABEL = 0.56  # in, from the axes to their names: numbers of many digits stand between
VERDICT_ROW, VERDICT_ROWS = 0.14, 3  # in, and how many at most
LEAST_WIDTH = 2.6  # in, of a panel with its labels
NO_FRICTION = (0, (6, 1.5, 1, 1.5))
ROOM = 1.15


def data(fit: Record) -> Forces | None:
    """What is shown; None without a table of forces."""
    return forces_shown(fit)


def caption(forces: Forces) -> str:
    """What is drawn, in plain words."""
    n = forces.count or sum(len(here.stroke) for here in forces.places)
    band = "lines: medians, with the intervals that hold them with 90 % probability" if len(forces.places[0].law) > 1 else (
        "lines: least squares"
    )
    beyond = beyond_the_axis(forces)
    edge = f"On its edge: {counted(beyond, 'reading')} beyond it. " if beyond else ""
    return (
        f"Output against {'the wrap angle, all about one input force' if forces.by_bend else 'input force'}, a color for each "
        f"bend; {band}. Below: how far each reading is off its line, in percent, "
        "with the band in which nine of ten single readings should lie. Beside: the friction coefficient that each reading by "
        f"itself would have by the capstan equation; where that equation holds it is the same at all loads. {edge}"
        f"n = {counted(n, 'reading')}."
    )


@in_paper_style
def draw(forces: Forces, width: float | None = None) -> Figure:
    """Output against input with a strip of residuals below; beside them the apparent coefficient against the load."""
    page = width or WIDE
    said = wrap_words(_verdict(forces), page - LEFT - RIGHT + LABEL, most=VERDICT_ROWS)
    figure, (main, strip, beside) = _panels(page, 0.06 + VERDICT_ROW * (1 + said.count("\n")))
    if forces.logarithmic:
        for axes, name, value in ((main, "x", "input_force"), (main, "y", "output_force"), (beside, "x", "input_force")):
            read = np.concatenate([getattr(here, value) for here in forces.places])
            make_logarithmic(axes, name, float(read.max() / read.min()))
    _main(main, forces)
    _strip(strip, forces)
    draw_apparent(beside, forces)
    inner = page * main.get_position().width
    for axes in (main, strip, beside):
        place_labels(figure, axes)
        axes.yaxis.set_label_coords(-LABEL / inner, 0.5)
    color = GREEN if forces.trusted else VERMILLION
    main.set_title(said, loc="left", color=color, fontsize=SMALL, x=-LABEL / inner)
    legend_above(figure, [main, strip, beside], columns=4)
    return figure


def _panels(page: float, top: float) -> tuple[Figure, list[Axes]]:
    """Output with its strip, and the coefficient beside them, or below where the page is narrow."""
    beside = page >= 2 * LEAST_WIDTH
    inner = (page - LEFT - RIGHT - ACROSS) / 2 if beside else page - LEFT - RIGHT
    lower = 0.0 if beside else MAIN + BOTTOM + 2 * GAP
    figure = empty_page(page, top + MAIN + GAP + STRIP + BOTTOM + lower)
    main = axes_at(figure, LEFT, lower + BOTTOM + STRIP + GAP, inner, MAIN)
    strip = axes_at(figure, LEFT, lower + BOTTOM, inner, STRIP, sharex=main)
    left, tall = (LEFT + inner + ACROSS, MAIN + GAP + STRIP) if beside else (LEFT, MAIN)
    return figure, [main, strip, axes_at(figure, left, BOTTOM, inner, tall)]


def _verdict(forces: Forces) -> str:
    """The verdict in a sentence."""
    if forces.trusted:
        return f"The readings follow the fitted law ({forces.model})."
    return f"Not trusted. {forces.verdict.partition(';')[0].rstrip('.')}."


def _main(axes: Axes, forces: Forces) -> None:
    """Output against input."""
    every = np.concatenate([here.stroke for here in forces.places])
    if forces.by_bend:
        draw_by_bend(axes, forces, "law")
    for here, color, _ in [] if forces.by_bend else colored_places(forces):
        for i, stroke in enumerate(STROKES):
            if np.any(here.stroke == stroke) or not np.any(here.stroke):
                line = "-" if stroke > 0 else RETURN_DASHES
                draw_quantiles(axes, *where_read(here, here.law[:, i]), color, linestyle=line, linewidth=1.0)
    load = forces.places[0].load
    bends, pulled = limits_of_bends(forces) if forces.by_bend else (0.0, 0.0), forces.places[0].input_force.mean()
    unloaded = (bends, (pulled, pulled)) if forces.by_bend else (load, load)
    axes.plot(*unloaded, color=GRAY, linewidth=0.8, linestyle=NO_FRICTION, label="No friction")
    law = forces.places[0].law
    what = LEAST_SQUARES if len(law) == 1 else "Law"
    for stroke, words, line, fill in ((1, "pulling", "-", GRAY), (-1, "returning", RETURN_DASHES, "white")):
        if np.any(every == stroke):
            axes.plot(
                [], [], linestyle=line, marker="o", color=GRAY, markerfacecolor=fill, markersize=MARK, label=f"{what}, {words}"
            )
    if np.any(every == 0):
        axes.plot([], [], "x", color=GRAY, markersize=MARK, label="Held")
    name_band(axes, law)
    draw_readings(axes, forces, "output_force", name=True)
    if not all(here.shown for here in forces.places):
        axes.plot([], [], ".", color=GRAY, label="Other bends")
    if forces.count:
        shown = sum(len(here.stroke) for here in forces.places)
        axes.plot([], [], " ", label=f"{shown:,} of {forces.count:,} readings shown")
    axes.set_xlim(*(bends if forces.by_bend else (load[0] if forces.logarithmic else 0.0, load[-1])))
    out = np.concatenate([here.output_force for here in forces.places])
    axes.set_ylim((0.7 * out.min(), 1.4 * out.max()) if forces.logarithmic else (0.0, 1.08 * max(out.max(), load[-1])))
    axes.set_ylabel("Output force (N)")
    axes.tick_params(labelbottom=False)


def _strip(axes: Axes, forces: Forces) -> None:
    """What readings are off the law."""
    off = np.concatenate([here.off for here in forces.places])
    limit = ROOM * float(np.nanmax(np.abs(off), initial=0.0)) or 1.0
    if len(forces.spread):
        read = np.concatenate([here.input_force for here in forces.places])
        loads = np.linspace(read.min(), read.max(), 4 * len(forces.spread_load))
        spread = np.minimum(np.interp(loads, forces.spread_load, forces.spread), 10 * limit)
        if forces.by_bend:
            every = np.concatenate([here.bend for here in forces.places])
            loads = np.linspace(every.min(), every.max(), len(loads))
        axes.fill_between(
            loads, -spread, spread, color=LIGHT, linewidth=0, zorder=0.4, label="9 of 10 readings"
        )
    axes.axhline(0.0, color=GRAY, linewidth=0.8, zorder=0.9)
    draw_readings(axes, forces, "off")
    axes.set_ylim(-limit, limit)
    axes.set(xlabel=WRAP_ANGLE if forces.by_bend else "Input force (N)", ylabel="Residual (%)")
    axes.locator_params(axis="y", nbins=5)
