"""A ring-down against time, a panel for each run, with the fitted free vibration."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import count_shown, describe_curve, describe_left_out, describe_strip
from bowdenfit.plots.curves import choose_evenly, draw_quantiles, name_band, note_shown_count
from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import draw_left_out, enlarge_marks, span
from bowdenfit.plots.strips import panels_with_strips
from bowdenfit.plots.style import BLUE, LEAST_SQUARES, MEDIAN, VERMILLION, in_paper_style
from bowdenfit.questions import bends as room
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Ring-down of the joint"
MOST, MOST_COLUMNS = 6, 3  # runs that are shown, and panels in a row
_POINTS = 400  # of the curve of a run


@dataclass(frozen=True)
class RingDown:
    """One run.

    Args:
        label: Number of the run, and what was added to the joint.
        quantity, unit: Quantity that was read, and its unit.
        time: Along the curve [s].
        reading: Quantiles there.
        points_time, points: Readings.
        points_fitted: Median of the fitted reading where each was made.
        left_out: Time and reading of those that the user leaves out [s].
    """

    label: str
    quantity: str
    unit: str
    time: np.ndarray
    reading: np.ndarray
    points_time: np.ndarray
    points: np.ndarray
    points_fitted: np.ndarray
    left_out: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))


def data(fit: Record) -> tuple[RingDown, ...] | None:
    """Return every run; None where no joint was released."""
    return room.collect_ring_downs(fit)


def caption(runs: tuple[RingDown, ...]) -> str:
    """Describe what is drawn, in plain words."""
    first, shown = runs[0], min(len(runs), MOST)
    return (
        f"{first.quantity} against the time since the release of the joint, {count_shown(shown, len(runs), 'run')}: what was "
        f"read, and the fitted free vibration. {describe_curve(len(first.reading) > 1)} {describe_strip(f'in {first.unit}')} "
        f"n = {counted(sum(len(run.points) for run in runs), 'reading')} in {counted(len(runs), 'run')}. "
        f"{describe_left_out(np.concatenate([run.left_out for run in runs], axis=1))}"
    ).rstrip()


@in_paper_style
def draw(runs: tuple[RingDown, ...], width: float | None = None) -> Figure:
    """Draw the reading against time [s], a panel for each of at most six runs."""
    shown = choose_evenly(runs, MOST)
    across = [span([run.time], room=0.03) for run in shown]
    up = [span([run.reading, run.points]) for run in shown]
    made = panels_with_strips([run.label for run in shown], across, up, MOST_COLUMNS, width=width)
    for axes, strip, run in zip(made.mains, made.strips, shown, strict=True):
        name = MEDIAN if len(run.reading) > 1 else LEAST_SQUARES
        draw_quantiles(axes, run.time, run.reading, VERMILLION, label=name)
        name_band(axes, run.reading)
        _draw_readings(axes, run.points_time, run.points)
        _draw_readings(strip, run.points_time, run.points - run.points_fitted)
        draw_left_out(axes, run.left_out)
    made.finish_strips()
    made.label("Time (s)", f"{shown[0].quantity} ({shown[0].unit})", shown[0].unit)
    note_shown_count(made.mains[-1], len(shown), len(runs), "runs")
    legend_above(made.figure, made.mains, columns={1: 2, 2: 3}.get(made.columns, 4))
    enlarge_marks(made.figure)
    return made.figure


def _draw_readings(axes: Axes, time: np.ndarray, shown: np.ndarray) -> None:
    """Draw readings or residuals."""
    axes.plot(time, shown, "o", color=BLUE, markersize=1.8, markeredgewidth=0, zorder=3, label="Read")
