"""Forces at both ends of a pull-pull loop while it moves: how they are read, checked and described."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from pydantic import model_validator
from typing_extensions import override

from bowdenfit.description import Description, Finite, Table
from bowdenfit.description.stated_parameters import PRELOAD
from bowdenfit.description.values import Frozen
from bowdenfit.errors import DatasetError, combine_errors
from bowdenfit.files.columns import Column, Quantity
from bowdenfit.files.headings import meanings
from bowdenfit.files.tables import RawTable
from bowdenfit.kinds.bench_error import BenchError, BenchLoads
from bowdenfit.kinds.kind import Design, FrictionTableKind, PlannedKind, Readings, RopeKind
from bowdenfit.kinds.measured_columns import MeasuredColumn, pair_forces
from bowdenfit.kinds.plausibility import HIGHEST, LOWEST, compare_without_runs, describe_copies
from bowdenfit.kinds.rows import (
    ENDS,
    STROKE_NAMES,
    FileRows,
    OwnAngles,
    RowOrigin,
    Stroke,
    check_spelling,
    convert_to_forces,
    convert_to_radians,
    describe_range,
    find_end_column,
    format_fixed,
    origin_of_rows,
    read_own_angles,
    read_route,
    read_tension,
    shared_columns,
    stroke_signs,
)
from bowdenfit.kinds.strokes import read_strokes
from bowdenfit.kinds.table_files import STROKE, InitQuestions, Source, TableFromFiles, WantedColumn
from bowdenfit.kinds.tables import LoopTable, Measurements, PreloadTable, StretchTable
from bowdenfit.types import Labels, Matrix, Vector
from bowdenfit.words import counted, shown

_UNUSED = ("time", "position", "run")  # columns that such a table may have and that nothing reads
_FREE = 0.25  # output over input force below which a loop moves nearly freely; a judgement


class _LoopRows(Frozen):
    """[design.loop]: wrap angles [deg] and input forces [N] under load, wrap angles of free motion [deg], and strokes."""

    wrap_angles: tuple[Finite, ...] = ()
    input_forces: tuple[Finite, ...] = ()
    strokes: tuple[Stroke, ...] = ("pull",)
    free_motion: tuple[Finite, ...] = ()

    @model_validator(mode="after")
    def _loads_are_given(self) -> "_LoopRows":
        if self.wrap_angles and not self.input_forces:
            raise ValueError("wrap_angles need input_forces, such as [5, 10, 20] (in N)")
        return self


class LoopDesign(Design):
    """[design]: how the loop is moved."""

    loop: _LoopRows = _LoopRows()


class LoopKind(FrictionTableKind[LoopTable], RopeKind[LoopTable], PlannedKind[LoopTable]):
    """Forces or torques at both ends of a loop of two ropes."""

    name = "loop"
    table = LoopTable
    readings = (Readings("loop_output_force", "loop", "loop", "output force in {}", "Output force (N)"),)
    methods_sentence = (
        "A loop in motion gave F_out = min(F_in - 2 P Lambda, F_in exp(-Lambda)) at its preload P and friction "
        "exponent Lambda."
    )
    init_questions = InitQuestions(
        "forces or torques at both ends of a loop of two ropes",
        (
            WantedColumn(
                Quantity("input_force", "force"), "the force at the motor", (Quantity("input_torque", "torque"),)
            ),
            WantedColumn(
                Quantity("output_force", "force"), "the force at the load", (Quantity("output_torque", "torque"),)
            ),
            STROKE,
        ),
        has_own_angles=True,
        is_guessed=False,
        description={"cable": {"kind": "loop"}},
    )
    design = LoopDesign

    @override
    def read(self, source: Source) -> TableFromFiles[LoopTable]:
        """Read a table of forces, or torques, at both ends of a pull-pull loop while it moves.

        Raises:
            DatasetError: See `read_table` and `find_columns`; or a preload is negative, a torque has no radius, or the output
                is larger than the input while moving forward.
        """
        path, route, contacts = source.file, source.description.route, source.description.angle_columns
        optional_columns = (Quantity("stroke", "text"), Quantity("preload", "force", optional=True))
        table, columns = source.read_table(path, (*ENDS, *optional_columns, *shared_columns(source.description)), _UNUSED)
        check_spelling(table, columns, optional_columns)
        nothing = np.full(len(table.rows), np.nan)
        input_force, output_force = table.faults.read_all(
            lambda end: _read_end_forces(table, columns, end, source.description), ("input", "output"), nothing
        )
        stroke = read_strokes(columns, len(table.rows), held="")
        preload = nothing
        if (column := columns.get("preload")) is not None:
            preload = np.array(
                column.read_cells(lambda c: np.nan if c.blank else read_tension(c, column, "a preload"), np.nan)
            )
        at, own_angles = read_route(table, columns, route), read_own_angles(table, columns, contacts)
        table.faults.refuse()
        if not stroke.all():
            reason = (
                "a loop that is held still gives only bounds; write pull (moving forward) or return, or leave the row "
                "out."
            )
            raise combine_errors([columns["stroke"].cells[i].refuse(reason) for i in np.flatnonzero(stroke == 0)])
        made = LoopTable(at, input_force, output_force, stroke, preload, own_angles, origin_of_rows(table))
        _check_loss(table, made)
        remarks = []
        if "stroke" not in columns:
            remarks.append(
                f"{table.file} has no stroke column: every row is taken as moving forward (the motor pulls)."
            )
        angles = [
            h for h in table.header if _is_plain_angle(h) and h not in {column.heading for column in columns.values()}
        ]
        if angles:
            remarks.append(
                f"{table.file} has the column {shown(angles[0])}, which no contact in cable.toml reads; it is "
                "ignored."
            )
        return TableFromFiles(made, {path.name: path}, tuple(remarks), (table.account,))

    @override
    def describe(self, table: LoopTable, description: Description) -> list[str]:
        """Return how many readings of each direction there are, how large, and where their preload comes from."""
        forward = int(np.sum(table.stroke > 0))
        how = (
            "follows the wrap angle as the stretch model says" if description.preload_follows_stretch else "is constant"
        )
        measured = int(np.isfinite(table.preload).sum())
        own = f"; {measured} rows have their own measured preload" if measured else ""
        return [
            f"{table.origin.files[0]}: {self.count_readings(table)} ({forward} moving forward, "
            f"{len(table.stroke) - forward} back), input {describe_range(table.input_force, 'N')}; its preload {how}{own}"
        ]

    @override
    def count_readings(self, table: LoopTable) -> str:
        return f"{counted(len(table.stroke), 'reading')} of a loop"

    @override
    def forces(self, table: LoopTable) -> Vector:
        """Return the input forces in the direction of motion [N]."""
        return table.input_force * table.stroke

    @override
    def bends(self, table: LoopTable) -> Vector:
        return np.nansum(table.own.angle, axis=1)

    @override
    def contradiction(self, settings: Table | None, description: Description) -> str:
        """Return that the cable is no loop, in a sentence; empty if it is one."""
        wrong = settings is not None and description.cable.kind != "loop"
        return 'the table loop needs kind = "loop" under [cable]' if wrong else ""

    @override
    def warnings(self, table: LoopTable, description: Description, measurements: Measurements) -> list[str]:
        warnings, has_preload = [], measurements.table(PreloadTable) is not None
        elastic = has_preload or measurements.table(StretchTable) is not None
        if description.preload_follows_stretch and not elastic:
            warnings.append(
                "the preload is said to follow the stretch of the rope, but no table has stretch or preload; how it changes "
                "with the wrap angle will rest on the priors."
            )
        stated = description.preload.value is not None or PRELOAD in description.prior or has_preload
        is_known = stated or np.isfinite(table.preload).any()
        if not is_known and np.median(np.abs(table.output_force)) < _FREE * np.median(np.abs(table.input_force)):
            warnings.append(
                f"nearly all of {table.origin.files[0]} was read in free motion, with almost no output force; that determines "
                "only the product of friction and preload: load the loop until its return side is slack, or measure the "
                "preload."
            )
        return warnings

    @override
    def copied_readings(self, table: LoopTable) -> list[str]:
        settings, setting = _number_settings(table)
        forces = np.column_stack([table.input_force, table.output_force])
        return describe_copies(
            compare_without_runs(table.origin, settings, forces, table.input_force, 3 * setting + table.stroke)
        )

    @override
    def measured_columns(self, table: LoopTable) -> list[MeasuredColumn]:
        return pair_forces(table.input_force, table.output_force, 3 * _number_settings(table)[1] + table.stroke)

    @override
    def with_bench_error(self, table: LoopTable, error: BenchError) -> LoopTable:
        """Return the table with the error in its forces and wrap angles."""
        forces = table.input_force, table.output_force
        strokes = 3 * _number_settings(table)[1] + table.stroke
        input_force, output_force = error.apply_to_loop(forces, table.stroke, strokes, BenchLoads.of(*forces))
        return replace(table, input_force=input_force, output_force=output_force, own=error.apply_to_rows(table.own))

    @override
    def why_implausible(self, measured: LoopTable, simulated: LoopTable) -> str:
        """Return that a loop gains force, or loses none or nearly all of it."""
        lost = simulated.stroke * (simulated.input_force - simulated.output_force)
        if np.median(lost) < 0:
            return "a loop gains force"
        loaded = np.abs(measured.input_force) >= 0.5 * np.abs(measured.input_force).max()
        share = np.median(lost[loaded] / np.abs(simulated.input_force[loaded]))
        return "" if 1 - HIGHEST <= share <= 1 - LOWEST else "a loop loses less than 1 % or more than 80 % of its force"

    @override
    def file_rows(self, table: LoopTable, description: Description) -> FileRows:
        """Return headings and rows, of torques where both pulleys' radii are stated."""
        cable, names = description.cable, table.own.names
        radii = [
            radius.to("length") / 1000 for radius in (cable.input_pulley_radius, cable.output_pulley_radius) if radius
        ]
        what, (first, second), digits = ("force_N", (1.0, 1.0), 3) if len(radii) < 2 else ("torque_N_m", radii, 5)
        inputs, outputs = format_fixed(first * table.input_force, digits), format_fixed(second * table.output_force, digits)
        rows = [
            [
                *(f"{angle:.6g}" for angle in np.rad2deg(table.own.angle[i])),
                STROKE_NAMES[int(table.stroke[i])],
                inputs[i],
                outputs[i],
            ]
            for i in range(len(table.stroke))
        ]
        return [*(f"{name}_deg" for name in names), "stroke", f"input_{what}", f"output_{what}"], rows

    @override
    def empty_table(self, design: LoopDesign, description: Description, file: str) -> LoopTable:
        loop, strokes = design.loop, stroke_signs(design.loop.strokes)
        loaded = [(a, f, s) for a in convert_to_radians(loop.wrap_angles) for s in strokes for f in loop.input_forces]
        free = [(a, np.nan, s) for a in convert_to_radians(loop.free_motion) for s in strokes]
        rows = np.array([*loaded, *free], dtype=float).reshape(-1, 3)
        names, n = description.angle_columns, len(rows)
        own_angles = OwnAngles.none(names, n)
        column = next((c.wrap_angle.column for c in description.contact if c.wrap_angle.column), None)
        if column is not None:
            own_angles.angle[:, names.index(column)] = rows[:, 0]
        nothing = np.full(n, np.nan)
        origin = RowOrigin.below_heading(file, n)
        return LoopTable(nothing, rows[:, 1], 0.8 * rows[:, 1], rows[:, 2].astype(int), nothing, own_angles, origin)


