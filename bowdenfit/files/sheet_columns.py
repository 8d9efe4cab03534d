"""From the rows of a sheet, whatever program wrote it, to channels.

`_read_rows` reads cell by cell and notes the kind of each row; `read_arrays` decides by these kinds where the data end and
what is a remark; `make_channels` names the columns and gives them their clocks.
"""

import math
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import timedelta
from enum import IntEnum
from itertools import groupby
from typing import Any

import numpy as np

from bowdenfit.files.cells import Cell, classify_cell, parse_number
from bowdenfit.files.channels import Channel, make_names_unique
from bowdenfit.files.clocks import assign_clocks, parse_dates, trim_tails
from bowdenfit.files.layout import Layout, is_index
from bowdenfit.files.row_account import AGAIN, BELOW, BETWEEN, BLANK, COMMENT
from bowdenfit.files.sheet_rows import explain_row, is_summary, refuse_other_headings, refuse_other_separator
from bowdenfit.files.text_file import CsvRecord, refuse_long_row
from bowdenfit.types import Vector
from bowdenfit.words import few, shown

_MOST_SUMMARY_ROWS = 40  # judged: rows of statistics below the data
_MOST_ROWS_AFTER_BLANK = 10  # judged: rows behind a blank one that are an evaluation rather than data


class RowKind(IntEnum):
    """What a row holds."""

    DATA = 0  # readings
    SPACE = 1  # nothing
    SEPARATORS = 2  # separators only
    COMMENT = 3
    STATISTICS = 4
    WORDS = 5  # no numbers
    MIXED = 6  # words where numbers are expected, beside numbers
    REMARK = 7  # words between the rows that are no readings


_BLANK_KINDS = (RowKind.SPACE, RowKind.SEPARATORS, RowKind.COMMENT)
_OF_TEXT = (RowKind.WORDS, RowKind.MIXED, RowKind.COMMENT)


@dataclass(frozen=True)
class SheetRows:
    """The rows of a sheet from the first of data on.

    Args:
        place: File and sheet, for errors.
        layout: Headings and kinds of the columns.
        rows: Their cells, text or as the library gives them; None for a comment.
        first: Number of the first of them in the file.
        of_text: Whether they are lines of text, of which blank ones are only space and none may have too many cells.
        before: Numbers or dates of each column that have been read from the rows before, in pieces; taken out.
    """

    place: str
    layout: Layout
    rows: Iterable[Sequence[Any] | None]
    first: int
    of_text: bool = False
    before: dict[int, list[np.ndarray]] | None = None


@dataclass(frozen=True)
class SheetCells:
    """What has been read of a sheet.

    Args:
        numbers: The numbers of each column.
        dates: The texts of each column of dates.
        row_kinds: Kind of each row (`RowKind`).
        texts: By position, the cells of the rows that have words where numbers or dates are expected, or too many cells.
    """

    numbers: dict[int, array]
    dates: dict[int, list[str]]
    row_kinds: bytearray = field(default_factory=bytearray)
    texts: dict[int, list[str]] = field(default_factory=dict)


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


def read_arrays(sheet: SheetRows) -> SheetColumns:
    """Return the numbers of each column, and what was left out below the data, between the rows and beside them.

    Raises:
        DatasetError: Text stands among the numbers of a column.
    """
    cells = _read_rows(sheet)
    stop = _find_data_end(cells.row_kinds)
    left_out, remarks_beside = _explain_rows(sheet, cells, stop)
    dropped = {RowKind.COMMENT, RowKind.REMARK} | ({RowKind.SPACE} if sheet.of_text else set())
    retained = ~np.isin(np.array(cells.row_kinds[:stop]), list(dropped))
    columns: list[Vector | None] = [None] * len(sheet.layout.kinds)
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
    remarks = _describe_left_out(sheet, cells.row_kinds, left_out, remarks_beside, stop)
    return SheetColumns(columns, remarks, left_out, remarks_beside, len(cells.row_kinds), starts)


