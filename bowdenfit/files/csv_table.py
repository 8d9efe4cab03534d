"""CSV files as laboratories write them, read into cells that still know where they stood."""

import csv
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from bowdenfit.errors import DatasetError
from bowdenfit.words import shown

_UNDETECTED = re.compile(r"(?:<=|<|≤|&lt;)(?P<limit>.*)", re.DOTALL)
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:(?P<mark>[.,])[0-9]*)?|(?P<first>[.,])[0-9]+)(?:[eE][+-]?[0-9]+)?")
_GROUPED = re.compile(
    r"[+-]?[1-9][0-9]{0,2}(?P<separator>[ '.,])[0-9]{3}(?:(?P=separator)[0-9]{3})*(?:(?P<mark>[.,])[0-9]+)?"
)
_AMBIGUOUS = re.compile(r"[+-]?[1-9][0-9]{0,2}[.,][0-9]{3}")
_SEPARATORS = ("\t", ";", ",")
_NUMBERED = list[tuple[int, str]]  # lines with their numbers
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
class Decimals:
    """How a file writes decimals.

    Args:
        comma: Whether a lone comma is a decimal one, as in files separated by semicolons or tabs.
        seen: The first number that can only be read with a decimal point, and with a decimal comma.
    """

    comma: bool
    seen: dict[str, str]

    def other(self, mark: str) -> str | None:
        """A number of the file that speaks against `mark` being decimal."""
        return self.seen.get("," if mark == "." else ".")


@dataclass(frozen=True)
class Cell:
    """One cell with its place, for errors that can be found again in the file."""

    file: str
    row: int
    column: str
    text: str
    decimals: Decimals

    def refuse(self, what: str) -> DatasetError:
        """An error that names this cell."""
        return DatasetError(f"{self.file}, row {self.row}, column {shown(self.column)}: {what}")

    @property
    def shown(self) -> str:
        """What stands in the cell, for an error message."""
        return shown(self.text)

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
        match = _UNDETECTED.fullmatch(self.text.strip())
        return self._parse(match["limit"]) if match else None

    def _parse(self, text: str) -> float:
        plain = _plain(text)
        if plain.lower() in _NOT_FINITE:
            raise self.refuse(f"{self.shown} is not a finite number; correct the value or delete the row.")
        if _AMBIGUOUS.fullmatch(plain):
            self._refuse_ambiguous(plain)
        written = _with_decimal_point(plain)
        if written is None:
            raise self.refuse(
                f"{self.shown} is not a number; write a plain number there "
                "(remarks go into a comment line that starts with #)."
            )
        if not math.isfinite(float(written)):
            raise self.refuse(f"{self.shown} is too large for a number; correct the value.")
        return float(written)

    def _refuse_ambiguous(self, text: str) -> None:
        """Three digits behind a separator are decimals only where the file leaves no doubt."""
        mark = "," if "," in text else "."
        meanings = f"{self.shown} may mean {text.replace(mark, '')} or {text.replace(mark, '.')}"
        if mark == "," and not self.decimals.comma:
            raise self.refuse(f"{meanings}; write it without a thousands separator and with a decimal point.")
        if against := self.decimals.other(mark):
            raise self.refuse(
                f"{meanings}, because elsewhere the file has {shown(against)}; write all its decimals the same way, and "
                "no thousands separators."
            )


def _plain(text: str) -> str:
    """A number without the finer points of typography."""
    return re.sub(r"[^\S\r\n]", " ", text.strip()).replace("\u2212", "-").replace("’", "'")


def _with_decimal_point(text: str) -> str | None:
    """The number in Python's spelling, or None if it is none; separators of thousands must stand where they belong."""
    if _NUMBER.fullmatch(text):
        return text.replace(",", ".")
    grouped = _GROUPED.fullmatch(text)
    if grouped is None or grouped["mark"] == grouped["separator"]:
        return None
    return text.replace(grouped["separator"], "").replace(",", ".")


def _decimals_of(texts: Iterator[str], comma: bool) -> Decimals:
    """What the numbers of a file say about its decimal sign."""
    seen: dict[str, str] = {}
    for text in texts:
        if "," in text or "." in text:
            plain = _plain(text.strip(" <=≤%"))
            match = _NUMBER.fullmatch(plain) or _GROUPED.fullmatch(plain)
            if match and match["mark"] and not _AMBIGUOUS.fullmatch(plain):
                seen.setdefault(match["mark"], plain)
    return Decimals(comma, seen)


@dataclass(frozen=True)
class RawTable:
    """Header and rows of one file, all cells as text."""

    file: str
    header: tuple[str, ...]
    header_row: int
    rows: tuple[tuple[Cell, ...], ...]


