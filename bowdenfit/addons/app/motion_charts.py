"""Charts of what moves: force at the motor against its displacement, and ring-downs, as they were measured."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bowdenfit.addons.app.measured_rows import UnusedRow
from bowdenfit.addons.app.points import STROKES, Drawers, Points, by_stroke, make_chart, row_keys, unused_points
from bowdenfit.dataset import Dataset
from bowdenfit.kinds.displacement.table import DisplacementTable
from bowdenfit.kinds.ringdown.kind import RingDownTable
from bowdenfit.pages.section import Chart

_MOST_CHARTS = 24  # runs on a page, as of recordings
_NOT_READINGS = tuple((stroke, "Not used", "gray", "hollow") for stroke in (1, -1, 0))


def _draw_displacement(table: DisplacementTable, dataset: Dataset, unused: Sequence[UnusedRow]) -> list[Chart]:
    """Return the force at the motor against its displacement, a chart for each run."""
    del dataset
    charts = []
    for number, name in enumerate(table.run_names[:_MOST_CHARTS]):
        points = []
        for used, strokes in ((True, STROKES), (False, _NOT_READINGS)):
            rows = np.flatnonzero((table.run == number) & (table.used == used))
            origin = replace(table.origin, file=table.origin.file[rows], row=table.origin.row[rows])
            points += by_stroke(table.displacement[rows], table.force[rows], table.motion.stroke[rows], origin, strokes)
        if len(table.run_names) == 1:  # else it is not known of which run they are
            points += unused_points(unused, _place_of_displacement)
        charts.append(make_chart(f"Run {name}", "Displacement at the motor (mm)", "Force at the motor (N)", points))
    return charts


def _place_of_displacement(row: UnusedRow) -> tuple[float, float]:
    return row.values.get("displacement", np.nan), row.values.get("force", np.nan)


def _draw_ring_down(table: RingDownTable, dataset: Dataset, unused: Sequence[UnusedRow]) -> list[Chart]:
    """Return what swings over time, a chart for each run."""
    del dataset
    keys, charts = np.array(row_keys(table.origin)), []
    label, reading = ("Torque (N m)", table.reading) if table.is_torque else ("Angle (deg)", np.rad2deg(table.reading))
    for number in range(min(len(table.added), _MOST_CHARTS)):
        rows = table.run == number
        points = Points("Reading", "blue", "points", table.time[rows], reading[rows], tuple(keys[rows].tolist()))
        name = f"Run {number + 1}" + (f", {table.added[number]:.4g} kg m² added" if table.added[number] else "")
        of_run = [row for row in unused if row.values.get("run") == number]
        left_out = unused_points(of_run, _place_of_torque if table.is_torque else _place_of_angle)
        charts.append(make_chart(name, "Time from the release (s)", label, [points, *left_out]))
    return charts


def _place_of_torque(row: UnusedRow) -> tuple[float, float]:
    return row.values.get("time", np.nan), row.values.get("torque", np.nan)


def _place_of_angle(row: UnusedRow) -> tuple[float, float]:
    return row.values.get("time", np.nan), float(np.rad2deg(row.values.get("angle", np.nan)))


DRAWERS: Drawers = {
    DisplacementTable: ("Force at the motor", _draw_displacement), RingDownTable: ("Ring-down", _draw_ring_down),
}  # fmt: skip
