"""Efficiency against the route, and below it where the optimum lies and which length to buy; and the same as a chart."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import describe_left_out, describe_strip
from bowdenfit.plots.curves import GRID_POINTS, NEW_RUN, Band, density, draw_band, route_limits, shade_outside
from bowdenfit.plots.layout import TITLE, legend_above, panels, wrap_words
from bowdenfit.plots.panels import draw_left_out
from bowdenfit.plots.strips import STRIP, finish_strips, name_strip, place_names
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    EFFICIENCY,
    GREEN,
    ORANGE,
    SMALL,
    VERMILLION,
    WIDE,
    in_paper_style,
    percent,
    rounded_texts,
)
from bowdenfit.questions import length
from bowdenfit.results.optimal_length import OptimalLength

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record
from bowdenfit.pages.section import Chart, Series, SeriesGroup, Span
from bowdenfit.plots.style import LEAST_SQUARES, LEFT_OUT, MEDIAN, NARROW_INTERVAL, WIDE_INTERVAL

HEADING = "Efficiency along the route"
# marker, its size [pt] and label
READING, RUN = ("o", 4.5, "Measured"), ("D", 2.8, "Measured, mean of a run")
MOST_NUMBERS, SMALLEST_NUMBER = 16, 0.5  # so many bars have numbers over them, if they are so many percent high
LEAST_AT_EDGE = 0.005  # probability of an optimum at an end of the range from which on it is said; a judgement
DOTS = (0, (1, 1.2))


@dataclass(frozen=True)
class EfficiencyPoints:
    """Measured efficiencies [1].

    Args:
        of_runs: Whether each is the mean of a run.
        labels: Each in words.
        route: Route value; NaN without a route.
        measured: Efficiency.
        predicted: Quantiles (`BAND_QUANTILES`, first axis) of readings drawn anew; one row, least squares', without
            draws.
        inside: Whether it lies within the range of the curves.
    """

    of_runs: bool
    labels: tuple[str, ...]
    route: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    inside: np.ndarray


@dataclass(frozen=True)
class EfficiencyAlongRoute:
    """Efficiency along the route, and its optimum.

    Args:
        route_label: Axis label of the route with unit, such as "Cable length (mm)".
        route_range: Where the curves hold.
        efficiency: The curve.
        points: Measured efficiencies.
        optimum: The design answer; None without draws.
        optimal_length: Its draws; None likewise.
        at_input_force: Input force at which the curve holds [N]; None where it is the same at any.
        new_run: Ends of the interval that holds the efficiency of a run on a new mounting with 90 % probability, along the
            curve; None where no points are runs.
        left_out: Route and efficiency [1] of the readings that the user leaves out.
    """

    route_label: str
    route_range: tuple[float, float]
    efficiency: Band
    points: tuple[EfficiencyPoints, ...]
    optimum: OptimalLength | None = None
    optimal_length: np.ndarray | None = None
    at_input_force: float | None = None
    new_run: np.ndarray | None = None
    left_out: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))


def data(fit: Record) -> EfficiencyAlongRoute | None:
    """Return efficiency along the route and its optimum; None without a route."""
    from bowdenfit.questions import error_budget  # here, because drawing again needs no JAX

    route, with_errors = fit.dataset.description.route, error_budget.with_bench_errors(fit)
    if route is None:
        return None
    friction = fit.model.cable.friction
    force = friction.conditions.reference_force if friction.depends_on_load else None
    points = length.collect_efficiency_points(fit)
    left_out = fit.dataset.measurements.excluded_points("efficiencies", route.variable, "efficiency")
    efficiency = length.compute_curves(with_errors)["efficiency"]
    shown = EfficiencyAlongRoute(route.label, route.range, efficiency, points, at_input_force=force, left_out=left_out)
    if fit.sampled is None:
        return shown
    mounted = length.compute_new_run_interval(with_errors) if any(p.of_runs for p in points) else None
    best = error_budget.find_optimal_length(fit)
    return replace(shown, optimum=best, optimal_length=length.collect_optimal_lengths(with_errors), new_run=mounted)


def caption(data: EfficiencyAlongRoute) -> str:
    """Describe what is drawn, in plain words."""
    n, best = sum(len(points.labels) for points in data.points), data.optimum
    return " ".join(filter(None, (
        _describe_curve(data),
        _describe_circles(n),
        describe_left_out(data.left_out),
        describe_strip("in percent of the input force") if n else "",
        "Panels below: probability density of the best length"
        + (", and probability of each length on offer to be the best." if best.choices else ".") if best else "",
        _describe_window(data),
    )))  # fmt: skip


def describe_efficiency_chart(data: EfficiencyAlongRoute) -> str:
    """Describe the chart of the report, which has no panels."""
    n, best = sum(len(points.labels) for points in data.points), data.optimum
    line = f"Orange line: best {best.what}." if best else ""
    circles = _describe_circles(n), describe_left_out(data.left_out)
    return " ".join(filter(None, (_describe_curve(data), *circles, line, _describe_window(data))))


def _describe_curve(data: EfficiencyAlongRoute) -> str:
    """Return the sentences that explain the curve and its bands."""
    has_draws = not data.efficiency.is_line
    return " ".join(filter(None, (
        "Efficiency of the cable, output over input force, against the length.",
        "Line: median; bands: the intervals that hold the efficiency of the cable with 50 % and 90 % probability, bench "
        "errors included."
        if has_draws else "Line: least squares.",
        "Dotted: nine of ten runs lie between these lines, because no two mountings are alike."
        if data.new_run is not None else "",
        f"The curve holds at {data.at_input_force:g} N input force." if data.at_input_force is not None else "",
    )))  # fmt: skip


def _describe_circles(n: int) -> str:
    """Return the sentence that explains the measured points, of which there are `n`."""
    if not n:
        return "No efficiency was measured along the route."
    return f"Circles: measured, n = {n}; open ones lie outside the range of the curves."


def _describe_window(data: EfficiencyAlongRoute) -> str:
    """Return the sentence that explains the lengths that are good enough; empty without such."""
    best = data.optimum
    if best is None or not np.isfinite(best.window.start):
        return ""
    window = best.window
    return (
        f"Green: lengths that are within {percent(window.within)} of the best with {percent(window.probability)} probability."
    )


@in_paper_style
def draw(data: EfficiencyAlongRoute, width: float | None = None) -> Figure:
    """Draw efficiency [%] against the route, the density of the optimal length, and each choice's probability to be best."""
    below = 0 if data.optimum is None else 2 if data.optimum.choices else 1
    has_points = any(np.isfinite(points.route).any() for points in data.points)
    figure, flat = panels(
        [2.3] + [STRIP] * has_points + [0.75] * below, 1, 0.08, (0.0, TITLE + 0.02), width or WIDE, sharex=True
    )
    x_limits = route_limits(data.route_range, *(points.route for points in data.points))
    _draw_curve_and_points(flat[0], data)
    if has_points:
        _draw_residuals(flat[1], data)
        place_names(flat[0], flat[1])
    if data.optimum is not None:
        _draw_optimum_density(flat[1 + has_points], data, data.optimum)
        for axes in (flat[0], flat[1 + has_points]):
            _draw_optimum_marks(axes, data.optimum)
        if data.optimum.choices:
            _draw_choices(flat[2 + has_points], data.optimum, float(np.ptp(data.route_range)))
    for axes in flat:
        shade_outside(axes, data.route_range, x_limits)
    draw_left_out(flat[0], data.left_out * [[1], [100]])
    flat[-1].set_xlabel(data.route_label)
    legend_above(figure, flat[:1], columns=3)
    return figure


