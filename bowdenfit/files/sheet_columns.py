"""The columns of a sheet out of its rows of cells: numbers, dates, and what stands below the data."""

from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from datetime import timedelta
from typing import Any

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.clocks import seconds_of_dates
from bowdenfit.files.layout import Layout, is_summary, number_of
from bowdenfit.types import Vector
from bowdenfit.words import shown

_MOST_SUMMARY_ROWS = 40
_MOST_ROWS_AFTER_BLANK = 10
_NAN = float("nan")


@dataclass(frozen=True)
class _Cells:
    """What has been read of a sheet: the numbers and dates of each column, and words among them."""

    numbers: dict[int, array]
    dates: dict[int, list[str]]
    words: list[tuple[int, int, str]] = field(default_factory=list)
    filled: list[tuple[int, int]] = field(default_factory=list)


def columns_of(place: str, layout: Layout, rows: Iterable[Sequence[Any]]) -> tuple[list[Vector | None], list[str]]:
    """The numbers of each column, None for a column of text, and remarks on rows left out below the data.

    Args:
        place: File and sheet, for errors.
        layout: Headings and kinds of the columns.
        rows: Cells from the first row of data on.

    Raises:
        DatasetError: Text stands among the numbers of a column.
    """
    cells = _read(layout, rows)
    last = cells.filled[-1][1] if cells.filled else 0
    stop = _data_end(cells, last)
    for row, column, text in cells.words:
        if row < stop and layout.kinds[column] == "number":
            name = layout.headings[column].name or f"column{column + 1}"
            raise DatasetError(
                f"{place}, row {layout.start + row + 1}, column {shown(name)}: "
                f"{shown(text)} is not a number; correct the cell, or leave it blank if the sample is missing."
            )
    columns: list[Vector | None] = [None] * len(layout.kinds)
    for i, values in cells.numbers.items():
        columns[i] = np.array(values[:stop], dtype=float)
    for i, texts in cells.dates.items():
        columns[i] = seconds_of_dates(texts[:stop], f"{place}, column {shown(layout.headings[i].name)}")
    return columns, _remarks(layout.start, cells, stop, last)


def _read(layout: Layout, rows: Iterable[Sequence[Any]]) -> _Cells:
    kinds = layout.kinds
    numbers = {i: array("d") for i, kind in enumerate(kinds) if kind in ("number", "blank")}
    cells = _Cells(numbers, {i: [] for i, kind in enumerate(kinds) if kind == "date"})
    for position, row in enumerate(rows):
        for i, column in cells.numbers.items():
            cell = row[i] if i < len(row) else None
            column.append(cell if type(cell) is float else _number(cells, position, i, cell))
        for i, texts in cells.dates.items():
            texts.append("" if i >= len(row) or row[i] is None else str(row[i]))
        if any(cell is not None and cell != "" for cell in row):
            _extend(cells.filled, position)
    return cells


def _number(cells: _Cells, row: int, column: int, cell: object) -> float:
    if cell is None:
        return _NAN
    if isinstance(cell, float | int) and not isinstance(cell, bool):
        return float(cell)
    if isinstance(cell, timedelta):
        return cell.total_seconds()
    value = None if isinstance(cell, bool) else number_of(str(cell), ".")
    if value is None:
        cells.words.append((row, column, str(cell)))
        return _NAN
    return value


def _extend(runs: list[tuple[int, int]], row: int) -> None:
    """Add a filled row to the runs of filled rows (first, behind the last)."""
    if runs and runs[-1][1] == row:
        runs[-1] = (runs[-1][0], row + 1)
    else:
        runs.append((row, row + 1))


def _data_end(cells: _Cells, last: int) -> int:
    """Row behind the data: that of the first statistic below them, or of the blank row before a few last ones."""
    labels = [row for row, _, text in cells.words if is_summary([text]) and last - row <= _MOST_SUMMARY_ROWS]
    stop = min(labels, default=last)
    runs = [(start, min(end, stop)) for start, end in cells.filled if start < stop]
    worded = {row for row, _, _ in cells.words}
    while len(runs) > 1 and all(row in worded for row in range(*runs[-1])):
        runs.pop()
    if len(runs) == 2 and (after := runs[1][1] - runs[1][0]) <= _MOST_ROWS_AFTER_BLANK and runs[0][1] > 2 * after:
        runs.pop()
    return runs[-1][1] if runs else stop


def _remarks(start: int, cells: _Cells, stop: int, last: int) -> list[str]:
    below = [max(first, stop) for first, end in cells.filled if end > stop]
    if not below:
        return []
    top, bottom = start + below[0] + 1, start + last
    where = f"Row {top} was" if top == bottom else f"Rows {top} to {bottom} were"
    return [f"{where} left out: they stand below the data, as statistics do."]
