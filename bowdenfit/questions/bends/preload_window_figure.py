"""What a preload costs in free motion and what it buys: both sides of the loop staying taut."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.bands import draw_quantiles, middle, name_band
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
from bowdenfit.questions.bends.preload_figure import stretches

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.bends.figure_data import PreloadWindow
    from bowdenfit.questions.summary.figure_data import FigureData

ENOUGH = 0.95  # probability of staying taut from which on a preload is within the window


def has_preload_window(data: FigureData) -> bool:
    """Whether the cable is a loop whose preload can be chosen."""
    return data.elastic.window is not None


@in_paper_style
def preload_window(data: FigureData) -> Figure:
    """Friction felt in free motion, and the probability that both sides stay taut [%], against preload [N]."""
    window = data.elastic.window
    assert window is not None
    figure, (cost, gain) = panels([1.6, 1.3], 1, TITLE, (0, 0.16), MEDIUM, sharex=True)
    cost.set_title(_title(window))
    draw_quantiles(cost, window.preload, window.friction, BLUE, label=_name(window))
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


def _title(window: PreloadWindow) -> str:
    """The bends and the input force that the window is for."""
    low, high = window.bends
    bends = f"{low:.4g} deg" if low == high else f"{low:.4g} deg to {high:.4g} deg"
    loaded = f"input force up to {window.input_force:.4g} N" if window.input_force > 0 else "no load"
    return f"Bends {bends}, {loaded}"


def _name(window: PreloadWindow) -> str:
    return f"Friction, {(MEDIAN if len(window.friction) > 1 else LEAST_SQUARES).lower()}"


def _shade_window(axes: Axes, window: PreloadWindow) -> None:
    """The preloads that are enough, or the words that none shown is."""
    fine = np.linspace(window.preload.min(), window.preload.max(), 2001)
    regions = stretches(np.interp(fine, window.preload, window.taut_probability) >= ENOUGH)
    label = f"Taut with at least {percent(ENOUGH)} probability" if len(window.friction) > 1 else "Taut"
    for start, stop in regions:
        axes.axvspan(fine[start], fine[stop], facecolor=GREEN, alpha=0.16, linewidth=0, zorder=0.4, label=label)
    if not regions:
        axes.plot([], [], " ", label=f"No preload shown is taut with {percent(ENOUGH)}")


def _mark_lowest(axes: Axes, window: PreloadWindow) -> None:
    """The lowest preload that is enough with its interval, or in words where it is off the axis."""
    low, high = axes.get_xlim()
    lowest, which = float(middle(window.lowest)), MEDIAN if len(window.friction) > 1 else LEAST_SQUARES
    if not low <= lowest <= high:
        axes.plot([], [], " ", label=f"Lowest preload off the axis, {lowest:.3g} N")
        return
    axes.axvline(lowest, color=VERMILLION, linewidth=1.0, zorder=1.5, label=f"Lowest preload, {which.lower()}")
    if window.lowest[-1] > window.lowest[0]:
        start, stop = max(float(window.lowest[0]), low), min(float(window.lowest[-1]), high)
        label = f"Lowest preload, {WIDE_INTERVAL}"
        axes.axvspan(start, stop, facecolor=VERMILLION, alpha=0.18, linewidth=0, zorder=0.5, label=label)
    axes.set_xlim(low, high)
