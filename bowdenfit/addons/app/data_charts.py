"""What was measured as charts, before anything is fitted: a point for each reading, with the row of its file."""

from collections.abc import Sequence
from typing import Any

from bowdenfit.addons.app import angle_charts, friction_charts, motion_charts, recording_charts, rope_charts
from bowdenfit.addons.app.measured_rows import MeasuredRows, UnusedRow
from bowdenfit.addons.app.points import COLORS, Drawers, Points, make_chart, parse_sample_key
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.lone_file import FileColumn
from bowdenfit.pages.section import Chart, Picture, SeriesGroup
from bowdenfit.questions.start.measured_file import MeasuredFile
from bowdenfit.words import counted

_DRAWERS: Drawers = {
    **friction_charts.DRAWERS, **angle_charts.DRAWERS, **recording_charts.DRAWERS, **rope_charts.DRAWERS,
    **motion_charts.DRAWERS,
}  # fmt: skip
_STRETCH_CLICKED = "To leave a stretch out, click on a line where it begins, and then where it ends."
_MARKS = {"Left out by you": "Gray, left out by you", "Refused": "Red, refused"}


def make_pictures(
    measured: MeasuredRows, curves: Sequence[SeriesGroup] = (), can_change: bool = True
) -> tuple[Picture, ...]:
    """Return the charts of a data set, one picture for each kind of table.

    Args:
        measured: Its rows.
        curves: Curves of wrap angles, see `fit_curves`.
        can_change: Whether a stretch of a recording can be left out.
    """
    dataset = measured.dataset
    made: list[Picture] = []
    for kind, table in iterate_tables(dataset.measurements) if dataset is not None else ():
        if type(table) not in _DRAWERS:
            continue
        title, draw = _DRAWERS[type(table)]
        unused = [row for row in measured.unused if row.kind == kind.name]
        more: dict[str, Any] = {"lines": curves} if type(table) in angle_charts.DRAWERS else {}
        charts = draw(table, dataset, unused, **more)
        made.append(Picture(f"data-{kind.name}", title, "", tuple(charts), _caption(charts, unused, can_change), alone=True))
    return tuple(made)


def _caption(charts: Sequence[Chart], unused: Sequence[UnusedRow], can_change: bool) -> str:
    """Say what a picture shows, and what a click does."""
    shown = (series for chart in charts for group in chart.groups for series in group.series if series.label in _MARKS)
    labels = [label for label, _ in {(series.label, key) for series in shown for key in series.keys}]
    sentences = ["As measured, before any fit."]
    sentences += [f"{words}: {labels.count(label)}." for label, words in _MARKS.items() if label in labels]
    missing = len(unused) - sum(labels.count(label) for label in _MARKS)
    sentences += [f"{counted(missing, 'row')} without a number to draw: see below."] if missing > 0 and charts else []
    sentences += ["The menu shows the other charts."] if len(charts) > 1 else []
    keys = {key for chart in charts[:1] for group in chart.groups for series in group.series for key in series.keys[:1]}
    if any(parse_sample_key(key) for key in keys):
        return " ".join([*sentences, _STRETCH_CLICKED] if can_change else sentences)
    return " ".join([*sentences, "Click a point to see its row below."] if keys else sentences)


def _label(column: FileColumn) -> str:
    """Return the heading of a column with its unit, which the heading may have already."""
    has_unit = not column.unit or f"({column.unit})" in column.name or f"[{column.unit}]" in column.name
    return column.name if has_unit else f"{column.name} ({column.unit})"


def sketch_file(file: MeasuredFile, number: int = 0) -> Picture | None:
    """Return the numbers of a file against each other, as written, while it is not known yet what all of them are.

    Args:
        file: A file on its way to a data set.
        number: Its number among those of a page.
    """
    columns = [column for column in file.columns if column.numbers and not column.is_clock and len(column.finite) > 1]
    meanings = {file.meaning_of(column): column for column in columns}
    forces = [meanings[name] for name in ("input_force", "output_force") if name in meanings]
    if len(columns) < 2:
        return None
    first, *upward = forces if len(forces) == 2 else columns
    labels = {column.name: _label(column) for column in columns}
    points = [
        Points(labels[column.name], color, "points", first.values, column.values)
        for column, color in zip(upward, COLORS, strict=False)
    ]
    units = list(dict.fromkeys(column.unit for column in upward[: len(COLORS)]))
    y_label = labels[upward[0].name] if len(upward) == 1 else f"({units[0]})" if len(units) == 1 and units[0] else "As written"
    chart = make_chart(file.name, labels[first.name], y_label, points)
    caption = "As written in the file; what is not answered yet is not applied."
    return Picture(f"sketch-{number}", file.name, "", (chart,), caption, alone=True)
