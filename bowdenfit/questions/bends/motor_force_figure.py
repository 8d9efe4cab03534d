"""Force at the motor against its displacement, a panel for each run, with the fitted loop through every turn of the motor."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit.plots.captions import count_shown, describe_curve, describe_strip
from bowdenfit.plots.curves import choose_evenly, draw_quantiles, name_band, note_shown_count
from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import enlarge_marks, span
from bowdenfit.plots.strips import panels_with_strips
from bowdenfit.plots.style import BLUE, GRAY, LEAST_SQUARES, MEDIAN, VERMILLION, in_paper_style
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.kinds.displacement.table import DisplacementTable
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Force at the motor against displacement"
MOST, MOST_COLUMNS = 6, 3
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


def data(fit: Record) -> tuple[MotorForce, ...] | None:
    """The loop of each run; None where no force was measured against displacement."""
    from bowdenfit.kinds.displacement.table import DisplacementTable
    from bowdenfit.kinds.displacement.term import DisplacementTerm, reading_arrays, split_turns_by_depth
    from bowdenfit.questions.bends.curves import Values, evaluate_curves, quantiles_of_draws

    table = fit.dataset.measurements.table(DisplacementTable)
    term = next((t for t in fit.model.terms if isinstance(t, DisplacementTerm)), None)
    if table is None or term is None:
        return None
    path = _fine_path(table)
    both = [
        {
            "turns": split_turns_by_depth(way.motion.turns),
            "angles": term.data["angles"],
            **reading_arrays(way, np.arange(len(way.run))),
        }
        for way in (path, table)
    ]

    def curves(values: Values) -> dict[str, Any]:
        mounted = term.mounted_exponents(values, term.data)
        return {name: term.load_cell_force(values, way, mounted) for name, way in zip(("along", "read"), both, strict=True)}

    draws, runs = evaluate_curves(fit, curves), []
    along, fitted = draws["along"], np.median(draws["read"], axis=0)
    for run, name in enumerate(table.run_names):
        here, rows = path.run == run, table.run == run
        label = "" if len(table.run_names) == 1 else name
        points = table.displacement[rows], table.force[rows], table.motion.stroke[rows], table.used[rows], fitted[rows]
        curve = path.displacement[here], quantiles_of_draws(along[:, here]), path.motion.stroke[here]
        runs.append(MotorForce(label, *curve, *points))
    return tuple(runs)


def _fine_path(table: DisplacementTable) -> DisplacementTable:
    """The way that the motor took in each run, in steps finer than its readings."""
    from bowdenfit.kinds.displacement.table import follow_motor, history_of_sliding_rope

    x, run, stroke = [], [], []
    for number in range(len(table.run_names)):
        at = table.displacement[table.run == number]
        if table.sliding:
            line = np.linspace(at.min(), at.max(), _POINTS)
            x.append(np.concatenate([line, line]))
            stroke.append(np.repeat([1, -1], _POINTS))
        else:
            steps = max(1, -(-_POINTS // max(len(at) - 1, 1)))
            x.append(np.interp(np.arange(steps * (len(at) - 1) + 1) / steps, np.arange(len(at)), at))
        run.append(np.full(len(x[-1]), number))
    displacement, of_run = np.concatenate(x), np.concatenate(run)
    if table.sliding:
        motion = history_of_sliding_rope(np.concatenate(stroke), displacement, of_run)
    else:
        motion = follow_motor(displacement, of_run)
    no_force, nowhere = np.zeros(len(of_run)), np.full(len(of_run), np.nan)
    every = np.ones(len(of_run), dtype=bool)
    return replace(
        table, route=nowhere, force=no_force, displacement=displacement, motion=motion, run=of_run, used=every
    )


def caption(runs: tuple[MotorForce, ...]) -> str:
    """What is drawn, in plain words."""
    n, shown = sum(int(run.points_used.sum()) for run in runs), min(len(runs), MOST)
    return (
        f"Force at the motor against its displacement, {count_shown(shown, len(runs), 'run')}: what was read, and the "
        f"fitted loop through every turn of the motor. {describe_curve(len(runs[0].force) > 1)} {describe_strip('in N')} "
        f"n = {counted(n, 'reading')} in {counted(len(runs), 'run')}."
    )


@in_paper_style
def draw(runs: tuple[MotorForce, ...], width: float | None = None) -> Figure:
    """Force at the motor [N] against displacement [mm], a panel for each of at most six runs."""
    shown = choose_evenly(runs, MOST)
    across = [span([run.displacement], room=0.03) for run in shown]
    up = [span([run.force, run.points_force]) for run in shown]
    made = panels_with_strips([run.label for run in shown], across, up, MOST_COLUMNS, width=width)
    for axes, strip, run in zip(made.mains, made.strips, shown, strict=True):
        _loop(axes, run)
        _readings(axes, run.points_force, run)
        _readings(strip, run.points_force - run.points_fitted, run)
    made.finish_strips()
    made.label("Displacement at the motor (mm)", "Force at the motor (N)", "N")
    note_shown_count(made.mains[-1], len(shown), len(runs), "runs")
    legend_above(made.figure, made.mains, columns={1: 2, 2: 3}.get(made.columns, 4))
    enlarge_marks(made.figure)
    return made.figure


def _loop(axes: Axes, run: MotorForce) -> None:
    """The fitted force stroke by stroke, each from the end of the one before."""
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


def _readings(axes: Axes, shown: np.ndarray, run: MotorForce) -> None:
    """Forces or residuals of the readings by stroke; those that are not used are open."""
    for stroke, name, marker, size, color in _STROKES:
        for used, words in ((True, name), (False, "Not used")):
            here = (run.points_stroke == stroke) & (run.points_used.astype(bool) == used)
            if here.any():
                axes.plot(
                    run.points_displacement[here], shown[here], marker, color=color, markersize=size,
                    markerfacecolor=color if used else "white", markeredgewidth=0.5,
                    markeredgecolor="white" if used else color, zorder=3, label=words,
                )  # fmt: skip