def _read_end_forces(table: RawTable, columns: Mapping[str, Column], end: str, description: Description) -> Vector:
    """Return the forces at one end [N], from its force column or from its torques and the radius of its pulley."""
    read = np.asarray(find_end_column(table, columns, end, is_loop=True).numbers())
    return convert_to_forces(read, table, columns, end, description)


def _is_plain_angle(heading: str) -> bool:
    return any(unit for _, unit in meanings(heading, (Quantity("wrap_angle", "angle"),)))


def _check_loss(table: RawTable, made: LoopTable) -> None:
    """Refuse a loop that gains force: over all rows the output is behind the input in the direction of motion."""
    gained = made.stroke * (made.output_force - made.input_force)
    if np.median(gained) > 0:
        worst = int(np.argmax(gained))
        raise DatasetError(
            f"{table.file}: in most rows the output is larger than the input in the direction of motion, as in row "
            f"{made.origin.row[worst]} (input {made.input_force[worst]:.4g} N, output {made.output_force[worst]:.4g} N); the "
            "usual cause is that input and output columns, or pull and return, were swapped."
        )


def _number_settings(table: LoopTable) -> tuple[Matrix, Labels]:
    """Return under what each row was read, but for the forces, and the number of its setting."""
    settings = np.column_stack([table.route, table.own.angle, table.preload])
    return settings, np.unique(np.nan_to_num(settings, nan=-1.0), axis=0, return_inverse=True)[1].ravel()
