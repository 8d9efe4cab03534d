"""Transmission efficiencies, output force over input force while pulling: how they are read, checked and described."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from typing_extensions import override

from bowdenfit.description import Description, Finite
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import (
    Column,
    Quantity,
    read_unused_columns,
    remark_on_errors_in_cells,
    require_column,
)
from bowdenfit.kinds.bench_error import BenchError, BenchLoads, order_of, powers, smooth_readings
from bowdenfit.kinds.kind import Design, FrictionTableKind, PlannedKind, efficiency_readings
from bowdenfit.kinds.measured_columns import MeasuredColumn
from bowdenfit.kinds.plausibility import (
    GAIN_ERROR,
    CoarseReadings,
    compare_without_runs,
    describe_copies,
    explain_impossible_loss,
    find_coarse_readings,
    route_or_wrap_angle,
)
from bowdenfit.kinds.rows import (
    FileRows,
    OwnAngles,
    RowOrigin,
    origin_of_rows,
    read_labels,
    read_own_angles,
    read_route,
    route_cells,
    route_heading,
    shared_columns,
)
from bowdenfit.kinds.strokes import read_stroke
from bowdenfit.kinds.table_files import InitQuestions, Source, TableFromFiles, WantedColumn
from bowdenfit.types import Vector
from bowdenfit.words import counted, listed, percent

LOSS = Quantity("loss", "ratio")
_HUNDREDTH = 0.005  # judged: share of the lowest other efficiency from which a small one is a hundredth of what it should be
_FRACTION = 0.01  # efficiency up to which a percentage is as likely a fraction; a judgement
_SDS = 4.5  # stated standard deviations above 1: one healthy row of 300,000 exceeds it


@dataclass(frozen=True)
class EfficiencyTable:
    """Measured transmission efficiencies.

    Args:
        route: Route variable; NaN where the cable has no route.
        efficiency: Output force over input force while pulling [1].
        sd: Standard deviation where given [1], else 0.
        own: Wrap angles measured with the row.
        origin: Where each row was read.
        unused: Numbers or texts of columns that nothing reads, by heading.
    """

    route: Vector
    efficiency: Vector
    sd: Vector
    own: OwnAngles
    origin: RowOrigin
    unused: Mapping[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])


class EfficiencyDesign(Design):
    """[design]: route values at which an efficiency is measured."""

    efficiencies: tuple[Finite, ...] = ()


class EfficiencyKind(FrictionTableKind[EfficiencyTable], PlannedKind[EfficiencyTable]):
    """Efficiencies that were calculated before, one a row."""

    name = "efficiencies"
    needs_load_cell = True
    table = EfficiencyTable
    readings = (efficiency_readings("efficiency", "efficiencies", "efficiencies", "efficiency at {}"),)
    methods_sentence = (
        "The logarithm of a measured efficiency was that of the model, up to the scatter between mountings."
    )
    init_questions = InitQuestions(
        "efficiencies: output force over input force while pulling",
        (WantedColumn(Quantity("efficiency", "ratio"), "the efficiency"),),
        has_own_angles=True,
    )
    design = EfficiencyDesign

    @override
    def read(self, source: Source) -> TableFromFiles[EfficiencyTable]:
        """Read a table of transmission efficiencies, 0 to 1 or in percent where the heading or the cell says so.

        Raises:
            DatasetError: See `read_table` and `find_columns`; or an efficiency is not positive, or above 1 beyond its error.
        """
        path, route, contacts = source.file, source.description.route, source.description.angle_columns
        sds = [Quantity(f"{name}_sd", "ratio", optional=True) for name in ("efficiency", "loss")]
        names = (Quantity("efficiency", "ratio"), LOSS, *sds)
        labels = (Quantity("run", "text"), Quantity("stroke", "text"))
        table, columns = source.read_table(path, (*names, *labels, *shared_columns(source.description)))
        is_loss = "efficiency" not in columns and LOSS.name in columns
        name = LOSS.name if is_loss else "efficiency"
        column = require_column(table, columns, name, "efficiency (0 to 1) or efficiency_percent")
        sd, spread = [0.0] * len(table.rows), columns.get(f"{name}_sd")
        if spread is not None:
            cells_by_row = {cell.row: cell for cell in column.cells}
            sd = spread.read_cells(
                lambda c: 0.0 if c.blank else _read_efficiency_sd(c, spread, cells_by_row[c.row], column), 0.0
            )
        errors = dict(zip((cell.row for cell in column.cells), sd, strict=True))
        efficiency = column.read_cells(
            lambda cell: _read_loss(cell, column) if is_loss else _read_efficiency(cell, column, errors[cell.row]), np.nan
        )
        if "stroke" in columns:
            columns["stroke"].read_cells(_check_pulling, 0)
        rows = EfficiencyTable(
            read_route(table, columns, route),
            np.array(efficiency),
            np.array(sd),
            read_own_angles(table, columns, contacts),
            origin_of_rows(table),
            read_unused_columns(table, columns),
        )
        _refuse_single_fractions(column, rows)
        if "run" in columns:
            _refuse_shared_runs(columns["run"].cells, rows)
        remarks = (*_remark_fractions(column, rows), *remark_on_errors_in_cells(table, columns))
        return TableFromFiles(rows, {path.name: path}, remarks, (table.account,))

    @override
    def describe(self, table: EfficiencyTable, description: Description) -> list[str]:
        """Return how many efficiencies there are, and how large."""
        low, high = table.efficiency.min(), table.efficiency.max()
        return [f"{table.origin.files[0]}: {self.count_readings(table)}, {percent(low)} to {percent(high)}"]

    @override
    def describe_single_file(self, table: EfficiencyTable) -> str:
        return f"a table of {self.count_readings(table)}"

    @override
    def count_readings(self, table: EfficiencyTable) -> str:
        return counted(len(table.efficiency), "efficiency", "efficiencies")

    @override
    def copied_readings(self, table: EfficiencyTable) -> list[str]:
        settings = np.column_stack([table.route, table.own.angle])
        return describe_copies(compare_without_runs(table.origin, settings, table.efficiency, route_or_wrap_angle(table)))

    @override
    def coarse_readings(self, table: EfficiencyTable) -> CoarseReadings | None:
        """Check tables in which no standard deviation is stated."""
        if np.any(table.sd > 0):
            return None
        settings = np.column_stack([table.route, table.own.angle])
        return find_coarse_readings(listed(table.origin.files), settings, table.efficiency)

    @override
    def measured_columns(self, table: EfficiencyTable) -> list[MeasuredColumn]:
        return [MeasuredColumn("efficiency", "", table.efficiency, route_or_wrap_angle(table))]

    @override
    def with_bench_error(self, table: EfficiencyTable, error: BenchError) -> EfficiencyTable:
        """Return the table with the error in its efficiencies and wrap angles."""
        count, inputs = len(table.efficiency), np.ones(len(table.efficiency))
        loads, order = BenchLoads.of(inputs, table.efficiency), order_of(np.arange(count), count)
        columns = np.column_stack([powers(table.route, 4), np.nan_to_num(table.own.angle)])
        smooth = smooth_readings(table.efficiency, columns, np.zeros(count, dtype=int))
        friction = error.where_angles_grow(table.own.sd)
        changed = error.apply_to_force(friction.apply_to_friction(inputs, smooth, loads, order))
        return replace(table, efficiency=table.efficiency + changed - smooth, own=error.apply_to_rows(table.own))

    @override
    def why_implausible(self, measured: EfficiencyTable, simulated: EfficiencyTable) -> str:
        return explain_impossible_loss(-np.log(simulated.efficiency), "an efficiency")

    @override
    def file_rows(self, table: EfficiencyTable, description: Description) -> FileRows:
        values = zip(table.route, table.efficiency, strict=True)
        rows = [[*route_cells(length, description), f"{eta:.5f}"] for length, eta in values]
        return [*route_heading(description), "efficiency"], rows

    @override
    def empty_table(self, design: EfficiencyDesign, description: Description, file: str) -> EfficiencyTable:
        n = len(design.efficiencies)
        own_angles, origin = OwnAngles.none(description.angle_columns, n), RowOrigin.below_heading(file, n)
        return EfficiencyTable(np.array(design.efficiencies), np.full(n, 0.8), np.zeros(n), own_angles, origin)


def _remark_fractions(column: Column, table: EfficiencyTable) -> tuple[str, ...]:
    """Return a remark on efficiencies in percent that look like fractions; a fit's verdict says it later and without names."""
    small = np.flatnonzero(table.efficiency <= _FRACTION)
    if not len(small) or not any(_is_in_percent(cell, column) for cell in column.cells):
        return ()
    first = int(small[0])
    few = counted(len(small), "efficiency is", "efficiencies are")
    which = "every efficiency is" if len(small) == len(table.efficiency) else few
    return (
        f"{table.origin.describe_row(first)}: {which} at most 1 %; the usual cause is a fraction under a heading that says "
        "percent: call the column efficiency, or write percentages.",
    )