def _explain_rows(
    sheet: SheetRows, cells: SheetCells, stop: int
) -> tuple[dict[int, tuple[str, str]], list[tuple[int, str]]]:
    """Return why rows are not read and what they say, by their numbers, and remarks beside those that are read.

    Remarks between the rows become `RowKind.REMARK`.

    Raises:
        DatasetError: A row is neither readings nor a remark.
    """
    left_out: dict[int, tuple[str, str]] = {}
    beside: list[tuple[int, str]] = []
    layout = sheet.layout
    width = sum(kind != "blank" for kind in layout.kinds)
    for position, kind in enumerate(cells.row_kinds):
        if position < stop and kind in (RowKind.DATA, RowKind.SEPARATORS):
            continue
        row = CsvRecord(sheet.first + position, 0, cells.texts.get(position, []))
        text = " ".join(filter(None, map(str.strip, row.cells)))
        reason = explain_row(row, layout.header, layout.numeric) if kind in (RowKind.WORDS, RowKind.STATISTICS) else ""
        if kind in _BLANK_KINDS:
            left_out[row.row] = (COMMENT if kind == RowKind.COMMENT else BLANK), ""
        elif position >= stop or reason:
            refuse_other_separator(sheet.place, row.row, text, len(layout.kinds), layout.numeric)
            left_out[row.row] = (BELOW if position >= stop else reason), text
            cells.row_kinds[position] = RowKind.REMARK
        else:
            refuse_other_headings(sheet.place, row, layout.header, width)
            beside += _read_row_with_words(sheet, row)
    return left_out, beside


def _read_row_with_words(sheet: SheetRows, row: CsvRecord) -> list[tuple[int, str]]:
    """Return the remark behind the last column of a row of readings, with its number; empty without.

    Raises:
        DatasetError: Words stand in a column of numbers, or numbers behind the last column.
    """
    layout = sheet.layout
    of_numbers = ("number", "blank") if sheet.of_text else ("number",)
    for i, (text, kind) in enumerate(zip(row.cells, layout.kinds, strict=False)):
        if kind in of_numbers and parse_number(text, layout.decimal) is None:
            raise Cell(sheet.place, row.row, layout.name(i), text).no_sample(layout.decimal)
    behind = [cell.strip() for cell in row.cells[len(layout.kinds) :] if cell.strip()] if sheet.of_text else []
    if any(classify_cell(cell, layout.decimal) != "text" for cell in behind):
        refuse_long_row(sheet.place, row.row, row.cells, len(layout.kinds))
    return [(row.row, " ".join(behind))] if behind else []


def _find_data_end(row_kinds: bytearray) -> int:
    """Return the position of the row behind the data.

    Below the data stand statistics, words alone, a block in whose every row are words, or a few last rows after a blank.
    """
    end = len(row_kinds.rstrip(bytes(_BLANK_KINDS)))
    label = row_kinds.find(RowKind.STATISTICS, max(0, end - _MOST_SUMMARY_ROWS), end)
    above = row_kinds[: end if label < 0 else label].rstrip(bytes((*_BLANK_KINDS, RowKind.WORDS)))
    blocks = list(_split_at_blank_rows(above))
    while len(blocks) > 1 and all(kind in _OF_TEXT for kind in row_kinds[slice(*blocks[-1])]):
        blocks.pop()
    sizes = [stop - start for start, stop in blocks]
    if len(blocks) == 2 and sizes[1] <= _MOST_ROWS_AFTER_BLANK and sizes[0] > 2 * sizes[1] + 2:
        blocks.pop()
    return blocks[-1][1] if blocks else 0


def _split_at_blank_rows(row_kinds: bytearray) -> Iterator[tuple[int, int]]:
    """Yield start and stop of each block of rows between blank ones."""
    start = 0
    for blank, rows in groupby(row_kinds, key=lambda kind: kind == RowKind.SPACE):
        stop = start + sum(1 for _ in rows)
        if not blank:
            yield start, stop
        start = stop


