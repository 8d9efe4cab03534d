"""Tables of stretch, of preload, and of forces at both ends of a pull-pull loop."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from itertools import product
from pathlib import Path

import numpy as np

from bowdenfit.description.pulleys import Pulleys
from bowdenfit.errors import DatasetError
from bowdenfit.files.columns import Column, ColumnSource, Quantity, find_columns, meanings, require
from bowdenfit.files.csv_table import Cell, RawTable, read_csv
from bowdenfit.kinds.rows import (
    Route,
    provenance_of,
    read_angle,
    read_own_angles,
    read_route,
    read_strokes,
    shared_columns,
)
from bowdenfit.kinds.tables import LoopTable, PreloadTable, StretchTable
from bowdenfit.types import Flags, Labels, Vector
from bowdenfit.words import shown

_BRANCHES = {
    **dict.fromkeys(("load", "loading", "up", "+1", "1"), False),
    **dict.fromkeys(("unload", "unloading", "down", "-1"), True),
}
_UNUSED = ("time", "position", "run")  # columns that these tables may have and that nothing reads
_FEWEST = 2  # readings beyond one a group below which a falling stretch may be noise
_ALIKE = 0.75  # likeness from which an unknown heading is taken for a misspelled one
_SURE = 0.9  # how closely the stretch must follow the falling line for its sign to be refused


def read_stretch(path: Path, sources: Mapping[str, ColumnSource] | None = None) -> tuple[StretchTable, tuple[str, ...]]:
    """Read a table of stretch under load, at one or several wrap angles.

    Rows of one `cycle` (all at one wrap angle without such a column) belong to one loading and unloading; `branch` says
    which of the two a row is read in. Without it every row is taken as read while the load grew, which is remarked on.

    Args:
        path: CSV file.
        sources: Columns named by the user.

    Returns:
        The table, and remarks on what had to be assumed.

    Raises:
        DatasetError: See `read_csv` and `find_columns`; or a load is negative, or stretch falls with load.
    """
    table = read_csv(path)
    wanted = (Quantity("load", "force"), Quantity("wrap_angle", "angle"), Quantity("stretch", "length"))
    optional = (Quantity("branch", "text"), Quantity("cycle", "text"))
    found = find_columns(table, (*wanted, *optional), sources, _UNUSED)
    _check_spelling(table, found, optional)
    loads, angles, stretches = (
        require(table, found, name, f"{name}_{unit}")
        for name, unit in (("load", "N"), ("wrap_angle", "deg"), ("stretch", "mm"))
    )
    load = np.array([_tension(cell, loads, "a load") for cell in loads.cells])
    wrap_angle = np.array([read_angle(cell, angles) for cell in angles.cells])
    stretch = stretches.numbers()
    unloading = _branches(found.get("branch"), len(load))
    cycle, names = _cycles(found.get("cycle"), wrap_angle)
    peak = np.array([load[cycle == c].max() for c in cycle])
    made = StretchTable(load, wrap_angle, np.asarray(stretch), unloading, peak, cycle, names, provenance_of(table))
    _check_rising(stretches, made)
    return made, tuple(_branch_remarks(table, made, "branch" in found))


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


def _check_spelling(table: RawTable, found: Mapping[str, Column], optional: Sequence[Quantity]) -> None:
    """A column that nothing reads must not be a misspelled one that would have been read."""
    read = {column.heading for column in found.values()}
    missing = [quantity.name for quantity in optional if quantity.name not in found]
    for heading in table.header:
        name = heading.lower().partition(" ")[0].partition("_")[0]
        near = get_close_matches(name, missing, n=1, cutoff=_ALIKE) if heading and heading not in read else []
        if near:
            raise DatasetError(
                f"{table.file}, row {table.header_row}: the column {shown(heading)} is not known; did you mean {near[0]}? "
                "Rename it, or delete it."
            )


def _tension(cell: Cell, column: Column, what: str) -> float:
    if cell.limit() is not None:
        raise cell.refuse(f"{cell.shown} is a bound, no reading; write the value, and 0 for a slack rope.")
    value = column.value(cell)
    if value < 0:
        raise cell.refuse(
            f"{what} of {cell.shown} is negative; a rope cannot be pushed: the usual cause is the sign convention of the "
            "load cell or its tare, so write tension as positive, and 0 for a slack rope."
        )
    return value


def _branches(column: Column | None, n_rows: int) -> Flags:
    if column is None:
        return np.zeros(n_rows, dtype=bool)
    branches = []
    for cell in column.cells:
        text = cell.text.strip().lower()
        if text not in _BRANCHES:
            seen = "the cell is blank" if cell.blank else f"{cell.shown} is no branch"
            raise cell.refuse(f"{seen}; write load (while the load grows) or unload (while it falls).")
        branches.append(_BRANCHES[text])
    return np.array(branches, dtype=bool)


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


def read_preload(path: Path, sources: Mapping[str, ColumnSource] | None = None) -> PreloadTable:
    """Read a table of preload against wrap angle, measured between fixed ends; 0 where the rope is slack.

    Args:
        path: CSV file.
        sources: Columns named by the user.

    Raises:
        DatasetError: See `read_csv` and `find_columns`; or a preload is negative.
    """
    table = read_csv(path)
    wanted = (Quantity("preload", "force"), Quantity("wrap_angle", "angle"))
    found = find_columns(table, wanted, sources, _UNUSED)
    angles = require(table, found, "wrap_angle", "wrap_angle_deg")
    preloads = require(table, found, "preload", "preload_N")
    return PreloadTable(
        np.array([read_angle(cell, angles) for cell in angles.cells]),
        np.array([_tension(cell, preloads, "a preload") for cell in preloads.cells]),
        provenance_of(table),
    )


def read_loop(
    path: Path,
    route: Route | None,
    contacts: Sequence[str],
    pulleys: Pulleys = Pulleys(),  # noqa: B008 - it is immutable
    sources: Mapping[str, ColumnSource] | None = None,
) -> tuple[LoopTable, tuple[str, ...]]:
    """Read a table of forces, or torques, at both ends of a pull-pull loop while it moves.

    Args:
        path: CSV file.
        route: The route variable, if the cable has one.
        contacts: Columns in which rows may carry their own wrap angle.
        pulleys: At the motor and at the load side.
        sources: Columns named by the user.

    Returns:
        The table, and remarks on what had to be assumed.

    Raises:
        DatasetError: See `read_csv` and `find_columns`; or a preload is negative, a torque has no radius, or the output is
            larger than the input while moving forward.
    """
    table = read_csv(path)
    ends = [Quantity(f"{end}_{what}", what) for end in ("input", "output") for what in ("force", "torque")]
    others = (Quantity("stroke", "text"), Quantity("preload", "force"))
    found = find_columns(table, (*ends, *others, *shared_columns(route, contacts)), sources, _UNUSED)
    _check_spelling(table, found, others)
    input_force, output_force = (_end(table, found, end, pulleys) for end in ("input", "output"))
    stroke = read_strokes(found, len(table.rows), held="")
    if not stroke.all():
        held = found["stroke"].cells[int(np.flatnonzero(stroke == 0)[0])]
        raise held.refuse(
            "a loop that is held still tells nothing but bounds; write pull (moving forward) or return, or leave the row out."
        )
    column = found.get("preload")
    preload = np.full(len(table.rows), np.nan)
    if column is not None:
        preload = np.array([np.nan if c.blank else _tension(c, column, "a preload") for c in column.cells])
    made = LoopTable(
        read_route(table, found, route),
        input_force,
        output_force,
        stroke,
        preload,
        read_own_angles(table, found, contacts),
        provenance_of(table),
    )
    _check_loss(table, made)
    remarks = []
    if "stroke" not in found:
        remarks.append(f"{table.file} has no stroke column: every row is taken as moving forward (the motor pulls).")
    angles = [h for h in table.header if _plain_angle(h) and h not in {column.heading for column in found.values()}]
    if angles:
        remarks.append(
            f"{table.file} has the column {shown(angles[0])}, which no contact in cable.toml reads; it is left out of account."
        )
    return made, tuple(remarks)


def _end(table: RawTable, found: Mapping[str, Column], end: str, pulleys: Pulleys) -> Vector:
    """Forces at one end [N], from its force column or from its torques and the radius of its pulley."""
    force, torque = f"{end}_force", f"{end}_torque"
    if force in found and torque in found:
        raise DatasetError(f"{table.file} has both {force} and {torque}; leave one of the two columns out.")
    if torque not in found:
        return np.asarray(require(table, found, force, f"{force}_N or {torque}_N_m").numbers())
    return pulleys.forces(np.asarray(found[torque].numbers()), end, table.file)


def _plain_angle(heading: str) -> bool:
    return any(unit for _, unit in meanings(heading, (Quantity("wrap_angle", "angle"),)))


def _check_loss(table: RawTable, made: LoopTable) -> None:
    """A loop loses force: over all rows the output is behind the input in the direction of motion."""
    gained = made.stroke * (made.output_force - made.input_force)
    if np.median(gained) > 0:
        worst = int(np.argmax(gained))
        raise DatasetError(
            f"{table.file}: in most rows the output is larger than the input in the direction of motion, as in row "
            f"{made.origin.row[worst]} (input {made.input_force[worst]:.4g} N, output {made.output_force[worst]:.4g} N); the "
            "usual cause is that input and output columns, or pull and return, were swapped."
        )
