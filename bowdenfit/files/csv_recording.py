"""Recordings in CSV files and their relatives, a million rows and more.

The first lines tell encoding, separator, decimal mark and headings (`read_start`). Then pandas reads all rows but the last
few, which are read cell by cell, because statistics and remarks may stand below the data and the file may break off there.
"""

import csv
import io
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files import serial_log
from bowdenfit.files.cells import MISSING, Cell, Decimals, remark_on_thousands
from bowdenfit.files.channels import (
    ChannelFile,
    UnreadNames,
    load_library,
    make_channel_file,
    refuse_larger,
    refuse_too_large,
)
from bowdenfit.files.clocks import assign_rate_times
from bowdenfit.files.headings import Heading, heading_of
from bowdenfit.files.layout import Layout, find_layout
from bowdenfit.files.pieces import never_falls
from bowdenfit.files.row_account import ABOVE, BLANK, RowAccount, make_account
from bowdenfit.files.sheet_columns import (
    SheetColumns,
    SheetRows,
    make_channels,
    read_arrays,
)
from bowdenfit.files.sheet_rows import is_summary, refuse_other_separator
from bowdenfit.files.sheet_text import choose_decimal, explain_lines, find_headings_in_comments, split_rows
from bowdenfit.files.text_file import (
    CsvRecord,
    Line,
    Section,
    check_encoding,
    comment_mark,
    count_rows_before,
    first_bytes,
    first_lines,
    is_blank,
    last_lines,
    lines_between,
    refuse_long_row,
    remark_on_nul_tail,
    split_cells,
    text_size,
)
from bowdenfit.files.units_in_cells import find_units_in_cells, take_units_from_cells, take_units_off
from bowdenfit.units import is_unit
from bowdenfit.words import shown

LARGEST_BYTES = 2 << 30  # judged: some 80 million rows of a time and two forces, a day at 1 kHz
_FIRST_BYTES = 1 << 18  # judged: far more than the lines over the data and `_FIRST_LINES` rows have
_LAST_BYTES = 1 << 16
_LAST_ROWS = 200  # judged: with all that may stand below the data
_FEW_BYTES = 1 << 16  # of data; cell by cell they take 0.03 s, and pandas 0.2 s to load
_ROWS_AT_ONCE = 200_000  # some 10 MB of numbers a chunk, little beside what is kept
_MANY_ROWS = 1 << 22  # from which memory counts: see `read`
_MARKS = sorted({form for mark in MISSING for form in (mark, mark.upper(), mark.capitalize(), mark.title())})
_LABVIEW_UNITS = "Y_Unit_Label"  # whose cells stand over the columns of the data
_CUT = "the file breaks off there"
_COMMENTS = "#%"
_FIRST_LINES = 300  # judged: in which headings and the first data must stand
_HEADING_LINES = 12  # judged: lines over which a quoted heading may run


@dataclass(frozen=True)
class Sheet:
    """What the first lines of a file tell about all of it.

    Args:
        encoding: Name of the encoding.
        separator: Separator of columns; a blank for any run of blanks and tabs.
        start: Where the data start [bytes].
        layout: Headings and kinds of the columns.
        metadata: The lines above the data.
        above: Why the other rows above the data are not read, and what they say, by their numbers.
        units: The unit behind each number of a column, by its position; and of a column of units, which holds nothing else.
        thousands: Columns of which the first rows may hold thousands, and their first number.
    """

    encoding: str
    separator: str
    start: int
    layout: Layout
    metadata: tuple[str, ...]
    above: dict[int, tuple[str, str]]
    units: dict[int, str] = field(default_factory=dict)
    thousands: Sequence[tuple[int, str]] = ()


