"""The friction coefficient that each reading by itself would have, against the load."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.curves import draw_quantiles, middle
from bowdenfit.plots.style import BLACK, GRAY, WRAP_ANGLE
from bowdenfit.questions.summary.forces_by_bend import draw_by_bend, limits_of_bends
from bowdenfit.questions.summary.forces_marks import RETURN_DASHES, colored_places, draw_readings, where_read
from bowdenfit.questions.summary.forces_shown import STROKES

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes
    from bowdenfit.questions.summary.forces_shown import Forces, ForcesHere

CAPSTAN, CAPSTAN_DOTS = "Capstan equation", (0, (1, 1.2))
ALIKE = 1e-3  # of a coefficient, within which it is the same
FROM_ZERO = 0.6  # lowest over highest coefficient below which the axis begins at 0
_MOST_BAND = 4  # times as much as the readings may the axis leave for a band, above and below
_OUTER = (0.02, 0.98)  # quantiles of the readings; the axis of the coefficient reaches as far beyond them as they are apart


def draw_apparent(axes: Axes, forces: Forces) -> None:
    """Apparent coefficient against the load, beside what the capstan equation says: a horizontal line."""
    load = forces.places[0].load
    axes.set_xlim(*(limits_of_bends(forces) if forces.by_bend else (load[0] if forces.logarithmic else 0.0, load[-1])))
    axes.set_ylim(*_coefficient_limits(forces))
    if forces.by_bend:
        draw_by_bend(axes, forces, "apparent_law")
    colored, bent = [] if forces.by_bend else colored_places(forces), False
    together = colored and _all_alike(forces)
    for here, color in [(colored[0][0], BLACK)] if together else [(here, color) for here, color, _ in colored]:
        for i, stroke in enumerate(STROKES):
            if np.any(here.stroke == stroke):
                line = "-" if stroke > 0 else RETURN_DASHES
                draw_quantiles(axes, *where_read(here, here.apparent_law[:, i]), color, linestyle=line, linewidth=1.0)
        if np.isfinite(here.capstan) and not _is_level(here):
            axes.axhline(here.capstan, color=color, linestyle=CAPSTAN_DOTS, linewidth=1.1)
            bent = True
    axes.plot([], [], color=GRAY, linestyle=CAPSTAN_DOTS if bent else "-", linewidth=1.1, label=CAPSTAN)
    draw_readings(axes, forces, "apparent")
    axes.locator_params(axis="y", nbins=6)
    axes.set(xlabel=WRAP_ANGLE if forces.by_bend else "Input force (N)", ylabel="Apparent friction coefficient")


def _all_alike(forces: Forces) -> bool:
    """Whether several places have one coefficient, so that their lines are one."""
    lines = np.array([middle(here.apparent_law) for here in forces.places if here.shown])
    return bool(len(lines) > 1 and np.ptp(lines) < ALIKE * np.max(np.abs(lines)))


def _is_level(here: ForcesHere) -> bool:
    """Whether the law is the capstan equation's: the same coefficient at all loads."""
    line = middle(here.apparent_law)
    return bool(np.ptp(line) < ALIKE * np.max(np.abs(line)))


def beyond_the_axis(forces: Forces) -> int:
    """How many readings are drawn on the edge, because their coefficients lie beyond it."""
    readings = np.concatenate([here.apparent for here in forces.places])
    low, high = _coefficient_limits(forces)
    return int(np.sum((readings < low) | (readings > high)))


def _coefficient_limits(forces: Forces) -> tuple[float, float]:
    """From the readings but for a few far ones, and from the laws with their bands; far ones are drawn on the edge."""
    readings = np.concatenate([here.apparent for here in forces.places])
    readings = readings[np.isfinite(readings)]
    if not len(readings):
        return 0.0, 1.0
    lines = [value for here in forces.places if here.shown for value in (here.capstan, *middle(here.apparent_law)[0])]
    outer = np.quantile(readings, _OUTER)
    far = np.ptp(outer)
    outer = np.clip([readings.min(), readings.max()], outer[0] - far, outer[1] + far)
    low, high = min(*outer, np.nanmedian(lines)), max(*outer, np.nanmedian(lines))
    bands = np.array([here.apparent_law[[0, -1]] for here in forces.places if here.shown])
    reach = max(_MOST_BAND * (high - low), abs(high))
    low, high = max(min(low, np.nanmin(bands)), low - reach), min(max(high, np.nanmax(bands)), high + reach)
    room = 0.15 * (high - low) or 0.1 * abs(high)
    return (low - room if low > FROM_ZERO * high else min(0.0, low - room)), high + room
