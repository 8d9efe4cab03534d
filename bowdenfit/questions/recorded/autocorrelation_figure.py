"""Whether what the model leaves over in a recording is noise: autocorrelation of the deviations against the lag."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import alike, chosen, label_outer, recording_panels, say_how_many, set_limits
from bowdenfit.plots.style import BLUE, GRAY, in_paper_style

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.summary.figure_data import FigureData, RecordedTrace

MOST_COLUMNS = 4
NORMAL_95 = 1.96
MOST_STEMS = 60  # lags that have a stem each; with more, a line alone


def has_autocorrelation(data: FigureData) -> bool:
    """Whether the deviations of a recording were correlated with each other."""
    return any(map(_has_lags, data.recordings))


def _has_lags(recording: RecordedTrace) -> bool:
    return len(recording.lag) > 1 and bool(np.isfinite(recording.autocorrelation).any())


@in_paper_style
def autocorrelation(data: FigureData) -> Figure:
    """Autocorrelation against the lag [s], a panel a recording, and the band that noise without memory would keep to."""
    shown, every = chosen(data, _has_lags)
    lags = [(float(-0.02 * r.lag.max()), float(1.02 * r.lag.max())) for r in shown]
    share_x = alike(lags)
    figure, flat, columns = recording_panels([r.name for r in shown], MOST_COLUMNS, 1.2, share_x, share_y=True)
    set_limits(flat, lags, "x", share_x)
    for axes, recording in zip(flat, shown, strict=True):
        _panel(axes, recording)
        axes.locator_params(axis="x", nbins=4)
    lowest = min(min(float(np.nanmin(r.autocorrelation)), -_bound(r)) for r in shown)
    flat[0].set_ylim(max(-1.05, min(-0.2, 1.15 * lowest)), 1.05)
    label_outer(flat, columns, "Lag (s)", "Autocorrelation")
    say_how_many(flat[0], len(shown), len(every))
    legend_above(figure, flat, columns=3 if columns > 1 else 2)
    return figure


def _bound(recording: RecordedTrace) -> float:
    """What 95 % of the autocorrelations of so many independent blocks are within."""
    return NORMAL_95 / float(np.sqrt(max(int(recording.used.sum()), 1)))


def _panel(axes: Axes, recording: RecordedTrace) -> None:
    lag, correlation = recording.lag, recording.autocorrelation
    bound = _bound(recording)
    axes.axhspan(-bound, bound, facecolor="#D5D5D5", linewidth=0, zorder=0.6, label="95 % of noise without memory")
    axes.axhline(0, color=GRAY, linewidth=0.7, zorder=0.9)
    if len(lag) > MOST_STEMS:
        axes.plot(lag, correlation, color=BLUE, linewidth=1.0, label="Deviations from the fit")
        return
    axes.vlines(lag, 0, correlation, color=BLUE, linewidth=0.8)
    axes.plot(lag, correlation, "o", color=BLUE, markersize=2.2, label="Deviations from the fit")