def read(path: Path) -> ChannelFile:
    """Read the columns of a text file.

    Understands comma, semicolon, tab, bar and blanks between columns; decimal point and comma; UTF-8, UTF-16 and
    Windows encodings; comments (#, %); lines before the headings, a line of units below them, rows of statistics below
    the data; a pair of columns for each run; dates as time; a file that breaks off in its last line; separators of
    thousands that cannot be decimal marks.

    Limits: files of up to 2 GiB (`LARGEST_BYTES`), and of 2 GiB of numbers. They are read in pieces; the memory needed is that
    of the numbers and of one column more. Of more rows than `_MANY_ROWS`, columns that are no clock are kept with 24 bits, as
    many as the finest converters have and seven digits need: an error of 6e-8 of each number, and 0.9 GiB for a file of
    1 GB with four columns.

    Args:
        path: The file.

    Raises:
        DatasetError: The file is missing, empty, too large, no text, has no rows of numbers, or a cell among numbers is
            text.
    """
    if serial_log.is_serial_log(path):
        return serial_log.read(path)
    data = first_bytes(path, _FIRST_BYTES)
    refuse_larger(path, LARGEST_BYTES, "convert it to Parquet with the needed columns only, or cut it into runs")
    sheet = read_start(path, data)
    check_encoding(path)
    last = last_lines(path, sheet.encoding, sheet.start, _LAST_BYTES)[-_LAST_ROWS:]
    cut = _is_cut(last[-51:], sheet.separator)
    stop = last[-1].start if cut else text_size(path)
    if stop <= sheet.start:
        raise DatasetError(f"{path.name} breaks off before its first whole row of numbers; copy or export it again.")
    split = last[0].start if last else stop
    plain = _read_plain(path, sheet, split) if split - sheet.start > _FEW_BYTES else None
    quick = (sheet.start, 0) if not plain else (split, sum(map(len, next(iter(plain.values())))))
    columns = read_arrays(_rows(path, sheet, sheet.start if plain is None else split, stop, plain))
    channels, left_out = make_channels(sheet.layout, columns)
    timed, clock = assign_rate_times(channels, sheet.metadata)
    row = count_rows_before(path, stop) + 1 if cut else 0
    broken = [f"The file breaks off in row {row}; that row was left out."] if cut else []
    thousands = _remark_on_thousands(path.name, sheet, columns)
    remarks = (*thousands, *left_out, *broken, *remark_on_nul_tail(path), *columns.remarks, *clock)
    whole = make_channel_file(path, "CSV", timed, UnreadNames(), remarks)
    return replace(whole, account=_account_rows(path, sheet, columns, quick, stop))


def _remark_on_thousands(file: str, sheet: Sheet, columns: SheetColumns) -> tuple[str, ...]:
    """Return the remark on columns that may hold thousands; one with a number below 1 holds decimals."""
    may_be = [(i, text) for i, text in sheet.thousands if (v := columns.values[i]) is not None and not np.any(np.abs(v) < 1)]
    return remark_on_thousands(file, [sheet.layout.name(i) for i in range(len(columns.values))], may_be)


def _read_plain(path: Path, sheet: Sheet, stop: int) -> dict[int, list[np.ndarray]] | None:
    """Return the pieces of each column up to a byte as pandas reads them, dates as text; None if it cannot read a cell."""
    pandas = load_library("pandas", "CSV")
    kinds = sheet.layout.kinds
    used = [i for i, kind in enumerate(kinds) if kind != "text"]
    rows = count_rows_before(path, stop) - count_rows_before(path, sheet.start) + 1  # at most
    refuse_too_large(path, rows * len(used))
    filled, whole = 0, dict[int, np.ndarray]()
    dates: dict[int, list[np.ndarray]] = {i: [] for i in used if kinds[i] == "date"}
    with io.BufferedReader(Section(path, sheet.start, stop), 1 << 20) as stream, warnings.catch_warnings():
        # A warning means that a row has more cells than the headings, or that a column holds different kinds.
        warnings.simplefilter("error")
        try:
            chunks = pandas.read_csv(
                stream,
                sep=sheet.separator if sheet.separator != " " else r"\s+",
                decimal=sheet.layout.decimal,
                header=None,
                names=list(range(len(kinds))),
                dtype={i: str if kind in ("date", "text") else float for i, kind in enumerate(kinds)},
                index_col=False,
                na_values=_MARKS,
                keep_default_na=False,
                skipinitialspace=True,
                encoding=sheet.encoding,
                encoding_errors="replace",
                **_round_trip_option(pandas.__version__),
                engine="c",
                chunksize=_ROWS_AT_ONCE,
            )
            for chunk in chunks:
                if any(kinds[i] != "text" or (chunk[i] != unit).any() for i, unit in sheet.units.items()):
                    return None  # row by row, which takes units off, or names the row
                if not filled:  # joining pieces would need twice the memory
                    whole = {i: np.empty(rows, _choose_precision(chunk[i], rows)) for i in used if kinds[i] != "date"}
                for i, values in whole.items():
                    values[filled : filled + len(chunk)] = chunk[i]
                for i, pieces in dates.items():
                    pieces.append(chunk[i].fillna("").to_numpy(copy=True))
                filled += len(chunk)
        except (ValueError, Warning, csv.Error):
            return None
    return {i: [values[:filled]] for i, values in whole.items()} | dates


