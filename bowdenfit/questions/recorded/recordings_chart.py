"""Recordings over time, to zoom into: the lines of the figure, one recording after the other."""

from collections.abc import Callable, Iterator

import numpy as np

from bowdenfit.pages.section import Chart, Series, SeriesGroup, Span
from bowdenfit.plots.curves import choose_evenly
from bowdenfit.plots.panels import extremes
from bowdenfit.plots.style import LEAST_SQUARES, WIDE_INTERVAL
from bowdenfit.questions.recorded.recordings_figure import (
    FORCE,
    LOOP_PHASES,
    PHASES,
    TIME,
    OverTime,
    after_gaps,
    phase_spans,
    start_of,
)

MOST_CHARTS = 24  # recordings
_POINTS = 6000  # of all recordings together
_MAX_LEFT_OUT = 300  # samples of each
_COLORS = {1: "pull", -1: "return", 0: "rest"}


def recordings_charts(recordings: tuple[OverTime, ...]) -> tuple[Chart, ...]:
    """A chart for each recording, or for evenly chosen ones of many.

    Args:
        recordings: What the figure shows, and all that it has no room for.
    """
    shown = choose_evenly(recordings, MOST_CHARTS)
    return tuple(_chart(recording, _POINTS // len(shown)) for recording in shown)


def _chart(recording: OverTime, most: int) -> Chart:
    time = recording.time - start_of(recording)
    keep = np.unique(
        np.concatenate([extremes(values, most // 2) for values in (recording.input_force, recording.output_force)])
    )
    gaps = after_gaps(time[keep])

    def broken(values: np.ndarray) -> np.ndarray:
        return np.insert(values[keep].astype(float), gaps, np.nan)

    places = np.insert(time[keep], gaps, 0.5 * (time[keep][gaps - 1] + time[keep][gaps]))
    lines = SeriesGroup(places, tuple(_series(recording, broken)))
    names = LOOP_PHASES if recording.loop else tuple(name for _, name, _ in PHASES)
    spans = tuple(
        Span(name, _COLORS[value], start, stop)
        for (value, _, _), name in zip(PHASES, names, strict=True)
        for start, stop in phase_spans(recording, value)
    )
    return Chart(recording.name, TIME, FORCE, (lines, *_left_out_group(recording)), spans)


def _series(recording: OverTime, broken: Callable[[np.ndarray], np.ndarray]) -> Iterator[Series]:
    """What was measured, predicted and fitted."""
    yield Series("Input", "dashed", "gray", broken(recording.input_force))
    yield Series("Output", "line", "black", broken(recording.output_force))
    predicted = [broken(row) for row in recording.predicted]
    if len(predicted) == 1:
        yield Series(f"Output predicted, {LEAST_SQUARES.lower()}", "dashed", "blue", predicted[0])
    else:
        yield Series(f"Output predicted, {WIDE_INTERVAL}", "low", "blue", predicted[0])
        yield Series(f"Output predicted, {WIDE_INTERVAL}", "high", "blue", predicted[-1])
    yield Series("Output fitted", "line", "vermillion", broken(recording.fitted))


def _left_out_group(recording: OverTime) -> Iterator[SeriesGroup]:
    """Output force of samples that were left out, where they have one."""
    finite = np.flatnonzero(np.isfinite(recording.flagged_output))
    if not len(finite):
        return
    chosen = np.array(choose_evenly(finite.tolist(), _MAX_LEFT_OUT))
    time, first = np.unique(recording.flagged_time[chosen] - start_of(recording), return_index=True)
    yield SeriesGroup(time, (Series("Output left out", "hollow", "purple", recording.flagged_output[chosen][first]),))
