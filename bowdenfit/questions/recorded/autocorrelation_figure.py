"""Autocorrelation of the residuals of a recording against the lag: whether they are noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import count_shown
from bowdenfit.plots.curves import choose_evenly, note_shown_count
from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import MOST, label_outer, recording_panels, set_limits, share_limits
from bowdenfit.plots.style import BLUE, GRAY, in_paper_style
from bowdenfit.questions import recorded as room

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Autocorrelation of the residuals"
MOST_COLUMNS = 4  # panels in a row
LEAST_BLOCKS, MOST_LAGS = 8, 60  # blocks of a recording with an autocorrelation, and lags that are shown
NORMAL_95 = 1.96  # standard deviations either way that hold 95 % of a normal distribution
MOST_STEMS = 60  # lags that have a stem each; with more, a line alone


@dataclass(frozen=True)
class Autocorrelation:
    """Autocorrelation of the deviations from the fit in one recording.

    Args:
        name: Name of the recording.
        lag: From one block to another [s].
        correlation: Autocorrelation there.
        n_blocks: Number of blocks that are used.
    """

    name: str
    lag: np.ndarray
    correlation: np.ndarray
    n_blocks: int


def data(fit: Record) -> tuple[Autocorrelation, ...] | None:
    """Return the autocorrelation of every recording with enough blocks; None without any."""
    autocorrelations = []
    for trace in room.trace_recordings(fit):
        correlation = compute_autocorrelation(trace.deviation)
        if len(correlation) > 1:
            lag = float(np.median(np.diff(trace.time))) * np.arange(len(correlation))
            autocorrelations.append(Autocorrelation(trace.recording.name, lag, correlation, int(trace.used.sum())))
    return tuple(autocorrelations) or None


def compute_autocorrelation(deviation: np.ndarray) -> np.ndarray:
    """Return the autocorrelation at lags from 0; at lag 0 alone where there are too few blocks."""
    centered = deviation - deviation.mean() if len(deviation) else deviation
    if len(centered) < LEAST_BLOCKS or not np.any(centered):
        return np.ones(1)
    lags = min(MOST_LAGS, len(centered) // 3)
    products = [float(np.dot(centered[: len(centered) - k], centered[k:])) for k in range(lags)]
    return np.array(products) / products[0]


def caption(recordings: tuple[Autocorrelation, ...]) -> str:
    """Describe what is drawn, in plain words."""
    shown = min(len(recordings), MOST)
    return (
        f"Autocorrelation of the deviations from the fit in {count_shown(shown, len(recordings), 'recording')}, by the "
        "time between them. For white noise, 95 % lie in the gray band; a slow wave outside it is an effect that the model "
        f"does not include. n = {sum(r.n_blocks for r in recordings)} blocks of samples."
    )


@in_paper_style
def draw(recordings: tuple[Autocorrelation, ...], width: float | None = None) -> Figure:
    """Draw the autocorrelation against the lag [s], a panel a recording, and the band of white noise."""
    shown = choose_evenly(recordings, MOST)
    lags = [(float(-0.02 * r.lag.max()), float(1.02 * r.lag.max())) for r in shown]
    share_x = share_limits(lags)
    figure, flat, columns = recording_panels([r.name for r in shown], MOST_COLUMNS, 1.2, share_x, True, width=width)
    set_limits(flat, lags, "x", share_x)
    for axes, recording in zip(flat, shown, strict=True):
        _draw_panel(axes, recording)
        axes.locator_params(axis="x", nbins=4)
    lowest = min(min(float(np.nanmin(r.correlation)), -_bound(r)) for r in shown)
    flat[0].set_ylim(max(-1.05, min(-0.2, 1.15 * lowest)), 1.05)
    label_outer(flat, columns, "Lag (s)", "Autocorrelation")
    note_shown_count(flat[0], len(shown), len(recordings), "recordings")
    legend_above(figure, flat, columns=3 if columns > 1 else 2)
    return figure


def _bound(recording: Autocorrelation) -> float:
    """Return the bound that 95 % of the autocorrelations of as many independent blocks keep to."""
    return NORMAL_95 / float(np.sqrt(max(recording.n_blocks, 1)))


def _draw_panel(axes: Axes, recording: Autocorrelation) -> None:
    """Draw the autocorrelation of one recording, with the band of white noise."""
    lag, correlation = recording.lag, recording.correlation
    bound = _bound(recording)
    axes.axhspan(-bound, bound, facecolor="#D5D5D5", linewidth=0, zorder=0.6, label="95 % of white noise")
    axes.axhline(0, color=GRAY, linewidth=0.7, zorder=0.9)
    if len(lag) > MOST_STEMS:
        axes.plot(lag, correlation, color=BLUE, linewidth=1.0, label="Deviations from the fit")
        return
    axes.vlines(lag, 0, correlation, color=BLUE, linewidth=0.8)
    axes.plot(lag, correlation, "o", color=BLUE, markersize=2.2, label="Deviations from the fit")
