"""Preload between fixed ends against the wrap angle, and where bending lets the rope go slack."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import describe_curve, describe_left_out, describe_strip
from bowdenfit.plots.curves import draw_quantiles, middle, name_band
from bowdenfit.plots.layout import legend_above, panels
from bowdenfit.plots.panels import draw_left_out, span
from bowdenfit.plots.strips import STRIP, finish_strips, name_strip, place_names
from bowdenfit.plots.style import BLACK, BLUE, LEAST_SQUARES, LIGHT, MEDIAN, MEDIUM, WRAP_ANGLE, in_paper_style, percent
from bowdenfit.questions import bends as room
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Preload against the wrap angle"
DARK = "#C4C4C4"
PERHAPS, RATHER = 0.05, 0.5  # chosen probabilities of being slack from which on a region is shaded lightly and darkly
PLACES = 2001  # along the wrap angle, for the ends of the regions


@dataclass(frozen=True)
class PreloadCurve:
    """Preload against the wrap angle between fixed ends.

    Args:
        wrap_angle: Wrap angle of the curves [deg].
        preload: Quantiles of the preload [N].
        slack: Quantiles of the slack [mm].
        slack_probability: Share of the draws that are slack.
        points_wrap_angle, points_preload: Readings [deg, N].
        left_out: Wrap angle and preload of the readings that the user leaves out [deg, N].
    """

    wrap_angle: np.ndarray
    preload: np.ndarray
    slack: np.ndarray
    slack_probability: np.ndarray
    points_wrap_angle: np.ndarray
    points_preload: np.ndarray
    left_out: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))


def data(fit: Record) -> PreloadCurve | None:
    """Return preload and slack against the wrap angle; None where preload does not depend on the wrap angle."""
    return room.collect_preload(fit)


def caption(curve: PreloadCurve) -> str:
    """Describe what is drawn, in plain words."""
    n = len(curve.points_preload)
    return " ".join(filter(None, (
        "Tension of the rope between fixed ends, which bending changes because it lengthens the sheath.",
        describe_curve(len(curve.preload) > 1),
        "Gray: where the rope is slack." if np.max(curve.slack) > 0 else "",
        describe_left_out(curve.left_out),
        describe_strip("in N") if n else "",
        f"n = {counted(n, 'reading')}." if n else "Preload was read at no bend; the curve follows from the other tables.",
    )))  # fmt: skip


@in_paper_style
def draw(curve: PreloadCurve, width: float | None = None) -> Figure:
    """Draw preload [N] against the wrap angle [deg], and below it the slack [mm] where there is any."""
    ever_slack = bool(np.max(curve.slack) > 0)
    read = len(curve.points_wrap_angle) > 0
    heights = [2.2, *([STRIP] if read else []), *([0.9] if ever_slack else [])]
    figure, flat = panels(heights, 1, 0.02, (0, 0.16), width or MEDIUM, sharex=True)
    _draw_preload(flat[0], curve)
    if read:
        _draw_residuals(flat[1], curve)
        place_names(flat[0], flat[1])
    if ever_slack:
        draw_quantiles(flat[-1], curve.wrap_angle, curve.slack, BLUE)
        _start_at_zero(flat[-1], "Slack (mm)", curve.slack)
    for axes in flat:
        _shade_slack(axes, curve)
    flat[-1].set_xlabel(WRAP_ANGLE)
    flat[-1].set_xlim(*span([curve.wrap_angle, curve.points_wrap_angle], room=0.02))
    draw_left_out(flat[0], curve.left_out)
    legend_above(figure, flat, columns=2)
    return figure


def _draw_preload(axes: Axes, curve: PreloadCurve) -> None:
    """Draw the curve and the readings."""
    name = MEDIAN if len(curve.preload) > 1 else LEAST_SQUARES
    draw_quantiles(axes, curve.wrap_angle, curve.preload, BLUE, label=name)
    name_band(axes, curve.preload, BLUE)
    if len(curve.points_wrap_angle):
        axes.plot(curve.points_wrap_angle, curve.points_preload, "o", color=BLACK, zorder=3, label="Reading")
    _start_at_zero(axes, "Preload (N)", curve.preload, curve.points_preload)


def _draw_residuals(strip: Axes, curve: PreloadCurve) -> None:
    """Draw readings less the curve."""
    order = np.argsort(curve.wrap_angle)
    line = np.interp(curve.points_wrap_angle, curve.wrap_angle[order], middle(curve.preload)[order])
    strip.plot(curve.points_wrap_angle, curve.points_preload - line, "o", color=BLACK, markersize=3.6)
    finish_strips([strip])
    name_strip(strip, "N")


def _start_at_zero(axes: Axes, label: str, *values: np.ndarray) -> None:
    """Let an axis begin just below zero, so that a line on it is seen, and end above everything."""
    highest = span([np.zeros(1), *values])[1]
    axes.set_ylim(-0.03 * highest, highest)
    axes.locator_params(axis="y", nbins=5 if axes.get_position().height < 0.3 else 7)
    axes.set_ylabel(label)


def _shade_slack(axes: Axes, curve: PreloadCurve) -> None:
    """Shade where the rope is slack in most draws, and where in some."""
    angle = np.linspace(curve.wrap_angle.min(), curve.wrap_angle.max(), PLACES)
    order = np.argsort(curve.wrap_angle)
    share = np.interp(angle, curve.wrap_angle[order], curve.slack_probability[order])
    some = f"Slack with {percent(PERHAPS)} to {percent(RATHER)} probability"
    most = f"Slack with more than {percent(RATHER)} probability" if len(curve.preload) > 1 else "Slack"
    regions = (((share >= PERHAPS) & (share <= RATHER), LIGHT, some), (share > RATHER, DARK, most))
    for here, color, label in regions if len(curve.preload) > 1 else regions[1:]:
        for start, stop in true_stretches(here):
            axes.axvspan(angle[start], angle[stop], facecolor=color, linewidth=0, zorder=0.4, label=label)


def true_stretches(flags: np.ndarray) -> list[tuple[int, int]]:
    """Return the first and last index of each run of true values, in order."""
    steps = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(a), int(b) - 1) for a, b in steps.reshape(-1, 2)]
