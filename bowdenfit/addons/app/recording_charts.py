"""Charts of recordings, and of the table of a pull-pull loop, as they were measured."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bowdenfit.addons.app.measured_rows import UnusedRow
from bowdenfit.addons.app.points import (
    INPUT,
    MOST_POINTS,
    OUTPUT,
    Drawers,
    Points,
    by_stroke,
    forces_of,
    make_chart,
    sample_key,
    unused_points,
)
from bowdenfit.dataset import Dataset
from bowdenfit.kinds.tables import LoopTable
from bowdenfit.pages.section import Chart
from bowdenfit.questions.recorded.recordings_figure import OverTime, find_start, make_recordings_charts
from bowdenfit.recordings.recording import Recording, Recordings

_LOOP_STROKES = ((1, "Forward", "blue", "points"), (-1, "Back", "vermillion", "points"))
_MOST_RECORDINGS = 24  # on a page, as in the report


def _draw_loop(table: LoopTable, dataset: Dataset, unused: Sequence[UnusedRow]) -> list[Chart]:
    """Return output against input force of a pull-pull loop."""
    del dataset
    shown = by_stroke(table.input_force, table.output_force, table.stroke, table.origin, _LOOP_STROKES)
    return [make_chart("Output against input force", INPUT, OUTPUT, [*shown, *unused_points(unused, forces_of)])]


def _draw_recordings(table: Recordings, dataset: Dataset, unused: Sequence[UnusedRow]) -> list[Chart]:
    """Return every recording over time, and its output against its input force."""
    del dataset, unused
    items = table.items[:_MOST_RECORDINGS]
    shown = {number: _over_time(r, table.loop) for number, r in enumerate(items) if len(r.blocks.time) > 1}
    charts = zip(shown, make_recordings_charts(tuple(shown.values())), strict=True)
    over_time = [_call_samples(chart, number, find_start(shown[number])) for number, chart in charts]
    return [*over_time, *(_draw_hysteresis(recording, table.loop) for recording in items)]


def _call_samples(chart: Chart, number: int, start: float) -> Chart:
    """Return the chart of a recording over time in which each sample is called by its time on the recording's clock.

    Args:
        chart: The chart, whose time begins at 0.
        number: Number of the recording.
        start: Time of the first sample [s].
    """
    groups = []
    for group in chart.groups:
        keys = tuple(sample_key(number, time) for time in (group.x + start).tolist())
        groups.append(replace(group, series=tuple(replace(series, keys=keys) for series in group.series)))
    return replace(chart, groups=tuple(groups))


def _over_time(recording: Recording, is_loop: bool) -> OverTime:
    """Return a recording over time, without what only a fit knows."""
    blocks, flagged, nothing = recording.blocks, recording.account.flagged, np.zeros(0)
    left_out = flagged.kind, flagged.time, flagged.input_force, flagged.output_force
    return OverTime(
        recording.name, is_loop, blocks.time, blocks.input_force, blocks.output_force, recording.strokes.stroke,
        blocks.saturated, np.zeros((0, len(blocks.time))), nothing, *left_out,
    )  # fmt: skip


def _draw_hysteresis(recording: Recording, is_loop: bool) -> Chart:
    """Return the output against the input force of a recording, by stroke."""
    blocks, stroke = recording.blocks, recording.strokes.stroke
    step = max(1, -(-len(stroke) // (MOST_POINTS // 4)))
    shown = slice(None, None, step)
    names = [("Forward" if is_loop else "Pulling", 1, "blue"), ("Back" if is_loop else "Returning", -1, "vermillion")]
    force_in, force_out = blocks.input_force[shown], blocks.output_force[shown]
    points = [
        Points(label, color, "points", force_in[rows], force_out[rows])
        for label, value, color in [*names, ("Switching or held", 0, "gray")]
        if (rows := stroke[shown] == value).any()
    ]
    return make_chart(f"{recording.name}: output against input", INPUT, OUTPUT, points)


DRAWERS: Drawers = {LoopTable: ("Pull-pull loop", _draw_loop), Recordings: ("Recordings", _draw_recordings)}
