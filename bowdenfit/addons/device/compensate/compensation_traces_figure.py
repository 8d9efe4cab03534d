"""Torques of a simulated device through time, as in figures 9 to 11 of the haptic paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bowdenfit.addons.device.compensate.answer import ACTIVE, KARNOPP, NONE
from bowdenfit.plots.layout import TITLE, legend_above, panels
from bowdenfit.plots.style import BLUE, SERIES_LINES, VERMILLION, in_paper_style
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.addons.device.compensate.answer import Compensation, SimulatedLaw
    from bowdenfit.plots.layout import Axes, Figure

HEADING = "Torques while a hand moves the device"
_TITLES = {NONE: "Nothing hidden", KARNOPP: "Fed forward", ACTIVE: "Fed back"}
_HEIGHT = 1.9  # in
_TORQUE = "Torque (N m)"


def caption(answer: Compensation) -> str:
    """Say what is drawn, in plain words."""
    n = len(answer.simulated.laws) if answer.simulated is not None else 0
    return (
        "Simulated torques at the motor and at the joint while a hand moves the device to and fro, a panel for each way of "
        f"compensating friction. n = {counted(n, 'simulation')}."
    )


@in_paper_style
def draw(answer: Compensation) -> Figure:
    """Draw torques at motor and joint while a hand moves the device to and fro, a panel a law."""
    simulation = answer.simulated
    assert simulation is not None  # asked only of a simulation
    figure, axes_by_law = panels([_HEIGHT], len(simulation.laws), TITLE, (0.25, 0), sharey=True)
    for axes, law in zip(axes_by_law, simulation.laws, strict=True):
        _draw_torques(axes, law)
    axes_by_law[0].set_ylabel(_TORQUE)
    legend_above(figure, axes_by_law, columns=2)
    return figure


def _draw_torques(axes: Axes, law: SimulatedLaw) -> None:
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
