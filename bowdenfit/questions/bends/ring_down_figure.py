"""A ring-down against time, a panel for each run, with the fitted free vibration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bowdenfit.plots.captions import count_shown, describe_curve, describe_strip
from bowdenfit.plots.curves import choose_evenly, draw_quantiles, name_band, note_shown_count
from bowdenfit.plots.layout import legend_above
from bowdenfit.plots.panels import enlarge_marks, span
from bowdenfit.plots.strips import panels_with_strips
from bowdenfit.plots.style import BLUE, LEAST_SQUARES, MEDIAN, VERMILLION, in_paper_style
from bowdenfit.words import counted

if TYPE_CHECKING:
    from bowdenfit.kinds.ringdown.kind import RingDownTable
    from bowdenfit.plots.layout import Axes, Figure
    from bowdenfit.results.record import Record

HEADING = "Ring-down of the joint"
MOST, MOST_COLUMNS = 6, 3
_POINTS = 400  # of the curve of a run


@dataclass(frozen=True)
class RingDown:
    """One run.

    Args:
        label: Number of the run, and what was added to the joint.
        quantity, unit: What was read.
        time: Along the curve [s].
        reading: Quantiles there.
        points_time, points: Readings.
        points_fitted: Median of the fitted reading where each was made.
    """

    label: str
    quantity: str
    unit: str
    time: np.ndarray
    reading: np.ndarray
    points_time: np.ndarray
    points: np.ndarray
    points_fitted: np.ndarray


def data(fit: Record) -> tuple[RingDown, ...] | None:
    """Every run; None where no joint was released."""
    from bowdenfit.kinds.ringdown.kind import RingDownTable
    from bowdenfit.questions.bends.curves import Values, evaluate_curves, quantiles_of_draws

    table = fit.dataset.measurements.table(RingDownTable)
    term = next((t for t in fit.model.terms if t.name == "ringdown"), None)
    if table is None or term is None:
        return None
    runs, times = range(len(table.added)), [table.time[table.run == run] for run in range(len(table.added))]
    fine = [np.linspace(time[0], time[-1], _POINTS) for time in times]
    along = term.data | {"time": np.concatenate(fine), "run": np.repeat(np.arange(len(fine)), _POINTS)}

    def curves(values: Values) -> dict[str, Any]:
        return {"along": term.expected(values, along), "read": term.expected(values, term.data)}

    draws = evaluate_curves(fit, curves)
    scale, quantity, unit = (1.0, "Torque", "N m") if table.is_torque else (np.rad2deg(1.0), "Angle", "deg")
    fitted = np.median(draws["read"], axis=0)
    return tuple(
        RingDown(
            _label(table, run), quantity, unit, fine[run], scale * quantiles_of_draws(draws["along"][:, along["run"] == run]),
            times[run], scale * table.reading[table.run == run], scale * fitted[table.run == run],
        )
        for run in runs
    )  # fmt: skip


def _label(table: RingDownTable, run: int) -> str:
    if len(table.added) == 1:
        return ""
    return f"Run {run + 1}" + (f", {table.added[run]:.3g} kg m² added" if table.added[run] else "")


def caption(runs: tuple[RingDown, ...]) -> str:
    """What is drawn, in plain words."""
    first, shown = runs[0], min(len(runs), MOST)
    return (
        f"{first.quantity} against the time since the release of the joint, {count_shown(shown, len(runs), 'run')}: what was "
        f"read, and the fitted free vibration. {describe_curve(len(first.reading) > 1)} {describe_strip(f'in {first.unit}')} "
        f"n = {counted(sum(len(run.points) for run in runs), 'reading')} in {counted(len(runs), 'run')}."
    )


@in_paper_style
def draw(runs: tuple[RingDown, ...], width: float | None = None) -> Figure:
    """Reading against time [s], a panel for each of at most six runs."""
    shown = choose_evenly(runs, MOST)
    across = [span([run.time], room=0.03) for run in shown]
    up = [span([run.reading, run.points]) for run in shown]
    made = panels_with_strips([run.label for run in shown], across, up, MOST_COLUMNS, width=width)
    for axes, strip, run in zip(made.mains, made.strips, shown, strict=True):
        name = MEDIAN if len(run.reading) > 1 else LEAST_SQUARES
        draw_quantiles(axes, run.time, run.reading, VERMILLION, label=name)
        name_band(axes, run.reading)
        _readings(axes, run.points_time, run.points)
        _readings(strip, run.points_time, run.points - run.points_fitted)
    made.finish_strips()
    made.label("Time (s)", f"{shown[0].quantity} ({shown[0].unit})", shown[0].unit)
    note_shown_count(made.mains[-1], len(shown), len(runs), "runs")
    legend_above(made.figure, made.mains, columns={1: 2, 2: 3}.get(made.columns, 4))
    enlarge_marks(made.figure)
    return made.figure


def _readings(axes: Axes, time: np.ndarray, shown: np.ndarray) -> None:
    axes.plot(time, shown, "o", color=BLUE, markersize=1.8, markeredgewidth=0, zorder=3, label="Read")
