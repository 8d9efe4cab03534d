"""Tables of readings in CSV files and workbooks: headings, and rows of cells that know where they stood."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from bowdenfit.errors import DatasetError, Faults
from bowdenfit.files.cells import Cell, Decimals, is_plain_number, remark_on_thousands
from bowdenfit.files.formats import PLAIN_TEXT, UNKNOWN, WORKBOOKS, check_ending, recognize, refuse_sheet
from bowdenfit.files.headings import heading_of, repeated_heading
from bowdenfit.files.isolation import LIMITS, call_isolated
from bowdenfit.files.layout import header_position
from bowdenfit.files.measured_cells import is_measured, split_measured
from bowdenfit.files.pivot import unpivot
from bowdenfit.files.row_account import RowAccount, make_account
from bowdenfit.files.sheet_rows import is_words
from bowdenfit.files.sheet_text import explain_lines, find_headings_in_comments, split_rows
from bowdenfit.files.table_parts import TableParts, split_table
from bowdenfit.files.text_file import (
    CsvRecord,
    Line,
    check_encoding,
    first_bytes,
    first_lines,
    refuse_long_row,
    remark_on_nul_tail,
    short_row_error,
)
from bowdenfit.files.unit_columns import in_one_unit, join_unit_columns
from bowdenfit.inputs import refuse_special
from bowdenfit.words import shown

_FIRST_BYTES = 1 << 18  # judged: bytes that hold the first rows
_MOST_COLUMNS = 2000  # judged: tables of forces have some ten; each is compared with every spelling of a heading
_MOST_CELLS = 150_000  # measured: each takes some 60 us; ring-downs of 50 s at 1 kHz have as many
_LARGEST = 10e6  # bytes; some fifty times as many are needed to read them
_COMMENTS = "#"  # % may be a heading


@dataclass(frozen=True)
class RawTable:
    """Header and rows of one file, all cells as text.

    Args:
        file: Its name.
        header: Heading of each column.
        header_row: The row of the headings, of which the last stands over the units or the data.
        rows: Rows of readings.
        units: The unit that stands below each heading, or behind its numbers; empty without one.
        lines: Where the rows of the file went.
        errors: Errors after ± in the cells of a column, by its heading.
        remarks: How its layout was understood, in sentences.
        faults: Faults noticed while it is read.
    """

    file: str
    header: tuple[str, ...]
    header_row: int
    rows: tuple[tuple[Cell, ...], ...]
    units: tuple[str, ...]
    lines: RowAccount
    errors: Mapping[str, tuple[Cell, ...]] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    faults: Faults = field(default_factory=Faults, compare=False)

    @property
    def account(self) -> RowAccount:
        """Where the rows of the file went, for a reader that is through with it.

        Raises:
            DatasetError: All that is wrong with the file.
        """
        self.faults.refuse()
        return self.lines


def read_table(path: Path, most: int | None = None, sheet: str = "") -> RawTable:
    """Read one table from a CSV file or an Excel workbook.

    Args:
        path: The file.
        most: Number of its first rows that are enough; all if omitted.
        sheet: Title of the sheet of a workbook that is read; that with the table if empty.

    Raises:
        DatasetError: See `read_csv` and `read_workbook`.
    """
    refuse_special(path)
    if path.suffix.lower() not in WORKBOOKS:
        refuse_sheet(path, sheet)
        return read_csv(path, most)
    check_ending(path)
    table: RawTable = call_isolated(path, "bowdenfit.files.excel:read_workbook", most, sheet)
    return table


def list_sheets(path: Path) -> tuple[str, ...]:
    """Return the titles of the sheets of a workbook on which something stands; none for another file.

    Raises:
        DatasetError: It cannot be read.
    """
    refuse_special(path)
    if path.suffix.lower() not in WORKBOOKS:
        return ()
    check_ending(path)
    titles: tuple[str, ...] = call_isolated(path, "bowdenfit.files.excel:list_sheets")
    return titles


def read_csv(path: Path, most: int | None = None) -> RawTable:
    """Read one table.

    Understands comma, semicolon, tab, bar and blanks between columns; decimal comma; UTF-8, UTF-16 and Windows encodings;
    comment lines starting with #; Excel's `sep=;` line, trailing empty columns, blank lines and quoted cells; lines over the
    headings, a row of units below them, remarks between the rows and beside them, statistics and other text below.

    Args:
        path: The file.
        most: Number of its first rows that are enough; all if omitted.

    Raises:
        DatasetError: The file is missing, is no text, is empty, has no header or duplicate columns, or a row is longer
            than the header.
    """
    if most is None:
        _refuse_large(path)
    name, data = path.name, first_bytes(path, -1 if most is None else _FIRST_BYTES)
    if most is None:
        _refuse_many_lines(name, data)
    content = recognize(path, data[:4096])
    if content not in (UNKNOWN, PLAIN_TEXT):
        raise DatasetError(f"{name} is {content.what}, not a CSV file; save the table as CSV and name that file.")
    _, all_lines = first_lines(data, name, whole=most is None, most=most)
    check_encoding(path)
    if most is not None and len(all_lines) > 1 and not all_lines[-1].ended:
        all_lines = all_lines[:-1]
    separator, rows = split_rows(all_lines, name, _COMMENTS, len(all_lines))
    for row in rows:
        if not row.closed:
            raise DatasetError(
                f"{name}, row {row.row}: a quotation mark opens there that is never closed, or a cell is too long; close or "
                "delete it."
            )
    if all(row.blank for row in rows):
        raise DatasetError(f"{name} is empty; it needs one header row and the measurements below it.")
    table = make_table(name, all_lines, _take_headings_from_comments(all_lines, rows, separator), separator)
    return replace(table, remarks=(*table.remarks, *(f"{name}: {remark}" for remark in remark_on_nul_tail(path))))


def _take_headings_from_comments(lines: Sequence[Line], rows: list[CsvRecord], separator: str) -> list[CsvRecord]:
    """Return the rows below the comment that names their columns, where no row of words does."""
    filled = [row for row in rows if not row.blank]
    if header_position(filled) is not None:
        return rows
    above = [line for line in lines if line.row < filled[0].row]
    headings = find_headings_in_comments(above, len(filled[0].cells), separator)
    return [headings, *rows] if headings and is_words(headings) else rows


def _refuse_large(path: Path) -> None:
    """Refuse a file that is too large for a table of readings, before it fills the memory.

    Raises:
        DatasetError: The file is too large.
    """
    size, largest = path.stat().st_size if path.is_file() else 0, _LARGEST * LIMITS.get()
    if size > largest:
        raise DatasetError(
            f"{path.name} has {size / 1e6:.0f} MB, more than the {largest / 1e6:.0f} MB that a table may have; keep the "
            "rows that are readings, name a recording as one, or allow more with --reading-limit 4."
        )


def _refuse_many_lines(name: str, data: bytes) -> None:
    """Refuse a file of very many lines, before an object is made of each; most are blank, or there are too many cells too.

    Raises:
        DatasetError: There are too many.
    """
    lines, most = max(data.count(b"\n"), data.count(b"\r")), int(_MOST_CELLS * LIMITS.get())
    if lines > most:
        raise DatasetError(
            f"{name} has {lines:,} lines, and a table has at most {most:,}, blank ones and remarks too; keep the lines of "
            "readings, name a file that holds every sample of a logger as a recording, or allow more with --reading-limit 4."
        )


def _refuse_many_cells(name: str, rows: Sequence[CsvRecord]) -> None:
    """Refuse a table that would take minutes to read; rows without any text do not count.

    Raises:
        DatasetError: It has too many cells.
    """
    cells, most = sum(len(row.cells) for row in rows if not row.blank), int(_MOST_CELLS * LIMITS.get())
    if cells > most:
        raise DatasetError(
            f"{name} has {len(rows):,} rows with {cells:,} cells, and a table has at most {most:,} cells; the usual cause is "
            "that it holds every sample of a logger: name it as a recording, keep one row for each reading, or allow more "
            "with --reading-limit 4."
        )


def make_table(name: str, lines: Sequence[Line], rows: Sequence[CsvRecord], separator: str) -> RawTable:
    """Return the table that the rows of a file make.

    Args:
        name: Name of the file.
        lines: All its lines.
        rows: The cells of those that are no comments.
        separator: Separator of columns.

    Raises:
        DatasetError: See `read_csv`.
    """
    width = max((len(row.cells) for row in rows), default=0)
    if width > _MOST_COLUMNS:
        raise DatasetError(
            f"{name} has rows of {width:,} cells, and a table has at most {_MOST_COLUMNS:,} columns; the usual cause is a "
            "table that was exported on its side, or without line ends: keep the columns of forces, angles, strokes and runs."
        )
    _refuse_many_cells(name, rows)
    parts, with_units = join_unit_columns(split_table(rows, name))
    header = _header(parts, name)
    if not parts.body:
        raise DatasetError(
            f"{name} has a header row but no measurements; add the rows, or remove the table from cable.toml."
        )
    decimals = Decimals.of((_number_in(cell) for row in parts.body for cell in row.cells), separator != ",")
    in_column = decimals.of_columns([[_number_in(cell) for cell in _column(parts.body, i)] for i in range(len(header))])
    wrong_width = Faults()
    nothing = tuple[Cell, ...]()
    fewest = _fewest_cells(parts.body, len(header))
    cells = tuple(wrong_width.read_all(lambda row: _cells(name, header, row, in_column, fewest), parts.body, nothing))
    wrong_width.refuse()
    cells = _in_one_unit(header, cells, with_units)
    below = (*parts.headings.units, *[""] * len(header))[: len(header)]
    units = tuple(
        _unit_of(heading, unit, header, [row[i] for row in cells])
        for i, (heading, unit) in enumerate(zip(header, below, strict=True))
    )
    account = _account(name, lines, rows, parts, len(header))
    remarks = tuple(f"{name}: the column behind {shown(heading)} says the unit of each row." for heading in with_units)
    thousands = decimals.likely_thousands([_column(parts.body, i) for i in range(len(header))])
    remarks += remark_on_thousands(name, header, thousands)
    if long := unpivot(header, units, cells):
        header, units, cells, remarks = long.header, long.units, long.rows, (*remarks, f"{name}: {long.remark}")
    errors = _errors_in_cells(header, cells)
    return RawTable(name, header, parts.headings.rows[0].row, cells, units, account, errors, remarks)


def _in_one_unit(
    header: Sequence[str], rows: tuple[tuple[Cell, ...], ...], named: Sequence[str]
) -> tuple[tuple[Cell, ...], ...]:
    """Return rows in which the cells of the named columns are in one unit each."""
    if not named:
        return rows
    by_heading = zip(header, zip(*rows, strict=True), strict=True)
    columns = [in_one_unit(cells) if heading in named else cells for heading, cells in by_heading]
    return tuple(zip(*columns, strict=True))


def _header(parts: TableParts, file: str) -> tuple[str, ...]:
    """Return the headings, without the empty ones behind the last."""
    header, row = parts.headings.names, parts.headings.rows[0].row
    while not header[-1]:
        header = header[:-1]
    if all(is_plain_number(column) for column in header if column):
        raise DatasetError(
            f"{file}, row {row}: this is the header row, but it holds numbers only ({shown(header[0])}, ...); write the "
            "names of the columns, with their units, above them."
        )
    seen: dict[str, int] = {}
    for position, column in enumerate(header, start=1):
        if column and column.lower() in seen:
            raise DatasetError(
                f"{file}, row {row}: the column {shown(column)} appears twice (columns {seen[column.lower()]} and "
                f"{position}); rename or delete one of them."
            )
        seen[column.lower()] = position
    return header


def _column(rows: Sequence[CsvRecord], position: int) -> list[str]:
    """Return texts of one column, of the rows that reach it."""
    return [row.cells[position] for row in rows if position < len(row.cells)]


def _fewest_cells(rows: Sequence[CsvRecord], width: int) -> int:
    """Return the number of cells that a row must have: up to the last column in which any row has a number."""
    return max((i + 1 for row in rows for i, cell in enumerate(row.cells[:width]) if is_measured(cell)), default=0)


def _cells(
    file: str, header: tuple[str, ...], row: CsvRecord, decimals: Sequence[Decimals], fewest: int
) -> tuple[Cell, ...]:
    if any(map(is_measured, _behind(row, len(header)))):
        refuse_long_row(file, row.row, row.cells, len(header))
    if len(row.cells) < fewest:
        raise short_row_error(file, row.row, row.cells, header)
    padded = row.cells + [""] * (len(header) - len(row.cells))
    cells = []
    for i, (column, text) in enumerate(zip(header, padded, strict=False)):
        parts = split_measured(text)
        measured, unit = (parts.number, parts.unit) if parts else (None, "")
        cells.append(Cell(file, row.row, column or f"(column {i + 1}, without heading)", text, decimals[i], measured, unit))
    return tuple(cells)


def _number_in(text: str) -> str:
    """Return a cell without the unit and the error behind its number."""
    parts = split_measured(text)
    return parts.number if parts else text


def _unit_of(heading: str, below: str, header: Sequence[str], cells: Sequence[Cell]) -> str:
    """Return the unit of a column where its own heading has none: that below it, or of the heading that it repeats, or of the
    first of its cells that has one, if most hold numbers; else empty.
    """
    if heading_of(heading, below).unit:
        return below
    if unit := heading_of(repeated_heading(heading, header)).unit:
        return unit
    unit = next((cell.unit for cell in cells if cell.unit), "")
    numbers = sum(is_measured(cell.text) for cell in cells) if unit else 0
    return unit if 2 * numbers > sum(not cell.blank for cell in cells) else ""


def _errors_in_cells(header: Sequence[str], rows: Sequence[tuple[Cell, ...]]) -> dict[str, tuple[Cell, ...]]:
    """Return what stands behind ± in columns that have it, by their headings; empty cells where a row has none."""
    errors = dict[str, tuple[Cell, ...]]()
    for i, heading in enumerate(header):
        parts = [split_measured(row[i].text) for row in rows]
        if heading and any(part and part.error for part in parts):
            texts = [part.error if part else "" for part in parts]
            errors[heading] = tuple(replace(row[i], text=text, measured=None) for row, text in zip(rows, texts, strict=True))
    return errors


def _behind(row: CsvRecord, width: int) -> list[str]:
    """Return what stands in cells behind the last column."""
    return [cell.strip() for cell in row.cells[width:] if cell.strip()]


def _account(name: str, lines: Sequence[Line], rows: Sequence[CsvRecord], parts: TableParts, width: int) -> RowAccount:
    texts = {row.row: " ".join(filter(None, map(str.strip, row.cells))) for row in rows}
    left_out = {row: (reason, texts[row]) for row, reason in parts.left_out.items()}
    reasons = explain_lines(lines, rows, left_out, _COMMENTS)
    beside = [(row.row, " ".join(text)) for row in parts.body if (text := _behind(row, width))]
    return make_account(name, len(lines), [row.row for row in parts.headings.rows], reasons, (*parts.beside, *beside))
