"""The rows of a CSV file: the separator that its first line may declare, and the cells of each record."""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

from bowdenfit.errors import DatasetError
from bowdenfit.files.text_file import Line, comment_mark, is_blank
from bowdenfit.words import shown

SEPARATORS = ("\t", ";", ",", "|", " ")
"""What may stand between columns, the surer first; a blank is any run of blanks and tabs."""

_END = "\x00"  # stands in no text file, and so only in a row of its own unless a quote before it is open


@dataclass(frozen=True)
class CsvRecord:
    """The cells of one row.

    Args:
        row: Number of its first line in the file, from 1.
        start: Where it starts [bytes].
        cells: What stands in it.
        closed: Whether every quotation mark that opens in it is closed.
    """

    row: int
    start: int
    cells: list[str]
    closed: bool = True

    @property
    def blank(self) -> bool:
        """Whether nothing stands in it."""
        return not any(map(str.strip, self.cells))


def declared_separator(lines: list[Line], name: str) -> tuple[str | None, list[Line]]:
    """The separator that a first line `sep=;` declares, as Excel writes it, and the lines below it.

    Raises:
        DatasetError: It declares what separates nothing.
    """
    first = next((i for i, line in enumerate(lines) if not is_blank(line.text) and comment_mark(line.text) != "#"), 0)
    text = lines[first].text.strip().strip('"').lower() if lines else ""
    if not text.startswith("sep=") or len(text) > 5:
        return None, lines
    separator = text[4:] or "\t"
    if separator not in SEPARATORS:
        raise DatasetError(
            f"{name}, row {lines[first].row}: {shown(text)} names no column separator; use semicolon, comma or tab."
        )
    return separator, lines[first + 1 :]


def records(lines: Sequence[Line], separator: str, most: int) -> Iterator[CsvRecord]:
    """Each record of some lines; a quoted cell may run over up to `most` of them."""
    i = 0
    while i < len(lines):
        following = (lines[k].text.rstrip("\r\n") + "\n" for k in range(i, min(i + most, len(lines))))
        whole = _whole_record(following, separator)
        count, cells = whole or (1, cells_of(lines[i].text, separator))
        yield CsvRecord(lines[i].row, lines[i].start, cells, whole is not None)
        i += count


def cells_of(line: str, separator: str) -> list[str]:
    """Cells of one line."""
    if separator == " ":
        return [cell.strip('"') for cell in line.split()]
    try:
        return next(csv.reader([line.rstrip("\r\n")], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:  # a cell is too long
        return [line]


def _whole_record(lines: Iterator[str], separator: str) -> tuple[int, list[str]] | None:
    """How many lines the first record has, and its cells; None if a quotation mark stays open or a cell is too long."""
    if separator == " ":
        return 1, cells_of(next(lines), separator)
    reader = csv.reader(chain(lines, [_END]), delimiter=separator, skipinitialspace=True)
    try:
        cells = next(reader)
    except csv.Error:
        return None
    return None if cells and _END in cells[-1] else (reader.line_num, cells)


def too_many_cells(file: str, row: int, cells: Sequence[str], width: int) -> None:
    """Check that nothing stands beyond the columns that the headings, or the rows above, have.

    Raises:
        DatasetError: Something does.
    """
    extra = [cell for cell in cells[width:] if cell.strip()]
    if extra:
        error = DatasetError(
            f"{file}, row {row}: {len(cells)} cells where the headings or the rows above have {width} (the first too many "
            f"is {shown(extra[0])}); the usual cause is a decimal comma in a file separated by commas (separate the columns "
            "with semicolons, or write decimal points), or a row that was written twice."
        )
        error.fault_key, error.row = (file, "too many cells"), row
        raise error


def too_few_cells(file: str, row: int, cells: Sequence[str], header: Sequence[str]) -> DatasetError:
    """Return the refusal of a row that ends before a column in which other rows have numbers."""
    error = DatasetError(
        f"{file}, row {row}: {len(cells)} cell{'s' if len(cells) > 1 else ''} where the headings have {len(header)}: the "
        f"cell of {shown(header[len(cells)] or f'column {len(cells) + 1}')} is missing. The usual causes are a file that was "
        "cut off, and a value that was deleted together with its separator. Complete the row, delete it, or leave the cell "
        "blank behind a separator of its own if nothing was measured."
    )
    error.fault_key, error.row = (file, "too few cells"), row
    return error
