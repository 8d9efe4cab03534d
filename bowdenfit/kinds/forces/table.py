"""Pairs of forces read at both ends of a cable, in runs: one run is one mounting."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from bowdenfit.description import Description
from bowdenfit.errors import DatasetError, Faults
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import (
    Column,
    Quantity,
    describe_paired_headings,
    read_unused_columns,
    remark_on_errors_in_cells,
)
from bowdenfit.files.row_account import RowAccount
from bowdenfit.files.tables import RawTable
from bowdenfit.kinds.forces.mountings import (
    GROUP,
    NO_GROUP,
    find_mountings,
    read_groups,
    remark_on_one_row_runs,
    remark_on_reused_labels,
)
from bowdenfit.kinds.forces.stated_noise import FORCE_SDS, concatenate_sds, read_force_sds, remark_on_large_sds
from bowdenfit.kinds.plausibility import NO_NOISE
from bowdenfit.kinds.rows import (
    ENDS,
    OwnAngles,
    RowOrigin,
    convert_to_forces,
    find_end_column,
    label_key,
    number_names,
    origin_of_rows,
    read_labels,
    read_own_angles,
    read_route,
    shared_columns,
)
from bowdenfit.kinds.strokes import read_strokes_by_loss
from bowdenfit.kinds.table_files import Source, TableFromFiles
from bowdenfit.types import Labels, Matrix, Vector
from bowdenfit.units import INTERNAL_UNITS, speed_dimension
from bowdenfit.words import few, listed

# How readings fall together at loads: judgements, which a sentence and the guess of a file's kind rest on, and no fit.
_MOST_LOADS = 25  # loads that are counted
_APART = 3.0  # smallest gap between loads over the largest within one
_SAME = 0.002  # relative difference of equal readings, the last digit of a display
_ONE_LOAD = 0.03  # relative width of readings at one load
_FEWEST_ALIKE = 4  # loads beyond the first of each run and stroke, from which their noise is looked at; a judgement
_UNUSED = ("time", "position")  # columns that a force table may have and that nothing reads


@dataclass(frozen=True)
class ForceTable:
    """Pairs of forces read at both ends.

    Args:
        route: Route variable; NaN where the cable has no route.
        input_force: Force at the motor side [N].
        output_force: Force at the load side [N].
        run: Number of the run (one mounting of the cable) of each row.
        run_names: Name of each run.
        stroke: +1 pulling, -1 return, 0 held.
        own: Wrap angles measured with the row.
        origin: Where each row was read.
        velocity: Velocity of the rope [mm/s] or of the motor [rad/s]; NaN where it is not known.
        velocity_unit: Which of the two; empty without velocities.
        group: Group of each row, such as "new rope"; empty without groups.
        unused: Numbers or texts of columns that nothing reads, by heading; NaN in files that lack one.
        sd: Stated standard deviations of the input and the output force of each row [N]; None where they are not stated.
    """

    route: Vector
    input_force: Vector
    output_force: Vector
    run: Labels
    run_names: tuple[str, ...]
    stroke: Labels
    own: OwnAngles
    origin: RowOrigin
    velocity: Vector
    velocity_unit: str = ""
    group: tuple[str, ...] = ()
    unused: Mapping[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])
    sd: Matrix | None = None

    def noises(self, noise_ratio: float) -> Matrix:
        """Return the noise of each input and output force: as stated [N], or over that of an output [1].

        Args:
            noise_ratio: Noise of an input over that of an output, where they are not stated.
        """
        return np.tile([noise_ratio, 1.0], (len(self.run), 1)) if self.sd is None else self.sd


def read_forces(source: Source) -> TableFromFiles[ForceTable]:
    """Read force tables, one or several files, into one table.

    A run is one mounting of the cable. It is what the `run` column says, file by file, at one length and bend (see
    `ForceSettings`); without one, all rows of a file at one route value and one set of own angles are taken for one run,
    which is remarked on. Without a `stroke` column all rows are taken as pulling, likewise.

    Args:
        source: Where they are.

    Raises:
        DatasetError: See `read_table` and `find_columns`; or a force is not positive, or a stroke is unknown.
    """
    paths, contacts = source.files, source.description.angle_columns
    faults, sheets = Faults(), [(path, sheet) for path in paths for sheet in source.sheets_of(path)]
    read = faults.read_all(lambda sheet: _read_force_file(*sheet, source), sheets, None)
    parts = [part for part in read if part is not None]
    faults.refuse()
    names: list[str] = []
    runs = []
    for (path, sheet), (part, *_) in zip(sheets, parts, strict=True):
        runs.append(part.run + len(names))
        label = sheet if len(paths) == 1 else f"{path.stem}:{sheet}" if sheet else path.stem
        names += [f"{label}:{name}" if len(sheets) > 1 else name for name in part.run_names]
    tables = [part for part, *_ in parts]
    own_angles = OwnAngles(
        tuple(contacts),
        np.concatenate([t.own.angle for t in tables]),
        np.concatenate([t.own.sd for t in tables]),
    )
    merged = ForceTable(
        np.concatenate([t.route for t in tables]),
        np.concatenate([t.input_force for t in tables]),
        np.concatenate([t.output_force for t in tables]),
        np.concatenate(runs),
        tuple(names),
        np.concatenate([t.stroke for t in tables]),
        own_angles,
        RowOrigin(
            tuple(path.name for path in paths),
            np.concatenate([np.full(len(t.run), i) for i, t in enumerate(tables)]),
            np.concatenate([t.origin.row for t in tables]),
        ),
        np.concatenate([t.velocity for t in tables]),
        _common_velocity_unit(tables),
        _concatenate_groups(tables),
        _concatenate_unused(tables),
        concatenate_sds([t.sd for t in tables], paths),
    )
    remarks = dict.fromkeys(remark for _, file_remarks, _ in parts for remark in file_remarks)
    remarks |= dict.fromkeys(_remark_on_missing_noise(merged))
    if source.settings.run != "each row":
        remarks |= dict.fromkeys(_remark_on_labels_of_several_files(tables))
    accounts = tuple(account for *_, account in parts)
    return TableFromFiles(merged, {source.name_of(path): path for path in paths}, tuple(remarks), accounts)


def _remark_on_missing_noise(table: ForceTable) -> list[str]:
    """Return a remark where all loads of a run and stroke lose the same share of the force, finer than a cell can read."""
    loss = np.log(table.input_force / table.output_force)
    alike = 3 * table.run + table.stroke
    _, group = np.unique(alike[table.stroke != 0], return_inverse=True)
    loss, loads = loss[table.stroke != 0], table.input_force[table.stroke != 0]
    count = np.bincount(group)
    deviation = loss - (np.bincount(group, loss) / np.maximum(count, 1))[group]
    different = len(np.unique(np.column_stack([group, loads]), axis=0)) - len(count)
    if different < _FEWEST_ALIKE or np.sqrt(np.sum(deviation**2) / different) > NO_NOISE:
        return []
    return [
        f"{listed(table.origin.files)}: all loads of a run and stroke lose the same share of the force to within "
        f"{NO_NOISE:.0e} of it, finer than any load cell reads. The usual cause is that these forces were computed, by a "
        "simulation or a spreadsheet; their intervals have almost no width. Fit what was read on a bench."
    ]


def _remark_on_labels_of_several_files(tables: Sequence[ForceTable]) -> list[str]:
    """Return a remark on labels of runs that several files have, each of which is a mounting of its own in each file."""
    files = Counter(key for table in tables for key in {label_key(name) for name in table.run_names})
    again = [key for key, count in files.items() if count > 1]
    if not again:
        return []
    return [
        f"runs are counted file by file: {few(again)} {'is' if len(again) == 1 else 'are'} in several of the "
        f"{len(tables)} files of forces, and each file's is taken as a mounting of its own. If the cable stayed mounted from "
        "one file to the next, put its rows into one file."
    ]


def _concatenate_groups(tables: Sequence[ForceTable]) -> tuple[str, ...]:
    """Return the group of each row of all files; empty where none has groups."""
    if not any(t.group for t in tables):
        return ()
    return tuple(name for t in tables for name in (t.group or (NO_GROUP,) * len(t.run)))


def _concatenate_unused(tables: Sequence[ForceTable]) -> dict[str, np.ndarray]:
    headings = dict.fromkeys(heading for t in tables for heading in t.unused)
    return {
        heading: np.concatenate([t.unused.get(heading, np.full(len(t.run), np.nan)) for t in tables]) for heading in headings
    }


def _common_velocity_unit(tables: Sequence[ForceTable]) -> str:
    units = {t.velocity_unit: t.origin.files[0] for t in tables if t.velocity_unit}
    if len(units) > 1:
        raise DatasetError(
            f"{' and '.join(units.values())} give velocities of different kinds, of the rope and of the motor; give both in "
            "mm/s or both in r/min."
        )
    return next(iter(units), "")


def _read_force_file(path: Path, sheet: str, source: Source) -> tuple[ForceTable, list[str], RowAccount]:
    route, contacts = source.description.route, source.description.angle_columns
    optional_columns = (
        Quantity("run", "text"),
        Quantity("stroke", "text"),
        Quantity("velocity", "speed", optional=True),
        GROUP,
    )
    table, columns = source.read_table(
        path, (*ENDS, *FORCE_SDS, *optional_columns, *shared_columns(source.description)), _UNUSED, sheet
    )
    nothing = np.full(len(table.rows), np.nan)
    read = partial(_read_tensions, table, columns, source.description)
    sd, sd_remarks = read_force_sds(table, columns, source.description)
    input_force, output_force = table.faults.read_all(read, ("input", "output"), nothing)
    own_angles = read_own_angles(table, columns, contacts)
    route_values = read_route(table, columns, route)
    groups = source.settings.groups == "called by numbers", source.description.by_group
    group, remarks = tuple[str, ...](), list[str]()
    with table.faults.collect():
        group, remarks = read_groups(columns, table.file, *groups)
    remarks += describe_paired_headings(table, columns, source.columns) + sd_remarks
    remarks += [*remark_on_errors_in_cells(table, columns), *table.remarks]
    if "stroke" not in columns:
        remarks.append(f"{table.file} has no stroke column: every row is taken as pulling (rope sliding to the motor).")
    strokes, stroke_remarks = read_strokes_by_loss(columns, np.log(input_force / output_force))
    remarks, origin = remarks + stroke_remarks, origin_of_rows(table)
    velocity, unit = _read_velocities(columns.get("velocity"), len(table.rows))
    table.faults.refuse()
    remarks += remark_on_large_sds(table.file, sd, np.column_stack([input_force, output_force]))
    run, run_names, run_remarks = _assign_runs(columns.get("run"), source, route_values, own_angles, origin, group)
    remarks += run_remarks
    if held := int(np.sum(strokes == 0)):
        remarks.append(
            f"{table.file}: {held} readings are held. A held reading says only that friction is at least as large as it takes "
            "to hold it; a coefficient that rests on such readings alone has a lower bound, and above it nothing but its prior."
        )
    parts = (route_values, input_force, output_force, run, run_names, strokes, own_angles, origin, velocity, unit, group)
    unused = read_unused_columns(table, columns)
    return ForceTable(*parts, unused, sd), remarks, table.account


def _read_velocities(column: Column | None, n_rows: int) -> tuple[Vector, str]:
    """Return velocities, NaN where blank or without a column, and their internal unit."""
    if column is None:
        return np.full(n_rows, np.nan), ""
    values = np.array(column.read_cells(lambda cell: np.nan if cell.blank else column.value(cell), np.nan))
    return values, INTERNAL_UNITS[speed_dimension(column.unit or "mm/s")]


def _assign_runs(
    column: Column | None, source: Source, route: Vector, own: OwnAngles, origin: RowOrigin, group: tuple[str, ...]
) -> tuple[Labels, tuple[str, ...], list[str]]:
    """Return the run of each row, the name of each run, and remarks on what had to be assumed."""
    limits, how, file = source.description.route, source.settings.run, origin.files[0]
    if how == "each row":
        return np.arange(len(route)), tuple(f"row {row}" for row in origin.row), [remark_on_one_row_runs(len(route), file)]
    if column is None:
        keys = _describe_conditions(route, own, limits.unit if limits else "")
        keys = [f"{name}, {key}" for name, key in zip(group, keys, strict=True)] if group else keys
        return *number_names(keys), [
            f"{file} has no run column: all rows at one {limits.variable if limits else 'wrap angle'}"
            f"{' and of one group' if group else ''} are taken as one run (one mounting of the cable); if the cable was "
            'remounted for each row, write run = "each row" next to the file in cable.toml.'
        ]  # fmt: skip
    labels = read_labels(column.cells, "(no run)")
    if how != "at one length":
        return *number_names(labels), []
    run, distinct = find_mountings(labels, group, route, own, limits)
    remark = remark_on_reused_labels(labels, group, len(distinct), file, limits)
    return run, tuple(distinct), [remark] if remark else []


def _describe_conditions(route: Vector, own: OwnAngles, unit: str) -> list[str]:
    """Return length and wrap angles of each row in words, such as "440 mm" or "45 deg"."""
    rows, units = np.column_stack([route, np.rad2deg(own.angle)]), [unit, *["deg"] * len(own.names)]
    finite = [[(value, unit) for value, unit in zip(row, units, strict=True) if np.isfinite(value)] for row in rows]
    return [", ".join(f"{value:g} {unit}".rstrip() for value, unit in row) or "all" for row in finite]


def _read_tensions(table: RawTable, columns: Mapping[str, Column], description: Description, end: str) -> Vector:
    """Return the tensions at one end [N], from its forces, or from its torques or currents."""
    is_motor = end == "input" and description.motor is not None
    column = find_end_column(table, columns, end, has_motor=is_motor)
    values = np.array(column.read_cells(partial(_read_force, column, is_motor), np.nan))
    return convert_to_forces(values, table, columns, end, description)


def _read_force(column: Column, is_motor: bool, cell: Cell) -> float:
    value = column.value(cell)
    if value < 0:
        cell.refuse_missing_code()
    if value <= 0 and is_motor:
        raise cell.refuse(
            f"{cell.shown} is not positive; the usual cause is the sign convention of the motor, or a return in which it has "
            "to push its gear back: write what pulls the rope as positive, and leave such a return out."
        )
    if value <= 0:
        raise cell.refuse(
            f"{cell.shown} is not positive; the usual cause is the sign convention of the load cell or a "
            "reading before tension was on: write tension as positive and leave slack readings out."
        )
    return value


def count_loads(forces: Vector) -> int | None:
    """Return the number of loads that readings fall together at; None where they spread.

    Args:
        forces: All positive [N].
    """
    logs = np.sort(np.log(forces))
    if logs[-1] - logs[0] < _ONE_LOAD:
        return 1
    gaps = np.sort(np.diff(logs))[::-1]
    most = min(_MOST_LOADS, (len(forces) + 1) // 2)
    ratios = gaps[: most - 1] / np.maximum(gaps[1:most], _SAME) if most > 1 else np.zeros(0)
    if not len(ratios) or ratios.max() < _APART:
        return None
    return int(np.argmax(ratios)) + 2
