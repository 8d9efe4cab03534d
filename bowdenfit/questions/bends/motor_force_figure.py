"""Force at the motor against its displacement, a panel for each run, with the fitted loop through every turn of the motor."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from bowdenfit.plots.captions import count_shown, describe_curve, describe_left_out, describe_strip
from bowdenfit.plots.curves import choose_evenly, draw_quantiles, name_band, note_shown_count
from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import draw_left_out, enlarge_marks, span
from bowdenfit.plots.strips import panels_with_strips
from bowdenfit.plots.style import BLUE, GRAY, LEAST_SQUARES, MEDIAN, VERMILLION, in_paper_style
from bowdenfit.questions import bends as room
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Force at the motor against displacement"
MOST, MOST_COLUMNS = 6, 3  # runs that are shown, and panels in a row
_POINTS = 150  # of the loop of a run, at least
# stroke, name, marker, size [pt], color
_STROKES = ((1, "Read while pulling", "o", 3.2, BLUE), (-1, "Read on the return", "s", 3.0, VERMILLION))


@dataclass(frozen=True)
class MotorForce:
    """Force at the motor of one run.

    Args:
        label: Name of the run.
        displacement: Along the fitted path, in the order in which the motor took it [mm].
        force: Quantiles of the force there [N].
        stroke: +1 pulling, -1 return, there.
        points_displacement, points_force, points_stroke: Readings [mm, N].
        points_used: Whether each is used.
        points_fitted: Median of the fitted force where each was read [N].
        left_out: Displacement and force of the readings that the user leaves out, of a single run [mm, N].
    """

    label: str
    displacement: np.ndarray
    force: np.ndarray
    stroke: np.ndarray
    points_displacement: np.ndarray
    points_force: np.ndarray
    points_stroke: np.ndarray
    points_used: np.ndarray
    points_fitted: np.ndarray
    left_out: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))


def data(fit: Record) -> tuple[MotorForce, ...] | None:
    """Return the loop of each run; None where no force was measured against displacement."""
    return room.collect_motor_forces(fit)


def caption(runs: tuple[MotorForce, ...]) -> str:
    """Describe what is drawn, in plain words."""
    n, shown = sum(int(run.points_used.sum()) for run in runs), min(len(runs), MOST)
    return (
        f"Force at the motor against its displacement, {count_shown(shown, len(runs), 'run')}: what was read, and the "
        f"fitted loop through every turn of the motor. {describe_curve(len(runs[0].force) > 1)} {describe_strip('in N')} "
        f"n = {counted(n, 'reading')} in {counted(len(runs), 'run')}. {describe_left_out(runs[0].left_out)}"
    ).rstrip()


@in_paper_style
def draw(runs: tuple[MotorForce, ...], width: float | None = None) -> Figure:
    """Draw the force at the motor [N] against displacement [mm], a panel for each of at most six runs."""
    shown = choose_evenly(runs, MOST)
    across = [span([run.displacement], room=0.03) for run in shown]
    up = [span([run.force, run.points_force]) for run in shown]
    made = panels_with_strips([run.label for run in shown], across, up, MOST_COLUMNS, width=width)
    for axes, strip, run in zip(made.mains, made.strips, shown, strict=True):
        _draw_loop(axes, run)
        _draw_readings(axes, run.points_force, run)
        _draw_readings(strip, run.points_force - run.points_fitted, run)
        draw_left_out(axes, run.left_out)
    made.finish_strips()
    made.label("Displacement at the motor (mm)", "Force at the motor (N)", "N")
    note_shown_count(made.mains[-1], len(shown), len(runs), "runs")
    legend_above(made.figure, made.mains, columns={1: 2, 2: 3}.get(made.columns, 4))
    enlarge_marks(made.figure)
    return made.figure


def _draw_loop(axes: Axes, run: MotorForce) -> None:
    """Draw the fitted force stroke by stroke, each from the end of the one before."""
    name = (MEDIAN if len(run.force) > 1 else LEAST_SQUARES).lower()
    ends = [0, *(np.flatnonzero(np.diff(run.stroke)) + 1).tolist(), len(run.stroke)]
    labelled = set[int]()
    for start, stop in pairwise(ends):
        joined = start > 0 and abs(run.displacement[start] - run.displacement[start - 1]) < 0.5 * np.ptp(
            run.displacement
        )
        way, part = int(run.stroke[start]), slice(start - joined, stop)
        label = {} if way in labelled else {"label": f"{'Pull' if way > 0 else 'Return'}, {name}"}
        draw_quantiles(axes, run.displacement[part], run.force[:, part], BLUE if way > 0 else VERMILLION, **label)
        labelled.add(way)
    name_band(axes, run.force)
    axes.axhline(0.0, color=GRAY, linewidth=0.6, zorder=0.5)


def _draw_readings(axes: Axes, shown: np.ndarray, run: MotorForce) -> None:
    """Draw forces or residuals of the readings by stroke; those that are not used are open."""
    for stroke, name, marker, size, color in _STROKES:
        for used, words in ((True, name), (False, "Not used")):
            mask = (run.points_stroke == stroke) & (run.points_used.astype(bool) == used)
            if mask.any():
                axes.plot(
                    run.points_displacement[mask], shown[mask], marker, color=color, markersize=size,
                    markerfacecolor=color if used else "white", markeredgewidth=0.5,
                    markeredgecolor="white" if used else color, zorder=3, label=words,
                )  # fmt: skip
