"""Readings of forces as marks, and which lines of theirs are shown in which color and over which loads."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.style import GRAY, SERIES_COLORS, SERIES_MARKERS

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes
    from bowdenfit.questions.summary.forces_shown import Forces, ForcesHere

MARK, SMALL_MARK, MANY = 3.4, 2.0, 300  # pt, pt, and readings from which marks are small
RETURN_DASHES = (0, (4, 1.6))
EVEN = 1e-3  # of the ratio of two loads, within which they are as far from each other as others


def colored_places(forces: Forces) -> list[tuple[ForcesHere, str, str]]:
    """The places with lines of their own, with color and marker."""
    shown = [here for here in forces.places if here.shown]
    return [(here, SERIES_COLORS[i % 8], SERIES_MARKERS[i % 8]) for i, here in enumerate(shown)]


def draw_readings(axes: Axes, forces: Forces, value: str, name: bool = False) -> None:
    """Readings of all places: filled while pulling, open while returning, crosses where held, gray without a line."""
    size = MARK if sum(len(here.stroke) for here in forces.places) < MANY else SMALL_MARK
    low, high = axes.get_ylim() if value == "apparent" else (-np.inf, np.inf)
    looks = {id(here): (color, marker) for here, color, marker in colored_places(forces)}
    for here in forces.places:
        color, marker = looks.get(id(here), (GRAY, "."))
        y = np.clip(getattr(here, value), low, high)
        for stroke, mark, fill in ((1, marker, color), (-1, marker, "white"), (0, "x", color)):
            mine = (here.stroke == stroke) & np.isfinite(y)
            if mine.any():
                x = here.bend if forces.by_bend else here.input_force
                axes.plot(
                    x[mine], y[mine], mark, color=color, markerfacecolor=fill, markersize=size, markeredgewidth=0.7, zorder=3,
                    clip_on=value != "apparent",
                )  # fmt: skip
        if name and here.shown and here.label:
            axes.plot([], [], marker=marker, color=color, markersize=MARK, label=here.label)


def where_read(here: ForcesHere, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Loads of a line and its quantiles there, from the lowest reading of the place to its highest."""
    loads = np.linspace(here.input_force.min(), here.input_force.max(), len(here.load))
    if here.load[1] / here.load[0] < here.load[-1] / here.load[-2] + EVEN:  # evenly spaced in the logarithm
        loads = np.geomspace(loads[0], loads[-1], len(loads))
    return loads, np.stack([np.interp(loads, here.load, row) for row in line])