def read_csv(path: Path) -> RawTable:
    """Read one table.

    Understands comma, semicolon and tab; decimal comma; byte-order marks (UTF-8 and UTF-16) and Windows encodings;
    comment lines starting with #; Excel's `sep=;` line, trailing empty columns, blank lines and quoted cells.

    Args:
        path: The file.

    Raises:
        DatasetError: The file is missing, is no text, is empty, has no header or duplicate columns, or a row is longer
            than the header.
    """
    name = path.name
    delimiter, lines = _delimiter(_text_lines(path, name), name)
    records = [(row, cells) for row, cells in _records(lines, delimiter, name) if any(c.strip() for c in cells)]
    if not records:
        raise DatasetError(f"{name} is empty; it needs one header row and the measurements below it.")
    header_row, header = records[0][0], tuple(" ".join(cell.split()) for cell in records[0][1])
    while header and not header[-1]:
        header = header[:-1]
    _check_header(header, header_row, name)
    if len(records) == 1:
        raise DatasetError(
            f"{name} has a header row but no measurements; add the rows, or remove the table from cable.toml."
        )
    decimals = _decimals_of((cell for _, cells in records[1:] for cell in cells), delimiter != ",")
    rows = tuple(_row(name, header, number, cells, decimals) for number, cells in records[1:])
    return RawTable(name, header, header_row, rows)


def _row(file: str, header: tuple[str, ...], number: int, cells: list[str], decimals: Decimals) -> tuple[Cell, ...]:
    extra = [cell for cell in cells[len(header) :] if cell.strip()]
    if extra:
        raise DatasetError(
            f"{file}, row {number}: {len(cells)} cells under {len(header)} column headings (the first too many is "
            f"{shown(extra[0])}); the usual cause is a decimal comma in a comma-separated file: separate the "
            "columns with semicolons, or write decimal points."
        )
    padded = cells + [""] * (len(header) - len(cells))
    return tuple(
        Cell(file, number, column or f"(column {i + 1}, without heading)", text, decimals)
        for i, (column, text) in enumerate(zip(header, padded, strict=False))
    )


def _check_header(header: tuple[str, ...], row: int, file: str) -> None:
    if all(_with_decimal_point(_plain(column)) for column in header if column):
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


def _text_lines(path: Path, name: str) -> _NUMBERED:
    """Numbered lines without comments."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise DatasetError(
            f"{name} does not exist in {path.parent}; check the file's name and folder, or put the file there."
        ) from None
    except OSError as error:
        raise DatasetError(f"{name} cannot be read ({error.strerror}); check that it is a file you may open.") from None
    lines = re.split(r"\r\n|\r|\n", _decoded(data, name))
    return [(i, line) for i, line in enumerate(lines, start=1) if not _is_comment(line)]


def _is_comment(line: str) -> bool:
    """Whether the line is a comment; a data row may begin with Excel's #N/A, which is none."""
    start = line.lstrip().lstrip('"').lower()
    return start.startswith("#") and not any(start.startswith(mark) for mark in _NOT_FINITE if mark[0] == "#")


def _decoded(data: bytes, name: str) -> str:
    if data[:4] in (b"PK\x03\x04", b"\xd0\xcf\x11\xe0"):
        raise DatasetError(f"{name} is a workbook, not a CSV file; save the sheet as CSV and name that file.")
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        text = data.decode("cp1252" if encoding == "utf-8-sig" else encoding, errors="replace")
    if "\x00" in text:
        raise DatasetError(f"{name} is not a text file; export the measurements as CSV.")
    return text


def _delimiter(lines: _NUMBERED, name: str) -> tuple[str, _NUMBERED]:
    """The column separator, as Excel's `sep=` line says, and the lines from the header on.

    Without such a line it is the separator that splits the first rows into equally many cells, and the header into most.
    """
    start = next((i for i, (_, line) in enumerate(lines) if line.strip(' \t;,"')), len(lines))
    lines = lines[start:]
    if not lines:
        return ",", []
    first = lines[0][1].strip().strip('"').lower()
    if first.startswith("sep=") and len(first) <= 5:
        if first[4:] not in ("", *_SEPARATORS, "|"):
            raise DatasetError(
                f"{name}, row {lines[0][0]}: {shown(first)} names no column separator; use semicolon, comma or tab."
            )
        return (first[4:] or "\t"), lines[1:]

    def fitness(delimiter: str) -> tuple[bool, int]:
        try:
            rows = [cells for _, cells in islice(_records(lines, delimiter, name), 20) if any(map(str.strip, cells))]
        except DatasetError:
            return False, 0
        counts = [len(cells) for cells in rows]
        return counts[0] > 1 and set(counts) == {counts[0]}, counts[0]

    return max(_SEPARATORS, key=fitness), lines


def _records(lines: _NUMBERED, delimiter: str, name: str) -> Iterator[tuple[int, list[str]]]:
    """Cells of each record with the line where it starts; a quoted cell may run over several lines.

    Raises:
        DatasetError: A quote is never closed.
    """
    end = "\x00"  # stands in no text file, and so in a row of its own unless a quote before it is open
    text = (line + "\n" for line in (*(line for _, line in lines), end))
    reader = csv.reader(text, delimiter=delimiter, skipinitialspace=True)
    start, what = 0, "a quotation mark opens there that is never closed; close or delete it"
    try:
        for cells in reader:
            if cells == [end]:
                return
            if cells and end in cells[-1]:
                break
            yield lines[start][0], cells
            start = reader.line_num
    except csv.Error:
        what = f"a cell there has more than {csv.field_size_limit()} characters; check the quotation marks"
    raise DatasetError(f"{name}, row {lines[start][0]}: {what}.")
