"""CSV files as laboratories write them, read into cells that still know where they stood."""

import csv
import io
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from bowdenfit.errors import DatasetError

_UNDETECTED = re.compile(r"^\s*(?:<|≤|<=|&lt;)\s*(?P<limit>.*)$")
_AMBIGUOUS = re.compile(r"^[+-]?[1-9]\d{0,2},\d{3}$")
_MISSING = {"", "-", "--", "n/a", "na", "n.d.", "nd", "none", "null"}
_NOT_FINITE = {
    "nan",
    "inf",
    "+inf",
    "-inf",
    "infinity",
    "-infinity",
    "#n/a",
    "#div/0!",
    "#value!",
    "#num!",
    "#ref!",
    "1.#inf",
    "1.#qnan",
    "-nan",
}


@dataclass(frozen=True)
class Cell:
    """One cell with its place, for errors that can be found again in the file."""

    file: str
    row: int
    column: str
    text: str
    decimal_comma: bool  # whether the file writes decimal commas, as those separated by semicolons or tabs do

    def refuse(self, what: str) -> DatasetError:
        """An error that names this cell."""
        return DatasetError(f"{self.file}, row {self.row}, column {self.column!r}: {what}")

    @property
    def blank(self) -> bool:
        """Whether nothing was written here (or one of the usual marks for nothing)."""
        return self.text.strip().lower() in _MISSING

    def number(self) -> float:
        """The number in this cell.

        Raises:
            DatasetError: The cell is blank, is text, or is not finite.
        """
        if self.blank:
            raise self.refuse("the cell is blank; fill in the value or delete the row.")
        return self._parse(self.text)

    def percentage(self) -> float | None:
        """The number where the cell itself carries a percent sign ("78.5 %"), else None."""
        text = self.text.strip()
        return self._parse(text[:-1]) / 100 if text.endswith("%") else None

    def limit(self) -> float | None:
        """The number behind a less-than sign ("<10"), else None."""
        match = _UNDETECTED.match(self.text)
        return self._parse(match["limit"]) if match else None

    def _parse(self, text: str) -> float:
        clean = re.sub(r"[\s\u00a0\u202f'’]", "", text).replace("\u2212", "-")
        if clean.lower() in _NOT_FINITE:
            raise self.refuse(f"{self.text.strip()!r} is not a finite number; correct the value or delete the row.")
        if not self.decimal_comma and _AMBIGUOUS.match(clean):
            raise self.refuse(
                f"{self.text.strip()!r} may mean {clean.replace(',', '')} or {clean.replace(',', '.')}; "
                "write it without a thousands separator and with a decimal point."
            )
        try:
            value = float(_with_decimal_point(clean))
        except ValueError:
            raise self.refuse(
                f"{self.text.strip()!r} is not a number; write a plain number there "
                "(remarks go into a comment line that starts with #)."
            ) from None
        if not math.isfinite(value):
            raise self.refuse(f"{self.text.strip()!r} is too large for a number; correct the value.")
        return value


def _with_decimal_point(text: str) -> str:
    """The number in Python's spelling: the last of two kinds of separator is the decimal one, and so is a lone comma."""
    if "," in text and "." in text:
        thousands, decimal = (".", ",") if text.rfind(",") > text.rfind(".") else (",", ".")
        return text.replace(thousands, "").replace(decimal, ".")
    return text.replace(",", "" if text.count(",") > 1 else ".")


@dataclass(frozen=True)
class RawTable:
    """Header and rows of one file, all cells as text."""

    file: str
    header: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


