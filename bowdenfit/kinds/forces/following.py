"""Refuses an output that does not follow the input: a dead cell, or a column that is no force.

While a rope slides, what comes out rises with what goes in, whatever its friction does with the load: pulling it rises at
least in proportion, and returning by at least as many newtons, for the capstan equation as for any load exponent or drag.
Where inputs differ widely and the output shows next to nothing of that, beyond what noise hides, it is another thing.
"""

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.kinds.forces.table import ForceTable

_WIDE = 0.3  # standard deviation of the loads of a run over their mean, from which the question is asked
_FEWEST = 4  # degrees of freedom
_SDS = 3.0
_SLOPE = 0.5  # of the least that a rope shows, below which the output does not follow
_EXPLAINED = 0.25  # share of the variance of the output that the input explains, below which it does not follow
_STROKES = {1: "pulling", -1: "returning"}


def check_following(table: ForceTable) -> None:
    """Refuse a table whose output force does not rise with its input force.

    Raises:
        DatasetError: Says what was seen, the usual causes and what to do.
    """
    for stroke, how in _STROKES.items():
        rows = np.flatnonzero(table.stroke == stroke)
        if _does_not_follow(table, rows, stroke):
            force_in, force_out = table.input_force[rows], table.output_force[rows]
            raise DatasetError(
                f"{table.origin.place(rows[0])} and on: while {how}, output_force does not follow input_force, which goes from "
                f"{force_in.min():.4g} to {force_in.max():.4g} N while the output is {force_out.mean():.4g} N give or take "
                f"{force_out.std():.2g} N, and of that the input explains little; a rope passes on more where more goes in. "
                "The usual causes are a dead load cell, a column that is no force (a position, a time), and rows of one column "
                "that belong beside others of the other; map the right columns in cable.toml, or leave these rows out."
            )


def _does_not_follow(table: ForceTable, rows: np.ndarray, stroke: int) -> bool:
    """Whether the output of the rows of a stroke hangs on the input by far less than a rope's, run by run."""
    force_in, force_out = table.input_force[rows], table.output_force[rows]
    place = np.column_stack([table.run[rows], np.nan_to_num(table.route[rows])])
    cell = np.unique(place, axis=0, return_inverse=True)[1].ravel()
    count = np.bincount(cell)
    mean_in, mean_out = ((np.bincount(cell, force) / count)[cell] for force in (force_in, force_out))
    x, y = force_in / mean_in - 1, (force_out - mean_out) / (mean_out if stroke > 0 else mean_in)
    freedom, spread = len(rows) - len(count) - 1, float(x @ x)
    if freedom < _FEWEST or spread < len(rows) * _WIDE**2:
        return False
    slope, whole = float(x @ y) / spread, float(y @ y)
    rest = max(whole - slope**2 * spread, 0.0)
    explained = 1 - rest / whole if whole > 0 else 0.0
    return explained < _EXPLAINED and slope + _SDS * np.sqrt(rest / freedom / spread) < _SLOPE
