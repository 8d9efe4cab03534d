"""Stretch of the rope against its load, a curve for each wrap angle, loading and coming down again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit.plots.bands import draw_quantiles, evenly, name_band, say_of_how_many
from bowdenfit.plots.layout import legend_above, panels
from bowdenfit.plots.panels import span
from bowdenfit.plots.style import BLACK, GRAY, LEAST_SQUARES, MEDIAN, MEDIUM, in_paper_style, mapped_color

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.bends.figure_data import StretchCurve
    from bowdenfit.questions.summary.figure_data import FigureData

MOST, MOST_COLUMNS = 8, 4  # wrap angles in a panel, and columns of its legend
DARKEST, LIGHTEST = 0.0, 0.86  # ends of the color map in use; what follows is too light on white
DASHES = (0, (4, 1.6))
MARKERS = ("o", "s", "^", "D", "v", "p", "<", "h")  # whose open forms can be told from the filled ones


def has_stretch(data: FigureData) -> bool:
    """Whether the rope's stretch is known at any wrap angle."""
    return bool(data.elastic.stretch)


@in_paper_style
def stretch(data: FigureData) -> Figure:
    """Stretch [mm] against load [N], a color for each wrap angle."""
    every = sorted(data.elastic.stretch, key=lambda curve: curve.wrap_angle)
    shown = evenly(every, MOST)
    figure, (axes,) = panels([2.9], 1, 0.02, (0, 0), MEDIUM)
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    rows = _explain(axes, shown)
    for i, curve in enumerate(shown):
        _curve(axes, curve, _color(i, len(shown)), MARKERS[i])
    axes.set_xlim(*span([v for c in shown for v in (c.load, c.points_load)], room=0.03))
    axes.set(xlabel="Load (N)", ylabel="Stretch (mm)")
    say_of_how_many(axes, len(shown), len(every))
    legend_above(figure, [axes], columns=min(MOST_COLUMNS, 1 - (-len(shown) // rows)))
    return figure


def _color(number: int, of: int) -> Any:
    """From dark to light as the wrap angle grows."""
    return mapped_color("viridis", DARKEST + (LIGHTEST - DARKEST) * number / max(of - 1, 1))


def _curve(axes: Axes, curve: StretchCurve, color: Any, marker: str) -> None:
    """Both branches of one wrap angle, and the readings on each."""
    draw_quantiles(axes, curve.load, curve.loading, color)
    if curve.unloading is not None:
        draw_quantiles(axes, curve.load, curve.unloading, color, linestyle=DASHES)
    down = curve.points_unloading.astype(bool)
    for here, fill in ((~down, color), (down, "white")):
        axes.plot(
            curve.points_load[here], curve.points_stretch[here], marker, color=color, markersize=3.8,
            markerfacecolor=fill, zorder=3,
        )  # fmt: skip
    axes.plot([], [], marker=marker, markersize=3.8, color=color, label=f"{curve.wrap_angle:.4g} deg")


def _explain(axes: Axes, shown: Sequence[StretchCurve]) -> int:
    """Entries of the legend for what all wrap angles share, which fill its first column; how many they are."""
    name = MEDIAN if len(shown[0].loading) > 1 else LEAST_SQUARES
    down = any(c.unloading is not None or np.any(c.points_unloading) for c in shown)
    both = ((f"{name}, loading", "-", GRAY), (f"{name}, unloading", DASHES, "white"))
    for words, line, fill in both if down else ((name, "-", GRAY),):
        axes.plot([], [], linestyle=line, marker="o", markersize=3.8, color=GRAY, markerfacecolor=fill, label=words)
    name_band(axes, shown[0].loading)
    return (2 if down else 1) + (len(shown[0].loading) > 1)
