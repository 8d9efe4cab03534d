"""Recordings in CSV files and their relatives, a million rows and more."""

import csv
import io
import warnings
from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import ChannelFile
from bowdenfit.files.clocks import seconds_of_dates
from bowdenfit.files.csv_ends import data_end
from bowdenfit.files.csv_start import Sheet, cells_of, start_of
from bowdenfit.files.layout import MISSING, number_of
from bowdenfit.files.libraries import load
from bowdenfit.files.sheets import channels_of, with_rate
from bowdenfit.files.text_file import Section, beginning, is_comment, rows_before
from bowdenfit.types import Vector
from bowdenfit.words import shown

LARGEST_BYTES = 2 << 30
_FIRST_BYTES = 1 << 18
_ROWS_AT_ONCE = 200_000
_MARKS = sorted({form for mark in MISSING for form in (mark, mark.upper(), mark.capitalize(), mark.title())})
_Columns = list[Vector | None]


def read(path: Path) -> ChannelFile:
    """Read the columns of a text file.

    Understands comma, semicolon, tab, bar and blanks between columns; decimal point and comma; UTF-8, UTF-16 and
    Windows encodings; comments (#, %); lines before the headings, a line of units below them, rows of statistics below
    the data; a pair of columns for each run; dates as time; a file that breaks off in its last line. It does not
    understand separators of thousands.

    Limits: files of up to 2 GiB (`LARGEST_BYTES`). They are read in pieces; the memory needed is about twice that of
    the numbers, 8 bytes a cell.

    Args:
        path: The file.

    Raises:
        DatasetError: The file is missing, empty, too large, no text, has no rows of numbers, or a cell among numbers is
            text.
    """
    data, size = beginning(path, _FIRST_BYTES)
    _check_size(path, size)
    sheet = start_of(path, data)
    end = data_end(path, sheet, size)
    if end.stop <= sheet.start:
        raise DatasetError(f"{path.name} breaks off before its first whole row of numbers; copy or export it again.")
    columns = _fast(path, sheet, end.stop)
    remarks = list(end.remarks)
    if columns is None:
        columns, comments = _careful(path, sheet, end.stop)
        remarks += comments
    channels, left_out = channels_of(sheet.layout, columns)
    if not channels:
        raise DatasetError(f"{path.name} has no column of numbers; check that it is the file of the recording.")
    timed, clock = with_rate(channels, sheet.metadata)
    return ChannelFile(path, "CSV", timed, (*sheet.remarks, *left_out, *remarks, *clock))


def _check_size(path: Path, size: int) -> None:
    if size == 0:
        raise DatasetError(f"{path.name} is empty; export the recording again.")
    if size > LARGEST_BYTES:
        raise DatasetError(
            f"{path.name} has {size / (1 << 30):.1f} GiB, more than the {LARGEST_BYTES / (1 << 30):g} GiB that can be read; "
            "convert it to Parquet with the needed columns only, or cut it into runs."
        )


def _fast(path: Path, sheet: Sheet, stop: int) -> _Columns | None:
    """Columns as pandas reads them; None where it meets a cell that it cannot."""
    pandas = load("pandas", "CSV")
    kinds = sheet.layout.kinds
    used = [i for i, kind in enumerate(kinds) if kind != "text"]
    pieces: dict[int, list] = {i: [] for i in used}
    with io.BufferedReader(Section(path, sheet.start, stop), 1 << 20) as stream, warnings.catch_warnings():
        # A warning means that a row has more cells than the headings, or that a column holds different kinds.
        warnings.simplefilter("error")
        try:
            chunks = pandas.read_csv(
                stream,
                sep=sheet.separator if sheet.separator != " " else r"\s+",
                decimal=sheet.decimal,
                header=None,
                names=list(range(len(kinds))),
                dtype={i: str if kind in ("date", "text") else float for i, kind in enumerate(kinds)},
                index_col=False,
                na_values=_MARKS,
                keep_default_na=False,
                skipinitialspace=True,
                encoding=sheet.encoding,
                encoding_errors="replace",
                **_exactly(pandas.__version__),
                engine="c",
                chunksize=_ROWS_AT_ONCE,
            )
            for chunk in chunks:
                for i in used:
                    values = chunk[i].fillna("") if kinds[i] == "date" else chunk[i]
                    pieces[i].append(values.to_numpy(copy=True))
        except (ValueError, Warning, csv.Error):
            return None
    columns: _Columns = [None] * len(kinds)
    for i in used:
        joined = np.concatenate(pieces.pop(i)) if pieces[i] else np.empty(0)
        columns[i] = seconds_of_dates(joined, _place(path, sheet, i)) if kinds[i] == "date" else _finite(joined)
    return columns


