"""Stretch of the rope under loads and at wrap angles."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from bowdenfit.display import Part
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column, Quantity, find_columns, require
from bowdenfit.files.csv_table import RawTable
from bowdenfit.files.tables import read_table
from bowdenfit.kinds.kind import Source, TableFromFiles
from bowdenfit.kinds.rows import RowOrigin, check_spelling, provenance_of, read_angle, read_tension
from bowdenfit.types import Flags, Labels, Vector

_BRANCHES = {
    **dict.fromkeys(("load", "loading", "up", "+1", "1"), False),
    **dict.fromkeys(("unload", "unloading", "down", "-1"), True),
}
_UNUSED = ("time", "position", "run")  # columns that such a table may have and that nothing reads
_FEWEST = 2  # readings beyond one a group below which a falling stretch may be noise
_SURE = 0.9  # how closely the stretch must follow the falling line for its sign to be refused


@dataclass(frozen=True, repr=False)
class StretchTable(Part):
    """Stretch of the rope, seen at its loaded end while the far end is held, under loads and at wrap angles.

    Args:
        load: Tension at the loaded end [N].
        wrap_angle: Total wrap angle of the cable [rad].
        stretch: Reading [mm]; what counts as zero is unknown.
        unloading: Whether the load was larger before, in the same cycle.
        peak: Largest load of the row's cycle [N].
        cycle: Number of the cycle of each row.
        cycle_names: Name of each cycle.
        origin: Where each row was read.
    """

    load: Vector
    wrap_angle: Vector
    stretch: Vector
    unloading: Flags
    peak: Vector
    cycle: Labels
    cycle_names: tuple[str, ...]
    origin: RowOrigin


def read_stretch(source: Source) -> TableFromFiles[StretchTable]:
    """Read a table of stretch under load, at one or several wrap angles.

    Rows of one `cycle` (all at one wrap angle without such a column) belong to one loading and unloading; `branch` says
    which of the two a row is read in. Without it every row is taken as read while the load grew, which is remarked on.

    Args:
        source: Where it is.

    Raises:
        DatasetError: See `read_table` and `find_columns`; or a load is negative, or stretch falls with load.
    """
    path = source.file
    table = read_table(path)
    wanted = (Quantity("load", "force"), Quantity("wrap_angle", "angle"), Quantity("stretch", "length"))
    optional = (Quantity("branch", "text"), Quantity("cycle", "text"))
    found = find_columns(table, (*wanted, *optional), source.columns, _UNUSED)
    check_spelling(table, found, optional)
    loads, angles, stretches = (
        require(table, found, name, f"{name}_{unit}")
        for name, unit in (("load", "N"), ("wrap_angle", "deg"), ("stretch", "mm"))
    )
    load = np.array(loads.each(lambda cell: read_tension(cell, loads, "a load"), np.nan))
    wrap_angle = np.array(angles.each(lambda cell: read_angle(cell, angles), np.nan))
    stretch = stretches.numbers()
    unloading = _branches(found.get("branch"), len(load))
    table.faults.refuse()
    cycle, names = _cycles(found.get("cycle"), wrap_angle)
    peak = np.array([load[cycle == c].max() for c in cycle])
    made = StretchTable(load, wrap_angle, np.asarray(stretch), unloading, peak, cycle, names, provenance_of(table))
    _check_rising(stretches, made)
    remarks = tuple(_branch_remarks(table, made, "branch" in found))
    return TableFromFiles(made, {path.name: path}, remarks, (table.account,))


def _branch_remarks(table: RawTable, made: StretchTable, stated: bool) -> list[str]:
    """What had to be assumed of loading and unloading."""
    cycles = [np.flatnonzero(made.cycle == c) for c in range(len(made.cycle_names))]
    if stated:
        down = [made.cycle_names[c] for c, rows in enumerate(cycles) if made.unloading[rows].all()]
        return [
            f"{table.file} has only readings with falling load at {name}; they are taken to come down from the largest of "
            "them."
            for name in down
        ]
    remark = f"{table.file} has no branch column: every row is taken as read while the load grew"
    falls = [row for rows in cycles for row in rows[1:][np.diff(made.load[rows]) < 0]]
    if not falls:
        return [remark + "."]
    return [
        f"{remark}, although the load falls in row {made.origin.row[falls[0]]}; if the rope was unloaded there, say so in a "
        "column branch (load or unload)."
    ]


def _branches(column: Column | None, n_rows: int) -> Flags:
    if column is None:
        return np.zeros(n_rows, dtype=bool)
    return np.array(column.each(_branch, False), dtype=bool)


def _branch(cell: Cell) -> bool:
    text = cell.text.strip().lower()
    if text not in _BRANCHES:
        seen = "the cell is blank" if cell.blank else f"{cell.shown} is no branch"
        raise cell.refuse(f"{seen}; write load (while the load grows) or unload (while it falls).")
    return _BRANCHES[text]


def _cycles(column: Column | None, wrap_angle: Vector) -> tuple[Labels, tuple[str, ...]]:
    """Cycle of each row: as named, at one wrap angle."""
    names = [cell.text.strip() or "(no cycle)" for cell in column.cells] if column else [""] * len(wrap_angle)
    shown = [
        f"{name + ', ' if name else ''}{np.rad2deg(angle):.4g} deg"
        for name, angle in zip(names, wrap_angle, strict=True)
    ]
    different = tuple(dict.fromkeys(shown))
    return np.array([different.index(name) for name in shown], dtype=int), different


def _check_rising(column: Column, made: StretchTable) -> None:
    """Stretch that falls while load grows has its sign turned round: in one branch of a cycle, or in all together."""
    groups = [
        np.flatnonzero((made.cycle == cycle) & (made.unloading == unloading))
        for cycle, unloading in product(range(len(made.cycle_names)), (False, True))
    ]
    groups = [rows for rows in groups if len(np.unique(made.load[rows])) > 1]
    for together in [[rows] for rows in groups] + [groups]:
        load, stretch = (_about_means(values, together) for values in (made.load, made.stretch))
        if len(load) - len(together) < _FEWEST or np.ptp(stretch) == 0:
            continue
        if np.corrcoef(load, stretch)[0, 1] < -_SURE:
            rows = together[0]
            low, high = rows[np.argmin(made.load[rows])], rows[np.argmax(made.load[rows])]
            raise column.cells[high].refuse(
                f"the stretch falls from {made.stretch[low]:g} mm in row {made.origin.row[low]} to {made.stretch[high]:g} mm "
                f"here while the load grows from {made.load[low]:g} to {made.load[high]:g} N; the usual cause is a "
                "displacement counted toward the cable: write stretch as positive where the rope's end moves away."
            )


def _about_means(values: np.ndarray, groups: Sequence[np.ndarray]) -> np.ndarray:
    """Values of all groups, each less the mean of its group."""
    return np.concatenate([values[rows] - values[rows].mean() for rows in groups]) if groups else np.zeros(0)
