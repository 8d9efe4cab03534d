"""Efficiency against the wrap angle for several friction coefficients and preloads, and by the capstan equation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit.plots.captions import WITH_BENCH_ERRORS, describe_curve
from bowdenfit.plots.curves import draw_quantiles, name_band
from bowdenfit.plots.layout import LEGEND_ROW, TITLE, count_columns, legend_above, panels
from bowdenfit.plots.panels import label_outer, span
from bowdenfit.plots.style import BLACK, EFFICIENCY, GRAY, MEDIUM, WIDE, WRAP_ANGLE, in_paper_style, mapped_color
from bowdenfit.questions import bends as room
from bowdenfit.words import counted, significant

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Efficiency against the wrap angle"
DASHES = (0, (4, 1.6))
MARKERS = ("o", "s", "^", "D", "v", "P")
MARKS = 4  # on each line
LEAST_WIDTH = 2.2  # in, of a panel
LINES_IN_A_ROW = 2  # of a panel's legend
TIMES_COEFFICIENT, TIMES_PRELOAD = (0.5, 1.0, 2.0), (0.0, 0.5, 1.0, 2.0)  # times what was fitted
# What a panel varies, and the color map its lines are from, so that neither panel's legend holds for the other.
COEFFICIENTS, PRELOADS, FITTED = ("Friction", "YlOrRd"), ("Preload", "GnBu"), ("Efficiency", "Greys")


@dataclass(frozen=True)
class EfficiencyLine:
    """Efficiency [1] against the wrap angle under stated conditions, and by the capstan equation alone.

    Args:
        label: The conditions in words, such as "preload 20 N".
        efficiency: Efficiency of the cable.
        capstan: Of the capstan equation with the same coefficient.
    """

    label: str
    efficiency: np.ndarray
    capstan: np.ndarray


@dataclass(frozen=True)
class BendingLoss:
    """Efficiency against the wrap angle.

    Args:
        wrap_angle: Wrap angle of the lines [deg].
        input_force: Force at which efficiency is meant [N].
        fitted: Quantiles of the cable as fitted, with its own preload [1].
        fitted_capstan: Median of the capstan equation with the fitted coefficients [1].
        fitted_label: Words for it, such as "as fitted, preload 22 N".
        coefficients: Lines for several friction coefficients, with the fitted preload.
        preloads: Lines for several preloads, with the fitted coefficients.
        points_wrap_angle, points_efficiency: Measured there [deg, 1], between the readings next to the input force.
    """

    wrap_angle: np.ndarray
    input_force: float
    fitted: np.ndarray
    fitted_capstan: np.ndarray
    fitted_label: str
    coefficients: tuple[EfficiencyLine, ...]
    preloads: tuple[EfficiencyLine, ...]
    points_wrap_angle: np.ndarray = field(default_factory=lambda: np.zeros(0))
    points_efficiency: np.ndarray = field(default_factory=lambda: np.zeros(0))


def data(fit: Record) -> BendingLoss | None:
    """Return efficiency against the wrap angle; None of a cable that is not a loop with preload, or was measured at no bend."""
    return room.collect_bending_loss(fit)


def caption(loss: BendingLoss) -> str:
    """Describe what is drawn, in plain words."""
    line = describe_curve(len(loss.fitted) > 1, sources=WITH_BENCH_ERRORS)
    return (
        "Efficiency, output over input force while moving forward, against the wrap angle, at "
        f"{significant(loss.input_force, 4)} N input "
        f"force. Black: the cable as fitted. {line} In color: the same cable with other "
        "friction coefficients and other preloads. Dashed: the capstan equation alone, which has no preload. Circles: "
        f"measured, between the readings next to that input force, n = {counted(len(loss.points_wrap_angle), 'wrap angle')}."
    )


@in_paper_style
def draw(loss: BendingLoss, width: float | None = None) -> Figure:
    """Draw efficiency [%] against the wrap angle [deg]: several friction coefficients, and several preloads."""
    sides = [(*COEFFICIENTS, loss.coefficients), (*PRELOADS, loss.preloads)]
    sides = [side for side in sides if side[2]] or [(*FITTED, ())]
    rows = max(-(-len(lines) // LINES_IN_A_ROW) for _, _, lines in sides)
    page, above = width or (WIDE if len(sides) > 1 else MEDIUM), TITLE + rows * LEGEND_ROW
    columns = count_columns(page, len(sides), LEAST_WIDTH, 0.2)
    figure, flat = panels([2.3] * (len(sides) // columns), columns, above, (0.2, above + 0.4), page, sharey=True)
    for axes, (what, colors, lines) in zip(flat, sides, strict=True):
        _draw_lines(axes, loss, lines, colors)
        _draw_fitted(axes, loss)
        axes.set_title(f"{what}, at {significant(loss.input_force, 4)} N input force", pad=6 + 72 * rows * LEGEND_ROW)
    label_outer(flat, columns, WRAP_ANGLE, EFFICIENCY)
    flat[0].set_ylim(*_limits(loss))
    legend_above(figure, flat, columns=4 if len(sides) > 1 else 2)
    return figure


def _draw_lines(axes: Axes, loss: BendingLoss, lines: Sequence[EfficiencyLine], colors: str) -> None:
    """Draw the lines of one panel with the capstan equation's dashed, and their legend between title and panel."""
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


def _draw_fitted(axes: Axes, loss: BendingLoss) -> None:
    """Draw the cable itself, and the entries of the legend above both panels."""
    label = loss.fitted_label[:1].upper() + loss.fitted_label[1:]
    draw_quantiles(axes, loss.wrap_angle, 100 * loss.fitted, BLACK, linewidth=1.6, label=label)
    name_band(axes, loss.fitted, BLACK)
    axes.plot(loss.wrap_angle, 100 * loss.fitted_capstan, color=BLACK, linestyle=DASHES, linewidth=0.9)
    axes.plot([], [], color=GRAY, linestyle=DASHES, linewidth=0.9, label="Capstan equation alone")
    if len(loss.points_wrap_angle):
        axes.plot(
            loss.points_wrap_angle, 100 * loss.points_efficiency, "o", color=BLACK, markersize=4.5, markerfacecolor="white",
            zorder=4, label="Measured",
        )  # fmt: skip


def _color(colors: str, number: int, of: int) -> Any:
    """Return a color from light to dark, as the number in the label grows."""
    return mapped_color(colors, 0.42 + 0.5 * (number + 0.5) / of)


def _limits(loss: BendingLoss) -> tuple[float, float]:
    """Return limits of the efficiency that show every line, from 0 % to 100 % at most."""
    lines = [v for line in (*loss.coefficients, *loss.preloads) for v in (line.efficiency, line.capstan)]
    lines += [loss.fitted, loss.fitted_capstan, loss.points_efficiency]
    low, high = span([100 * np.asarray(v) for v in lines], room=0.04)
    return max(low, -2.0), min(high, max(102.0, 103 * float(loss.points_efficiency.max(initial=0.0))))
