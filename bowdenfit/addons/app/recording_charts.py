"""Charts of recordings, and of the table of a pull-pull loop, as they were measured."""

from collections.abc import Sequence

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
    unused_points,
)
from bowdenfit.dataset import Dataset
from bowdenfit.kinds.tables import LoopTable
from bowdenfit.pages.section import Chart
from bowdenfit.questions.recorded.recordings_figure import OverTime, make_recordings_charts
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
    shown = tuple(_over_time(recording, table.loop) for recording in items if len(recording.blocks.time) > 1)
    return [*make_recordings_charts(shown), *(_draw_hysteresis(recording, table.loop) for recording in items)]


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
