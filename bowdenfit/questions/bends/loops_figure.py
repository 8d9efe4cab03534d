"""Output against input force of a preloaded loop, moving forward and back, a panel for each wrap angle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.bands import draw_quantiles, evenly, middle, name_band, say_of_how_many
from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import alike, enlarge_marks, label_outer, recording_panels, set_limits, span
from bowdenfit.plots.style import BLACK, BLUE, GRAY, LEAST_SQUARES, MEDIAN, PURPLE, VERMILLION, in_paper_style

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.bends.figure_data import LoopCurve
    from bowdenfit.questions.summary.figure_data import FigureData

MOST, MOST_COLUMNS = 6, 3
WORD_ROOM = 0.075  # share of a panel's width that a word along the line takes
# stroke, name, marker, size [pt], color
STROKES = (
    (1, "Read moving forward", "o", 3.4, BLUE),
    (-1, "Read moving back", "s", 3.2, VERMILLION),
    (0, "Recorded", "o", 1.2, GRAY),
)


def has_loops(data: FigureData) -> bool:
    """Whether the cable is a loop with preload."""
    return bool(data.elastic.loops)


@in_paper_style
def loops(data: FigureData) -> Figure:
    """Output against input force [N], a panel for each of at most six wrap angles."""
    shown = evenly(data.elastic.loops, MOST)
    across = [span([loop.input_force, loop.points_input], room=0.03) for loop in shown]
    up = [span([loop.forward, loop.back, loop.points_output]) for loop in shown]
    share_x, share_y = alike(across), alike(up)
    names = [loop.label for loop in shown]
    figure, flat, columns = recording_panels(names, MOST_COLUMNS, None, share_x, share_y)
    set_limits(flat, across, "x", share_x)
    set_limits(flat, up, "y", share_y)
    for axes, loop in zip(flat, shown, strict=True):
        axes.locator_params(nbins=6, steps=[1, 2, 2.5, 5, 10])
        _curves(axes, loop)
        _readings(axes, loop)
        _slack(axes, loop)
    label_outer(flat, columns, "Input force (N)", "Output force (N)")
    say_of_how_many(flat[-1], len(shown), len(data.elastic.loops), "wrap angles")
    legend_above(figure, flat, columns={1: 2, 2: 3}.get(columns, 4))
    enlarge_marks(figure)
    return figure


def _curves(axes: Axes, loop: LoopCurve) -> None:
    """Both ways, and the way forward of a rope without preload."""
    name = (MEDIAN if len(loop.forward) > 1 else LEAST_SQUARES).lower()
    draw_quantiles(axes, loop.input_force, loop.forward, BLUE, label=f"Forward, {name}")
    draw_quantiles(axes, loop.input_force, loop.back, VERMILLION, label=f"Back, {name}")
    name_band(axes, loop.forward)
    axes.plot(
        loop.input_force, loop.capstan, color=BLACK, linestyle=(0, (4, 1.6)), linewidth=1.0, zorder=2.5,
        label="Forward, no preload",
    )  # fmt: skip


def _readings(axes: Axes, loop: LoopCurve) -> None:
    """Forces by stroke; those of recordings are many and small."""
    for stroke, name, marker, size, color in STROKES:
        here = loop.points_stroke == stroke
        if here.any():
            edge = {"markeredgewidth": 0.0} if stroke == 0 else {"markeredgewidth": 0.5, "markeredgecolor": "white"}
            axes.plot(
                loop.points_input[here], loop.points_output[here], marker, color=color, markersize=size, **edge,
                zorder=2.2 if stroke == 0 else 3, label=name, rasterized=stroke == 0,
            )  # fmt: skip


def _slack(axes: Axes, loop: LoopCurve) -> None:
    """The input force at which the return side goes slack, where it is shown, and what the rope is on either side."""
    low, high = axes.get_xlim()
    load = float(middle(loop.slack_load))
    if not low < load < high:
        return
    if len(loop.slack_load) > 1:
        axes.axvspan(
            max(loop.slack_load[0], low), min(loop.slack_load[-1], high), facecolor=PURPLE, alpha=0.25, linewidth=0,
            zorder=0.5,
        )  # fmt: skip
    axes.axvline(load, color=PURPLE, linewidth=1.0, zorder=1.5, label="Return side goes slack")
    axes.set_xlim(low, high)
    _branches(axes, loop, (load - low) / (high - low))


def _branches(axes: Axes, loop: LoopCurve, place: float) -> None:
    """Both branches named along the line, at the end of it that is farther from the loop."""
    bottom, top = axes.get_ylim()
    height = float(np.interp(middle(loop.slack_load), loop.input_force, middle(loop.forward + loop.back) / 2))
    y, side = (0.02, "bottom") if height > (bottom + top) / 2 else (0.98, "top")
    for words, align, room, shift in (
        ("return side taut", "right", place, -0.015),
        ("slack", "left", 1 - place, 0.015),
    ):
        if room > WORD_ROOM:
            axes.text(
                place + shift, y, words, transform=axes.transAxes, rotation=90, ha=align, va=side, fontsize=6,
                color="#8A3A68", zorder=4,
            )  # fmt: skip
