"""The columns of a sheet out of its rows of cells: numbers, dates, and what stands below the data."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bowdenfit.files.cells import Cell, kind_of
from bowdenfit.files.clocks import seconds_of_dates
from bowdenfit.files.csv_rows import too_many_cells
from bowdenfit.files.headings import heading_of
from bowdenfit.files.row_account import AGAIN, BELOW, BETWEEN, BLANK, COMMENT
from bowdenfit.files.sheet_cells import (
    EMPTY,
    REMARK,
    REMARKED,
    SPACE,
    SUMMARY,
    WORDS,
    SheetCells,
    SheetRows,
    cells_of_sheet,
    text_of,
)
from bowdenfit.types import Vector
from bowdenfit.words import few, shown

_MOST_SUMMARY_ROWS = 40
_MOST_ROWS_AFTER_BLANK = 10
_BLOCK_OF_WORDS = re.compile(rb"(?<=[^ ])(?: +[wm#]+)+$")
_LAST_FEW = re.compile(rb"([^ ]+) +([^ ]{1,%d})" % _MOST_ROWS_AFTER_BLANK)


@dataclass(frozen=True)
class SheetColumns:
    """What a sheet holds.

    Args:
        values: The numbers of each column; None for a column of text.
        remarks: What was left out, in sentences.
        left_out: Why a row is not read, and what it says, by its number.
        beside: Row and text of remarks beside the columns.
        rows: How many rows there are from the first of data on.
    """

    values: list[Vector | None]
    remarks: list[str]
    left_out: dict[int, tuple[str, str]]
    beside: list[tuple[int, str]]
    rows: int


def columns_of(sheet: SheetRows) -> SheetColumns:
    """The numbers of each column, and what was left out below the data, between the rows and beside them.

    Raises:
        DatasetError: Text stands among the numbers of a column.
    """
    kinds, cells = sheet.layout.kinds, cells_of_sheet(sheet)
    stop = _data_end(bytes(cells.letters))
    left_out, beside = _left_out(sheet, cells, stop), []
    for position, column, text in cells.words:
        if position >= stop:
            break
        row = sheet.number(position)
        if row in left_out:
            continue
        if column == len(kinds):
            beside.append((row, _remark_beside(sheet, row, text)))
        elif kinds[column] == "number" or (sheet.of_text and kinds[column] == "blank"):
            raise Cell(sheet.place, row, sheet.layout.name(column), text).no_sample(sheet.decimal)
    dropped = [REMARKED, SPACE, REMARK] if sheet.of_text else [REMARKED, REMARK]
    kept = ~np.isin(np.array(cells.letters[:stop]), dropped)
    columns: list[Vector | None] = [None] * len(kinds)
    before = sheet.before or {}
    for i, values in (cells.numbers | cells.dates).items():
        pieces = before.pop(i, [])
        kind = pieces[0].dtype if pieces else float
        remaining = np.array(values[:stop], dtype=object if i in cells.dates else kind)[kept]
        whole = np.concatenate([*pieces, remaining])
        pieces.clear()
        if i in cells.dates:
            columns[i] = seconds_of_dates(whole, f"{sheet.place}, column {shown(sheet.layout.name(i))}")
        else:
            whole[~np.isfinite(whole)] = np.nan
            columns[i] = whole
    return SheetColumns(
        columns, _remarks(sheet, cells.letters, left_out, beside, stop), left_out, beside, len(cells.letters)
    )


def _left_out(sheet: SheetRows, cells: SheetCells, stop: int) -> dict[int, tuple[str, str]]:
    """Why rows are not read, by their numbers; remarks between the rows are marked as such in the letters."""
    of_row: dict[int, list[tuple[int, str]]] = {}
    for position, column, text in cells.words:
        if column < len(sheet.layout.kinds):
            of_row.setdefault(position, []).append((column, text_of(text)))
    left_out: dict[int, tuple[str, str]] = {}
    for position, letter in enumerate(cells.letters):
        text_of_row = " ".join(text for _, text in of_row.get(position, ()))
        if letter == REMARKED:
            left_out[sheet.number(position)] = COMMENT, ""
        elif letter == SPACE or (letter == EMPTY and position >= stop):
            left_out[sheet.number(position)] = BLANK, ""
        elif position >= stop:
            left_out[sheet.number(position)] = BELOW, text_of_row
        elif letter == WORDS and (why := _why_words(sheet, of_row.get(position, []))):
            left_out[sheet.number(position)] = why, text_of_row
            cells.letters[position] = REMARK
    return left_out


def _why_words(sheet: SheetRows, words: Sequence[tuple[int, str]]) -> str:
    """Why a row without numbers is no bad sample: it has one remark alone, or the headings again; empty where it is one."""
    if len(words) == 1 and len(sheet.layout.kinds) > 1:
        return BETWEEN
    again = all(heading_of(text).name == sheet.layout.headings[column].name for column, text in words)
    return AGAIN if words and again else ""


def _remark_beside(sheet: SheetRows, row: int, cells: Sequence[str]) -> str:
    """The words behind the last column.

    Raises:
        DatasetError: Numbers stand there.
    """
    width = len(sheet.layout.kinds)
    behind = [cell.strip() for cell in cells[width:] if cell.strip()]
    if any(kind_of(cell, sheet.decimal) != "text" for cell in behind):
        too_many_cells(sheet.place, row, cells, width)
    return " ".join(behind)


def _data_end(letters: bytes) -> int:
    """Position of the row behind the data, by a letter for each row.

    Below the data stand statistics, words alone, a block in whose every row are words, or a few last rows after a blank.
    """
    filled = letters.rstrip(b" ,#")
    label = filled.find(SUMMARY, max(0, len(filled) - _MOST_SUMMARY_ROWS))
    data = (filled if label < 0 else filled[:label]).rstrip(b" ,#w")
    data = _BLOCK_OF_WORDS.sub(b"", data)
    last = _LAST_FEW.fullmatch(data)
    return last.end(1) if last and last.end(1) > 2 * len(last[2]) + 2 else len(data)


def _remarks(
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
        where = f"Row {top} was" if top == bottom else f"Rows {top} to {bottom} were"
        sentences.append(f"{where} left out: they stand below the data, as statistics do.")
    if sheet.of_text:
        return sentences  # the account of the file names the rest
    between = [f"row {row} ({shown(text)})" for row, (why, text) in left_out.items() if why in (BETWEEN, AGAIN)]
    sentences += [f"Left out because no numbers stand there: {few(between)}."] if between else []
    texts = [f"{shown(text)} in row {row}" for row, text in beside]
    return sentences + ([f"Remarks beside the columns were left out: {few(texts)}."] if texts else [])
