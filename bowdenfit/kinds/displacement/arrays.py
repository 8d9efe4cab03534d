"""Force at the motor against displacement as arrays that compiled functions take: readings by run, turns by depth."""

from typing import Any

import numpy as np

from bowdenfit.cable.cable import Cable
from bowdenfit.kinds.angles.table import AngleTable
from bowdenfit.kinds.displacement.table import ZERO, DisplacementTable
from bowdenfit.kinds.displacement.turns import Turns
from bowdenfit.kinds.row_angles import row_angles
from bowdenfit.kinds.rows import OwnAngles, RowConditions


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


def turns_by_depth(turns: Turns) -> tuple[dict[str, np.ndarray], ...]:
    """Turns by depth, each with the place of the one before it among those of lower depth."""
    place = places_of(turns)
    at = {"at": turns.at, "stroke": turns.stroke.astype(float), "after": place[turns.after], "run": turns.run}
    return tuple(
        {name: values[turns.depth == depth] for name, values in at.items()} for depth in range(int(turns.depth.max()) + 1)
    )


def angles_of_runs(cable: Cable, table: DisplacementTable, angles: AngleTable | None) -> dict[str, np.ndarray]:
    """Wrap angles of every run, which are those of its first row."""
    first = np.array([np.flatnonzero(table.run == run)[0] for run in range(len(table.run_names))])
    own = OwnAngles(table.own.names, table.own.angle[first], table.own.sd[first])
    return row_angles(cable.description, RowConditions(table.route[first], own), angles).data


def places_of(turns: Turns) -> np.ndarray:
    """Place of each turn where they are ordered by depth."""
    place = np.empty(len(turns.depth), dtype=int)
    place[np.argsort(turns.depth, kind="stable")] = np.arange(len(turns.depth))
    return place


def zero_names(table: DisplacementTable) -> tuple[str, ...]:
    """Parameters of the displacement without force, one a run."""
    n = len(table.run_names)
    return (ZERO,) if n == 1 else tuple(f"{ZERO}_{i + 1}" for i in range(n))
