"""What a preload costs in free motion and what it buys: both sides of the loop staying taut."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import WITH_BENCH_ERRORS, describe_curve
from bowdenfit.plots.curves import draw_quantiles, middle, name_band
from bowdenfit.plots.layout import TITLE, legend_above, panels
from bowdenfit.plots.panels import span
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    LEAST_SQUARES,
    MEDIAN,
    MEDIUM,
    VERMILLION,
    WIDE_INTERVAL,
    in_paper_style,
    percent,
)
from bowdenfit.questions import bends as room
from bowdenfit.questions.bends.preload_figure import true_stretches
from bowdenfit.words import significant

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Preload window"
COARSE, FINE = 25, 401  # preloads: friction against them is smooth, the probability of slack is not
ENOUGH = 0.95  # probability of staying taut from which on a preload is within the window, as `preload_window.TAUT`


@dataclass(frozen=True)
class PreloadWindowCurves:
    """What a preload costs and what it buys.

    Args:
        preload: At the reference wrap angle [N].
        reference: That wrap angle in words, such as "at 0 deg"; empty where preload is the same at all.
        friction: Quantiles of what is felt in free motion at the bend where it is largest, in `friction_unit`.
        friction_unit: "N*mm" with a pulley radius, else "N".
        taut_probability: Share of the draws in which both sides stay taut over all bends.
        lowest: 5 %, 50 % and 95 % quantiles of the lowest preload that keeps both sides taut [N].
        bends: Range of wrap angles [deg].
        input_force: Largest input force against which the return side must stay taut [N].
    """

    preload: np.ndarray
    reference: str
    friction: np.ndarray
    friction_unit: str
    taut_probability: np.ndarray
    lowest: np.ndarray
    bends: tuple[float, float]
    input_force: float


def data(fit: Record) -> PreloadWindowCurves | None:
    """Return what a preload costs and buys; None of a cable that is not a loop with preload, or was measured at no bend."""
    return room.collect_preload_window(fit)


def caption(window: PreloadWindowCurves) -> str:
    """Describe what is drawn, in plain words."""
    line = describe_curve(len(window.friction) > 1, sources=WITH_BENCH_ERRORS)
    return (
        "What a preload costs and what it buys. Above: the friction in free motion at the bend where it is "
        f"largest. {line} Below: the probability that both sides of the loop stay taut "
        "over all bends. Green: preloads for which that is nearly sure; the vertical line is the lowest that keeps both "
        "sides taut. Nothing here is measured directly; it follows from the fit."
    )


@in_paper_style
def draw(window: PreloadWindowCurves, width: float | None = None) -> Figure:
    """Draw friction felt in free motion, and the probability that both sides stay taut [%], against preload [N]."""
    figure, (cost, gain) = panels([1.6, 1.3], 1, TITLE, (0, 0.16), width or MEDIUM, sharex=True)
    cost.set_title(_title(window))
    draw_quantiles(cost, window.preload, window.friction, BLUE, label=_label_friction(window))
    name_band(cost, window.friction, BLUE)
    cost.set_ylim(0, span([np.zeros(1), window.friction])[1])
    cost.set_ylabel(f"Friction felt ({window.friction_unit.replace('*', chr(0xB7))})")
    label = "Probability that both sides stay taut" if len(window.friction) > 1 else "Both sides stay taut"
    gain.plot(window.preload, 100 * window.taut_probability, color=BLACK, label=label)
    gain.set(
        ylim=(-4, 104), ylabel="Both taut (%)", xlabel=f"{' '.join(filter(None, ('Preload', window.reference)))} (N)"
    )
    gain.set_xlim(float(window.preload.min()), float(window.preload.max()))
    for axes in (cost, gain):
        _shade_window(axes, window)
        _mark_lowest(axes, window)
    legend_above(figure, (cost, gain), columns=2)
    return figure


def _title(window: PreloadWindowCurves) -> str:
    """Return the bends and the input force that the window is for."""
    low, high = window.bends
    bends = f"{low:.4g} deg" if low == high else f"{low:.4g} deg to {high:.4g} deg"
    loaded = f"input force up to {significant(window.input_force, 4)} N" if window.input_force > 0 else "no load"
    return f"Bends {bends}, {loaded}"


def _label_friction(window: PreloadWindowCurves) -> str:
    """Return the label of the curve of friction."""
    return f"Friction, {(MEDIAN if len(window.friction) > 1 else LEAST_SQUARES).lower()}"


def _shade_window(axes: Axes, window: PreloadWindowCurves) -> None:
    """Shade the preloads that are enough, or say that none shown is."""
    fine = np.linspace(window.preload.min(), window.preload.max(), 2001)
    regions = true_stretches(np.interp(fine, window.preload, window.taut_probability) >= ENOUGH)
    label = f"Taut with at least {percent(ENOUGH)} probability" if len(window.friction) > 1 else "Taut"
    for start, stop in regions:
        axes.axvspan(fine[start], fine[stop], facecolor=GREEN, alpha=0.16, linewidth=0, zorder=0.4, label=label)
    if not regions:
        axes.plot([], [], " ", label=f"No preload shown is taut with {percent(ENOUGH)}")


def _mark_lowest(axes: Axes, window: PreloadWindowCurves) -> None:
    """Mark the lowest preload that is enough with its interval, or in words where it is off the axis."""
    low, high = axes.get_xlim()
    lowest, which = float(middle(window.lowest)), MEDIAN if len(window.friction) > 1 else LEAST_SQUARES
    if not low <= lowest <= high:
        axes.plot([], [], " ", label=f"Lowest preload off the axis, {significant(lowest)} N")
        return
    axes.axvline(lowest, color=VERMILLION, linewidth=1.0, zorder=1.5, label=f"Lowest preload, {which.lower()}")
    if window.lowest[-1] > window.lowest[0]:
        start, stop = max(float(window.lowest[0]), low), min(float(window.lowest[-1]), high)
        label = f"Lowest preload, {WIDE_INTERVAL}"
        axes.axvspan(start, stop, facecolor=VERMILLION, alpha=0.18, linewidth=0, zorder=0.5, label=label)
    axes.set_xlim(low, high)
