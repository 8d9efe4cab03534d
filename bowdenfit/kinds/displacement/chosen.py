r"""Which rows of force against displacement are used: not those that depend on how the rope lay before, nor before a stop.

Nobody knows how the rope lay before the motor first moved. It may have been pulled or let out; from its let-out state, where
the force is F_t, all of it slides once the force is :math:`F_t e^{2\Lambda}`, whatever the spring and the rope. At one
displacement the pull is over the return by at least :math:`e^\Lambda` (`bowdenfit.physics.tendon`), whose square is enough;
the last quarter of the stroke is used all the same, lest a loop have no pull.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.kinds.displacement.table import DisplacementTable
from bowdenfit.types import Flags

_LEAST_SHARE = 0.01  # of the largest force, which a rope's may be taken for none
_MOST = 600  # rows that are used, of longer tables
_PLACES = 9  # displacements at which pull and return are compared


def chosen(table: DisplacementTable, settings: Any, has_strokes: bool) -> tuple[DisplacementTable, list[str]]:
    """The table with the rows that are used, and what is said of the others.

    Args:
        table: All rows.
        settings: What stands under the table in cable.toml.
        has_strokes: Whether it has a column stroke.

    Raises:
        DatasetError: A stop is never reached.
    """
    file, x, used, remarks = table.origin.files[0], table.displacement, table.used.copy(), []
    if table.sliding:
        remarks.append(
            f"{file} has a stroke column: every row is taken as read while all of the rope slides. If rows were taken in order "
            'through the turns of the motor, write rows = "in order" beside the file in cable.toml.'
        )
    else:
        ignored = " Its stroke column is not needed." if has_strokes else ""
        unknown = early(table)
        used &= ~unknown
        remarks.append(
            f"{file}: rows are taken in the order in which they stand, and turns of the motor as the displacement shows them."
            f"{ignored} {int(unknown.sum())} of {len(x)} rows, at the start of each run, are not used, because there the force "
            "depends on how the rope lay before, which nobody knows."
        )
    if "end" not in settings.model_fields_set:
        remarks.append(
            f"{file}: the far end is taken for a spring whose stiffness is fitted; if the rope pulls against a stop, write "
            'end = "stop" beside the file in cable.toml, or --set tables.displacement.end=stop.'
        )
    if settings.stop is not None:
        at = settings.stop.to("length")
        if not np.any(x > at):
            raise DatasetError(
                f"{file}: the stop at {settings.stop.value:g} {settings.stop.unit} is never reached, the displacements end at "
                f"{x.max():.4g} mm; pull on to the stop, correct where it is, or leave it out if a spring is at the far end."
            )
        before = used & (x <= at)
        used &= ~before
        remarks.append(f"{file}: {int(before.sum())} rows lie before the stop, and are not used.")
    n = int(used.sum())
    if n > _MOST:
        step = -(-n // _MOST)
        used[np.flatnonzero(used)[np.arange(n) % step != 0]] = False
        remarks.append(
            f"{file}: of the {n} rows that are left one in {step} is used, {int(used.sum())} in all; those between them say "
            "hardly more, and the turns of the motor are those of all rows."
        )
    return replace(table, used=used), remarks


def early(table: DisplacementTable) -> Flags:
    """Rows of the first stroke of each run in which the force may depend on what was before it."""
    unknown = np.zeros(len(table.run), dtype=bool)
    for run in range(len(table.run_names)):
        rows = np.flatnonzero((table.run == run) & table.motion.first)
        back = np.flatnonzero((table.run == run) & (table.motion.stroke == -table.motion.stroke[rows[0]]))
        may = _before_half(table, rows) if len(back) < 2 else _before_all_slides(table, rows, back)
        last = np.flatnonzero(may)
        unknown[rows[: last[-1] + 1 if len(last) else 0]] = True
    return unknown


def _before_half(table: DisplacementTable, rows: np.ndarray) -> Flags:
    """Rows of a stroke before its middle, where no other stroke tells more."""
    x = table.displacement[rows]
    return np.asarray(table.motion.stroke[rows[0]] * (x - (x[0] + x[-1]) / 2) < 0)


def _before_all_slides(table: DisplacementTable, rows: np.ndarray, back: np.ndarray) -> Flags:
    """Rows of a stroke before all of the rope is known to slide, by the way back."""
    way, x, force = int(table.motion.stroke[rows[0]]), table.displacement, table.force
    order = back[np.argsort(x[back], kind="stable")]
    first, low, high = x[rows[0]], x[order[0]], x[order[-1]]
    beyond = first < low - 0.05 * (high - low) if way > 0 else first > high + 0.05 * (high - low)
    turned = np.sort(x[rows])
    shared = np.linspace(max(low, turned[0]), min(high, turned[-1]), _PLACES)[_PLACES // 2 : -1]
    there, here = (np.interp(shared, x[these], force[these]) for these in (rows[np.argsort(x[rows], kind="stable")], order))
    ratios = (there / np.maximum(here, 1e-12 * force.max())) ** way
    if beyond or shared[0] >= shared[-1] or not np.median(ratios) > 1:
        return _before_half(table, rows)
    most, turned_at = np.median(ratios) ** 2, float(np.interp(first, x[order], force[order]))
    turned_at = max(turned_at, _LEAST_SHARE * force.max())
    depends = force[rows] < turned_at * most if way > 0 else force[rows] > turned_at / most
    return np.asarray(depends & (way * (x[rows] - (x[rows[0]] + 3 * x[rows[-1]]) / 4) < 0))
