"""Figure of compensation: what may be fed forward by bend, and what preload does."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import TITLE, legend_above, panels
from bowdenfit.plots.style import BLUE, GREEN, SERIES_LINES, VERMILLION, WRAP_ANGLE, in_paper_style
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.addons.device.compensate.answer import Compensation
    from bowdenfit.plots.layout import Axes, Figure

HEADING = "How much friction may be compensated"
_HEIGHT = 1.9  # in
_TORQUE = "Torque (N m)"


def caption(answer: Compensation) -> str:
    """Say what is drawn, in plain words."""
    fed = (
        " Dashed and dotted: what a controller may feed forward without the device moving on its own."
        if answer.fixed
        else ""
    )
    return (
        f"Left: friction of the loop by wrap angle, median and 90 % interval.{fed} Right: torque in free motion, "
        "and torque from which on the rope goes slack, by preload, median and 90 % interval. "
        f"n = {counted(len(answer.by_bend), 'bend')} and {counted(len(answer.preloads), 'preload')}."
    )


@in_paper_style
def draw(answer: Compensation) -> Figure:
    """Draw friction with what may be fed forward, and the preload."""
    figure, (friction, preload) = panels([_HEIGHT], 2, TITLE, (0.75, 0))
    _draw_friction(friction, answer)
    _draw_preload(preload, answer)
    legend_above(figure, [friction, preload], columns=3)
    return figure


def _draw_friction(axes: Axes, answer: Compensation) -> None:
    wrap_angles = np.array([bend.wrap_angle for bend in answer.by_bend])
    low, median, high = (
        np.array([getattr(bend.friction, q) for bend in answer.by_bend]) for q in ("q05", "median", "q95")
    )
    single = len(wrap_angles) == 1
    wrap_angles = np.array([wrap_angles[0] - 1, wrap_angles[0] + 1]) if single else wrap_angles
    low, median, high = (np.repeat(values, 2) if single else values for values in (low, median, high))
    axes.fill_between(wrap_angles, low, high, color=BLUE, alpha=0.25, linewidth=0, label="Friction, 90 % interval")
    axes.plot(wrap_angles, median, color=BLUE, label="Friction, median")
    if answer.scheduled is not None and answer.fixed is not None:
        feed_forward = np.array([bend.scheduled for bend in answer.by_bend])
        axes.plot(
            wrap_angles,
            np.repeat(feed_forward, 2) if single else feed_forward,
            color=VERMILLION,
            linestyle=SERIES_LINES[1],
            label="Fed forward by bend",
        )
        axes.axhline(
            answer.fixed.torque, color=GREEN, linestyle=SERIES_LINES[2], label="Fed forward, one for all bends"
        )
    axes.set(xlabel=WRAP_ANGLE, ylabel=_TORQUE)
    axes.set_ylim(bottom=0)
    axes.set_title("What may be fed forward", loc="left")


def _draw_preload(axes: Axes, answer: Compensation) -> None:
    preloads = np.array([row.preload for row in answer.preloads])
    for name, color, line, label in (
        ("friction", BLUE, SERIES_LINES[0], "Friction in free motion"),
        ("slack_from", VERMILLION, SERIES_LINES[3], "Slack from this torque on"),
    ):
        intervals = [getattr(row, name) for row in answer.preloads]
        axes.fill_between(
            preloads, [k.q05 for k in intervals], [k.q95 for k in intervals], color=color, alpha=0.25, linewidth=0
        )
        axes.plot(
            preloads, [k.median for k in intervals], color=color, linestyle=line, marker="o", markersize=3, label=label
        )
    axes.set(xlabel="Preload (N)", ylabel=_TORQUE)
    axes.set_ylim(bottom=0)
    axes.set_title("What preload does", loc="left")
