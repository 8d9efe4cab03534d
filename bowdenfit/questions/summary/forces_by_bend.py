"""Lines of forces that were all read about one load, against the wrap angle: from one bend to the next."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.curves import draw_quantiles
from bowdenfit.plots.style import GRAY
from bowdenfit.questions.summary.forces_marks import RETURN_DASHES
from bowdenfit.questions.summary.forces_shown import STROKES

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes
    from bowdenfit.questions.summary.forces_shown import Forces


def draw_by_bend(axes: Axes, forces: Forces, value: str) -> None:
    """The law at the load of the readings, through all bends.

    Args:
        axes: Panel to draw on.
        forces: What is shown.
        value: "law" for output forces, "apparent_law" for coefficients.
    """
    places = sorted(forces.places, key=lambda here: float(here.bend.mean()))
    at = np.array([here.bend.mean() for here in places])
    for i, stroke in enumerate(STROKES):
        if any(np.any(here.stroke == stroke) for here in places):
            rows = [
                [np.interp(here.input_force.mean(), here.load, row) for row in getattr(here, value)[:, i]] for here in places
            ]
            draw_quantiles(axes, at, np.array(rows).T, GRAY, linestyle="-" if stroke > 0 else RETURN_DASHES, linewidth=1.0)


def limits_of_bends(forces: Forces) -> tuple[float, float]:
    """An axis from no bend to beyond the largest."""
    return 0.0, 1.05 * max(float(here.bend.max()) for here in forces.places)
