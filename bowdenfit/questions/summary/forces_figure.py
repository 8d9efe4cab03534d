"""Output against input force with the law that was fitted, what readings are off it, and the apparent friction by the load."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import describe_left_out
from bowdenfit.plots.curves import draw_quantiles, middle, name_band
from bowdenfit.plots.layout import BOTTOM, RIGHT, axes_at, empty_page, legend_above, place_labels, wrap_words
from bowdenfit.plots.panels import draw_left_out, make_logarithmic
from bowdenfit.plots.style import (
    BLACK,
    GRAY,
    GREEN,
    LEAST_SQUARES,
    LIGHT,
    SERIES_COLORS,
    SERIES_MARKERS,
    SMALL,
    VERMILLION,
    WIDE,
    WRAP_ANGLE,
    in_paper_style,
)
from bowdenfit.questions import summary
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
ROOM = 1.15  # times the largest residual that the axis shows
MARK, SMALL_MARK, MANY = 3.4, 2.0, 300  # pt, pt, and readings from which marks are small
RETURN_DASHES = (0, (4, 1.6))
EVEN = 1e-3  # of the ratio of two loads, within which they are as far from each other as others
CAPSTAN, CAPSTAN_DOTS = "Capstan equation", (0, (1, 1.2))
SAME_COEFFICIENT = 1e-3  # of a coefficient, within which it is the same
FROM_ZERO = 0.6  # lowest over highest coefficient below which the axis begins at 0
_MOST_BAND = 4  # times as much as the readings may the axis leave for a band, above and below
_OUTER = (0.02, 0.98)  # quantiles of the readings; the axis of the coefficient reaches as far beyond them as they are apart
STROKES = (1, -1)
ONE_BEND = 5.0  # deg, within which wrap angles count as one bend; readings of a bend scatter by a degree or two
_ONE_LOAD = 1.1  # ratio of the largest to the smallest load up to which readings count as taken at one load


@dataclass(frozen=True)
class ForcesAtBend:
    """Forces read at one bend, of one group.

    Args:
        label: Where, in words.
        input_force, output_force: Readings [N].
        stroke: +1 pulling, -1 return, 0 held.
        off: Output over that of the law, less 1 [%]; NaN of held readings.
        apparent: Apparent friction coefficient s log(F_in/F_out) / theta; NaN of held readings.
        load: Load of the lines [N].
        law: Quantiles of the output force, pulling and returning: (quantile, stroke, load) [N].
        apparent_law: The same of the apparent coefficient.
        capstan: The apparent coefficient that describes its readings best, were it the same at all loads.
        shown: Whether it has a line and a color of its own.
        bend: Wrap angle of each reading [deg]; empty where it is of no interest.
    """

    label: str
    input_force: np.ndarray
    output_force: np.ndarray
    stroke: np.ndarray
    off: np.ndarray
    apparent: np.ndarray
    load: np.ndarray
    law: np.ndarray
    apparent_law: np.ndarray
    capstan: float
    shown: bool
    bend: np.ndarray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class ForcesData:
    """A table of forces with its law.

    Args:
        places: Bends and groups, from the least bend on.
        spread_load: Loads at which it is known how readings scatter [N].
        spread: How far nine of ten single readings lie from the law, to either side [%]; empty without draws.
        model: The friction model.
        trusted: Whether the verdict is good.
        verdict: In words.
        logarithmic: Whether loads are so different that axes are logarithmic.
        count: How many readings there are, where not all are shown; else 0.
        left_out: Input and output force of the readings that the user leaves out [N].
    """

    places: tuple[ForcesAtBend, ...]
    spread_load: np.ndarray
    spread: np.ndarray
    model: str
    trusted: bool
    verdict: str
    logarithmic: bool
    count: int = 0
    left_out: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))

    @property
    def by_bend(self) -> bool:
        """Whether all readings are about one load, so that the wrap angle is what tells them apart."""
        load = np.concatenate([here.input_force for here in self.places])
        bends = [float(here.bend.mean()) for here in self.places if len(here.bend)]
        one = bool(load.max() < _ONE_LOAD * load.min())
        return one and len(bends) == len(self.places) and bool(np.ptp(bends) > ONE_BEND)


def data(fit: Record) -> ForcesData | None:
    """Return readings and law of a table of forces; None without one."""
    return summary.collect_forces(fit)


def caption(forces: ForcesData) -> str:
    """Describe what is drawn, in plain words."""
    n = forces.count or sum(len(here.stroke) for here in forces.places)
    band = "lines: medians, with the intervals that hold them with 90 % probability" if len(forces.places[0].law) > 1 else (
        "lines: least squares"
    )
    beyond = count_beyond_axis(forces)
    edge = f"On its edge: {counted(beyond, 'reading')} beyond it. " if beyond else ""
    return (
        f"Output against {'the wrap angle, all about one input force' if forces.by_bend else 'input force'}, a color for each "
        f"bend; {band}. Strip below: residuals, each reading relative to its line, in percent, with the band in which nine of "
        "ten single readings should lie. Last panel: the apparent friction coefficient, that of each reading by itself by the "
        f"capstan equation; where that equation holds, it is the same at all loads. {edge}"
        f"n = {counted(n, 'reading')}. {describe_left_out(forces.left_out)}"
    ).rstrip()


@in_paper_style
def draw(forces: ForcesData, width: float | None = None) -> Figure:
    """Draw output against input force with residuals below, and the apparent coefficient against the load beside them."""
    page = width or WIDE
    verdict_lines = wrap_words(_describe_verdict(forces), page - LEFT - RIGHT + LABEL, most=VERDICT_ROWS)
    figure, (main, strip, beside) = _make_panels(page, 0.06 + VERDICT_ROW * (1 + verdict_lines.count("\n")))
    if forces.logarithmic:
        for axes, name, value in ((main, "x", "input_force"), (main, "y", "output_force"), (beside, "x", "input_force")):
            read = np.concatenate([getattr(here, value) for here in forces.places])
            make_logarithmic(axes, name, float(read.max() / read.min()))
    _draw_forces(main, forces)
    _draw_residuals(strip, forces)
    draw_apparent_friction(beside, forces)
    inner = page * main.get_position().width
    for axes in (main, strip, beside):
        place_labels(figure, axes)
        axes.yaxis.set_label_coords(-LABEL / inner, 0.5)
    color = GREEN if forces.trusted else VERMILLION
    main.set_title(verdict_lines, loc="left", color=color, fontsize=SMALL, x=-LABEL / inner)
    legend_above(figure, [main, strip, beside], columns=4)
    return figure


def _make_panels(page: float, top: float) -> tuple[Figure, list[Axes]]:
    """Return the figure with panels for the output, its residuals, and the coefficient beside or below."""
    beside = page >= 2 * LEAST_WIDTH
    inner = (page - LEFT - RIGHT - ACROSS) / 2 if beside else page - LEFT - RIGHT
    lower = 0.0 if beside else MAIN + BOTTOM + 2 * GAP
    figure = empty_page(page, top + MAIN + GAP + STRIP + BOTTOM + lower)
    main = axes_at(figure, LEFT, lower + BOTTOM + STRIP + GAP, inner, MAIN)
    strip = axes_at(figure, LEFT, lower + BOTTOM, inner, STRIP, sharex=main)
    left, tall = (LEFT + inner + ACROSS, MAIN + GAP + STRIP) if beside else (LEFT, MAIN)
    return figure, [main, strip, axes_at(figure, left, BOTTOM, inner, tall)]


def _describe_verdict(forces: ForcesData) -> str:
    """Return the verdict in a sentence."""
    if forces.trusted:
        return f"The readings follow the fitted law ({forces.model})."
    return f"Not trusted. {forces.verdict.partition(';')[0].rstrip('.')}."


def _draw_forces(axes: Axes, forces: ForcesData) -> None:
    """Draw output against input force."""
    every = np.concatenate([here.stroke for here in forces.places])
    if forces.by_bend:
        draw_against_wrap_angle(axes, forces, "law")
    for here, color, _ in [] if forces.by_bend else assign_colors(forces):
        for i, stroke in enumerate(STROKES):
            if np.any(here.stroke == stroke) or not np.any(here.stroke):
                line = "-" if stroke > 0 else RETURN_DASHES
                draw_quantiles(axes, *cut_to_read_loads(here, here.law[:, i]), color, linestyle=line, linewidth=1.0)
    load = forces.places[0].load
    bends, pulled = find_wrap_angle_limits(forces) if forces.by_bend else (0.0, 0.0), forces.places[0].input_force.mean()
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
    if not forces.by_bend:
        draw_left_out(axes, forces.left_out)
    axes.set_ylabel("Output force (N)")
    axes.tick_params(labelbottom=False)


def _draw_residuals(axes: Axes, forces: ForcesData) -> None:
    """Draw the residuals of the readings."""
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


def assign_colors(forces: ForcesData) -> list[tuple[ForcesAtBend, str, str]]:
    """Return the places with lines of their own, with color and marker."""
    shown = [here for here in forces.places if here.shown]
    return [(here, SERIES_COLORS[i % 8], SERIES_MARKERS[i % 8]) for i, here in enumerate(shown)]


def draw_readings(axes: Axes, forces: ForcesData, value: str, name: bool = False) -> None:
    """Draw readings of all places: filled while pulling, open while returning, crosses where held, gray without a line."""
    size = MARK if sum(len(here.stroke) for here in forces.places) < MANY else SMALL_MARK
    low, high = axes.get_ylim() if value == "apparent" else (-np.inf, np.inf)
    styles = {id(here): (color, marker) for here, color, marker in assign_colors(forces)}
    for here in forces.places:
        color, marker = styles.get(id(here), (GRAY, "."))
        y = np.clip(getattr(here, value), low, high)
        for stroke, mark, fill in ((1, marker, color), (-1, marker, "white"), (0, "x", color)):
            selected = (here.stroke == stroke) & np.isfinite(y)
            if selected.any():
                x = here.bend if forces.by_bend else here.input_force
                axes.plot(
                    x[selected], y[selected], mark, color=color, markerfacecolor=fill, markersize=size, markeredgewidth=0.7,
                    zorder=3, clip_on=value != "apparent",
                )  # fmt: skip
        if name and here.shown and here.label:
            axes.plot([], [], marker=marker, color=color, markersize=MARK, label=here.label)


def cut_to_read_loads(here: ForcesAtBend, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return loads and quantiles of a line from the lowest reading of the place to its highest."""
    loads = np.linspace(here.input_force.min(), here.input_force.max(), len(here.load))
    if here.load[1] / here.load[0] < here.load[-1] / here.load[-2] + EVEN:  # evenly spaced in the logarithm
        loads = np.geomspace(loads[0], loads[-1], len(loads))
    return loads, np.stack([np.interp(loads, here.load, row) for row in line])


