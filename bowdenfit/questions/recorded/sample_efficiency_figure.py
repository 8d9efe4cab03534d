"""Efficiency sample by sample in each recording, with the mean of its run and what is expected of the cable.

References:
    On-body paper, figures 13 and 15.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.inference.interval import NORMAL_90
from bowdenfit.plots.captions import count_shown
from bowdenfit.plots.curves import choose_evenly, note_shown_count
from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import MOST, enlarge_marks, label_outer, recording_panels, share_limits
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
from bowdenfit.questions import recorded as room

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Efficiency sample by sample"
MOST_COLUMNS = 4  # panels in a row
EDGE = 0.12  # of the panel's width, right of the samples
SHARE = 0.998  # of the samples, within the axis


@dataclass(frozen=True)
class Samples:
    """Efficiencies [1] of one recording of a single rope.

    Args:
        name: Name of the recording.
        efficiency: Efficiency of each block inside a sliding phase.
        stroke: +1 pulling, -1 returning, of these.
        expected: Expected efficiency of the run, 5 %, 50 % and 95 % quantiles; one number without draws.
        mean: Mean of the run as measured.
        sd: Its standard error from the readings alone.
    """

    name: str
    efficiency: np.ndarray
    stroke: np.ndarray
    expected: np.ndarray
    mean: float
    sd: float


def data(fit: Record) -> tuple[Samples, ...] | None:
    """Return every recording of a single rope with blocks inside a sliding phase; None without any."""
    recordings, samples = [t for t in room.trace_recordings(fit) if not t.is_loop], []
    runs = room.estimate_run_efficiencies(fit) if recordings else {}
    for trace in recordings:
        efficiency, stroke = compute_sample_efficiencies(
            trace.input_force, trace.output_force, trace.stroke * trace.used
        )
        if len(efficiency):
            samples.append(Samples(trace.recording.name, efficiency, stroke, *runs[trace.recording.run]))
    return tuple(samples) or None


def compute_sample_efficiencies(
    input_force: np.ndarray, output_force: np.ndarray, stroke: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return efficiency [1], F_out / F_in when pulling and F_in / F_out when returning, and stroke of each sliding block."""
    here = (stroke != 0) & (np.minimum(input_force, output_force) > 0)
    stroke = stroke[here]
    return (output_force[here] / input_force[here]) ** stroke.astype(float), stroke


def caption(recordings: tuple[Samples, ...]) -> str:
    """Describe what is drawn, in plain words."""
    shown = min(len(recordings), MOST)
    return (
        f"Efficiency of every used block of samples in {count_shown(shown, len(recordings), 'recording')}. Line and gray "
        "band: mean of its run, with the 90 % interval that its readings alone give; green: what is expected of the "
        "cable. Runs differ by more than the gray band because no two mountings are alike. "
        f"n = {sum(len(r.stroke) for r in recordings)} blocks."
    )


@in_paper_style
def draw(recordings: tuple[Samples, ...], width: float | None = None) -> Figure:
    """Draw the efficiency [%] of each used block against its number, a panel a recording on one efficiency axis."""
    shown = choose_evenly(recordings, MOST)
    counts = [(0.0, float(len(r.stroke))) for r in shown]
    share_x = share_limits(counts)
    figure, flat, columns = recording_panels([r.name for r in shown], MOST_COLUMNS, 1.6, share_x, True, width=width)
    longest = max(count for _, count in counts)
    for axes, recording, (_, count) in zip(flat, shown, counts, strict=True):
        _draw_samples(axes, recording)
        end = (longest if share_x else count) + 0.5
        axes.set_xlim(0.5 - 0.02 * end, end / (1 - EDGE))
        axes.locator_params(axis="x", nbins=4, integer=True, min_n_ticks=1)
        _draw_mean(axes, recording, count)
        _draw_expected(axes, recording)
    flat[0].set_ylim(*_limit_efficiency(shown))
    flat[0].locator_params(axis="y", nbins=7)
    label_outer(flat, columns, "Number of the sample", EFFICIENCY)
    note_shown_count(flat[0], len(shown), len(recordings), "recordings")
    legend_above(figure, flat, columns=3 if columns > 1 else 2)
    enlarge_marks(figure)
    return figure


def _draw_samples(axes: Axes, recording: Samples) -> None:
    """Draw a marker for every block, by stroke."""
    values, stroke = recording.efficiency, recording.stroke
    number = 1 + np.arange(len(values))
    for sign, label, marker, color in ((1, "Pulling", "o", BLUE), (-1, "Returning", "s", VERMILLION)):
        mask = stroke == sign
        if mask.any():
            axes.plot(
                number[mask], 100 * values[mask], marker, color=color, markersize=1.8 if len(values) > 100 else 2.6,
                markerfacecolor=color if sign > 0 else "white", markeredgewidth=0.4, label=label, rasterized=True,
            )  # fmt: skip


def _draw_mean(axes: Axes, recording: Samples, count: float) -> None:
    """Draw the run's efficiency as measured, with the uncertainty from its readings."""
    mean, off = 100 * recording.mean, 100 * NORMAL_90 * recording.sd
    if not np.isfinite(mean):
        return
    across = [0.5, count + 0.5]
    axes.plot(across, [mean, mean], color=BLACK, linewidth=1.0, zorder=3, label="Mean of the run")
    if np.isfinite(off):
        axes.fill_between(
            across, mean - off, mean + off, color=BLACK, alpha=0.3, linewidth=0, zorder=2.5,
            label=f"Its {WIDE_INTERVAL}, from the readings alone",
        )  # fmt: skip


def _draw_expected(axes: Axes, recording: Samples) -> None:
    """Draw the efficiency that is expected of the cable, at the right edge."""
    efficiency = 100 * recording.expected
    low, middle, high = efficiency[0], efficiency[len(efficiency) // 2], efficiency[-1]
    right = axes.get_xlim()[1] * (1 - 0.4 * EDGE)
    has_draws = len(efficiency) > 1
    words = f"{MEDIAN.lower()} with {WIDE_INTERVAL}" if has_draws else LEAST_SQUARES.lower()
    axes.errorbar(
        [right], [middle], [[middle - low], [high - middle]] if has_draws else None, fmt="D", color=GREEN, markersize=3.2,
        linewidth=1.3, capsize=2.2, zorder=4, label=f"Expected of the cable, {words}",
    )  # fmt: skip


def _limit_efficiency(shown: list[Samples]) -> tuple[float, float]:
    """Return limits of the efficiency [%] that shows nearly all samples, every mean and every expectation."""
    ends = [np.quantile(r.efficiency, (0.5 - SHARE / 2, 0.5 + SHARE / 2)) for r in shown]
    means = np.array([r.mean for r in shown])
    values = 100 * np.concatenate([*ends, *(r.expected for r in shown), means[np.isfinite(means)]])
    room = 0.06 * float(np.ptp(values)) or 1.0
    return float(values.min() - room), float(values.max() + room)
