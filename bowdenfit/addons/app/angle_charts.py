"""Charts of wrap angles along the route, with the curves that would be fitted."""

from collections.abc import Sequence
from functools import partial
from importlib import import_module

import numpy as np

from bowdenfit.addons.app.measured_rows import UnusedRow
from bowdenfit.addons.app.points import ANGLE, COLORS, Drawers, Points, make_chart, row_keys, unused_points
from bowdenfit.dataset import Dataset
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.pages.section import Chart, Series, SeriesGroup, Span

_CURVE_POINTS = 101  # of a curve along the route; a judgement


def fit_curves(dataset: Dataset) -> tuple[SeriesGroup, ...]:
    """Return the least-squares curve of each curved contact, as lines of the chart of wrap angles; loads JAX."""
    table, route = dataset.measurements.table(AngleTable), dataset.description.route
    if table is None or route is None:
        return ()
    curve_fitter = import_module("bowdenfit.questions.start.curve_choice").fit_curve
    at, lines = np.linspace(*route.range, _CURVE_POINTS), []
    for contact in dataset.description.curved:
        name, family = contact.wrap_angle.column or "", contact.wrap_angle.curve or ""
        angle, _ = table.column(name)
        inside = (table.route >= route.range[0]) & (table.route <= route.range[1])
        if np.isfinite(angle[inside]).any():
            color = COLORS[table.names.index(name) % len(COLORS)]
            degrees = np.rad2deg(curve_fitter(route, family, table.route, angle, at))
            lines.append(Series(f"{name.replace('_', ' ')}, {family} curve, least squares", "line", color, degrees))
    return (SeriesGroup(at, tuple(lines)),) if lines else ()


def _draw_angles(
    table: AngleTable, dataset: Dataset, unused: Sequence[UnusedRow], lines: Sequence[SeriesGroup] = ()
) -> list[Chart]:
    """Return wrap angles along the route, those too small to detect at their limit."""
    route = dataset.description.route
    assert route is not None  # angles are read only with one
    label, keys, points = f"{route.variable.replace('_', ' ').capitalize()} ({route.unit})", tuple(row_keys(table.origin)), []
    for name, color in zip(table.names, COLORS * len(table.names), strict=False):
        angle, limit = (np.rad2deg(values) for values in table.column(name))
        words = name.replace("_", " ")
        points.append(Points(words, color, "points", table.route, angle, keys))
        if np.isfinite(limit).any():
            points.append(Points(f"{words}, less than", color, "hollow", table.route, limit, keys))
    for name in table.names:
        points += unused_points(unused, partial(_place_of_angle, name, route.variable))
    inside = Span("Range of the curves", "window", *route.range)
    return [make_chart("Wrap angles along the route", label, ANGLE, points, lines, (inside,))]


def _place_of_angle(name: str, variable: str, row: UnusedRow) -> tuple[float, float]:
    """Return length and wrap angle [deg] of a row that is not used."""
    return row.values.get(variable, np.nan), float(np.rad2deg(row.values.get(name, np.nan)))


DRAWERS: Drawers = {AngleTable: ("Wrap angles", _draw_angles)}
