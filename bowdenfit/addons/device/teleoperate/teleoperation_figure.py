"""Figure of teleoperation: which walls are stable, and one contact through time as in figures 12 to 14 of the haptic paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.addons.device.teleoperate.stability import FREE_SECONDS
from bowdenfit.plots.layout import TITLE, legend_above, panels
from bowdenfit.plots.style import BLUE, GRAY, SERIES_COLORS, SERIES_LINES, SERIES_MARKERS, VERMILLION, in_paper_style
from bowdenfit.words import listed

if TYPE_CHECKING:
    from bowdenfit.addons.device.teleoperate.answer import Teleoperation
    from bowdenfit.plots.layout import Axes, Figure

HEADING = "What a hand feels of a remote wall"
RISE = 0.05  # of the probability of stable contact, from which a second rise is said; a judgement
_HEIGHT, _DOWN = 1.7, 0.62  # in


def caption(answer: Teleoperation) -> str:
    """Say what is drawn, in plain words."""
    rises = [s.name for s in answer.schemes if s.stable[-1] > s.stable.min() + RISE]
    again = f"harder walls than the worst are likelier stable again with {listed(rises)}; " if rises else ""
    return (
        "Top left: probability that the slave touches a wall without oscillating, by the stiffness of the wall, for each "
        "coupling, by the linear loop without dry friction; "
        f"{again}the gray line is {100 * answer.probability:.0f} %. The others are one simulation with median parameters, "
        "in free motion for 2 s and then against the wall: angles of the master's joint and of the slave, torques of hand and "
        "wall, and each torque against its angle in contact, with the stiffness that a hand feels by the formula. "
        f"n = {answer.draws} devices and {len(answer.walls)} walls."
    )


@in_paper_style
def draw(answer: Teleoperation) -> Figure:
    """Draw the probability of stable contact by wall, then positions, torques, and torque against position."""
    figure, (walls, position, torque, stiffness) = panels([_HEIGHT, _HEIGHT], 2, TITLE, (0.75, _DOWN))
    _draw_walls(walls, answer)
    _draw_traces(position, torque, answer)
    _draw_contact(stiffness, answer)
    legend_above(figure, [walls, position, stiffness], columns=4)
    return figure


def _draw_walls(axes: Axes, answer: Teleoperation) -> None:
    for i, scheme in enumerate(answer.schemes):
        axes.plot(
            answer.walls, 100 * scheme.stable, color=SERIES_COLORS[i + 2], linestyle=SERIES_LINES[i % 4],
            marker=SERIES_MARKERS[i], markersize=3, label=f"{scheme.name[0].upper()}{scheme.name[1:]}",
        )  # fmt: skip
    axes.axhline(100 * answer.probability, color=GRAY, linewidth=0.8)
    axes.set_xscale("log")
    axes.set(xlabel="Stiffness of the wall (N m/rad)", ylabel="Stable contact (%)", ylim=(-3, 103))
    axes.set_title("Which walls are stable, linear loop", loc="left")


def _draw_traces(position: Axes, torque: Axes, answer: Teleoperation) -> None:
    contact = answer.contact
    for axes, master, slave in (
        (position, contact.master, contact.slave),
        (torque, contact.hand_torque, contact.wall_torque),
    ):
        axes.plot(contact.time, master, color=BLUE, linewidth=1.0, label="Master and hand")
        axes.plot(
            contact.time, slave, color=VERMILLION, linestyle=SERIES_LINES[1], linewidth=1.0, label="Slave and wall"
        )
        axes.set_xlabel("Time (s)")
    position.set_ylabel("Angle (rad)")
    position.set_title("Positions", loc="left")
    torque.set_ylabel("Torque (N m)")
    torque.set_title("Torques of hand and wall", loc="left")


def _draw_contact(axes: Axes, answer: Teleoperation) -> None:
    contact, stated = answer.contact, answer.stated.stiffness
    touching = contact.time > FREE_SECONDS
    axes.plot(contact.master[touching], contact.hand_torque[touching], color=BLUE, linewidth=1.0)
    axes.plot(
        contact.slave[touching],
        contact.wall_torque[touching],
        color=VERMILLION,
        linestyle=SERIES_LINES[1],
        linewidth=1.0,
    )
    hard = contact.wall_torque > 0
    if stated is not None and np.any(touching & hard):
        first = int(np.argmax(touching & hard))
        at = contact.master[first] + np.array([0.0, 0.6 / stated.median])
        axes.plot(
            at, contact.hand_torque[first] + stated.median * (at - at[0]), color=GRAY, linestyle=SERIES_LINES[2],
            label="Stiffness by the formula",
        )  # fmt: skip
    axes.locator_params(axis="x", nbins=5)
    axes.set(xlabel="Angle (rad)", ylabel="Torque (N m)")
    axes.set_title("Stiffness felt and touched", loc="left")