def draw_against_wrap_angle(axes: Axes, forces: ForcesData, value: str) -> None:
    """Draw the law at the load of the readings, through all bends.

    Args:
        axes: Panel to draw on.
        forces: Forces to draw.
        value: "law" for output forces, "apparent_law" for coefficients.
    """
    bends = sorted(forces.places, key=lambda here: float(here.bend.mean()))
    angles = np.array([here.bend.mean() for here in bends])
    for i, stroke in enumerate(STROKES):
        if any(np.any(here.stroke == stroke) for here in bends):
            rows = [
                [np.interp(here.input_force.mean(), here.load, row) for row in getattr(here, value)[:, i]] for here in bends
            ]
            draw_quantiles(axes, angles, np.array(rows).T, GRAY, linestyle="-" if stroke > 0 else RETURN_DASHES, linewidth=1.0)


def find_wrap_angle_limits(forces: ForcesData) -> tuple[float, float]:
    """Return limits of an axis from no bend to beyond the largest."""
    return 0.0, 1.05 * max(float(here.bend.max()) for here in forces.places)


def draw_apparent_friction(axes: Axes, forces: ForcesData) -> None:
    """Draw the apparent coefficient against the load, beside the horizontal line of the capstan equation."""
    load = forces.places[0].load
    axes.set_xlim(*(find_wrap_angle_limits(forces) if forces.by_bend else (load[0] if forces.logarithmic else 0.0, load[-1])))
    axes.set_ylim(*_find_coefficient_limits(forces))
    if forces.by_bend:
        draw_against_wrap_angle(axes, forces, "apparent_law")
    bent = [place for place in assign_colors(forces) if np.isfinite(place[0].capstan)]
    colored, any_curved = [] if forces.by_bend else bent, False
    one_line = colored and _lines_coincide(forces)
    for here, color in [(colored[0][0], BLACK)] if one_line else [(here, color) for here, color, _ in colored]:
        for i, stroke in enumerate(STROKES):
            if np.any(here.stroke == stroke):
                line = "-" if stroke > 0 else RETURN_DASHES
                draw_quantiles(axes, *cut_to_read_loads(here, here.apparent_law[:, i]), color, linestyle=line, linewidth=1.0)
        if np.isfinite(here.capstan) and not _is_constant(here):
            axes.axhline(here.capstan, color=color, linestyle=CAPSTAN_DOTS, linewidth=1.1)
            any_curved = True
    axes.plot([], [], color=GRAY, linestyle=CAPSTAN_DOTS if any_curved else "-", linewidth=1.1, label=CAPSTAN)
    draw_readings(axes, forces, "apparent")
    axes.locator_params(axis="y", nbins=6)
    axes.set(xlabel=WRAP_ANGLE if forces.by_bend else "Input force (N)", ylabel="Apparent friction coefficient")


