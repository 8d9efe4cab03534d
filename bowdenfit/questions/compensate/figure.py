"""What may be hidden by bend, what preload does, and the torques through time as in figures 9 to 11 of the haptic paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import TITLE, legend_above, panels
from bowdenfit.plots.style import BLUE, GREEN, SERIES_LINES, VERMILLION, WRAP_ANGLE, in_paper_style
from bowdenfit.questions.compensate.simulated import ACTIVE, KARNOPP, NONE

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.compensate.answer import Compensation
    from bowdenfit.questions.compensate.simulated import Law

_TITLES = {NONE: "Nothing hidden", KARNOPP: "Fed forward", ACTIVE: "Fed back"}
_HEIGHT = 1.9  # in
_TORQUE = "Torque (N m)"


@in_paper_style
def draw(found: Compensation) -> Figure:
    """Friction with what may be fed forward, and the preload; below them the simulated torques, a panel a law."""
    figure, (friction, preload) = panels([_HEIGHT], 2, TITLE, (0.75, 0))
    _friction(friction, found)
    _preload(preload, found)
    legend_above(figure, [friction, preload], columns=3)
    return figure


@in_paper_style
def draw_traces(found: Compensation) -> Figure:
    """Torques at motor and joint while a hand moves the device to and fro, a panel a law."""
    seen = found.simulated
    assert seen is not None  # asked only of a simulation
    figure, shown = panels([_HEIGHT], len(seen.laws), TITLE, (0.25, 0), sharey=True)
    for axes, law in zip(shown, seen.laws, strict=True):
        _torques(axes, law)
    shown[0].set_ylabel(_TORQUE)
    legend_above(figure, shown, columns=2)
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


def _torques(axes: Axes, law: Law) -> None:
    axes.plot(law.trace.time, law.trace.motor, color=BLUE, linewidth=0.9, label="At the motor")
    axes.plot(
        law.trace.time,
        law.trace.joint,
        color=VERMILLION,
        linestyle=SERIES_LINES[1],
        linewidth=0.9,
        label="At the joint",
    )
    axes.set_xlabel("Time (s)")
    axes.set_title(_TITLES[law.name], loc="left")
