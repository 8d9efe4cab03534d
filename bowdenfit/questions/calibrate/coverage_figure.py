"""How often the intervals of a calibration hold the truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.style import BLUE, GRAY, LIGHT, VERMILLION, in_paper_style
from bowdenfit.questions.calibrate.quantity_rows import quantity_panels
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure
    from bowdenfit.questions.calibrate.answer import Calibration

HEADING = "How often intervals hold the truth"


def caption(calibration: Calibration) -> str:
    """What is drawn, in plain words."""
    return (
        "Dots: share of the 50 % and 90 % intervals of each quantity that held the true value; gray: the range that "
        "chance allows for all of "
        f"them together in 99 % of calibrations; n = {counted(calibration.ranked, 'replication')}."
    )


@in_paper_style
def draw(calibration: Calibration) -> Figure:
    """The share of the 50 and 90 % intervals of each quantity that hold the truth, and what chance allows."""
    figure, flat = quantity_panels(calibration, 2)
    for k, axes in enumerate(flat):
        for i, q in enumerate(calibration.quantities):
            coverage = q.coverage[k]
            axes.plot(
                [100 * coverage.low, 100 * coverage.high], [i, i], color=LIGHT, lw=7, solid_capstyle="butt", label="By chance"
            )
            label, color = ("As often as claimed", BLUE) if coverage.within else ("Not as often as claimed", VERMILLION)
            axes.plot(100 * coverage.rate, i, "o" if coverage.within else "X", color=color, label=label)
        claimed = 100 * calibration.quantities[0].coverage[k].probability
        axes.axvline(claimed, color=GRAY, lw=0.8)
        axes.set_xlabel(f"{claimed:.0f} % intervals that hold the truth (%)")
    legend_above(figure, flat, 3)
    return figure
