"""Force recordings over time: both forces, phases, what the fit says, and what was left out; and the same as charts."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.curves import choose_evenly, note_shown_count
from bowdenfit.plots.layout import count_columns, legend_above
from bowdenfit.plots.panels import LEAST_WIDTH, draw_marks, extremes, label_outer, panels_with_limits, span
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    GRAY,
    GREEN,
    LEAST_SQUARES,
    LEFT_OUT,
    ORANGE,
    PURPLE,
    VERMILLION,
    WIDE,
    WIDE_INTERVAL,
    in_paper_style,
)
from bowdenfit.questions import recorded as room
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.recorded.traces import RecordingTrace
    from bowdenfit.results.record import Record
from collections.abc import Callable, Iterator

from bowdenfit.pages.section import Chart, Series, SeriesGroup, Span

HEADING = "Recordings over time"
POINTS = 3200  # of each line, all panels together, which is what a page can show
GAP_STEPS = 5  # times the median step between blocks, beyond which there is a gap
HEIGHT, ROW_GAP, LEAST_HEIGHT = 3.5, 0.42, 0.65  # in, of all panels, from one row to the next, of one panel at least
MOST_IN_TWO = 4  # panels in two columns
MOST_CYCLES = 8  # of each recording over time
PER_BLOCK = ("time", "input_force", "output_force", "stroke", "saturated", "predicted", "fitted")
FORCE, TIME = "Force (N)", "Time from the start (s)"
# stroke, name and fill, which differ in lightness too
PHASES = ((1, "Pulling", "#F1F6FC"), (-1, "Returning", "#F3E4CE"), (0, "Switching or held", "#D4D4D4"))
LOOP_PHASES = ("Moving forward", "Moving back", "Between")
BY_USER = "by the user"  # see `clock.KINDS`
FLAGS = {
    "dropout": ("x", VERMILLION), "spike": ("^", PURPLE), "saturated": ("s", ORANGE), "quiet": (".", GRAY),
    BY_USER: ("o", GRAY),
}  # fmt: skip
OTHER_FLAG = ("+", GREEN)
MOST_CHARTS = 24  # recordings on a page
_CHART_POINTS = 6000  # points of all charts together
_MAX_LEFT_OUT = 300  # samples left out that a chart shows
_CHART_COLORS = {1: "pull", -1: "return", 0: "rest"}


@dataclass(frozen=True)
class OverTime:
    """One recording over time, and what the fit says of it.

    Args:
        name: Name of the recording.
        loop: Whether it is of a pull-pull loop.
        time: Middle of each block [s].
        input_force, output_force: Mean forces of each block [N].
        stroke: +1 pulling, -1 returning, 0 switching or held.
        saturated: Blocks at the end of a load cell's range.
        predicted: Output force [N] of each block that the cable gives at the measured input force, 5 %, 50 % and 95 %
            quantiles (first axis) over draws and over new mountings; one row, least squares', without draws; none before a fit.
        fitted: Output force [N] of each block with this run's own mounting effect; empty before a fit.
        flagged_kind, flagged_time, flagged_input, flagged_output: Samples left out: why, when [s], and what was read [N].
    """

    name: str
    loop: bool
    time: np.ndarray
    input_force: np.ndarray
    output_force: np.ndarray
    stroke: np.ndarray
    saturated: np.ndarray
    predicted: np.ndarray
    fitted: np.ndarray
    flagged_kind: tuple[str, ...]
    flagged_time: np.ndarray
    flagged_input: np.ndarray
    flagged_output: np.ndarray


def data(fit: Record) -> tuple[OverTime, ...] | None:
    """Return every recording of two blocks or more; None without any."""
    return tuple(_show_over_time(trace) for trace in room.trace_recordings(fit) if len(trace.block_numbers) > 1) or None


def _show_over_time(trace: RecordingTrace) -> OverTime:
    """Return a recording as it is shown over time."""
    recording, flagged = trace.recording, trace.recording.account.flagged
    blocks = (
        trace.time,
        trace.input_force,
        trace.output_force,
        trace.stroke,
        recording.blocks.saturated[trace.block_numbers],
    )
    left_out = flagged.kind, flagged.time, flagged.input_force, flagged.output_force
    return OverTime(recording.name, trace.is_loop, *blocks, trace.predicted, trace.fitted, *left_out)


def caption(recordings: tuple[OverTime, ...]) -> str:
    """Describe what is drawn, in plain words."""
    band = (
        "90 % predictive interval, for a new mounting"
        if len(recordings[0].predicted) > 1
        else "the dashed line is the least-squares prediction"
    )
    return (
        f"Both forces over time of {counted(len(recordings), 'recording')} (of many, some evenly chosen are drawn). Black: the "
        f"measured output; gray: the measured input; blue: the output predicted for this input ({band}); orange: the fit with "
        "this recording's own mounting. Shading: what the rope does. Marks: samples that were left out, by reason. "
        f"n = {sum(len(r.time) for r in recordings)} blocks of samples."
    )


@in_paper_style
def draw(recordings: tuple[OverTime, ...], width: float | None = None) -> Figure:
    """Draw input and output force [N] over time, what the cable would give at this input, and the samples left out."""
    columns = min(2 if len(recordings) <= MOST_IN_TWO else 3, count_columns(width or WIDE, 3, LEAST_WIDTH, 0.42))
    rows_with_room = int((HEIGHT + ROW_GAP) / (LEAST_HEIGHT + ROW_GAP))
    whole = choose_evenly(recordings, columns * rows_with_room)
    rows = -(-len(whole) // columns)
    height = (HEIGHT + ROW_GAP) / rows - ROW_GAP
    shown = [cut_to_first_cycles(r) for r in whole]
    times = [span([r.time - find_start(r), r.flagged_time - find_start(r)], room=0.0) for r in shown]
    forces = [_force_limits(r) for r in shown]
    figure, flat, columns = panels_with_limits([r.name for r in shown], times, forces, columns, height, WIDE, width)
    for axes, recording in zip(flat, shown, strict=True):
        _shade_phases(axes, recording)
        _draw_forces(axes, recording, POINTS // (2 * len(shown)))
        _mark_left_out(axes, recording)
    label_outer(flat, columns, TIME, FORCE)
    note_shown_count(flat[0], len(shown), len(recordings), "recordings")
    if any(len(a.time) < len(b.time) for a, b in zip(shown, whole, strict=True)):
        flat[0].plot([], [], " ", label=f"First {MOST_CYCLES} cycles shown")
    legend_above(figure, flat, columns=4)
    return figure


def cut_to_first_cycles(recording: OverTime) -> OverTime:
    """Return a recording up to the last of as many cycles as can be told apart over time."""
    sliding = np.flatnonzero(recording.stroke)
    turns = sliding[1:][np.diff(recording.stroke[sliding]) != 0]
    if len(turns) < 2 * MOST_CYCLES:
        return recording
    stop = int(turns[2 * MOST_CYCLES - 1])
    sample = recording.flagged_time < recording.time[stop]
    return dataclasses.replace(
        recording,
        **{name: getattr(recording, name)[..., :stop] for name in PER_BLOCK},
        **{name: getattr(recording, name)[sample] for name in ("flagged_time", "flagged_input", "flagged_output")},
        flagged_kind=tuple(np.array(recording.flagged_kind, dtype=str)[sample].tolist()),
    )


def find_start(recording: OverTime) -> float:
    """Return the time of the first block or sample [s]."""
    return float(min(recording.time[0], recording.flagged_time.min(initial=np.inf)))


def _force_limits(recording: OverTime) -> tuple[float, float]:
    """Return limits that show what was measured and fitted, and the interval unless it is far away."""
    low, high = span([recording.input_force, recording.output_force, recording.fitted])
    band_low, band_high = span([recording.predicted])
    room = 0.3 * (high - low)
    return max(min(low, band_low), low - room), min(max(high, band_high), high + room)


def _shade_phases(axes: Axes, recording: OverTime) -> None:
    """Shade the phases: pulling, returning, and neither."""
    names = LOOP_PHASES if recording.loop else tuple(name for _, name, _ in PHASES)
    for (value, _, fill), name in zip(PHASES, names, strict=True):
        spans = [(start, stop - start) for start, stop in find_phases(recording, value)]
        if spans:
            axes.broken_barh(
                spans, (0, 1), transform=axes.get_xaxis_transform(), facecolor=fill, linewidth=0, zorder=0.4, label=name
            )


def find_phases(recording: OverTime, stroke: int) -> list[tuple[float, float]]:
    """Return begin and end of every phase of a stroke [s], midway between blocks; gaps in the recording belong to none."""
    time = recording.time - find_start(recording)
    gap = find_gaps(time)
    change = np.union1d(np.flatnonzero(np.diff(recording.stroke)) + 1, gap)
    before, after = time[change - 1], time[change]
    middle, recorded = 0.5 * (before + after), ~np.isin(change, gap)
    starts = np.append(time[:1], np.where(recorded, middle, after))
    stops = np.append(np.where(recorded, middle, before), time[-1:])
    mask = recording.stroke[np.append(0, change)] == stroke
    return list(zip(starts[mask].tolist(), stops[mask].tolist(), strict=True))


def find_gaps(time: np.ndarray) -> np.ndarray:
    """Return the number of the first block after every gap."""
    steps = np.diff(time)
    return np.flatnonzero(steps > GAP_STEPS * np.median(steps)) + 1


def _draw_forces(axes: Axes, recording: OverTime, most: int) -> None:
    """Draw the measured, predicted and fitted forces, broken where nothing was recorded."""
    time = recording.time - find_start(recording)
    gaps = find_gaps(time)

    def broken(values: np.ndarray) -> np.ndarray:
        return np.insert(values.astype(float), gaps, np.nan)

    time, predicted = broken(time), [broken(q) for q in recording.predicted]

    def line(values: np.ndarray, **style: object) -> None:
        places = extremes(values, most)
        axes.plot(time[places], values[places], **style)  # type: ignore[arg-type]

    line(broken(recording.input_force), color=GRAY, linewidth=0.9, linestyle=(0, (4, 1)), label="Input")
    line(broken(recording.output_force), color=BLACK, linewidth=1.3, label="Output")
    if len(predicted) == 1:
        line(
            predicted[0], color=BLUE, linewidth=0.9, linestyle="--", label=f"Output predicted, {LEAST_SQUARES.lower()}"
        )
    else:
        at = extremes(predicted[-1], most)
        axes.fill_between(
            time[at], predicted[0][at], predicted[-1][at], color=BLUE, alpha=0.4, linewidth=0, zorder=1.5,
            label=f"Output predicted, {WIDE_INTERVAL}",
        )  # fmt: skip
    line(broken(recording.fitted), color=VERMILLION, linewidth=0.7, label="Output fitted")


def _mark_left_out(axes: Axes, recording: OverTime) -> None:
    """Mark samples left out, by kind, those beyond the axes or without a reading on their edge; and blocks at a range's end."""
    kinds, start = np.array(recording.flagged_kind, dtype=str), find_start(recording)
    for kind in dict.fromkeys(recording.flagged_kind):
        mask = kinds == kind
        x = np.tile(recording.flagged_time[mask] - start, 2)
        y = np.concatenate([recording.flagged_input[mask], recording.flagged_output[mask]])
        label, fill = (LEFT_OUT, "white") if kind == BY_USER else (f"Left out: {kind}", None)
        draw_marks(axes, x, y, FLAGS.get(kind, OTHER_FLAG), label, fill)
    at = recording.saturated.astype(bool)
    if at.any():
        on_edge = np.full(int(at.sum()), np.nan)
        draw_marks(
            axes, recording.time[at] - start, on_edge, FLAGS["saturated"], "Block at the end of a range", "white"
        )


