"""Data of the figure of force against displacement: the fitted loop of each run through every turn of the motor."""

from dataclasses import replace
from typing import Any

import numpy as np

from bowdenfit.kinds.displacement.table import DisplacementTable, follow_motor, history_of_sliding_rope
from bowdenfit.kinds.displacement.term import DisplacementTerm, reading_arrays, split_turns_by_depth
from bowdenfit.questions.bends.curves import Values, evaluate_curves, quantiles_of_draws
from bowdenfit.questions.bends.motor_force_figure import MotorForce
from bowdenfit.results.record import Record

_LOOP_POINTS = 150  # of the fitted loop of a run, at least


def collect_motor_forces(fit: Record) -> tuple[MotorForce, ...] | None:
    """Return the fitted loop and the readings of each run; None where no force was measured against displacement."""
    table = fit.dataset.measurements.table(DisplacementTable)
    term = next((t for t in fit.model.terms if isinstance(t, DisplacementTerm)), None)
    if table is None or term is None:
        return None
    path = _fine_path(table)
    both = [
        replace(term.data, turns=split_turns_by_depth(way.motion.turns), **reading_arrays(way, np.arange(len(way.run))))
        for way in (path, table)
    ]

    def curves(values: Values) -> dict[str, Any]:
        mounted = term.mounted_exponents(values, term.data)
        return {name: term.load_cell_force(values, way, mounted) for name, way in zip(("along", "read"), both, strict=True)}

    draws, runs = evaluate_curves(fit, curves), []
    along, fitted = draws["along"], np.median(draws["read"], axis=0)
    for run, name in enumerate(table.run_names):
        mask, rows = path.run == run, table.run == run
        label = "" if len(table.run_names) == 1 else name
        points = table.displacement[rows], table.force[rows], table.motion.stroke[rows], table.used[rows], fitted[rows]
        curve = path.displacement[mask], quantiles_of_draws(along[:, mask]), path.motion.stroke[mask]
        runs.append(MotorForce(label, *curve, *points))
    if len(runs) == 1:  # else it is not known of which run they are
        left_out = fit.dataset.measurements.excluded_points("displacement", "displacement", "force")
        runs = [replace(runs[0], left_out=left_out)]
    return tuple(runs)


def _fine_path(table: DisplacementTable) -> DisplacementTable:
    """Return the path of the motor in each run, in steps finer than its readings."""
    x, run, stroke = [], [], []
    for number in range(len(table.run_names)):
        at = table.displacement[table.run == number]
        if table.sliding:
            line = np.linspace(at.min(), at.max(), _LOOP_POINTS)
            x.append(np.concatenate([line, line]))
            stroke.append(np.repeat([1, -1], _LOOP_POINTS))
        else:
            steps = max(1, -(-_LOOP_POINTS // max(len(at) - 1, 1)))
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