def read_csv(path: Path, file: str | None = None) -> RawTable:
    """Read one table.

    Understands comma, semicolon and tab; decimal comma; byte-order marks (UTF-8 and UTF-16) and Windows encodings;
    comment lines starting with #; Excel's `sep=;` line, trailing empty columns, blank lines and quoted cells.

    Args:
        path: The file.
        file: Name for error messages, the file's own name if omitted.

    Raises:
        DatasetError: The file is missing, is no text, is empty, has duplicate columns, or a row is longer than the header.
    """
    name = file or path.name
    lines = _text_lines(path, name)
    delimiter, lines = _delimiter(lines)
    records = [(number, cells) for number, cells in _records(lines, delimiter) if any(c.strip() for c in cells)]
    if not records:
        raise DatasetError(f"{name} is empty; it needs one header row and the measurements below it.")
    header = tuple(" ".join(cell.split()) for cell in records[0][1])
    while header and not header[-1]:
        header = header[:-1]
    _refuse_duplicates(header, name)
    if len(records) == 1:
        raise DatasetError(
            f"{name} has a header row but no measurements; add the rows, or remove the table from cable.toml."
        )
    comma = delimiter != ","
    rows = tuple(_row(name, header, number, cells, comma) for number, cells in records[1:])
    return RawTable(name, header, rows)


def _row(file: str, header: tuple[str, ...], number: int, cells: list[str], decimal_comma: bool) -> tuple[Cell, ...]:
    extra = [cell for cell in cells[len(header) :] if cell.strip()]
    if extra:
        raise DatasetError(
            f"{file}, row {number}: {len(cells)} cells under {len(header)} column headings (the first too many is "
            f"{extra[0].strip()!r}); the usual cause is a decimal comma in a comma-separated file: separate the "
            "columns with semicolons, or write decimal points."
        )
    padded = cells + [""] * (len(header) - len(cells))
    return tuple(
        Cell(file, number, column or f"(column {i + 1}, without heading)", text, decimal_comma)
        for i, (column, text) in enumerate(zip(header, padded, strict=False))
    )


def _refuse_duplicates(header: tuple[str, ...], file: str) -> None:
    seen: dict[str, int] = {}
    for position, column in enumerate(header, start=1):
        if column and column.lower() in seen:
            raise DatasetError(
                f"{file}, row 1: the column {column!r} appears twice (columns {seen[column.lower()]} and {position}); "
                "rename or delete one of them."
            )
        seen[column.lower()] = position


def _text_lines(path: Path, name: str) -> list[tuple[int, str]]:
    """Numbered lines without comments."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise DatasetError(
            f"{name} does not exist in {path.parent or '.'}; check the file name in cable.toml, or put the file there."
        ) from None
    except OSError as error:
        raise DatasetError(f"{name} cannot be read ({error.strerror}); check that it is a file you may open.") from None
    text = _decoded(data, name)
    numbered = enumerate(text.splitlines(), start=1)
    return [(i, line) for i, line in numbered if not line.lstrip().lstrip('"').startswith("#") or _is_excel_error(line)]


def _is_excel_error(line: str) -> bool:
    """A data row may begin with Excel's #N/A, which is no comment."""
    return any(line.lstrip().lstrip('"').lower().startswith(mark) for mark in _NOT_FINITE if mark.startswith("#"))


def _decoded(data: bytes, name: str) -> str:
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16")
    if data[:2] == b"PK" or data[:4] == b"\xd0\xcf\x11\xe0":
        raise DatasetError(f"{name} is an Excel workbook, not a CSV file; save the sheet as CSV and name that file.")
    if b"\x00" in data[:4096]:
        raise DatasetError(f"{name} is not a text file; export the measurements as CSV.")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def _delimiter(lines: list[tuple[int, str]]) -> tuple[str, list[tuple[int, str]]]:
    """The column separator: as Excel's `sep=` line says, else the one that splits the header into most cells."""
    lines = [(number, line) for number, line in lines if line.strip(' \t;,"')]
    if not lines:
        return ",", []
    first = lines[0][1].strip().strip('"').lower()
    if first.startswith("sep=") and len(first) <= 5:
        return (first[4:] or "\t"), lines[1:]
    counts = {d: len(next(csv.reader([lines[0][1]], delimiter=d))) for d in ("\t", ";", ",")}
    return max(counts, key=lambda d: counts[d]), lines


def _records(lines: list[tuple[int, str]], delimiter: str) -> Iterable[tuple[int, list[str]]]:
    """Cells of each record with the line where it starts; a quoted cell may run over several lines."""
    reader = csv.reader(io.StringIO("\n".join(line for _, line in lines)), delimiter=delimiter, skipinitialspace=True)
    start = 0
    for cells in reader:
        yield lines[start][0], cells
        start = reader.line_num