def _refuse_single_fractions(column: Column, table: EfficiencyTable) -> None:
    """Refuse a fraction among percentages: 0.775 where the others are 67.8 to 78.5.

    Raises:
        DatasetError: There is one.
    """
    is_small = table.efficiency <= _FRACTION
    if not np.any(~is_small):
        return
    low, high = (float(end(table.efficiency[~is_small])) for end in (np.min, np.max))
    for cell, efficiency in zip(column.cells, table.efficiency, strict=True):
        if _is_in_percent(cell, column) and _HUNDREDTH * low <= efficiency <= _FRACTION:
            raise cell.refuse(
                f"{cell.shown} is {100 * efficiency:.3g} %, and the other efficiencies are {100 * low:.3g} to "
                f"{100 * high:.3g} %. The usual cause is a fraction among percentages: write {1e4 * efficiency:.3g}, or leave "
                "the row out."
            )


def _check_pulling(cell: Cell) -> int:
    """Refuse a row that was not read while pulling."""
    stroke = read_stroke(cell)
    if stroke != 1:
        raise cell.refuse(
            f"{cell.shown} is not pulling, and an efficiency is output over input force while pulling; leave rows of other "
            "strokes out, or give the forces at both ends, input_force and output_force, in place of efficiencies."
        )
    return stroke


