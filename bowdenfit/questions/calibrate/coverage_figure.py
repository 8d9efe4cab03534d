"""Figure of the coverage of a calibration: how often its intervals hold the truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bowdenfit.plots.layout import LEFT, legend_above, panels, squeeze, text_width, wrap_words
from bowdenfit.plots.style import BLUE, GRAY, LIGHT, VERMILLION, in_paper_style
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.calibrate.answer import Calibration

HEADING = "Coverage of the intervals: how often they contain the true value"
_ROW = 0.24  # in, of a quantity
_LONGEST = 2.0  # in, of a name
_MARK = 0.2  # in, from a name to the panel and to the edge of the page


def caption(calibration: Calibration) -> str:
    """Say what is drawn, in plain words."""
    return (
        "Dots: share of the 50 % and 90 % intervals of each quantity that held the true value; gray: the range that "
        "chance allows for all of "
        f"them together in 99 % of calibrations; n = {counted(calibration.ranked, 'replication')}."
    )


@in_paper_style
def draw(calibration: Calibration) -> Figure:
    """Draw the share of the 50 and 90 % intervals of each quantity that hold the truth, and what chance allows."""
    figure, flat = quantity_panels(calibration, 2)
    for k, axes in enumerate(flat):
        for i, q in enumerate(calibration.quantities):
            coverage = q.coverage[k]
            axes.plot(
                [100 * coverage.low, 100 * coverage.high],
                [i, i],
                color=LIGHT,
                lw=7,
                solid_capstyle="butt",
                label="By chance",
            )
            label, color = ("As often as claimed", BLUE) if coverage.within else ("Not as often as claimed", VERMILLION)
            axes.plot(100 * coverage.rate, i, "o" if coverage.within else "X", color=color, label=label)
        claimed = 100 * calibration.quantities[0].coverage[k].probability
        axes.axvline(claimed, color=GRAY, lw=0.8)
        axes.set_xlabel(f"{claimed:.0f} % intervals that contain the truth (%)")
    legend_above(figure, flat, 3)
    return figure


def quantity_panels(calibration: Calibration, columns: int) -> tuple[Figure, list[Axes]]:
    """Return panels side by side with one row for each quantity, the first on top."""
    names = [wrap_words(q.symbol, _LONGEST, most=1) for q in calibration.quantities]
    figure, flat = panels([0.3 + _ROW * len(names)], columns, 0.1, (0.35, 0.3), sharey=True)
    for axes in flat:
        axes.set_ylim(len(names) - 0.4, -0.6)
        axes.set_yticks(range(len(names)), names)
    squeeze(figure, LEFT, max(LEFT, _MARK + max(map(text_width, names), default=0.0)))
    return figure, flat