def _lines_coincide(forces: ForcesData) -> bool:
    """Return whether several places have one coefficient, so that their lines are one."""
    lines = np.array([middle(here.apparent_law) for here in forces.places if here.shown and np.isfinite(here.capstan)])
    return bool(len(lines) > 1 and np.ptp(lines) < SAME_COEFFICIENT * np.max(np.abs(lines)))


def _is_constant(here: ForcesAtBend) -> bool:
    """Return whether the law is the capstan equation's: the same coefficient at all loads."""
    line = middle(here.apparent_law)
    return bool(np.ptp(line) < SAME_COEFFICIENT * np.max(np.abs(line)))


def count_beyond_axis(forces: ForcesData) -> int:
    """Count the readings that are drawn on the edge, because their coefficients lie beyond it."""
    readings = np.concatenate([here.apparent for here in forces.places])
    low, high = _find_coefficient_limits(forces)
    return int(np.sum((readings < low) | (readings > high)))


def _find_coefficient_limits(forces: ForcesData) -> tuple[float, float]:
    """Return limits that show the readings but for a few far ones, and the laws with their bands."""
    readings = np.concatenate([here.apparent for here in forces.places])
    readings = readings[np.isfinite(readings)]
    if not len(readings):
        return 0.0, 1.0
    lines = [value for here in forces.places if here.shown for value in (here.capstan, *middle(here.apparent_law)[0])]
    outer = np.quantile(readings, _OUTER)
    far = np.ptp(outer)
    outer = np.clip([readings.min(), readings.max()], outer[0] - far, outer[1] + far)
    low, high = min(*outer, np.nanmedian(lines)), max(*outer, np.nanmedian(lines))
    bands = np.array([here.apparent_law[[0, -1]] for here in forces.places if here.shown])
    reach = max(_MOST_BAND * (high - low), abs(high))
    low, high = max(min(low, np.nanmin(bands)), low - reach), min(max(high, np.nanmax(bands)), high + reach)
    room = 0.15 * (high - low) or 0.1 * abs(high)
    return (low - room if low > FROM_ZERO * high else min(0.0, low - room)), high + room
