"""What may be hidden by bend, and what preload does."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import TITLE, legend_above, panels
from bowdenfit.plots.style import BLUE, GREEN, SERIES_LINES, VERMILLION, WRAP_ANGLE, in_paper_style
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.compensate.answer import Compensation

HEADING = "How much friction may be hidden"
_HEIGHT = 1.9  # in
_TORQUE = "Torque (N m)"


def caption(found: Compensation) -> str:
    """What is drawn, in plain words."""
    fed = " Dashed and dotted: what a controller may feed forward without the device moving by itself." if found.fixed else ""
    return (
        f"Left: friction of the loop by wrap angle, median and 90 % interval.{fed} Right: torque that is felt in free motion, "
        "and torque from which on the rope goes slack, by preload, median and 90 % interval. "
        f"n = {counted(len(found.by_bend), 'bend')} and {counted(len(found.preloads), 'preload')}."
    )


@in_paper_style
def draw(found: Compensation) -> Figure:
    """Friction with what may be fed forward, and the preload."""
    figure, (friction, preload) = panels([_HEIGHT], 2, TITLE, (0.75, 0))
    _friction(friction, found)
    _preload(preload, found)
    legend_above(figure, [friction, preload], columns=3)
    return figure


def _friction(axes: Axes, found: Compensation) -> None:
    at = np.array([bend.wrap_angle for bend in found.by_bend])
    low, median, high = (
        np.array([getattr(bend.friction, q) for bend in found.by_bend]) for q in ("q05", "median", "q95")
    )
    single = len(at) == 1
    at = np.array([at[0] - 1, at[0] + 1]) if single else at
    low, median, high = (np.repeat(each, 2) if single else each for each in (low, median, high))
    axes.fill_between(at, low, high, color=BLUE, alpha=0.25, linewidth=0, label="Friction, 90 % interval")
    axes.plot(at, median, color=BLUE, label="Friction, median")
    if found.scheduled is not None and found.fixed is not None:
        fed = np.array([bend.scheduled for bend in found.by_bend])
        axes.plot(
            at,
            np.repeat(fed, 2) if single else fed,
            color=VERMILLION,
            linestyle=SERIES_LINES[1],
            label="Fed forward by bend",
        )
        axes.axhline(found.fixed.torque, color=GREEN, linestyle=SERIES_LINES[2], label="Fed forward, one for all bends")
    axes.set(xlabel=WRAP_ANGLE, ylabel=_TORQUE)
    axes.set_ylim(bottom=0)
    axes.set_title("What may be fed forward", loc="left")


def _preload(axes: Axes, found: Compensation) -> None:
    at = np.array([row.preload for row in found.preloads])
    for name, color, line, label in (
        ("felt", BLUE, SERIES_LINES[0], "Felt in free motion"),
        ("slack_from", VERMILLION, SERIES_LINES[3], "Slack from this torque on"),
    ):
        known = [getattr(row, name) for row in found.preloads]
        axes.fill_between(at, [k.q05 for k in known], [k.q95 for k in known], color=color, alpha=0.25, linewidth=0)
        axes.plot(at, [k.median for k in known], color=color, linestyle=line, marker="o", markersize=3, label=label)
    axes.set(xlabel="Preload (N)", ylabel=_TORQUE)
    axes.set_ylim(bottom=0)
    axes.set_title("What preload does", loc="left")
