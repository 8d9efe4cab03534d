"""Figure of the ranks of a calibration: where truths lie within the posteriors of its fits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import LEFT, RIGHT, TITLE, drop_unused, legend_above, panels, text_width, wrap_words
from bowdenfit.plots.panels import label_outer
from bowdenfit.plots.style import BLUE, GRAY, LIGHT, TITLE_SIZE, VERMILLION, WIDE, in_paper_style
from bowdenfit.questions.calibrate.rank_tests import UniformRanks
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure
    from bowdenfit.questions.calibrate.answer import Calibration

HEADING = "Where the true values fall within their estimated distributions"
_COLUMNS, _APART = 4, 0.5  # panels in a row, and inches between them
_MARGIN = 0.3  # in, between titles
_BAND = 0.99


def caption(calibration: Calibration) -> str:
    """Say what is drawn, in plain words."""
    return (
        "Line: share of the true values at or below each rank, minus that of uniform ranks; gray: what chance "
        "leaves in 99 % of calibrations. A hump followed by a dip means that intervals are too narrow, a dip then a hump that "
        "they are too wide; a line all above zero means that estimates are too high, all below that they are too low. p: "
        "probability that uniform ranks would lie so far from zero, corrected for the number of quantities; "
        f"n = {counted(calibration.ranked, 'replication')}."
    )


@in_paper_style
def draw(calibration: Calibration) -> Figure:
    """Draw the distribution function of the ranks less that of uniform ones, with the band that holds uniform ones in 99 %."""
    n = len(calibration.quantities)
    rows, columns = -(-n // _COLUMNS), min(_COLUMNS, n)
    figure, flat = panels([1.15] * rows, columns, TITLE, (_APART, 0.5), sharex=True)
    room = (WIDE - LEFT - RIGHT + _APART) / columns
    uniform = UniformRanks(calibration.ranked)
    positions, (low, high) = uniform.positions, uniform.band(_BAND)
    reach = max(0.01, float(max(np.max(high - positions), np.max(positions - low))))
    flat = drop_unused(flat, n)
    for axes, q in zip(flat, calibration.quantities, strict=True):
        difference = uniform.count_below(np.array(q.ranks)) / calibration.ranked - positions
        color = BLUE if q.is_calibrated else VERMILLION
        label = "True values" if q.is_calibrated else "True values of a quantity that is not calibrated"
        axes.fill_between(positions, low - positions, high - positions, color=LIGHT, lw=0, label="Uniform ranks (99 %)")
        axes.plot([0, *positions, 1], [0, *difference, 0], color=color, label=label)
        axes.axhline(0.0, color=GRAY, lw=0.6)
        p_value = f"   p = {q.corrected:.2g}"
        name = wrap_words(q.symbol, room - text_width(p_value, TITLE_SIZE) - _MARGIN, TITLE_SIZE, most=1)
        axes.set_title(f"{name}{p_value}", fontsize=TITLE_SIZE)
        axes.set_xlim(0, 1)
        axes.set_ylim(-1.15 * max(reach, np.max(np.abs(difference))), 1.15 * max(reach, np.max(np.abs(difference))))
    label_outer(flat, columns, "Rank of the true value", "Deviation from uniform")
    legend_above(figure, flat, 3)
    return figure
