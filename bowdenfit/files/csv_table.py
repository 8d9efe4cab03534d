"""Tables in CSV files: one row of headings, and rows of cells that still know where they stood."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import dropwhile, islice
from pathlib import Path

from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import Cell, Decimals, is_plain_number
from bowdenfit.files.contents import UNKNOWN, recognize
from bowdenfit.files.csv_rows import SEPARATORS, CsvRecord, declared_separator, records, too_many_cells
from bowdenfit.files.text_file import Line, comment_mark, first_bytes, first_lines, is_blank
from bowdenfit.words import shown

_FIRST_ROWS = 20


@dataclass(frozen=True)
class RawTable:
    """Header and rows of one file, all cells as text."""

    file: str
    header: tuple[str, ...]
    header_row: int
    rows: tuple[tuple[Cell, ...], ...]
    units: tuple[str, ...]


def read_csv(path: Path) -> RawTable:
    """Read one table.

    Understands comma, semicolon, tab and bar between columns; decimal comma; UTF-8, UTF-16 and Windows encodings; comment
    lines starting with #; Excel's `sep=;` line, trailing empty columns, blank lines and quoted cells.

    Args:
        path: The file.

    Raises:
        DatasetError: The file is missing, is no text, is empty, has no header or duplicate columns, or a row is longer
            than the header.
    """
    name, data = path.name, first_bytes(path)
    content = recognize(path, data[:1024])
    if content is not UNKNOWN:
        raise DatasetError(f"{name} is {content.what}, not a CSV file; save the table as CSV and name that file.")
    _, lines = first_lines(data, name, whole=True)
    declared, lines = declared_separator(lines, name)
    lines = list(
        dropwhile(lambda line: is_blank(line.text), (line for line in lines if comment_mark(line.text) != "#"))
    )  # % may be a heading
    separator = declared or max(SEPARATORS[:-1], key=lambda each: _fitness(lines, each))
    rows = [row for row in records(lines, separator, len(lines)) if not row.blank]
    for row in rows:
        if not row.closed:
            raise DatasetError(
                f"{name}, row {row.row}: a quotation mark opens there that is never closed, or a cell is too long; close or "
                "delete it."
            )
    if not rows:
        raise DatasetError(f"{name} is empty; it needs one header row and the measurements below it.")
    header = _header(rows[0], name)
    if len(rows) == 1:
        raise DatasetError(
            f"{name} has a header row but no measurements; add the rows, or remove the table from cable.toml."
        )
    decimals = Decimals.of((cell for row in rows[1:] for cell in row.cells), separator != ",")
    return RawTable(name, header, rows[0].row, tuple(_cells(name, header, row, decimals) for row in rows[1:]),
        ("",) * len(header))


def _fitness(lines: Sequence[Line], separator: str) -> tuple[bool, int]:
    """How well a separator splits the first rows: into equally many cells, and into most."""
    rows = list(islice((row for row in records(lines, separator, len(lines)) if not row.blank), _FIRST_ROWS))
    widths = [len(row.cells) for row in rows] or [0]
    return widths[0] > 1 and len(set(widths)) == 1 and all(row.closed for row in rows), widths[0]


def _header(row: CsvRecord, file: str) -> tuple[str, ...]:
    """The headings, without the empty ones behind the last."""
    header = tuple(" ".join(cell.split()) for cell in row.cells)
    while not header[-1]:
        header = header[:-1]
    if all(is_plain_number(column) for column in header if column):
        raise DatasetError(
            f"{file}, row {row.row}: this is the header row, but it holds numbers only ({shown(header[0])}, ...); write the "
            "names of the columns, with their units, above them."
        )
    seen: dict[str, int] = {}
    for position, column in enumerate(header, start=1):
        if column and column.lower() in seen:
            raise DatasetError(
                f"{file}, row {row.row}: the column {shown(column)} appears twice (columns {seen[column.lower()]} and "
                f"{position}); rename or delete one of them."
            )
        seen[column.lower()] = position
    return header


def _cells(file: str, header: tuple[str, ...], row: CsvRecord, decimals: Decimals) -> tuple[Cell, ...]:
    too_many_cells(file, row.row, row.cells, len(header))
    padded = row.cells + [""] * (len(header) - len(row.cells))
    return tuple(
        Cell(file, row.row, column or f"(column {i + 1}, without heading)", text, decimals)
        for i, (column, text) in enumerate(zip(header, padded, strict=False))
    )