def _choose_precision(first: Any, rows: int) -> type[np.floating]:
    """Return how precisely a column is kept, by its first numbers: a clock always with all digits."""
    return np.float64 if rows <= _MANY_ROWS or never_falls(first.to_numpy()) else np.float32


def _round_trip_option(version: str) -> dict[str, Any]:
    """Return the option that makes pandas read numbers to the last bit; from 3.1 on it does so by itself."""
    major, minor = version.split(".")[:2]
    return {"float_precision": "round_trip"} if (int(major), int(minor)) < (3, 1) else {}


def _rows(path: Path, sheet: Sheet, start: int, stop: int, before: dict[int, list[np.ndarray]] | None) -> SheetRows:
    """Yield the rows of a section of the file [bytes], to be read cell by cell behind what has been read before."""
    spaces = "\r\n " if sheet.separator == "\t" else "\r\n\t "

    def cells() -> Iterator[Sequence[str] | None]:
        for text in lines_between(path, sheet.encoding, start, stop):
            filled = [""] if is_blank(text) else split_cells(text, sheet.separator)
            filled = take_units_off(filled, sheet.units) if sheet.units else filled
            yield None if comment_mark(text) else filled if text.strip(spaces) else []

    first = count_rows_before(path, start) + 1
    return SheetRows(path.name, sheet.layout, _check_units(path.name, sheet, cells(), first), first, True, before)


def _check_units(
    file: str, sheet: Sheet, rows: Iterator[Sequence[str] | None], first: int
) -> Iterator[Sequence[str] | None]:
    """Yield rows in which each column of units holds the one of the first rows.

    Raises:
        DatasetError: One holds another, whose numbers would be read in the wrong unit.
    """
    constant = {i: unit for i, unit in sheet.units.items() if sheet.layout.kinds[i] == "text"}
    for row, cells in enumerate(rows, start=first):
        for i, unit in constant.items() if cells else ():
            text = cells[i].strip() if cells and i < len(cells) else unit
            if text not in (unit, ""):
                raise DatasetError(
                    f"{file}, row {row}: the unit in the column {shown(sheet.layout.name(i))} is {shown(text)} there, and "
                    f"{shown(unit)} in the rows before. The usual cause is a meter that changes its range. Export the "
                    "recording with one unit, or convert these rows."
                )
        yield cells


def _is_cut(lines: Sequence[Line], separator: str) -> bool:
    """Return whether a file breaks off in the last of its lines: it has no end, and fewer cells or digits than those before."""
    *whole, last = [split_cells(line.text, separator) for line in lines if not is_blank(line.text)] or [[]]
    if not whole or lines[-1].ended or is_blank(lines[-1].text) or comment_mark(lines[-1].text) or is_summary(last):
        return False
    if len(last) < min(map(len, whole)):
        return True
    ends = [row[-1].strip() for row in whole if len(row) == len(last)]
    return bool(ends) and (len(last[-1].strip()) < min(map(len, ends)) or last[-1].strip()[-1:] in {*"eE+-"})


def read_start(path: Path, data: bytes) -> Sheet:
    """Return what the first bytes of a file tell.

    Raises:
        DatasetError: They are no text, or hold no numbers in columns.
    """
    encoding, lines = first_lines(data, path.name, whole=False, most=_FIRST_LINES)
    if len(lines) > 1 and not lines[-1].ended:
        lines = lines[:-1]
    separator, rows = split_rows(lines, path.name, _COMMENTS, _HEADING_LINES)
    units = find_units_in_cells(rows)
    rows = [replace(row, cells=take_units_off(row.cells, units)) for row in rows] if units else rows
    layout = find_layout(rows, choose_decimal(rows), path.name)
    if layout is None:
        raise DatasetError(
            f"{path.name} has no rows of numbers in columns; export the recording as CSV with one column for each signal."
        )
    first = layout.first
    above = [line for line in lines if line.start < first.start]
    below = [row for row in rows if row.start >= first.start]
    layout = _take_units_of_labview(_fit_layout(path, layout, below, separator, above), separator, above)
    texts = {line.row: (ABOVE, " ".join(line.text.split())) for line in above if line.row not in layout.over}
    reasons = explain_lines([line for line in above if line.row in texts], rows, texts, _COMMENTS)
    layout, units = take_units_from_cells(path.name, layout, rows, units)
    width = len(layout.kinds)
    thousands = _find_likely_thousands(path.name, layout, rows, separator)
    for line in above:
        if reasons.get(line.row, (BLANK, ""))[0] == ABOVE and len(split_cells(line.text, separator)) < width:
            refuse_other_separator(path.name, line.row, line.text.strip(), width, layout.numeric)
    return Sheet(encoding, separator, first.start, layout, tuple(line.text for line in above), reasons, units, thousands)


