"""Codes that stand where a reading is missing, as the user states them: numbers such as -9999, and in tables words such as Err.

Cells of numbers that hold one count as blank. Labels, such as those of runs, are left as they are.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import Cell, parse_number
from bowdenfit.files.channels import ChannelFile
from bowdenfit.files.clocks import is_clock
from bowdenfit.files.columns import Column
from bowdenfit.files.headings import Quantity
from bowdenfit.files.tables import RawTable
from bowdenfit.words import counted, listed, shown


@dataclass(frozen=True)
class MissingCodes:
    """Stated codes.

    Args:
        stated: As the user writes them.
    """

    stated: tuple[float | str, ...]

    @property
    def numbers(self) -> frozenset[float]:
        """The codes that are numbers, in whatever spelling."""
        values = (parse_number(str(code).strip(), ".") for code in self.stated)
        return frozenset(value for value in values if value is not None and math.isfinite(value))

    @property
    def words(self) -> frozenset[str]:
        """The codes as texts, in small letters."""
        return frozenset(str(code).strip().lower() for code in self.stated)

    def mark(self, table: RawTable) -> RawTable:
        """Return a table whose cells know whether they hold a code."""
        if not self.stated:
            return table
        numbers, words = self.numbers, self.words

        def holds_code(cell: Cell) -> bool:
            if cell.text.strip().lower() in words:
                return True
            with suppress(DatasetError):
                return bool(numbers) and not cell.blank and cell.number() in numbers
            return False

        rows = tuple(tuple(replace(cell, is_code=True) if holds_code(cell) else cell for cell in row) for row in table.rows)
        return replace(table, rows=rows)

    def blank_samples(self, file: ChannelFile) -> tuple[ChannelFile, tuple[str, ...]]:
        """Return a recording in which samples that hold a code are missing, and a remark on how many these are.

        Raises:
            DatasetError: A code is no number.
        """
        if not self.stated:
            return file, ()
        wrong = next((code for code in self.stated if parse_number(str(code).strip(), ".") not in self.numbers), None)
        if wrong is not None:
            raise DatasetError(
                f"{file.path.name}: {shown(wrong)} is stated as a missing-value code, and samples of a recording are numbers; "
                "state a number such as -9999. Of words only the usual ones, such as NaN and N/A, mark missing samples there."
            )
        channels, counts = [], dict[str, int]()
        for channel in file.channels:
            codes = np.array(sorted(self.numbers)).astype(channel.values.dtype)
            is_code = np.isin(channel.values, codes)
            if is_code.any() and not is_clock(channel):
                counts[channel.name] = int(is_code.sum())
                channel = replace(channel, values=np.where(is_code, np.asarray(np.nan, channel.values.dtype), channel.values))
            channels.append(channel)
        return replace(file, channels=tuple(channels)), (self._describe_samples(file.path.name, counts),)

    def _describe_samples(self, file: str, counts: Mapping[str, int]) -> str:
        codes = listed([shown(code) for code in self.stated])
        if not counts:
            return f"{file}: no sample holds the stated missing-value code {codes}."
        place = listed([f"{counted(count, 'sample')} of {shown(name)}" for name, count in counts.items()])
        return f"{file}: {place} hold a stated missing-value code ({codes}), and count as missing."


def leave_out_coded_rows(
    table: RawTable, columns: Mapping[str, Column], wanted: Sequence[Quantity], codes: MissingCodes
) -> tuple[RawTable, dict[str, Column]]:
    """Return a table and its columns without rows in which a number that every row needs holds a code.

    Cells of other numbers count as blank. Both are counted in the account.

    Args:
        table: Marked by `MissingCodes.mark`.
        columns: Its columns, by quantity.
        wanted: The quantities, which say what may be blank.
        codes: As stated.

    Raises:
        DatasetError: Every row holds one.
    """
    if not codes.stated:
        return table, dict(columns)
    labels = {quantity.name for quantity in wanted if quantity.dimension == "text"}
    needed = {quantity.name for quantity in wanted if not quantity.optional} - labels
    coded: dict[int, str] = {}
    blank = 0
    for i, row in enumerate(table.rows):
        cells = [(name, column.cells[i]) for name, column in columns.items() if name not in labels and column.cells[i].is_code]
        missing = [cell for name, cell in cells if name in needed]
        if missing:
            coded[row[0].row] = f"{missing[0].shown} is stated as a missing-value code"
        else:
            blank += len(cells)
    if len(coded) == len(table.rows):
        raise DatasetError(
            f"{table.file}: every row holds a stated missing-value code ({listed([shown(code) for code in codes.stated])}) "
            "in a number that it needs; state the code that the file has, or another column."
        )
    retained = [row[0].row not in coded for row in table.rows]

    def keep(cells: Sequence[Cell]) -> tuple[Cell, ...]:
        return tuple(cell for cell, keeps in zip(cells, retained, strict=True) if keeps)

    rows = tuple(row for row, keeps in zip(table.rows, retained, strict=True) if keeps)
    stated = listed([shown(code) for code in codes.stated])
    note = f"{counted(blank, 'cell')} with a stated missing-value code ({stated}) count as blank" if blank else ""
    if not coded and not blank:
        note = f"no cell of a number that is read holds the stated missing-value code {stated}"
    account = table.lines.without_rows(coded)
    return (
        replace(table, rows=rows, lines=replace(account, note=note)),
        {name: replace(column, cells=keep(column.cells)) for name, column in columns.items()},
    )
