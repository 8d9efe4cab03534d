"""Rows of a table that are left out because their user says so."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column
from bowdenfit.files.row_account import ExcludedReading
from bowdenfit.files.tables import RawTable
from bowdenfit.words import few


def leave_out_rows(
    table: RawTable, columns: Mapping[str, Column], reasons: Mapping[int, str]
) -> tuple[RawTable, dict[str, Column]]:
    """Return a table and its columns without some rows, which its account names with their reasons.

    Args:
        table: The table.
        columns: Its columns, by quantity.
        reasons: Why each of these rows is left out, by its number in the file.

    Raises:
        DatasetError: One is no row of readings, or none would remain.
    """
    if not reasons:
        return table, dict(columns)
    rows = [row[0].row for row in table.rows]
    if unknown := sorted(set(reasons) - set(rows)):
        raise DatasetError(
            f"{table.file}: exclude names row {few([str(row) for row in unknown])}, where no reading is to be left out; the "
            f"usual cause is that rows were added or deleted above since. Readings are in the rows {min(rows)} to {max(rows)}: "
            "name the right ones, or delete the entry.",
            key_path=("exclude",),
        )
    if len(reasons) == len(rows):
        raise DatasetError(
            f"{table.file}: exclude names every row of readings; leave some in, or leave the table out.", key_path=("exclude",)
        )
    retained = [row not in reasons for row in rows]

    def keep(cells: Sequence[Cell]) -> tuple[Cell, ...]:
        return tuple(cell for cell, keeps in zip(cells, retained, strict=True) if keeps)

    return (
        replace(
            table,
            rows=tuple(row for row, keeps in zip(table.rows, retained, strict=True) if keeps),
            errors={heading: keep(cells) for heading, cells in table.errors.items()},
            lines=table.lines.without_rows(reasons, tuple(_read_rows(table.file, columns, sorted(reasons)))),
        ),
        {name: replace(column, cells=keep(column.cells)) for name, column in columns.items()},
    )


def _read_rows(file: str, columns: Mapping[str, Column], rows: Sequence[int]) -> Iterator[ExcludedReading]:
    """Yield the numbers in some rows, of those cells that hold one; whatever else is in them is not looked at."""
    for row in rows:
        values = {}
        for name, column in columns.items():
            for cell in (cell for cell in column.cells if cell.row == row):
                with suppress(DatasetError):
                    values[name] = column.value(cell)
        yield ExcludedReading(file, row, values)
