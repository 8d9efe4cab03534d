"""Stretch of the rope against its load, a curve for each wrap angle, loading and coming down again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit.plots.captions import count_shown, describe_curve, describe_left_out, describe_strip
from bowdenfit.plots.curves import choose_evenly, draw_quantiles, middle, name_band, note_shown_count
from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import draw_left_out, span
from bowdenfit.plots.strips import panels_with_strips
from bowdenfit.plots.style import BLACK, GRAY, LEAST_SQUARES, MEDIAN, in_paper_style, mapped_color
from bowdenfit.questions import bends as room
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Stretch against load"
MOST, MOST_COLUMNS = 8, 4  # wrap angles in a panel, and columns of its legend
HEIGHT = 2.6  # in
DARKEST, LIGHTEST = 0.0, 0.86  # ends of the color map in use; what follows is too light on white
DASHES = (0, (4, 1.6))
MARKERS = ("o", "s", "^", "D", "v", "p", "<", "h")  # whose open forms can be told from the filled ones


@dataclass(frozen=True)
class StretchCurve:
    """Stretch at one wrap angle against the load.

    Args:
        wrap_angle: Total wrap angle [deg].
        load: Loads of the curves [N].
        loading: Quantiles of the stretch while the load grows [mm].
        unloading: Quantiles while it comes down from the largest load [mm]; None if no row was read so.
        points_load, points_stretch: Readings [N, mm].
        points_unloading: Whether each was read while the load came down.
        left_out: Load and stretch of the readings that the user leaves out, of all wrap angles, on the first curve [N, mm].
    """

    wrap_angle: float
    load: np.ndarray
    loading: np.ndarray
    unloading: np.ndarray | None
    points_load: np.ndarray
    points_stretch: np.ndarray
    points_unloading: np.ndarray
    left_out: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))


def data(fit: Record) -> tuple[StretchCurve, ...] | None:
    """Return a curve for each wrap angle that stretch was read at; None without such readings."""
    return room.collect_stretch(fit)


def caption(stretch: tuple[StretchCurve, ...]) -> str:
    """Describe what is drawn, in plain words."""
    n, shown = sum(len(curve.points_load) for curve in stretch), min(len(stretch), MOST)
    down = any(np.any(curve.points_unloading) for curve in stretch)
    return " ".join(filter(None, (
        f"Stretch of the rope against its load, at {count_shown(shown, len(stretch), 'wrap angle')}, a color each.",
        describe_curve(len(stretch[0].loading) > 1),
        "Open marks and dashed lines: read while the load came down." if down else "",
        describe_left_out(stretch[0].left_out),
        describe_strip("in mm"),
        f"n = {counted(n, 'reading')}.",
    )))  # fmt: skip


@in_paper_style
def draw(stretch: tuple[StretchCurve, ...], width: float | None = None) -> Figure:
    """Draw stretch [mm] against load [N], a color for each wrap angle."""
    every = sorted(stretch, key=lambda curve: curve.wrap_angle)
    shown = choose_evenly(every, MOST)
    across = span([v for c in shown for v in (c.load, c.points_load)], room=0.03)
    up = span([np.zeros(1), *(v for c in shown for v in (c.loading, c.points_stretch))])
    made = panels_with_strips([""], [across], [up], 1, HEIGHT, width)
    (axes,), (strip,) = made.mains, made.strips
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    rows = _explain(axes, shown)
    for i, curve in enumerate(shown):
        _draw_curve(axes, curve, _color(i, len(shown)), MARKERS[i])
        _draw_marks(strip, curve, _residuals(curve), _color(i, len(shown)), MARKERS[i])
    draw_left_out(axes, stretch[0].left_out)
    made.finish_strips()
    made.label("Load (N)", "Stretch (mm)", "mm")
    note_shown_count(axes, len(shown), len(every))
    legend_above(made.figure, [axes], columns=min(MOST_COLUMNS, 1 - (-len(shown) // rows)))
    return made.figure


def _residuals(curve: StretchCurve) -> np.ndarray:
    """Return readings less the branch on which they were read [mm]."""
    back = curve.loading if curve.unloading is None else curve.unloading
    up, down = (np.interp(curve.points_load, curve.load, middle(line)) for line in (curve.loading, back))
    return np.asarray(curve.points_stretch - np.where(curve.points_unloading, down, up))


def _color(number: int, of: int) -> Any:
    """Return a color from dark to light as the wrap angle grows."""
    return mapped_color("viridis", DARKEST + (LIGHTEST - DARKEST) * number / max(of - 1, 1))


def _draw_curve(axes: Axes, curve: StretchCurve, color: Any, marker: str) -> None:
    """Draw both branches of one wrap angle, and the readings on each."""
    draw_quantiles(axes, curve.load, curve.loading, color)
    if curve.unloading is not None:
        draw_quantiles(axes, curve.load, curve.unloading, color, linestyle=DASHES)
    _draw_marks(axes, curve, curve.points_stretch, color, marker)
    axes.plot([], [], marker=marker, markersize=3.8, color=color, label=f"{curve.wrap_angle:.4g} deg")


def _draw_marks(axes: Axes, curve: StretchCurve, shown: np.ndarray, color: Any, marker: str) -> None:
    """Draw stretch or residuals of the readings, open where the load came down."""
    down = curve.points_unloading.astype(bool)
    for here, fill in ((~down, color), (down, "white")):
        axes.plot(
            curve.points_load[here], shown[here], marker, color=color, markersize=3.8, markerfacecolor=fill, zorder=3
        )


def _explain(axes: Axes, shown: Sequence[StretchCurve]) -> int:
    """Add legend entries for what all wrap angles share, which fill its first column, and return their number."""
    name = MEDIAN if len(shown[0].loading) > 1 else LEAST_SQUARES
    down = any(c.unloading is not None or np.any(c.points_unloading) for c in shown)
    both = ((f"{name}, loading", "-", GRAY), (f"{name}, unloading", DASHES, "white"))
    for words, line, fill in both if down else ((name, "-", GRAY),):
        axes.plot([], [], linestyle=line, marker="o", markersize=3.8, color=GRAY, markerfacecolor=fill, label=words)
    name_band(axes, shown[0].loading)
    return (2 if down else 1) + (len(shown[0].loading) > 1)
