"""Stretch of the rope under loads and at wrap angles: how it is read, checked and described."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from typing_extensions import override

from bowdenfit.description import Description, Finite
from bowdenfit.description.values import Frozen
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column, Quantity, require_column
from bowdenfit.files.tables import RawTable
from bowdenfit.kinds.bench_error import BenchError
from bowdenfit.kinds.kind import Design, PlannedKind, Readings, RopeKind
from bowdenfit.kinds.measured_columns import MeasuredColumn
from bowdenfit.kinds.plausibility import ComparedReadings, describe_copies, is_within_factor, split_by_group
from bowdenfit.kinds.rows import (
    FileRows,
    RowOrigin,
    check_spelling,
    convert_to_radians,
    describe_range,
    format_fixed,
    number_names,
    origin_of_rows,
    read_angle,
    read_labels,
    read_tension,
)
from bowdenfit.kinds.table_files import InitQuestions, Source, TableFromFiles, WantedColumn
from bowdenfit.kinds.tables import Measurements, StretchTable, warn_of_single_angle
from bowdenfit.types import Flags, Labels, Vector
from bowdenfit.words import counted, listed, significant

_BRANCHES = {
    **dict.fromkeys(("load", "loading", "up", "+1", "1"), False),
    **dict.fromkeys(("unload", "unloading", "down", "-1"), True),
}
_UNUSED = ("time", "position", "run")  # columns that such a table may have and that nothing reads
_FEWEST = 2  # degrees of freedom from which a falling stretch is refused; a judgement
_SURE = 0.9  # negative correlation of stretch and load from which the sign is refused; a judgement


_LOW = 1 / 3  # lowest load over the highest above which bedding-in may not show; a judgement
_STIFFNESSES = (0.1, 1e5)  # N/mm: a meter of thin cord, and of crane rope
_FEWEST_LOADS = 4  # different loads: as many as stiffness, the two coefficients of bedding-in and the zero


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
    wanted = (Quantity("load", "force"), Quantity("wrap_angle", "angle"), Quantity("stretch", "length"))
    optional = (Quantity("branch", "text"), Quantity("cycle", "text"))
    table, columns = source.read_table(path, (*wanted, *optional), _UNUSED)
    check_spelling(table, columns, optional)
    loads, angles, stretches = (
        require_column(table, columns, name, f"{name}_{unit}")
        for name, unit in (("load", "N"), ("wrap_angle", "deg"), ("stretch", "mm"))
    )
    load = np.array(loads.read_cells(lambda cell: read_tension(cell, loads, "a load"), np.nan))
    wrap_angle = np.array(angles.read_cells(lambda cell: read_angle(cell, angles), np.nan))
    stretch = stretches.numbers()
    unloading = _read_branches(columns.get("branch"), len(load))
    table.faults.refuse()
    cycle, names = _assign_cycles(columns.get("cycle"), wrap_angle)
    peak = np.array([load[cycle == c].max() for c in range(len(names))])[cycle]
    made = StretchTable(load, wrap_angle, np.asarray(stretch), unloading, peak, cycle, names, origin_of_rows(table))
    _check_rising(stretches, made)
    remarks = tuple(_branch_remarks(table, made, "branch" in columns))
    return TableFromFiles(made, {path.name: path}, remarks, (table.account,))


def _branch_remarks(table: RawTable, made: StretchTable, stated: bool) -> list[str]:
    """Return remarks on what had to be assumed of loading and unloading."""
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


def _read_branches(column: Column | None, n_rows: int) -> Flags:
    if column is None:
        return np.zeros(n_rows, dtype=bool)
    return np.array(column.read_cells(_read_branch, False), dtype=bool)


def _read_branch(cell: Cell) -> bool:
    text = cell.text.strip().lower()
    if text not in _BRANCHES:
        seen = "the cell is blank" if cell.blank else f"{cell.shown} is not a branch"
        raise cell.refuse(f"{seen}; write load (while the load grows) or unload (while it falls).")
    return _BRANCHES[text]


def _assign_cycles(column: Column | None, wrap_angle: Vector) -> tuple[Labels, tuple[str, ...]]:
    """Return the cycle of each row and the names of cycles: one name at one wrap angle."""
    names = read_labels(column.cells, "(no cycle)") if column else [""] * len(wrap_angle)
    return number_names(
        [
            f"{name + ', ' if name else ''}{np.rad2deg(angle):.4g} deg"
            for name, angle in zip(names, wrap_angle, strict=True)
        ]
    )


def _check_rising(column: Column, made: StretchTable) -> None:
    """Refuse stretch that falls while the load grows: in one branch of a cycle, or in all together."""
    groups = [
        np.flatnonzero((made.cycle == cycle) & (made.unloading == unloading))
        for cycle, unloading in product(range(len(made.cycle_names)), (False, True))
    ]
    groups = [rows for rows in groups if len(np.unique(made.load[rows])) > 1]
    for together in [[rows] for rows in groups] + [groups]:
        load, stretch = (_subtract_group_means(values, together) for values in (made.load, made.stretch))
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


def _subtract_group_means(values: np.ndarray, groups: Sequence[np.ndarray]) -> np.ndarray:
    """Return the values of all groups, each less the mean of its group."""
    return np.concatenate([values[rows] - values[rows].mean() for rows in groups]) if groups else np.zeros(0)


class _StretchRows(Frozen):
    """[design.stretch]: loads of every loading [N], wrap angles [deg], and whether the way down is read too."""

    loads: tuple[Finite, ...]
    wrap_angles: tuple[Finite, ...]
    unloading: bool = False


class StretchDesign(Design):
    """[design]: how the rope is stretched."""

    stretch: _StretchRows = _StretchRows(loads=(), wrap_angles=())


class StretchKind(RopeKind[StretchTable], PlannedKind[StretchTable]):
    """Stretch of the rope at its loaded end, the far end held."""

    name = "stretch"
    table = StretchTable
    readings = (Readings("stretch", "stretch", "stretch", "stretch under {}", "Stretch (mm)"),)
    methods_sentence = (
        "Under the tension T the rope stretched by e(T) = T/k + d (1 - exp(-T/T_c)), with what friction held back "
        "along it."
    )
    init_questions = InitQuestions(
        "stretch of the rope under load, the far end held",
        (
            WantedColumn(Quantity("load", "force"), "the load on the rope's end"),
            WantedColumn(Quantity("wrap_angle", "angle"), "the wrap angle of the cable"),
            WantedColumn(Quantity("stretch", "length"), "the stretch"),
        ),
    )
    design = StretchDesign

    @override
    def read(self, source: Source) -> TableFromFiles[StretchTable]:
        return read_stretch(source)

    @override
    def describe(self, table: StretchTable, description: Description) -> list[str]:
        """Return how many readings there are, loads, wrap angles, and the friction that acts."""
        down = f", {int(table.unloading.sum())} of them while the load came down" if table.unloading.any() else ""
        angles = np.rad2deg(np.unique(table.wrap_angle))
        own = description.stretch.friction or "a friction coefficient of its own, mu_stretch"
        return [
            f"{table.origin.files[0]}: {self.count_readings(table)}{down}, loads {describe_range(table.load, 'N')}, at "
            f"{len(angles)} wrap angle{'s' if len(angles) > 1 else ''}, {describe_range(angles, 'deg')}; friction: {own}"
        ]

    @override
    def count_readings(self, table: StretchTable) -> str:
        return f"{counted(len(table.load), 'reading')} of stretch"

    @override
    def bends(self, table: StretchTable) -> Vector:
        return table.wrap_angle

    @override
    def tensions(self, table: StretchTable) -> Vector:
        return table.load

    @override
    def warnings(self, table: StretchTable, description: Description, measurements: Measurements) -> list[str]:
        file, loads, warnings = table.origin.files[0], np.unique(table.load), []
        if len(loads) == 1:
            warnings.append(
                f"{file} has a single load, {loads[0]:g} N, so the stiffness of the rope is not identifiable; read the stretch "
                "at several loads."
            )
        elif len(loads) < _FEWEST_LOADS:
            warnings.append(
                f"{file} has {len(loads)} different loads, too few to separate stiffness from bedding-in; read the stretch at "
                f"{_FEWEST_LOADS} or more, some of them low."
            )
        elif loads[0] > _LOW * loads[-1]:
            warnings.append(
                f"{file} has no low loads, only {loads[0]:g} to {loads[-1]:g} N, so how the rope beds in may not be "
                "identifiable; read the stretch at some low loads too."
            )
        more, stretch = float(np.ptp(loads)), float(np.ptp(table.stretch))
        if more > 0 and not _STIFFNESSES[0] * stretch < more < _STIFFNESSES[1] * stretch:
            warnings.append(
                f"the rope of {file} gives {significant(stretch)} mm under {significant(more)} N more, as hardly any rope "
                "does; the usual cause is a unit: check those of stretch and load."
            )
        falling = _describe_falling_stretch(table)
        if falling:
            warnings.append(
                f"in {file} the stretch falls while the load grows, {falling}; check its sign, and whether the readings "
                "differ by more than their noise."
            )
        if not table.wrap_angle.any():
            warnings.append(
                f"every row of {file} is at a wrap angle of 0, so it has no information on friction; read at larger ones too."
            )
        return warnings + warn_of_single_angle(measurements)

    @override
    def copied_readings(self, table: StretchTable) -> list[str]:
        names = tuple(f"cycle {name}" for name in table.cycle_names)
        settings = np.column_stack([table.load, table.wrap_angle, table.unloading])
        curve = 2 * table.cycle + table.unloading
        read = table.stretch[:, None]
        return describe_copies(
            ComparedReadings(listed(table.origin.files), table.cycle, names, settings, read, table.load, curve, table.origin)
        )

    @override
    def measured_columns(self, table: StretchTable) -> list[MeasuredColumn]:
        return [MeasuredColumn("load", "N", table.load)]

    @override
    def with_bench_error(self, table: StretchTable, error: BenchError) -> StretchTable:
        """Return the table with the error in its loads and wrap angles."""
        return replace(
            table,
            load=error.apply_to_force(table.load, 0.0),
            peak=error.apply_to_force(table.peak, 0.0),
            wrap_angle=error.apply_to_angles(table.wrap_angle),
        )

    @override
    def why_implausible(self, measured: StretchTable, simulated: StretchTable) -> str:
        """Return that the stretch is of another size than the measured, or falls with the load."""
        if not is_within_factor(np.ptp(measured.stretch), np.ptp(simulated.stretch)):
            return "the stretch is far from the measured one"
        of_cycle = 2 * simulated.cycle + simulated.unloading
        load, stretch = (
            np.concatenate([part - part.mean() for part in split_by_group(of_cycle, values)])
            for values in (simulated.load, simulated.stretch)
        )
        return "the stretch falls with the load" if load @ stretch <= 0 else ""

    @override
    def file_rows(self, table: StretchTable, description: Description) -> FileRows:
        branch = np.where(table.unloading, "unload", "load")
        columns = zip(np.rad2deg(table.wrap_angle), branch, table.load, format_fixed(table.stretch, 4), strict=True)
        rows = [[f"{angle:.6g}", way, f"{load:g}", stretch] for angle, way, load, stretch in columns]
        return ["wrap_angle_deg", "branch", "load_N", "stretch_mm"], rows

    @override
    def empty_table(self, design: StretchDesign, description: Description, file: str) -> StretchTable:
        loads, angles = np.array(sorted(design.stretch.loads), dtype=float), convert_to_radians(design.stretch.wrap_angles)
        cycle = np.concatenate([loads, loads[-2::-1]]) if design.stretch.unloading else loads
        down = np.arange(len(cycle)) >= len(loads)
        n = len(angles)
        load, wrap_angle = np.tile(cycle, n), np.repeat(angles, len(cycle))
        peak = np.full(len(load), loads.max(initial=0.0))
        names = tuple(f"{angle:.4g} deg" for angle in np.rad2deg(angles))
        of_cycle = np.repeat(np.arange(n), len(cycle))
        origin = RowOrigin.below_heading(file, len(load))
        return StretchTable(load, wrap_angle, 0.01 * load, np.tile(down, n), peak, of_cycle, names, origin)


def _describe_falling_stretch(table: StretchTable) -> str:
    """Return where the stretch under the largest load is less than under the smallest, in words; empty if nowhere."""
    for cycle, unloading in product(range(len(table.cycle_names)), (False, True)):
        rows = np.flatnonzero((table.cycle == cycle) & (table.unloading == unloading))
        if len(np.unique(table.load[rows])) < 2:
            continue
        low, high = rows[np.argmin(table.load[rows])], rows[np.argmax(table.load[rows])]
        if table.stretch[high] < table.stretch[low]:
            return f"from row {table.origin.row[low]} to row {table.origin.row[high]}"
    return ""
