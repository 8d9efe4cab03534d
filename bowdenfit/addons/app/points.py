"""Readings as points of charts, each called as its row, for every kind of table."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from bowdenfit.addons.app.measured_rows import LEFT_OUT, REFUSED, UnusedRow
from bowdenfit.description import Description
from bowdenfit.kinds.rows import ForceRows, RowOrigin
from bowdenfit.pages.section import Chart, Look, Series, SeriesGroup, Span
from bowdenfit.types import Vector

INPUT, OUTPUT, EFFICIENCY, ANGLE = "Input force (N)", "Output force (N)", "Efficiency (%)", "Wrap angle (deg)"
STROKES = ((1, "Pulling", "blue", "points"), (-1, "Returning", "vermillion", "points"), (0, "Held", "green", "hollow"))
_UNUSED = ((LEFT_OUT, "Left out by you", "gray"), (REFUSED, "Refused", "bad"))
Drawers: TypeAlias = dict[type, tuple[str, Callable[..., list[Chart]]]]
"""Title and function that draws a table, by the class of the table."""
COLORS = ("blue", "vermillion", "green", "purple", "orange", "sky")
_SAMPLE = "sample "  # begins what a sample of a recording is called
MOST_POINTS = 3000  # of a chart; a judgement


@dataclass(frozen=True)
class Points:
    """Readings that look alike on a chart.

    Args:
        label: In the key.
        color, look: How they are drawn.
        x, y: Where they are.
        keys: File and row of each, which the table of rows has too; empty where there is none.
    """

    label: str
    color: str
    look: Look
    x: Vector
    y: Vector
    keys: tuple[str, ...] = ()


def row_key(file: str, row: int) -> str:
    """What a point and its row in a table of rows are both called."""
    return f"{row} {file}"


def sample_key(recording: int, time: float) -> str:
    """What a sample of a recording is called: number of the recording, and time on its clock [s]."""
    return f"{_SAMPLE}{recording} {time:.3f}"


def parse_sample_key(key: str) -> tuple[int, float] | None:
    """Return the number of the recording and the time [s] of a sample by what it is called; None of anything else."""
    with suppress(ValueError):
        number, time = key.removeprefix(_SAMPLE).split(" ")
        return (int(number), float(time)) if key.startswith(_SAMPLE) else None
    return None


def make_chart(
    name: str, x: str, y: str, points: Iterable[Points], lines: Sequence[SeriesGroup] = (), spans: tuple[Span, ...] = ()
) -> Chart:
    """Return a chart of points, of which many may stand at one place."""
    groups = [group for some in points for group in _split(some)]
    return Chart(name, x, y, (*lines, *groups), spans)


def _split(points: Points) -> list[SeriesGroup]:
    """Return points as groups in which each place occurs once, as charts take them."""
    drawable = np.flatnonzero(np.isfinite(points.x) & np.isfinite(points.y))[:MOST_POINTS]
    order = drawable[np.argsort(points.x[drawable], kind="stable")]
    x = points.x[order]
    _, first = np.unique(x, return_index=True)
    occurrence = np.arange(len(x)) - np.repeat(first, np.diff(np.append(first, len(x))))
    groups = []
    for number in range(int(occurrence.max(initial=-1)) + 1):
        rows = order[occurrence == number]
        keys = tuple(points.keys[i] for i in rows) if points.keys else ()
        groups.append(SeriesGroup(points.x[rows], (Series(points.label, points.look, points.color, points.y[rows], keys),)))
    return groups


def row_keys(origin: RowOrigin) -> list[str]:
    """What each row of a table is called; see `row_key`."""
    return [row_key(origin.files[file], int(row)) for file, row in zip(origin.file, origin.row, strict=True)]


def by_stroke(
    x: Vector, y: Vector, stroke: np.ndarray, origin: RowOrigin, names: Sequence[tuple[int, str, str, str]] = STROKES
) -> list[Points]:
    """Return points in one series for each stroke."""
    keys = row_keys(origin)
    made = []
    for value, label, color, look in names:
        rows = np.flatnonzero(stroke == value)
        if len(rows):
            kept = tuple(keys[i] for i in rows)
            made.append(Points(label, color, "hollow" if look == "hollow" else "points", x[rows], y[rows], kept))
    return made


def unused_points(unused: Sequence[UnusedRow], place: Callable[[UnusedRow], tuple[float, float]]) -> list[Points]:
    """Return the rows that are not used: gray where the user left them out, red where they are refused."""
    made = []
    for state, label, color in _UNUSED:
        rows = [row for row in unused if row.state == state]
        if rows:
            x, y = np.array([place(row) for row in rows], dtype=float).T
            made.append(Points(label, color, "hollow", x, y, tuple(row_key(row.file, row.row) for row in rows)))
    return made


def forces_of(row: UnusedRow) -> tuple[float, float]:
    """Return input and output force of a row that is not used."""
    return row.values.get("input_force", np.nan), row.values.get("output_force", np.nan)


def row_places(table: ForceRows, description: Description) -> tuple[str, Vector]:
    """Return the axis along which readings are drawn, and where each row is: its length, its wrap angle, or nothing."""
    route = description.route
    if route is not None:
        return f"{route.variable.replace('_', ' ').capitalize()} ({route.unit})", table.route
    return ANGLE, np.rad2deg(_constant_angle(description) + np.nansum(table.own.angle, axis=1))


def _constant_angle(description: Description) -> float:
    """Wrap angle of all contacts whose angle is constant [rad]."""
    return sum(contact.wrap_angle.constant.to("angle") for contact in description.contact if contact.wrap_angle.constant)


def row_place(row: UnusedRow, description: Description) -> float:
    """Return where a row that is not used is drawn along the axis of `places`."""
    if description.route is not None:
        return row.values.get(description.route.variable, np.nan)
    own = [row.values[name] for name in description.angle_columns if name in row.values]
    return float(np.rad2deg(_constant_angle(description) + sum(own)))
