"""Panels with a row for each quantity of a calibration."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bowdenfit.plots.layout import LEFT, panels, squeeze, text_width, wrap_words

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.calibrate.answer import Calibration

_ROW = 0.24  # in, of a quantity
_LONGEST = 2.0  # in, of a name
_MARK = 0.2  # in, from a name to the panel and to the edge of the page


def quantity_panels(calibration: Calibration, columns: int) -> tuple[Figure, list[Axes]]:
    """Panels side by side with one row for each quantity, the first on top."""
    names = [wrap_words(q.symbol, _LONGEST, most=1) for q in calibration.quantities]
    figure, flat = panels([0.3 + _ROW * len(names)], columns, 0.1, (0.35, 0.3), sharey=True)
    for axes in flat:
        axes.set_ylim(len(names) - 0.4, -0.6)
        axes.set_yticks(range(len(names)), names)
    squeeze(figure, LEFT, max(LEFT, _MARK + max(map(text_width, names), default=0.0)))
    return figure, flat