def _draw_residuals(strip: Axes, data: EfficiencyAlongRoute) -> None:
    """Draw measured less predicted efficiencies, and where a reading would lie with 90 % probability if it were taken anew."""
    for points in data.points:
        marker, size, _ = RUN if points.of_runs else READING
        middle = points.predicted[len(points.predicted) // 2]
        for inside, fill in ((points.inside, BLACK), (~points.inside, "white")):
            strip.plot(
                points.route[inside], 100 * (points.measured - middle)[inside], marker, color=BLACK, markersize=0.8 * size,
                markerfacecolor=fill, zorder=3,
            )  # fmt: skip
        if len(points.predicted) > 1:
            low, high = 100 * (points.predicted[[0, -1]] - middle)
            strip.plot(np.tile(points.route, (2, 1)), np.stack([low, high]), color=BLUE, linewidth=1.0, alpha=0.5)
    finish_strips([strip])
    name_strip(strip, "%")


def _draw_curve_and_points(axes: Axes, data: EfficiencyAlongRoute) -> None:
    """Draw the curve with its intervals, and the measured points."""
    draw_band(axes, data.efficiency, scale=100.0)
    if data.new_run is not None:
        for end in data.new_run:
            axes.plot(data.efficiency.route, 100 * end, color=BLUE, linewidth=0.8, linestyle=DOTS, label=NEW_RUN)
    for points in data.points:
        _draw_measured(axes, points, points.inside, BLACK, "")
        outside = ~points.inside & np.isfinite(points.route)
        if outside.any():
            _draw_predicted(axes, points, outside)
            _draw_measured(axes, points, outside, "white", ", outside the range")
    axes.set_ylabel(EFFICIENCY if data.at_input_force is None else f"{EFFICIENCY}\ncurve at {data.at_input_force:g} N")
    axes.locator_params(axis="y", nbins=6)


def _draw_measured(axes: Axes, points: EfficiencyPoints, where: np.ndarray, fill: str, note: str) -> None:
    """Draw some of the measured points; the note is added to their label."""
    marker, size, label = RUN if points.of_runs else READING
    if where.any():
        axes.plot(
            points.route[where], 100 * points.measured[where], marker, color=BLACK, markerfacecolor=fill,
            markersize=size, zorder=3, label=label + note,
        )  # fmt: skip


def _draw_predicted(axes: Axes, points: EfficiencyPoints, where: np.ndarray) -> None:
    """Draw what is predicted where there is no curve: median with 90 % interval, or the least-squares value."""
    predicted, route = 100 * points.predicted[:, where], points.route[where]
    if len(predicted) == 1:
        axes.plot(route, predicted[0], "_", color=BLUE, markersize=8, label="Predicted there")
        return
    low, _, median, _, high = predicted
    axes.errorbar(
        route, median, (median - low, high - median), fmt="_", color=BLUE, markersize=8, capsize=3, linewidth=1.1,
        label="Predicted there, 90 % interval",
    )  # fmt: skip


def _draw_optimum_density(axes: Axes, data: EfficiencyAlongRoute, optimum: OptimalLength) -> None:
    """Draw the density of the optimal length."""
    assert data.optimal_length is not None  # comes with the optimum
    grid = np.linspace(*data.route_range, 2 * GRID_POINTS)
    height = density(data.optimal_length, grid, *data.route_range)
    axes.fill_between(grid, height, color=BLUE, alpha=0.38, linewidth=0)
    axes.plot(grid, height, color=BLUE, linewidth=1.0)
    axes.set_ylim(0, 1.12 * height.max())
    axes.set_title("Where the optimum lies", loc="left", fontsize=SMALL)
    axes.set_ylabel(f"Density (1/{optimum.unit})", fontsize=SMALL)
    axes.locator_params(axis="y", nbins=3)
    if optimum.at_edge > LEAST_AT_EDGE:
        left = bool(optimum.length.median > np.mean(data.route_range))
        remark = f"at an end of the range with {percent(round(optimum.at_edge, 3))} probability"
        room = 0.4 * axes.bbox.width / axes.figure.dpi  # beside the density
        axes.text(
            0.03 if left else 0.97, 0.9, wrap_words(remark, room),
            transform=axes.transAxes, ha="left" if left else "right", va="top", fontsize=SMALL,
        )  # fmt: skip


def _draw_optimum_marks(axes: Axes, optimum: OptimalLength) -> None:
    """Draw the median optimum, and the window of lengths that are good enough."""
    length, window, unit = optimum.length, optimum.window, optimum.unit
    median, low, high = rounded_texts((length.median, length.q05, length.q95), length.q95 - length.q05)
    label = f"Optimum {median} {unit} (90 % interval {low} to {high} {unit})"
    axes.axvline(length.median, color=VERMILLION, linestyle="--", linewidth=1.1, label=label)
    if np.isfinite(window.start):
        good = f"Within {percent(window.within)} of the best with {percent(window.probability)} probability"
        axes.axvspan(
            window.start, window.stop, facecolor="#D9EFE6", edgecolor=GREEN, linestyle=":", zorder=0.5, label=good
        )


def _draw_choices(axes: Axes, optimum: OptimalLength, span: float) -> None:
    """Draw a bar for each choice; lengths that are far apart get bars of a tenth of the span at most."""
    lengths = np.array([choice.length for choice in optimum.choices])
    probability = 100 * np.array([choice.probability_best for choice in optimum.choices])
    width = 0.5 * float(np.min(np.diff(np.unique(lengths)), initial=0.1 * span))
    axes.bar(lengths, probability, width, color=ORANGE, edgecolor=BLACK, linewidth=0.6)
    axes.plot(lengths, np.zeros(len(lengths)), "|", color=BLACK, clip_on=False, markersize=5)
    if len(lengths) <= MOST_NUMBERS:
        for length, height in zip(lengths, probability, strict=True):
            axes.annotate(
                f"{height:.0f}" if height >= SMALLEST_NUMBER else "", (length, height), (0, 1.5), textcoords="offset points",
                ha="center", va="bottom", fontsize=6,
            )  # fmt: skip
    axes.set_ylim(0, 1.25 * probability.max())
    axes.set_title("Which choice is the best", loc="left", fontsize=SMALL)
    axes.set_ylabel("Probability (%)", fontsize=SMALL)
    axes.locator_params(axis="y", nbins=3)


def make_efficiency_chart(data: EfficiencyAlongRoute) -> tuple[Chart]:
    """Return the chart of the curve with its intervals, measured points, and the lengths that are good enough.

    Args:
        data: Data of the figure.
    """
    points = [_points_group(table) for table in data.points if np.isfinite(table.route).any()]
    groups = (*_new_run_group(data), _curve_group(data.efficiency), *points, *_left_out_group(data.left_out))
    force = "" if data.at_input_force is None else f", curve at {data.at_input_force:g} N"
    return (Chart("Efficiency", data.route_label, EFFICIENCY + force, groups, _optimum_spans(data)),)


def _new_run_group(data: EfficiencyAlongRoute) -> tuple[SeriesGroup, ...]:
    """Return the interval of the efficiencies of runs, each on a mounting of its own."""
    if data.new_run is None:
        return ()
    low, high = 100 * data.new_run
    return (SeriesGroup(data.efficiency.route, (Series(NEW_RUN, "low", "blue", low), Series(NEW_RUN, "high", "blue", high))),)


def _curve_group(band: Band) -> SeriesGroup:
    """Return the curve with its intervals."""
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
    """Return the measured points; those at one place one after the other, as near as they can be told apart."""
    order = np.flatnonzero(np.isfinite(points.route))
    order = order[np.argsort(points.route[order], kind="stable")]
    route, measured = _separate(points.route[order]), 100 * points.measured[order]
    inside, (_, _, label) = points.inside[order], RUN if points.of_runs else READING
    series = [Series(label, "points", "black", np.where(inside, measured, np.nan))]
    if not inside.all():
        series.append(Series(f"{label}, outside the range", "hollow", "black", np.where(inside, np.nan, measured)))
        rows = np.where(inside, np.nan, 100 * points.predicted[:, order])
        if len(rows) > 1:
            label = f"Predicted there, {WIDE_INTERVAL}"
            series += [Series(label, "from", "blue", rows[0]), Series(label, "to", "blue", rows[-1])]
        series.append(Series("Predicted there", "hollow", "blue", rows[len(rows) // 2]))
    return SeriesGroup(route, tuple(series))


def _left_out_group(points: np.ndarray) -> tuple[SeriesGroup, ...]:
    """Return the readings that the user leaves out."""
    route, efficiency = points[:, np.argsort(points[0], kind="stable")]
    return (SeriesGroup(_separate(route), (Series(LEFT_OUT, "hollow", "gray", 100 * efficiency),)),) if len(route) else ()


def _separate(route: np.ndarray) -> np.ndarray:
    """Return ascending places, moved apart where they are equal."""
    positions = np.array(route, dtype=float)
    least = 1e-6 * max(float(np.ptp(route)), float(np.abs(route).max()), 1e-9)
    for i in range(1, len(positions)):
        positions[i] = max(positions[i], positions[i - 1] + least)
    return positions


def _optimum_spans(data: EfficiencyAlongRoute) -> tuple[Span, ...]:
    """Return the lengths that are good enough, and the best one as a line."""
    best = data.optimum
    if best is None:
        return ()
    line = Span(f"Best {best.what}", "vermillion", best.length.median, best.length.median)
    if not best.is_certain:
        return (line,)
    return Span(f"Within {percent(best.window.within)} of the best", "window", best.window.start, best.window.stop), line
