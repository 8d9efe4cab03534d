"""Figure of the bias of a calibration: how far estimates lie from truths, and how far data narrow priors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.style import BLUE, GRAY, in_paper_style
from bowdenfit.questions.calibrate.coverage_figure import quantity_panels
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure
    from bowdenfit.questions.calibrate.answer import Calibration

HEADING = "Bias, and how much the measurements narrow the prior"


def caption(calibration: Calibration) -> str:
    """Say what is drawn, in plain words."""
    return (
        "Left: estimate minus true value, in standard deviations of the estimate, with three standard errors. Right: "
        "how much of the "
        "prior variance the measurements remove; "
        f"n = {counted(calibration.ranked, 'replication')}."
    )


@in_paper_style
def draw(calibration: Calibration) -> Figure:
    """Draw bias of the posterior mean, and how far the data narrow the prior."""
    figure, (left, right) = quantity_panels(calibration, 2)
    for i, q in enumerate(calibration.quantities):
        left.errorbar(q.bias, i, xerr=3 * q.bias_error, fmt="o", color=BLUE, lw=1.2, label="Mean, 3 standard errors")
        right.plot([0, 100 * q.shrinkage], [i, i], color=BLUE, lw=5, solid_capstyle="butt")
    left.axvline(0.0, color=GRAY, lw=0.8)
    left.set_xlabel("Estimate minus truth (standard deviations)")
    right.set_xlabel("Prior variance removed (%)")
    right.set_xlim(min(0.0, *(100 * q.shrinkage for q in calibration.quantities)), 100)
    legend_above(figure, [left], 1)
    return figure
