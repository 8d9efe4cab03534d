"""Efficiency against the wrap angle for several friction coefficients and preloads, and by the capstan equation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit.plots.bands import draw_quantiles, name_band
from bowdenfit.plots.layout import LEGEND_ROW, TITLE, legend_above, panels
from bowdenfit.plots.panels import span
from bowdenfit.plots.style import BLACK, EFFICIENCY, GRAY, MEDIUM, WIDE, WRAP_ANGLE, in_paper_style, mapped_color

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.bends.figure_data import BendingLoss, EfficiencyLine
    from bowdenfit.questions.summary.figure_data import FigureData

DASHES = (0, (4, 1.6))
MARKERS = ("o", "s", "^", "D", "v", "P")
MARKS = 4  # on each line
LINES_IN_A_ROW = 2  # of a panel's legend
# What a panel varies, and the color map its lines are from, so that neither panel's legend holds for the other.
COEFFICIENTS, PRELOADS, FITTED = ("Friction", "YlOrRd"), ("Preload", "GnBu"), ("Efficiency", "Greys")


def has_bending_loss(data: FigureData) -> bool:
    """Whether efficiency against the wrap angle is known for a loop or a rope with preload."""
    return data.elastic.bending_loss is not None


@in_paper_style
def bending_loss(data: FigureData) -> Figure:
    """Efficiency [%] against the wrap angle [deg]: several friction coefficients, and several preloads."""
    loss = data.elastic.bending_loss
    assert loss is not None
    sides = [(*COEFFICIENTS, loss.coefficients), (*PRELOADS, loss.preloads)]
    sides = [side for side in sides if side[2]] or [(*FITTED, ())]
    rows = max(-(-len(lines) // LINES_IN_A_ROW) for _, _, lines in sides)
    page = WIDE if len(sides) > 1 else MEDIUM
    figure, flat = panels([2.3], len(sides), TITLE + rows * LEGEND_ROW, (0.2, 0), page, sharey=True)
    for axes, (what, colors, lines) in zip(flat, sides, strict=True):
        _lines(axes, loss, lines, colors)
        _fitted(axes, loss)
        axes.set_title(f"{what}, at {loss.input_force:.4g} N input force", pad=6 + 72 * rows * LEGEND_ROW)
        axes.set_xlabel(WRAP_ANGLE)
    flat[0].set_ylabel(EFFICIENCY)
    flat[0].set_ylim(*_limits(loss))
    legend_above(figure, flat, columns=4 if len(sides) > 1 else 2)
    return figure


def _lines(axes: Axes, loss: BendingLoss, lines: Sequence[EfficiencyLine], colors: str) -> None:
    """The lines of one panel with the capstan equation's dashed, and their legend between title and panel."""
    handles = []
    for i, line in enumerate(lines):
        color, every = _color(colors, i, len(lines)), max(len(loss.wrap_angle) // MARKS, 1)
        look: dict[str, Any] = {"color": color, "marker": MARKERS[i % len(MARKERS)], "markersize": 3.2}
        axes.plot(loss.wrap_angle, 100 * line.capstan, color=color, linestyle=DASHES, linewidth=0.9)
        axes.plot(loss.wrap_angle, 100 * line.efficiency, markevery=(every // 2, every), **look)
        handles += axes.plot([], [], **look)
    if handles:
        axes.legend(
            handles, [line.label for line in lines], loc="lower center", bbox_to_anchor=(0.5, 1.0),
            ncols=LINES_IN_A_ROW, borderaxespad=0.2,
        )  # fmt: skip


def _fitted(axes: Axes, loss: BendingLoss) -> None:
    """The cable itself, and the entries of the legend above both panels."""
    label = loss.fitted_label[:1].upper() + loss.fitted_label[1:]
    draw_quantiles(axes, loss.wrap_angle, 100 * loss.fitted, BLACK, linewidth=1.6, label=label)
    name_band(axes, loss.fitted, BLACK)
    axes.plot(loss.wrap_angle, 100 * loss.fitted_capstan, color=BLACK, linestyle=DASHES, linewidth=0.9)
    axes.plot([], [], color=GRAY, linestyle=DASHES, linewidth=0.9, label="Capstan equation alone")


def _color(colors: str, number: int, of: int) -> Any:
    """From light to dark, as the number in the label grows."""
    return mapped_color(colors, 0.42 + 0.5 * (number + 0.5) / of)


def _limits(loss: BendingLoss) -> tuple[float, float]:
    """Efficiencies that show every line, from 0 % to 100 % at most."""
    lines = [v for line in (*loss.coefficients, *loss.preloads) for v in (line.efficiency, line.capstan)]
    low, high = span([100 * np.asarray(v) for v in (*lines, loss.fitted, loss.fitted_capstan)], room=0.04)
    return max(low, -2.0), min(high, 102.0)
