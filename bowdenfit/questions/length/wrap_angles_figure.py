"""Wrap angles against the route: what was read, what was too small to read, and the curve through it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import describe_left_out, describe_strip
from bowdenfit.plots.curves import Band, draw_band, route_limits, shade_outside
from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import draw_left_out
from bowdenfit.plots.strips import panels_with_strips
from bowdenfit.plots.style import BLACK, SERIES_LINES, VERMILLION, WRAP_ANGLE, in_paper_style
from bowdenfit.questions import length
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Wrap angle along the route"
FAMILY_ALONE = "Family alone"
MOST_COLUMNS, HEIGHT = 3, 1.8  # panels in a row, and height of one [in]


@dataclass(frozen=True)
class AngleCurve:
    """One contact's wrap angle [deg]: the curve, and the readings by how they entered.

    Args:
        contact: Name of the contact.
        band: The curve.
        route, angle: Detected readings inside the range of the curve.
        undetected_route, limit: Readings below the detection limit inside the range.
        outside_route, outside_angle: Readings outside the range, which the curve does not use.
        family_alone: The family's curve without its departure, where the band has its points; empty where it does not depart.
        left_out: Route and wrap angle of the readings that the user leaves out.
    """

    contact: str
    band: Band
    route: np.ndarray
    angle: np.ndarray
    undetected_route: np.ndarray
    limit: np.ndarray
    outside_route: np.ndarray
    outside_angle: np.ndarray
    family_alone: np.ndarray
    left_out: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))


@dataclass(frozen=True)
class WrapAngles:
    """The curves of all curved contacts, the axis label of the route, and where the curves hold."""

    curves: tuple[AngleCurve, ...]
    route_label: str
    route_range: tuple[float, float]


def data(fit: Record) -> WrapAngles | None:
    """Return the curves of all curved contacts; None where no contact's wrap angle is a curve."""
    route, curves = fit.dataset.description.route, length.collect_angle_curves(fit)
    return WrapAngles(curves, route.label, route.range) if route is not None and curves else None


def caption(data: WrapAngles) -> str:
    """Describe what is drawn, in plain words."""
    n_read = sum(len(c.route) for c in data.curves)
    limits, unused = sum(len(c.undetected_route) for c in data.curves), sum(len(c.outside_route) for c in data.curves)
    has_draws = not data.curves[0].band.is_line
    return " ".join(filter(None, (
        f"Wrap angle of {counted(len(data.curves), 'contact')} along the route, with the curve through the readings.",
        "Line: median; bands: the intervals that hold the curve with 50 % and 90 % probability, by the angles as they were "
        "read."
        if has_draws else "Line: least squares.",
        "Dashed: the curve's family alone, without its smooth departure."
        if any(len(c.family_alone) for c in data.curves) else "",
        "Hatched: too small to be read, so anything between zero and the triangle." if limits else "",
        "Squares: outside the range of the curve, which does not use them." if unused else "",
        describe_left_out(np.concatenate([c.left_out for c in data.curves], axis=1)),
        describe_strip("in degrees"),
        f"n = {counted(n_read, 'reading')}" + (f" and {counted(limits, 'upper limit')}." if limits else "."),
    )))  # fmt: skip


@in_paper_style
def draw(data: WrapAngles, width: float | None = None) -> Figure:
    """Draw the wrap angle [deg] of each curved contact against the route, a panel each."""
    everywhere = [route for c in data.curves for route in (c.route, c.undetected_route, c.outside_route)]
    shown = route_limits(data.route_range, *everywhere)
    names, top = [curve.contact for curve in data.curves], (0.0, _find_axis_top(data.curves))
    panels = panels_with_strips(names, [shown] * len(names), [top] * len(names), MOST_COLUMNS, HEIGHT, width)
    for axes, strip, curve in zip(panels.mains, panels.strips, data.curves, strict=True):
        draw_band(axes, curve.band)
        if len(curve.family_alone):
            axes.plot(curve.band.route, curve.family_alone, color=VERMILLION, linestyle=SERIES_LINES[1], label=FAMILY_ALONE)
        _draw_readings(axes, curve)
        strip.plot(curve.route, _residuals(curve), "o", color=BLACK, markersize=3.6)
        shade_outside(strip, data.route_range, shown)
        _draw_undetected(axes, curve, data.route_range, _find_spacing(everywhere, shown))
        shade_outside(axes, data.route_range, shown)
        draw_left_out(axes, curve.left_out)
        axes.locator_params(axis="y", nbins=7)
    panels.finish_strips()
    panels.label(data.route_label, WRAP_ANGLE, "deg")
    legend_above(panels.figure, panels.mains, columns=4 if panels.columns > 1 else 2)
    return panels.figure


def _residuals(curve: AngleCurve) -> np.ndarray:
    """Return readings less the curve that they follow [deg]."""
    middle = curve.band.quantiles[len(curve.band.quantiles) // 2]
    return np.asarray(curve.angle - np.interp(curve.route, curve.band.route, middle))


def _draw_readings(axes: Axes, curve: AngleCurve) -> None:
    """Draw the readings that the curve follows, and those that it does not."""
    axes.plot(curve.route, curve.angle, "o", color=BLACK, label="Reading")
    if len(curve.outside_route):
        axes.plot(
            curve.outside_route, curve.outside_angle, "s", color=BLACK, markerfacecolor="white",
            label="Not used by the curve",
        )  # fmt: skip


def _draw_undetected(axes: Axes, curve: AngleCurve, route_range: tuple[float, float], spacing: float) -> None:
    """Draw readings that may be anything between zero and their limit."""
    route, limit = curve.undetected_route, curve.limit
    if not len(route):
        return
    start, stop = (np.clip(route + side * spacing / 2, *route_range) for side in (-1, 1))
    axes.bar(
        start, limit, stop - start, align="edge", color="none", edgecolor="#999999", linewidth=0, hatch="//////",
        zorder=0.6, label="Too small to detect",
    )  # fmt: skip
    axes.plot(route, limit, "v", color=BLACK, markerfacecolor="white", label="Not detected, at its limit")


def _find_spacing(routes: list[np.ndarray], shown: tuple[float, float]) -> float:
    """Return the distance from one reading to the next."""
    steps = np.diff(np.unique(np.concatenate(routes)))
    return float(np.min(steps)) if len(steps) else 0.02 * (shown[1] - shown[0])


def _find_axis_top(curves: tuple[AngleCurve, ...]) -> float:
    """Return the top of the axis: above every reading, and above every interval unless that is far above the readings."""
    readings = np.concatenate([values for c in curves for values in (c.angle, c.limit, c.outside_angle)])
    band, reading = max(c.band.quantiles.max() for c in curves), readings.max(initial=0.0)
    return 1.06 * float(max(reading, min(band, 2 * reading) if reading else band))
