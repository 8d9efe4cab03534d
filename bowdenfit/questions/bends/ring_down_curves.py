"""Data of the figure of ring-downs: the fitted free vibration of each run."""

from dataclasses import replace
from typing import Any

import numpy as np

from bowdenfit.kinds.ringdown.kind import RingDownTable
from bowdenfit.questions.bends.curves import Values, evaluate_curves, quantiles_of_draws
from bowdenfit.questions.bends.ring_down_figure import RingDown
from bowdenfit.results.record import Record

_RING_POINTS = 400  # of the curve of a ring-down


def collect_ring_downs(fit: Record) -> tuple[RingDown, ...] | None:
    """Return every ring-down, with the fitted vibration; None where no joint was released."""
    table = fit.dataset.measurements.table(RingDownTable)
    term = next((t for t in fit.model.terms if t.name == "ringdown"), None)
    if table is None or term is None:
        return None
    runs, times = range(len(table.added)), [table.time[table.run == run] for run in range(len(table.added))]
    fine = [np.linspace(time[0], time[-1], _RING_POINTS) for time in times]
    along = replace(term.data, time=np.concatenate(fine), run=np.repeat(np.arange(len(fine)), _RING_POINTS))

    def curves(values: Values) -> dict[str, Any]:
        return {"along": term.expected(values, along), "read": term.expected(values, term.data)}

    draws = evaluate_curves(fit, curves)
    scale, quantity, unit = (1.0, "Torque", "N m") if table.is_torque else (np.rad2deg(1.0), "Angle", "deg")
    fitted = np.median(draws["read"], axis=0)
    ring_downs = []
    for run in runs:
        curve = scale * quantiles_of_draws(draws["along"][:, along.run == run])
        points = times[run], scale * table.reading[table.run == run], scale * fitted[table.run == run]
        excluded = fit.dataset.measurements.excluded_points("ringdown", "time", quantity.lower(), run)
        left_out = excluded * [[1.0], [scale]]
        ring_downs.append(RingDown(_name_run(table, run), quantity, unit, fine[run], curve, *points, left_out))
    return tuple(ring_downs)


def _name_run(table: RingDownTable, run: int) -> str:
    """Return the number of a run and what was added to the joint; empty of the only run."""
    if len(table.added) == 1:
        return ""
    return f"Run {run + 1}" + (f", {table.added[run]:.3g} kg m² added" if table.added[run] else "")
