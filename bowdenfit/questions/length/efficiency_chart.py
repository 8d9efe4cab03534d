"""Efficiency against the route, to zoom into: the lines and points of the figure."""

import numpy as np

from bowdenfit.pages.section import Chart, Series, SeriesGroup, Span
from bowdenfit.plots.curves import NEW_RUN, Band
from bowdenfit.plots.style import EFFICIENCY, LEAST_SQUARES, MEDIAN, NARROW_INTERVAL, WIDE_INTERVAL, percent
from bowdenfit.questions.length.efficiency_figure import READING, RUN, EfficiencyAlongRoute, EfficiencyPoints


def efficiency_chart(data: EfficiencyAlongRoute) -> tuple[Chart]:
    """The curve with its intervals, measured points, and the lengths that are good enough.

    Args:
        data: What the figure shows.
    """
    points = [_points_group(table) for table in data.points if np.isfinite(table.route).any()]
    groups = (*_new_run_group(data), _curve_group(data.efficiency), *points)
    force = "" if data.at_input_force is None else f", curve at {data.at_input_force:g} N"
    return (Chart("Efficiency", data.route_label, EFFICIENCY + force, groups, _optimum_spans(data)),)


def _new_run_group(data: EfficiencyAlongRoute) -> tuple[SeriesGroup, ...]:
    """Between which efficiencies runs lie, each on a mounting of its own."""
    if data.new_run is None:
        return ()
    low, high = 100 * data.new_run
    return (SeriesGroup(data.efficiency.route, (Series(NEW_RUN, "low", "blue", low), Series(NEW_RUN, "high", "blue", high))),)


def _curve_group(band: Band) -> SeriesGroup:
    rows = 100 * band.quantiles
    if band.is_line:
        return SeriesGroup(band.route, (Series(LEAST_SQUARES, "line", "blue", rows[0]),))
    low, lower, median, upper, high = rows
    return SeriesGroup(
        band.route,
        (
            Series(WIDE_INTERVAL, "low", "blue", low),
            Series(WIDE_INTERVAL, "high", "blue", high),
            Series(NARROW_INTERVAL, "low", "blue", lower),
            Series(NARROW_INTERVAL, "high", "blue", upper),
            Series(MEDIAN, "line", "blue", median),
        ),
    )


def _points_group(points: EfficiencyPoints) -> SeriesGroup:
    """Measured points; those at one place one after the other, as near as they can be told apart."""
    order = np.flatnonzero(np.isfinite(points.route))
    order = order[np.argsort(points.route[order], kind="stable")]
    route, measured = _separate(points.route[order]), 100 * points.measured[order]
    inside, (_, _, label) = points.inside[order], RUN if points.of_runs else READING
    series = [Series(label, "points", "black", np.where(inside, measured, np.nan))]
    if not inside.all():
        series.append(Series(f"{label}, outside the range", "hollow", "black", np.where(inside, np.nan, measured)))
        predicted = 100 * points.predicted[len(points.predicted) // 2, order]
        series.append(Series("Predicted there", "hollow", "blue", np.where(inside, np.nan, predicted)))
    return SeriesGroup(route, tuple(series))


def _separate(route: np.ndarray) -> np.ndarray:
    """Ascending places without any twice."""
    positions = np.array(route, dtype=float)
    least = 1e-6 * max(float(np.ptp(route)), float(np.abs(route).max()), 1e-9)
    for i in range(1, len(positions)):
        positions[i] = max(positions[i], positions[i - 1] + least)
    return positions


def _optimum_spans(data: EfficiencyAlongRoute) -> tuple[Span, ...]:
    """The lengths that are good enough, and the best one as a line."""
    best = data.optimum
    if best is None:
        return ()
    line = Span(f"Best {best.what}", "vermillion", best.length.median, best.length.median)
    if not best.is_certain:
        return (line,)
    return Span(f"Within {percent(best.window.within)} of the best", "window", best.window.start, best.window.stop), line
