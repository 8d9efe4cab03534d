"""At how many loads a table of forces was read."""

import numpy as np

from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.types import Vector

_MOST = 25  # loads that are counted
_APART = 3.0  # smallest gap between loads over the largest within one
_SAME = 0.002  # relative difference of readings that is none
_ONE = 0.03  # relative width of readings that are at one load


def alone(table: ForceTable) -> str:
    """How many readings, and at how many loads, counted at the end where they fall together."""
    n = len(table.input_force)
    counts = [found for found in map(levels, (table.input_force, table.output_force)) if found]
    at = f" at {min(counts)} load{'s' if min(counts) > 1 else ''}" if counts else ""
    return f"a table of {n} reading{'s' if n > 1 else ''}{at}"


def levels(forces: Vector) -> int | None:
    """Number of loads that readings fall together at; None where they spread.

    Args:
        forces: All positive [N].
    """
    logs = np.sort(np.log(forces))
    if logs[-1] - logs[0] < _ONE:
        return 1
    gaps = np.sort(np.diff(logs))[::-1]
    most = min(_MOST, (len(forces) + 1) // 2)
    ratios = gaps[: most - 1] / np.maximum(gaps[1:most], _SAME) if most > 1 else np.zeros(0)
    if not len(ratios) or ratios.max() < _APART:
        return None
    return int(np.argmax(ratios)) + 2