def _exactly(version: str) -> dict[str, Any]:
    """The option that makes pandas read numbers to the last bit; from 3.1 on it does so by itself."""
    major, minor = version.split(".")[:2]
    return {"float_precision": "round_trip"} if (int(major), int(minor)) < (3, 1) else {}


def _careful(path: Path, sheet: Sheet, stop: int) -> tuple[_Columns, list[str]]:
    """Columns read cell by cell, which finds the cell that is no number, and remarks on comments between them.

    Raises:
        DatasetError: Text stands in a column of numbers, or a row has too many cells.
    """
    kinds = sheet.layout.kinds
    numbers = {i: array("d") for i, kind in enumerate(kinds) if kind in ("number", "blank")}
    dates: dict[int, list[str]] = {i: [] for i, kind in enumerate(kinds) if kind == "date"}
    comments = 0
    first = rows_before(path, sheet.start) + 1
    for row, line in _lines(path, sheet, stop, first):
        if is_comment(line):
            comments += 1
            continue
        cells = cells_of(line, sheet.separator)
        if not line.strip():
            continue
        _check_width(path, sheet, row, cells)
        for i, column in numbers.items():
            column.append(_number(path, sheet, row, i, cells[i] if i < len(cells) else ""))
        for i, texts in dates.items():
            texts.append(cells[i] if i < len(cells) else "")
    columns: _Columns = [None] * len(kinds)
    for i, column in numbers.items():
        columns[i] = _finite(np.array(column, dtype=float))
    for i, texts in dates.items():
        columns[i] = seconds_of_dates(texts, _place(path, sheet, i))
    return columns, [f"{comments} comment lines between the rows of data were left out."] if comments else []


def _lines(path: Path, sheet: Sheet, stop: int, first: int) -> Iterator[tuple[int, str]]:
    with io.BufferedReader(Section(path, sheet.start, stop), 1 << 20) as stream:
        text = io.TextIOWrapper(stream, encoding=sheet.encoding, errors="replace")
        yield from enumerate(text, start=first)


def _number(path: Path, sheet: Sheet, row: int, column: int, cell: str) -> float:
    value = number_of(cell, sheet.decimal)
    if value is not None:
        return value
    other = "," if sheet.decimal == "." else "."
    mixed = number_of(cell, other) is not None
    raise DatasetError(
        f"{path.name}, row {row}, column {shown(_name(sheet, column))}: {shown(cell)} is not a number"
        + (f" like the others, which have a decimal {'comma' if other == '.' else 'point'}" if mixed else "")
        + "; correct the cell, or leave it blank if the sample is missing."
    )


def _check_width(path: Path, sheet: Sheet, row: int, cells: Sequence[str]) -> None:
    extra = [cell for cell in cells[len(sheet.layout.kinds) :] if cell.strip()]
    if extra:
        raise DatasetError(
            f"{path.name}, row {row}: {len(cells)} cells where the rows above have {len(sheet.layout.kinds)} (the first too "
            f"many is {shown(extra[0])}); the usual cause is a decimal comma in a file separated by commas, or a row that "
            "was written twice: correct or delete the row."
        )


def _finite(values: np.ndarray) -> Vector:
    """Numbers with NaN for those too large to be any."""
    values[~np.isfinite(values)] = np.nan
    return values


def _place(path: Path, sheet: Sheet, column: int) -> str:
    return f"{path.name}, column {shown(_name(sheet, column))}"


def _name(sheet: Sheet, column: int) -> str:
    return sheet.layout.headings[column].name or f"column{column + 1}"
