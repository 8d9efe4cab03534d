"""The cells of a sheet, row by row: numbers and dates by column, what is neither, and a letter for what each row holds."""

import math
from array import array
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

import numpy as np

from bowdenfit.files.cells import kind_of, number_of
from bowdenfit.files.layout import Layout, is_summary

DATA, SPACE, EMPTY, REMARKED, SUMMARY, WORDS, MIXED, REMARK = b"d ,#swmr"
"""What a row holds: readings, nothing, separators only, a comment, statistics, words, words among numbers, a remark."""


@dataclass(frozen=True)
class SheetRows:
    """The rows of a sheet from the first of data on.

    Args:
        place: File and sheet, for errors.
        layout: Headings and kinds of the columns.
        rows: Their cells, text or as the library gives them; None for a comment.
        number: The number in the file of the row at a position, from 0.
        decimal: Decimal mark of numbers that are text.
        of_text: Whether they are lines of text, of which blank ones are only space and none may have too many cells.
        before: Numbers or dates of each column that have been read from the rows before, in pieces; taken out.
    """

    place: str
    layout: Layout
    rows: Iterable[Sequence[Any] | None]
    number: Callable[[int], int]
    decimal: str = "."
    of_text: bool = False
    before: dict[int, list[np.ndarray]] | None = None


@dataclass(frozen=True)
class SheetCells:
    """What has been read of a sheet.

    Args:
        numbers: The numbers of each column.
        dates: The texts of each column of dates.
        words: Position, column and text of each cell that is not as it should be; the cells of a row that has too many.
        letters: What each row holds.
    """

    numbers: dict[int, array]
    dates: dict[int, list[str]]
    words: list[tuple[int, int, Any]]
    letters: bytearray


def text_of(cell: object) -> str:
    """A cell as text: dates as ISO dates, true and false as words."""
    if isinstance(cell, str):
        return cell
    if isinstance(cell, timedelta):
        return repr(cell.total_seconds())
    if cell is None:
        return ""
    return repr(cell) if isinstance(cell, bool | int | float) else str(cell)


def cells_of_sheet(sheet: SheetRows) -> SheetCells:
    """All cells of a sheet."""
    kinds = sheet.layout.kinds
    numbers = {i: array("d") for i, kind in enumerate(kinds) if kind in ("number", "blank")}
    cells = SheetCells(numbers, {i: [] for i, kind in enumerate(kinds) if kind == "date"}, [], bytearray())
    for position, row in enumerate(sheet.rows):
        filled = row or ()
        if sheet.of_text and len(filled) > len(kinds) and any(map(str.strip, filled[len(kinds) :])):
            cells.words.append((position, len(kinds), filled))
        known = len(cells.words)
        for i, column in cells.numbers.items():
            cell = filled[i] if i < len(filled) else None
            column.append(cell if type(cell) in (float, int) else _number(cells, position, i, cell, sheet.decimal))
        for i, texts in cells.dates.items():
            texts.append(text_of(filled[i]) if i < len(filled) else "")
            if kind_of(texts[-1], sheet.decimal) == "text":
                cells.words.append((position, i, texts[-1]))
        cells.letters.append(_letter(row, sheet, len(cells.words) > known))
    return cells


def _number(cells: SheetCells, row: int, column: int, cell: object, decimal: str) -> float:
    value = number_of(text_of(cell), decimal)
    if value is None:
        cells.words.append((row, column, text_of(cell)))
    return math.nan if value is None else value


def _letter(row: Sequence[Any] | None, sheet: SheetRows, worded: bool) -> int:
    """What a row holds; statistics bear a label in a column that holds no words in the data."""
    if row is None:
        return REMARKED
    if all(cell is None or cell == "" for cell in row):
        return EMPTY if sheet.of_text and row else SPACE
    if not worded:
        return DATA
    texts, kinds = [text_of(cell) for cell in row], sheet.layout.kinds
    if is_summary([text for i, text in enumerate(texts) if i >= len(kinds) or kinds[i] != "text"]):
        return SUMMARY
    kinds_of_cells = {kind_of(text, sheet.decimal) for text in texts}
    return MIXED if len(kinds) == 1 or kinds_of_cells & {"number", "date"} else WORDS
