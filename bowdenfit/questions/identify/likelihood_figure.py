"""Profile likelihoods, and contours of the likelihood of two parameters, as figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import (
    area_entry,
    axes_at,
    empty_page,
    legend_above,
    number_below,
    number_left,
    place_labels,
)
from bowdenfit.plots.style import BLUE, GRAY, LIGHT, axis_label, in_paper_style

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure

LEVEL_OF_ONE = 2.706  # rise of -2 log L at the ends of a 90 % interval: quantile of chi-squared with 1 degree of freedom
LEVELS_OF_TWO = (2.279, 4.605)  # at the edges of 68 and 90 % regions: with 2 degrees of freedom
_WIDTH, _HEIGHT, _PANEL = 3.5, 2.9, (0.62, 0.45, 2.7, 2.3)  # in
HIGHEST_RISE = 12.0  # that is drawn; a judgement


@in_paper_style
def draw_profile(name: str, unit: str, values: np.ndarray, rise: np.ndarray) -> Figure:
    """Draw the rise of -2 log L along one parameter, with the level of a 90 % interval."""
    figure = empty_page(_WIDTH, _HEIGHT)
    axes = axes_at(figure, *_PANEL)
    axes.plot(values, rise, color=BLUE, label="Others fitted again")
    axes.axhline(LEVEL_OF_ONE, color=GRAY, linestyle="--", linewidth=0.8, label="90 % interval")
    axes.set_xlim(float(values[0]), float(values[-1]))
    axes.set_ylim(-0.3, min(HIGHEST_RISE, float(np.nanmax(rise)) + 0.5))
    _label(figure, axes, axis_label(name, unit), "Rise of -2 log L")
    legend_above(figure, [axes], columns=2)
    return figure


@in_paper_style
def draw_contour(
    names: tuple[str, str], units: tuple[str, str], values: tuple[np.ndarray, np.ndarray], rise: np.ndarray
) -> Figure:
    """Draw the regions of 68 and 90 % of two parameters, and where the likelihood is highest."""
    figure = empty_page(_WIDTH, _HEIGHT)
    axes = axes_at(figure, *_PANEL)
    high = np.where(np.isfinite(rise), rise, np.nanmax(rise)).T
    axes.contourf(*values, high, levels=(high.min() - 1, *LEVELS_OF_TWO), colors=(BLUE, LIGHT))
    first, second = np.unravel_index(int(np.nanargmin(rise)), rise.shape)
    (marked,) = axes.plot(values[0][first], values[1][second], "+", color="black", label="Highest likelihood")
    _label(figure, axes, axis_label(names[0], units[0]), axis_label(names[1], units[1]))
    axes.legend(handles=[area_entry("68 %", BLUE), area_entry("90 %", LIGHT), marked], loc="best")
    return figure


def _label(figure: Figure, axes: Axes, x_label: str, y_label: str) -> None:
    """Put labels and numbers on a panel."""
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    number_below(axes)
    number_left(axes)
    place_labels(figure, axes)