def describe_recordings_charts(recordings: tuple[OverTime, ...]) -> str:
    """Describe the charts of the report, one recording at a time."""
    band = "band: 90 % predictive interval, for a new mounting" if len(recordings[0].predicted) > 1 else "least squares"
    return (
        f"Both forces over time, one of {counted(min(len(recordings), MOST_CHARTS), 'recording')} at a time. Black: the "
        f"measured output; gray, dashed: the measured input; blue: the output predicted for this input ({band}); orange: "
        "the fit with this recording's own mounting. Shading: what the rope does. Open circles: samples that were left out."
    )


def make_recordings_charts(recordings: tuple[OverTime, ...]) -> tuple[Chart, ...]:
    """Return a chart for each recording, or for evenly chosen ones of many.

    Args:
        recordings: Recordings in the figure, and all that it has no room for.
    """
    shown = choose_evenly(recordings, MOST_CHARTS)
    return tuple(_make_chart(recording, _CHART_POINTS // len(shown)) for recording in shown)


def _make_chart(recording: OverTime, most: int) -> Chart:
    """Return the chart of a recording, with at most so many points."""
    time = recording.time - find_start(recording)
    keep = np.unique(
        np.concatenate([extremes(values, most // 2) for values in (recording.input_force, recording.output_force)])
    )
    gaps = find_gaps(time[keep])

    def broken(values: np.ndarray) -> np.ndarray:
        return np.insert(values[keep].astype(float), gaps, np.nan)

    places = np.insert(time[keep], gaps, 0.5 * (time[keep][gaps - 1] + time[keep][gaps]))
    lines = SeriesGroup(places, tuple(_series(recording, broken)))
    names = LOOP_PHASES if recording.loop else tuple(name for _, name, _ in PHASES)
    spans = tuple(
        Span(name, _CHART_COLORS[value], start, stop)
        for (value, _, _), name in zip(PHASES, names, strict=True)
        for start, stop in find_phases(recording, value)
    )
    return Chart(recording.name, TIME, FORCE, (lines, *_left_out_group(recording)), spans)


def _series(recording: OverTime, broken: Callable[[np.ndarray], np.ndarray]) -> Iterator[Series]:
    """Yield the measured, predicted and fitted forces."""
    yield Series("Input", "dashed", "gray", broken(recording.input_force))
    yield Series("Output", "line", "black", broken(recording.output_force))
    predicted = [broken(row) for row in recording.predicted]
    if len(predicted) == 1:
        yield Series(f"Output predicted, {LEAST_SQUARES.lower()}", "dashed", "blue", predicted[0])
    elif predicted:
        yield Series(f"Output predicted, {WIDE_INTERVAL}", "low", "blue", predicted[0])
        yield Series(f"Output predicted, {WIDE_INTERVAL}", "high", "blue", predicted[-1])
    if len(recording.fitted):
        yield Series("Output fitted", "line", "vermillion", broken(recording.fitted))


def _left_out_group(recording: OverTime) -> Iterator[SeriesGroup]:
    """Yield the output force of samples that were left out, where they have one: by the user, and for other reasons."""
    by_user = np.array(recording.flagged_kind, dtype=str) == BY_USER
    for label, color, mask in ((LEFT_OUT, "gray", by_user), ("Output left out", "purple", ~by_user)):
        finite = np.flatnonzero(np.isfinite(recording.flagged_output) & mask)
        if len(finite):
            chosen = np.array(choose_evenly(finite.tolist(), _MAX_LEFT_OUT))
            time, first = np.unique(recording.flagged_time[chosen] - find_start(recording), return_index=True)
            yield SeriesGroup(time, (Series(label, "hollow", color, recording.flagged_output[chosen][first]),))
