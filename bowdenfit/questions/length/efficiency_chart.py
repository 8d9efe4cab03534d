"""Efficiency against the route, to zoom into: the lines and points of the figure."""

import numpy as np

from bowdenfit.pages.chart import Chart, Group, Series, Span
from bowdenfit.plots.curves import NEW_RUN, Band
from bowdenfit.plots.style import EFFICIENCY, LEAST_SQUARES, MEDIAN, NARROW_INTERVAL, WIDE_INTERVAL, percent
from bowdenfit.questions.length.efficiency_figure import READING, RUN, AlongRoute
from bowdenfit.questions.length.efficiency_points import EfficiencyPoints


def efficiency_chart(data: AlongRoute) -> tuple[Chart]:
    """The curve with its intervals, measured points, and the lengths that are good enough.

    Args:
        data: What the figure shows.
    """
    points = [_points(one) for one in data.points if np.isfinite(one.route).any()]
    groups = (*_of_runs(data), _curve(data.efficiency), *points)
    force = "" if data.at_input_force is None else f", curve at {data.at_input_force:g} N"
    return (Chart("Efficiency", data.route_label, EFFICIENCY + force, groups, _spans(data)),)


def _of_runs(data: AlongRoute) -> tuple[Group, ...]:
    """Between which efficiencies runs lie, each on a mounting of its own."""
    if data.new_run is None:
        return ()
    low, high = 100 * data.new_run
    return (Group(data.efficiency.route, (Series(NEW_RUN, "low", "blue", low), Series(NEW_RUN, "high", "blue", high))),)


def _curve(band: Band) -> Group:
    rows = 100 * band.quantiles
    if band.is_line:
        return Group(band.route, (Series(LEAST_SQUARES, "line", "blue", rows[0]),))
    low, lower, median, upper, high = rows
    return Group(
        band.route,
        (
            Series(WIDE_INTERVAL, "low", "blue", low),
            Series(WIDE_INTERVAL, "high", "blue", high),
            Series(NARROW_INTERVAL, "low", "blue", lower),
            Series(NARROW_INTERVAL, "high", "blue", upper),
            Series(MEDIAN, "line", "blue", median),
        ),
    )


def _points(points: EfficiencyPoints) -> Group:
    """Measured points; those at one place one after the other, as near as they can be told apart."""
    there = np.flatnonzero(np.isfinite(points.route))
    there = there[np.argsort(points.route[there], kind="stable")]
    route, measured = _apart(points.route[there]), 100 * points.measured[there]
    inside, (_, _, label) = points.inside[there], RUN if points.of_runs else READING
    series = [Series(label, "points", "black", np.where(inside, measured, np.nan))]
    if not inside.all():
        series.append(Series(f"{label}, outside the range", "hollow", "black", np.where(inside, np.nan, measured)))
        predicted = 100 * points.predicted[len(points.predicted) // 2, there]
        series.append(Series("Predicted there", "hollow", "blue", np.where(inside, np.nan, predicted)))
    return Group(route, tuple(series))


def _apart(route: np.ndarray) -> np.ndarray:
    """Ascending places without any twice."""
    nudged = np.array(route, dtype=float)
    least = 1e-6 * max(float(np.ptp(route)), float(np.abs(route).max()), 1e-9)
    for i in range(1, len(nudged)):
        nudged[i] = max(nudged[i], nudged[i - 1] + least)
    return nudged


def _spans(data: AlongRoute) -> tuple[Span, ...]:
    """The lengths that are good enough, and the best one as a line."""
    best = data.optimum
    if best is None:
        return ()
    line = Span(f"Best {best.what}", "vermillion", best.length.median, best.length.median)
    if not best.is_certain:
        return (line,)
    return Span(f"Within {percent(best.window.within)} of the best", "window", best.window.start, best.window.stop), line
