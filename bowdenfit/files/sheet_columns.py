"""From the rows of a sheet, whatever program wrote it, to channels.

`read_cells` reads cell by cell and notes a letter for what each row holds; `read_columns` decides by these letters where
the data end and what is a remark; `make_channels` names the columns and gives them their clocks.
"""

import math
import re
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import timedelta
from typing import Any

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import Cell, classify_cell, parse_number
from bowdenfit.files.channels import Channel, make_names_unique
from bowdenfit.files.clocks import assign_clocks, parse_dates, trim_tails
from bowdenfit.files.headings import heading_of
from bowdenfit.files.layout import Layout, is_index, is_summary
from bowdenfit.files.row_account import AGAIN, BELOW, BETWEEN, BLANK, COMMENT
from bowdenfit.files.text_file import holds_other_row, other_separator_error, refuse_long_row
from bowdenfit.types import Vector
from bowdenfit.words import few, shown

_MOST_SUMMARY_ROWS = 40  # judged: rows of statistics below the data
_MOST_ROWS_AFTER_BLANK = 10  # judged: rows behind a blank one that are an evaluation rather than data
_BLOCK_OF_WORDS = re.compile(rb"(?<=[^ ])(?: +[wm#]+)+$")
_LAST_FEW = re.compile(rb"([^ ]+) +([^ ]{1,%d})" % _MOST_ROWS_AFTER_BLANK)

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
        letters: Kinds of cells in each row, as letters.
    """

    numbers: dict[int, array]
    dates: dict[int, list[str]]
    words: list[tuple[int, int, Any]]
    letters: bytearray


@dataclass(frozen=True)
class SheetColumns:
    """What a sheet holds.

    Args:
        values: The numbers of each column; None for a column of text.
        remarks: Omissions, in sentences.
        left_out: Why a row is not read, and what it says, by its number.
        beside: Row and text of remarks beside the columns.
        rows: How many rows there are from the first of data on.
        starts: When columns of dates start, by column (`Channel.start`).
    """

    values: list[Vector | None]
    remarks: list[str]
    left_out: dict[int, tuple[str, str]]
    beside: list[tuple[int, str]]
    rows: int
    starts: dict[int, float] = field(default_factory=dict)


def make_channels(layout: Layout, sheet_columns: SheetColumns) -> tuple[tuple[Channel, ...], list[str]]:
    """Return the channels of a sheet with their clocks, and remarks on the columns left out.

    Args:
        layout: Its headings.
        sheet_columns: Its columns.
    """
    columns = sheet_columns.values
    retained: list[Channel] = []
    remarks: list[str] = []
    nameless = [not heading.name for heading in layout.headings]
    for i, (heading, values) in enumerate(zip(layout.headings, columns, strict=True)):
        place = f"Column {i + 1}" if nameless[i] else f"The column {shown(heading.name)}"
        if values is None:
            remarks.append(f"{place} holds text and was left out.")
        elif not np.isfinite(values).any():
            remarks += [] if nameless[i] else [f"{place} holds no numbers and was left out."]
        elif nameless[i] and layout.named and is_index(values):
            remarks.append(f"{place} has no heading, only counts the rows and was left out.")
        else:
            retained.append(Channel(layout.name(i), heading.unit, values, start=sheet_columns.starts.get(i)))
    if not layout.named:
        remarks.append("There is no row of headings; the columns are called column1, column2, ... from the left.")
    named = make_names_unique(retained)
    return assign_clocks(trim_tails(named)) if named else (), remarks


def read_columns(sheet: SheetRows) -> SheetColumns:
    """Return the numbers of each column, and what was left out below the data, between the rows and beside them.

    Raises:
        DatasetError: Text stands among the numbers of a column.
    """
    kinds, cells = sheet.layout.kinds, read_cells(sheet)
    stop = _data_end(bytes(cells.letters))
    left_out, beside = _explain_left_out(sheet, cells, stop), []
    for position, column, text in cells.words:
        if position >= stop:
            break
        row = sheet.number(position)
        if row in left_out:
            continue
        if column == len(kinds):
            beside.append((row, _remark_beside(sheet, row, text)))
        elif kinds[column] == "number" or (sheet.of_text and kinds[column] == "blank"):
            _refuse_other_headings(sheet, row, [cell_text(other) for at, _, other in cells.words if at == position])
            raise Cell(sheet.place, row, sheet.layout.name(column), text).no_sample(sheet.decimal)
    dropped = [REMARKED, SPACE, REMARK] if sheet.of_text else [REMARKED, REMARK]
    retained = ~np.isin(np.array(cells.letters[:stop]), dropped)
    columns: list[Vector | None] = [None] * len(kinds)
    starts = dict[int, float]()
    before = sheet.before or {}
    for i, values in (cells.numbers | cells.dates).items():
        pieces = before.pop(i, [])
        kind = pieces[0].dtype if pieces else float
        remaining = np.array(values[:stop], dtype=object if i in cells.dates else kind)[retained]
        whole = np.concatenate([*pieces, remaining])
        pieces.clear()
        if i in cells.dates:
            columns[i], start = parse_dates(whole, f"{sheet.place}, column {shown(sheet.layout.name(i))}")
            starts |= {} if start is None else {i: start}
        else:
            whole[~np.isfinite(whole)] = np.nan
            columns[i] = whole
    remarks = _describe_left_out(sheet, cells.letters, left_out, beside, stop)
    return SheetColumns(columns, remarks, left_out, beside, len(cells.letters), starts)


def _refuse_other_headings(sheet: SheetRows, row: int, words: Sequence[str]) -> None:
    """Refuse a row that has a word in every column, each another one, as headings do that are not those of the sheet.

    Raises:
        DatasetError: It is such a row.
    """
    columns = sum(kind != "blank" for kind in sheet.layout.kinds)
    if len(words) >= columns > 1 and len({*words}) == len(words):
        raise DatasetError(
            f"{sheet.place}, row {row}: every column has words ({shown(' '.join(words))}), as headings do, but not those "
            "at the top; the usual cause is a second recording behind the first. Put what is below into a file of its own, or "
            "delete the row if its columns are the same."
        )


def _explain_left_out(sheet: SheetRows, cells: SheetCells, stop: int) -> dict[int, tuple[str, str]]:
    """Return why rows are not read, by their numbers; remarks between the rows are marked as such in the letters."""
    of_row: dict[int, list[tuple[int, str]]] = {}
    for position, column, text in cells.words:
        if column < len(sheet.layout.kinds):
            of_row.setdefault(position, []).append((column, cell_text(text)))
    left_out: dict[int, tuple[str, str]] = {}
    for position, letter in enumerate(cells.letters):
        text_of_row = " ".join(text for _, text in of_row.get(position, ()))
        if letter == REMARKED:
            left_out[sheet.number(position)] = COMMENT, ""
        elif letter == SPACE or (letter == EMPTY and position >= stop):
            left_out[sheet.number(position)] = BLANK, ""
        elif position >= stop:
            _refuse_samples(sheet, position, of_row.get(position, []))
            left_out[sheet.number(position)] = BELOW, text_of_row
        elif letter == WORDS and (reason := _explain_words(sheet, of_row.get(position, []))):
            _refuse_samples(sheet, position, of_row[position])
            left_out[sheet.number(position)] = reason, text_of_row
            cells.letters[position] = REMARK
    return left_out


def _refuse_samples(sheet: SheetRows, position: int, words: Sequence[tuple[int, str]]) -> None:
    """Refuse to leave out a row whose only words are numbers behind another separator.

    Raises:
        DatasetError: It is such a row.
    """
    if len(words) == 1 and holds_other_row(words[0][1], len(sheet.layout.kinds)):
        raise other_separator_error(sheet.place, sheet.number(position), words[0][1])


def _explain_words(sheet: SheetRows, words: Sequence[tuple[int, str]]) -> str:
    """Return why a row without numbers is no bad sample, one remark alone or the headings again; empty where it is one."""
    if len(words) == 1 and len(sheet.layout.kinds) > 1:
        return BETWEEN
    again = all(heading_of(text).name == sheet.layout.headings[column].name for column, text in words)
    return AGAIN if words and again else ""


def _remark_beside(sheet: SheetRows, row: int, cells: Sequence[str]) -> str:
    """Return the words behind the last column.

    Raises:
        DatasetError: Numbers stand there.
    """
    width = len(sheet.layout.kinds)
    behind = [cell.strip() for cell in cells[width:] if cell.strip()]
    if any(classify_cell(cell, sheet.decimal) != "text" for cell in behind):
        refuse_long_row(sheet.place, row, cells, width)
    return " ".join(behind)


def _data_end(letters: bytes) -> int:
    """Return the position of the row behind the data, by a letter for each row.

    Below the data stand statistics, words alone, a block in whose every row are words, or a few last rows after a blank.
    """
    filled = letters.rstrip(b" ,#")
    label = filled.find(SUMMARY, max(0, len(filled) - _MOST_SUMMARY_ROWS))
    data = (filled if label < 0 else filled[:label]).rstrip(b" ,#w")
    data = _BLOCK_OF_WORDS.sub(b"", data)
    last = _LAST_FEW.fullmatch(data)
    return last.end(1) if last and last.end(1) > 2 * len(last[2]) + 2 else len(data)


def _describe_left_out(
    sheet: SheetRows,
    letters: bytearray,
    left_out: Mapping[int, tuple[str, str]],
    beside: Sequence[tuple[int, str]],
    stop: int,
) -> list[str]:
    comments = letters[:stop].count(REMARKED)
    sentences = [f"{comments} comment lines between the rows of data were left out."] if comments else []
    below = [i for i in range(stop, len(letters)) if letters[i] not in b" ,#"]
    if below:
        top, bottom = sheet.number(below[0]), sheet.number(below[-1])
        place = f"Row {top} was" if top == bottom else f"Rows {top} to {bottom} were"
        sentences.append(f"{place} left out: they are below the data, as statistics are.")
    if sheet.of_text:
        return sentences  # the account of the file names the rest
    between = [f"row {row} ({shown(text)})" for row, (reason, text) in left_out.items() if reason in (BETWEEN, AGAIN)]
    sentences += [f"Left out because they have no numbers: {few(between)}."] if between else []
    texts = [f"{shown(text)} in row {row}" for row, text in beside]
    return sentences + ([f"Notes next to the columns were left out: {few(texts)}."] if texts else [])


def read_cells(sheet: SheetRows) -> SheetCells:
    """Return all cells of a sheet."""
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
            column.append(cell if type(cell) in (float, int) else _read_number(cells, position, i, cell, sheet.decimal))
        for i, texts in cells.dates.items():
            texts.append(cell_text(filled[i]) if i < len(filled) else "")
            if classify_cell(texts[-1], sheet.decimal) == "text":
                cells.words.append((position, i, texts[-1]))
        cells.letters.append(_row_letter(row, sheet, len(cells.words) > known))
    return cells


def _read_number(cells: SheetCells, row: int, column: int, cell: object, decimal: str) -> float:
    value = parse_number(cell_text(cell), decimal)
    if value is None:
        cells.words.append((row, column, cell_text(cell)))
    return math.nan if value is None else value


def _row_letter(row: Sequence[Any] | None, sheet: SheetRows, worded: bool) -> int:
    """Return what a row holds; statistics bear a label in a column that holds no words in the data."""
    if row is None:
        return REMARKED
    if all(cell is None or cell == "" for cell in row):
        return EMPTY if sheet.of_text and row else SPACE
    if not worded:
        return DATA
    texts, kinds = [cell_text(cell) for cell in row], sheet.layout.kinds
    if is_summary([text for i, text in enumerate(texts) if i >= len(kinds) or kinds[i] != "text"]):
        return SUMMARY
    kinds_of_cells = {classify_cell(text, sheet.decimal) for text in texts}
    return MIXED if len(kinds) == 1 or kinds_of_cells & {"number", "date"} else WORDS


def cell_text(cell: object) -> str:
    """Return a cell as text: dates as ISO dates, true and false as words."""
    if isinstance(cell, str):
        return cell
    if isinstance(cell, timedelta):
        return repr(cell.total_seconds())
    if cell is None:
        return ""
    return repr(cell) if isinstance(cell, bool | int | float) else str(cell)