def _describe_left_out(
    sheet: SheetRows,
    row_kinds: bytearray,
    left_out: Mapping[int, tuple[str, str]],
    beside: Sequence[tuple[int, str]],
    stop: int,
) -> list[str]:
    comments = row_kinds[:stop].count(RowKind.COMMENT)
    sentences = [f"{comments} comment lines between the rows of data were left out."] if comments else []
    below = [i for i in range(stop, len(row_kinds)) if row_kinds[i] not in _BLANK_KINDS]
    if below:
        top, bottom = sheet.first + below[0], sheet.first + below[-1]
        place = f"Row {top} was" if top == bottom else f"Rows {top} to {bottom} were"
        sentences.append(f"{place} left out: they are below the data, as statistics are.")
    if sheet.of_text:
        return sentences  # the account of the file names the rest
    between = [f"row {row} ({shown(text)})" for row, (reason, text) in left_out.items() if reason in (BETWEEN, AGAIN)]
    sentences += [f"Left out because they have no numbers: {few(between)}."] if between else []
    texts = [f"{shown(text)} in row {row}" for row, text in beside]
    return sentences + ([f"Notes next to the columns were left out: {few(texts)}."] if texts else [])


def _read_rows(sheet: SheetRows) -> SheetCells:
    """Return all cells of a sheet."""
    kinds, decimal = sheet.layout.kinds, sheet.layout.decimal
    numbers = {i: array("d") for i, kind in enumerate(kinds) if kind in ("number", "blank")}
    cells = SheetCells(numbers, {i: [] for i, kind in enumerate(kinds) if kind == "date"})
    for position, row in enumerate(sheet.rows):
        filled = row or ()
        as_expected = not sheet.of_text or not any(map(str.strip, filled[len(kinds) :]))
        for i, column in cells.numbers.items():
            cell = filled[i] if i < len(filled) else None
            value = cell if type(cell) in (float, int) else parse_number(cell_text(cell), decimal)
            column.append(math.nan if value is None else value)
            as_expected = as_expected and value is not None
        for i, texts in cells.dates.items():
            texts.append(cell_text(filled[i]) if i < len(filled) else "")
            as_expected = as_expected and classify_cell(texts[-1], decimal) != "text"
        if not as_expected:
            cells.texts[position] = [cell_text(cell) for cell in filled]
        cells.row_kinds.append(_kind_of_row(row, sheet, cells.texts.get(position)))
    return cells


def _kind_of_row(row: Sequence[Any] | None, sheet: SheetRows, texts: Sequence[str] | None) -> RowKind:
    """Return what a row holds; statistics bear a label in a column that holds no words in the data.

    Args:
        row: Its cells; None for a comment.
        sheet: The sheet.
        texts: Its cells as text, where not all are as expected; else None.
    """
    if row is None:
        return RowKind.COMMENT
    if all(cell is None or cell == "" for cell in row):
        return RowKind.SEPARATORS if sheet.of_text and row else RowKind.SPACE
    if texts is None:
        return RowKind.DATA
    kinds = sheet.layout.kinds
    if is_summary([text for i, text in enumerate(texts) if i >= len(kinds) or kinds[i] != "text"]):
        return RowKind.STATISTICS
    kinds_of_cells = {classify_cell(text, sheet.layout.decimal) for text in texts}
    return RowKind.MIXED if len(kinds) == 1 or kinds_of_cells & {"number", "date"} else RowKind.WORDS


def cell_text(cell: object) -> str:
    """Return a cell as text: dates as ISO dates, true and false as words."""
    if isinstance(cell, str):
        return cell
    if isinstance(cell, timedelta):
        return repr(cell.total_seconds())
    if cell is None:
        return ""
    return repr(cell) if isinstance(cell, bool | int | float) else str(cell)
