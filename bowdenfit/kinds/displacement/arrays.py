"""Force at the motor against displacement as arrays that compiled functions take: readings by run, turns by depth."""

from dataclasses import replace
from typing import Any

import numpy as np

from bowdenfit.cable.cable import Cable
from bowdenfit.kinds.angles.table import AngleTable
from bowdenfit.kinds.displacement.table import DisplacementTable
from bowdenfit.kinds.displacement.turns import Turns
from bowdenfit.kinds.row_angles import row_angles
from bowdenfit.kinds.rows import OwnAngles

_ZERO = "displacement_zero"


def order_of(table: DisplacementTable) -> np.ndarray:
    """The rows that are used, in order of their runs."""
    rows = np.flatnonzero(table.used)
    return rows[np.argsort(table.run[rows], kind="stable")]


def readings(table: DisplacementTable, rows: np.ndarray) -> dict[str, Any]:
    """Arrays of some rows, ordered by run."""
    run, motion = table.run[rows], table.motion
    return {
        "displacement": table.displacement[rows],
        "stroke": motion.stroke[rows].astype(float),
        "after": places_of(motion.turns)[motion.after[rows]],
        "slides": motion.slides[rows],
        "run": run,
        "start": np.searchsorted(run, run),
    }


def arrays_of(cable: Cable, table: DisplacementTable, angles: AngleTable | None) -> dict[str, Any]:
    """Turns by depth, each with the place of the one before among those of lower depth; and the wrap angles of every run."""
    turns, place = table.motion.turns, places_of(table.motion.turns)
    levels = []
    for depth in range(int(turns.depth.max()) + 1):
        these = np.flatnonzero(turns.depth == depth)
        at = {"at": turns.at, "stroke": turns.stroke.astype(float), "after": place[turns.after], "run": turns.run}
        levels.append({name: values[these] for name, values in at.items()})
    first = np.array([np.flatnonzero(table.run == run)[0] for run in range(len(table.run_names))])
    own = OwnAngles(table.own.names, table.own.angle[first], table.own.sd[first])
    of_runs = replace(table, route=table.route[first], own=own)
    return {"turns": tuple(levels), "angles": row_angles(cable.description, of_runs, angles).data}


def places_of(turns: Turns) -> np.ndarray:
    """Place of each turn where they are ordered by depth."""
    place = np.empty(len(turns.depth), dtype=int)
    place[np.argsort(turns.depth, kind="stable")] = np.arange(len(turns.depth))
    return place


def zero_names(table: DisplacementTable) -> tuple[str, ...]:
    """Parameters of the displacement without force, one a run."""
    n = len(table.run_names)
    return (_ZERO,) if n == 1 else tuple(f"{_ZERO}_{i + 1}" for i in range(n))