def _find_likely_thousands(file: str, layout: Layout, rows: Sequence[CsvRecord], separator: str) -> list[tuple[int, str]]:
    """Return columns whose numbers may be thousands by the first rows, as `Decimals.likely_thousands` does.

    Raises:
        DatasetError: Every number of a column has three digits behind a mark, and others show that the other mark is decimal.
    """
    body = [row for row in rows if row.row >= layout.first.row]
    columns = [[row.cells[i] for row in body if i < len(row.cells)] for i in range(len(layout.kinds))]
    decimals = Decimals.of((cell for column in columns for cell in column), separator != ",")
    for mark in ".,":
        for i, text in decimals.likely_thousands(columns, mark) if decimals.other(mark) else ():
            row = next(row.row for row in body if i < len(row.cells) and row.cells[i].strip() == text)
            Cell(file, row, layout.name(i), text, decimals).number()  # refuses what may be either
    return decimals.likely_thousands(columns)


def _fit_layout(path: Path, layout: Layout, below: Sequence[CsvRecord], separator: str, above: Sequence[Line]) -> Layout:
    """Return the layout with as many headings as columns; headings may stand in a comment.

    Raises:
        DatasetError: A row has more cells than there are headings.
    """
    if separator == " " and layout.named and layout.heading_cells != len(layout.kinds):
        return _take_headings_from_comment(layout, separator, above)
    for row in () if layout.fits else below:
        refuse_long_row(path.name, row.row, row.cells, layout.room)
    if not layout.named:
        return _take_headings_from_comment(layout, separator, above)
    return replace(layout, headings=layout.headings[: layout.room], kinds=layout.kinds[: layout.room])


def _take_headings_from_comment(layout: Layout, separator: str, above: Sequence[Line]) -> Layout:
    width = len(layout.kinds)
    if headings := find_headings_in_comments(above, width, separator):
        return replace(layout, named=True, headings=tuple(map(heading_of, headings.cells)))
    return replace(layout, named=False, headings=tuple(Heading(f"column{i + 1}") for i in range(width)))


def _take_units_of_labview(layout: Layout, separator: str, above: Sequence[Line]) -> Layout:
    """Return the layout with the units that the header of an LVM file has for columns whose headings have none."""
    rows = [split_cells(line.text, separator) for line in above if line.text.startswith(_LABVIEW_UNITS)]
    units = [cell.strip() for cell in rows[-1]] if rows else []
    headings = [
        replace(heading, unit=unit) if i and heading.name and not heading.unit and is_unit(unit) else heading
        for i, (heading, unit) in enumerate(zip(layout.headings, units, strict=False))
    ]
    return replace(layout, headings=(*headings, *layout.headings[len(headings) :]))


def _account_rows(path: Path, sheet: Sheet, columns: SheetColumns, quick: tuple[int, int], stop: int) -> RowAccount:
    """Return the account of a file.

    Args:
        path: The file.
        sheet: Layout found in its first lines.
        columns: Cells of its last rows, which were read one by one.
        quick: Where the rows end that were read at once [bytes], and how many these are.
        stop: Where the last whole row ends [bytes].
    """
    end, rows = quick
    size = text_size(path)
    first = count_rows_before(path, sheet.start) + 1
    reasons = {**sheet.above, **columns.left_out}
    if end > sheet.start and count_rows_before(path, end) - first + 1 != rows:
        texts = enumerate(lines_between(path, sheet.encoding, sheet.start, end), start=first)
        reasons |= {row: (BLANK, "") for row, text in texts if not text.strip()}
    total = count_rows_before(path, size) + (0 if _ends_with_newline(path, size) else 1)
    if stop < size:
        reasons |= dict.fromkeys(range(count_rows_before(path, stop) + 1, total + 1), (_CUT, ""))
    return make_account(path.name, total, sheet.layout.over, reasons, columns.beside)


def _ends_with_newline(path: Path, size: int) -> bool:
    """Return whether the last line has an end."""
    with path.open("rb") as file:
        file.seek(max(size - 2, 0))
        return file.read(2).rstrip(b"\0").endswith((b"\n", b"\r"))
