"""Efficiency sample by sample in each recording, with the mean of its run and what is expected of the cable.

References:
    On-body paper, figures 13 and 15.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import alike, chosen, enlarge_marks, label_outer, recording_panels, say_how_many
from bowdenfit.plots.style import (
    BLACK,
    BLUE,
    EFFICIENCY,
    GREEN,
    LEAST_SQUARES,
    MEDIAN,
    VERMILLION,
    WIDE_INTERVAL,
    in_paper_style,
)
from bowdenfit.questions.recorded.recordings_figure import is_loop

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.questions.summary.figure_data import FigureData, RecordedTrace

MOST_COLUMNS = 4
NORMAL_90 = 1.645  # standard errors to either end of a 90 % interval
EDGE = 0.12  # of the panel's width, right of the samples
SHARE = 0.998  # of the samples, within the axis


def has_sample_efficiency(data: FigureData) -> bool:
    """Whether a recording of a single rope has blocks inside a sliding phase."""
    return any(map(_has_samples, data.recordings))


def _has_samples(recording: RecordedTrace) -> bool:
    return not is_loop(recording) and bool(_sliding(recording).any())


def _sliding(recording: RecordedTrace) -> np.ndarray:
    """The blocks whose forces tell the efficiency."""
    forces = np.minimum(recording.input_force, recording.output_force)
    return recording.used & (recording.stroke != 0) & (forces > 0)


def sample_efficiencies(recording: RecordedTrace) -> tuple[np.ndarray, np.ndarray]:
    """Efficiency [1] of each used block, F_out / F_in when pulling and F_in / F_out when returning; and its stroke."""
    here = _sliding(recording)
    stroke = recording.stroke[here]
    return (recording.output_force[here] / recording.input_force[here]) ** stroke.astype(float), stroke


@in_paper_style
def sample_efficiency(data: FigureData) -> Figure:
    """Efficiency [%] of each used block against its number, a panel a recording on one efficiency axis."""
    shown, every = chosen(data, _has_samples)
    counts = [(0.0, float(_sliding(r).sum())) for r in shown]
    share_x = alike(counts)
    figure, flat, columns = recording_panels([r.name for r in shown], MOST_COLUMNS, 1.6, share_x, share_y=True)
    longest = max(count for _, count in counts)
    for axes, recording, (_, count) in zip(flat, shown, counts, strict=True):
        _samples(axes, recording)
        end = (longest if share_x else count) + 0.5
        axes.set_xlim(0.5 - 0.02 * end, end / (1 - EDGE))
        axes.locator_params(axis="x", nbins=4, integer=True, min_n_ticks=1)
        _mean(axes, recording, count)
        _expected(axes, recording)
    flat[0].set_ylim(*_limits(shown))
    flat[0].locator_params(axis="y", nbins=7)
    label_outer(flat, columns, "Number of the sample", EFFICIENCY)
    say_how_many(flat[0], len(shown), len(every))
    legend_above(figure, flat, columns=3 if columns > 1 else 2)
    enlarge_marks(figure)
    return figure


def _samples(axes: Axes, recording: RecordedTrace) -> None:
    """A mark a block, by stroke."""
    values, stroke = sample_efficiencies(recording)
    number = 1 + np.arange(len(values))
    for sign, label, marker, color in ((1, "Pulling", "o", BLUE), (-1, "Returning", "s", VERMILLION)):
        here = stroke == sign
        if here.any():
            axes.plot(
                number[here], 100 * values[here], marker, color=color, markersize=1.8 if len(values) > 100 else 2.6,
                markerfacecolor=color if sign > 0 else "white", markeredgewidth=0.4, label=label, rasterized=True,
            )  # fmt: skip


def _mean(axes: Axes, recording: RecordedTrace, count: float) -> None:
    """The run's efficiency as measured, with the uncertainty from its readings."""
    mean, off = 100 * recording.own_efficiency, 100 * NORMAL_90 * recording.own_efficiency_sd
    if not np.isfinite(mean):
        return
    across = [0.5, count + 0.5]
    axes.plot(across, [mean, mean], color=BLACK, linewidth=1.0, zorder=3, label="Mean of the run")
    if np.isfinite(off):
        axes.fill_between(
            across, mean - off, mean + off, color=BLACK, alpha=0.3, linewidth=0, zorder=2.5,
            label=f"Its {WIDE_INTERVAL}, from the readings alone",
        )  # fmt: skip


def _expected(axes: Axes, recording: RecordedTrace) -> None:
    """What is expected of the cable, at the right edge."""
    efficiency = 100 * recording.efficiency
    low, middle, high = efficiency[0], efficiency[len(efficiency) // 2], efficiency[-1]
    right = axes.get_xlim()[1] * (1 - 0.4 * EDGE)
    drawn = len(recording.predicted) > 1
    words = f"{MEDIAN.lower()} with {WIDE_INTERVAL}" if drawn else LEAST_SQUARES.lower()
    axes.errorbar(
        [right], [middle], [[middle - low], [high - middle]] if drawn else None, fmt="D", color=GREEN, markersize=3.2,
        linewidth=1.3, capsize=2.2, zorder=4, label=f"Expected of the cable, {words}",
    )  # fmt: skip


def _limits(shown: list[RecordedTrace]) -> tuple[float, float]:
    """Efficiency axis [%] that shows nearly all samples, every mean and every expectation."""
    ends = [np.quantile(sample_efficiencies(r)[0], (0.5 - SHARE / 2, 0.5 + SHARE / 2)) for r in shown]
    means = np.array([r.own_efficiency for r in shown])
    values = 100 * np.concatenate([*ends, *(r.efficiency for r in shown), means[np.isfinite(means)]])
    room = 0.06 * float(np.ptp(values)) or 1.0
    return float(values.min() - room), float(values.max() + room)