def _refuse_shared_runs(labels: Sequence[Cell], table: EfficiencyTable) -> None:
    """Refuse several efficiencies of one run at one length and bend, which are not independent.

    Raises:
        DatasetError: There are such.
    """
    conditions = np.nan_to_num(np.column_stack([table.route, table.own.angle]))
    first: dict[tuple[object, ...], Cell] = {}
    for cell, label, condition in zip(labels, read_labels(labels, ""), conditions, strict=True):
        before = first.setdefault((label, *condition), cell)
        if before is not cell:
            raise cell.refuse(
                f"run {cell.shown} has an efficiency in row {before.row} too. Efficiencies of one run (one mounting of the "
                "cable) share its error, and here each row counts as a mounting of its own, so that intervals would be too "
                "narrow: write the mean of each run in one row, or give the forces at both ends, input_force and output_force, "
                "in place of efficiencies; rename the column if it is something else than runs."
            )


def _read_ratio(cell: Cell, column: Column) -> float:
    """Return a number, or a percentage where the heading or the cell says so [1]."""
    percentage = cell.percentage()
    return column.value(cell) if percentage is None else percentage


def _is_in_percent(cell: Cell, column: Column) -> bool:
    return column.factor != 1 or cell.percentage() is not None


def _read_efficiency(cell: Cell, column: Column, sd: float) -> float:
    """Return an efficiency [1]; one slightly above 1 may be noise."""
    value = _read_ratio(cell, column)
    if value <= 0:
        raise cell.refuse(f"an efficiency of {cell.shown} is not possible; it is output force over input force.")
    if value > 1 + GAIN_ERROR + _SDS * sd:
        usual = (
            "the usual cause is that input and output force were swapped"
            if _is_in_percent(cell, column)
            else "if it is in percent, name the column efficiency_percent"
        )
        noise = "" if sd else ", or state its standard deviation in efficiency_sd if noise did that"
        raise cell.refuse(f"an efficiency of {cell.shown} is above 1; {usual}{noise}.")
    return value


def _read_loss(cell: Cell, column: Column) -> float:
    """Return the efficiency that a loss leaves, of the input force [1]; one slightly below 0 may be noise."""
    value = _read_ratio(cell, column)
    if not -GAIN_ERROR <= value < 1:
        usual = "" if _is_in_percent(cell, column) else "; if it is in percent, name the column loss_percent"
        raise cell.refuse(
            f"a loss of {cell.shown} is not possible; it is the share of the input force that does not arrive{usual}."
        )
    return 1 - value


def _read_efficiency_sd(cell: Cell, column: Column, efficiency: Cell, efficiency_column: Column) -> float:
    """Return the standard deviation of an efficiency [1]."""
    value = _read_ratio(cell, column)
    if not 0 < value <= 1:
        raise cell.refuse(
            f"a standard deviation of {cell.shown} is not possible for an efficiency; write one up to 1 (100 %)."
        )
    if _is_in_percent(efficiency, efficiency_column) and not _is_in_percent(cell, column):
        raise cell.refuse(
            f"{cell.shown} does not say whether it is in percent, as the efficiency next to it is; name the column "
            "efficiency_sd_percent, or write 1 % for 0.01."
        )
    return value
