"""Figures of a calibration: ranks against uniform ones, how often intervals hold the truth, bias and shrinkage."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import TITLE, drop_unused, legend_above, panels
from bowdenfit.plots.panels import label_outer
from bowdenfit.plots.style import BLUE, GRAY, LIGHT, VERMILLION, in_paper_style
from bowdenfit.plots.write import FORMATS, write_all
from bowdenfit.questions.calibrate.uniformity import UniformRanks

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.calibrate.answer import Calibration, Checked

_COLUMNS = 4
_BAND = 0.99
_ROW = 0.24  # in, of a quantity


@in_paper_style
def draw_calibration(found: Calibration, folder: Path, formats: Sequence[str] = FORMATS) -> list[Path]:
    """Draw and write all figures of a calibration.

    Args:
        found: The calibration.
        folder: Where the files go; made if it is missing.
        formats: Endings; each figure is written in every one.
    """
    folder.mkdir(parents=True, exist_ok=True)
    drawn = {"coverage": coverage(found)}
    if not found.truths:  # else ranks need not be uniform, and there is no prior variance to compare with
        drawn |= {"ranks": ranks(found), "sharpness": sharpness(found)}
    return [path for name, figure in drawn.items() for path in write_all(figure, folder, name, formats)]


@in_paper_style
def ranks(found: Calibration) -> Figure:
    """Distribution function of the ranks less that of uniform ones, with the band that holds uniform ones in 99 %.

    A hump to the left of the middle and a dip to the right is of intervals too wide, the reverse of intervals too narrow; all
    above zero is of estimates too high, all below of estimates too low.
    """
    n = len(found.quantities)
    rows = -(-n // _COLUMNS)
    figure, flat = panels([1.15] * rows, min(_COLUMNS, n), TITLE, (0.5, 0.5), sharex=True)
    by_chance = UniformRanks(found.ranked)
    places, (low, high) = by_chance.places, by_chance.band(_BAND)
    reach = max(0.01, float(max(np.max(high - places), np.max(places - low))))
    flat = drop_unused(flat, n)
    for axes, q in zip(flat, found.quantities, strict=True):
        difference = by_chance.below(np.array(q.ranks)) / found.ranked - places
        color = BLUE if q.is_calibrated else VERMILLION
        axes.fill_between(places, low - places, high - places, color=LIGHT, lw=0, label="Uniform ranks, 99 %")
        axes.plot([0, *places, 1], [0, *difference, 0], color=color, label="Ranks of the truth")
        axes.axhline(0.0, color=GRAY, lw=0.6)
        axes.set_title(f"{q.symbol}   p = {q.corrected:.2g}")
        axes.set_xlim(0, 1)
        axes.set_ylim(-1.15 * max(reach, np.max(np.abs(difference))), 1.15 * max(reach, np.max(np.abs(difference))))
    label_outer(flat, min(_COLUMNS, n), "Rank of the truth", "ECDF less uniform")
    legend_above(figure, flat, 2)
    return figure


@in_paper_style
def coverage(found: Calibration) -> Figure:
    """How often the 50 and 90 % intervals of each quantity hold the truth, and what chance allows."""
    figure, flat = _lines(found, 2)
    for k, axes in enumerate(flat):
        for i, q in enumerate(found.quantities):
            each = q.coverage[k]
            axes.plot(
                [100 * each.low, 100 * each.high], [i, i], color=LIGHT, lw=7, solid_capstyle="butt", label="By chance"
            )
            color = BLUE if each.within else VERMILLION
            axes.plot(
                100 * each.rate, i, "o", color=color, label="Intervals that hold the truth" if each.within else "Wrong"
            )
        claimed = 100 * found.quantities[0].coverage[k].probability
        axes.axvline(claimed, color=GRAY, lw=0.8)
        axes.set_xlabel(f"{claimed:.0f} % intervals that hold the truth (%)")
    legend_above(figure, flat, 3)
    return figure


@in_paper_style
def sharpness(found: Calibration) -> Figure:
    """Bias of the posterior mean, and how far the data narrow the prior."""
    figure, (left, right) = _lines(found, 2)
    for i, q in enumerate(found.quantities):
        left.errorbar(q.bias, i, xerr=3 * q.bias_error, fmt="o", color=BLUE, lw=1.2, label="Mean, 3 standard errors")
        right.plot([0, 100 * q.shrinkage], [i, i], color=BLUE, lw=5, solid_capstyle="butt")
    left.axvline(0.0, color=GRAY, lw=0.8)
    left.set_xlabel("Posterior mean less truth (posterior sd)")
    right.set_xlabel("Shrinkage of the prior variance (%)")
    right.set_xlim(min(0.0, *(100 * q.shrinkage for q in found.quantities)), 100)
    legend_above(figure, [left], 1)
    return figure


def _lines(found: Calibration, columns: int) -> tuple[Figure, list[Axes]]:
    """Panels with one line for each quantity, the first on top."""
    quantities: tuple[Checked, ...] = found.quantities
    figure, flat = panels([0.3 + _ROW * len(quantities)], columns, 0.1, (0.35, 0.3), sharey=True)
    for axes in flat:
        axes.set_ylim(len(quantities) - 0.4, -0.6)
        axes.set_yticks(range(len(quantities)), [q.symbol for q in quantities])
    return figure, flat
