"""Text files of any size and encoding: their lines, sections of them as streams, and the rows of cells in a CSV file."""

import codecs
import csv
import io
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from bowdenfit.errors import DatasetError
from bowdenfit.inputs import refuse_special
from bowdenfit.words import shown

_BYTE_ORDER_MARKS = ((b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"), (b"\xef\xbb\xbf", "utf-8"))
_COMMENT = re.compile(r"\s*\"?\s*(?P<mark>#(?!n/a|div/0!|value!|num!|ref!|na\b)|%)", re.IGNORECASE)
# Two bytes of a table in UTF-8, or of one in the other order, read as one letter of UTF-16: no language has several in a row.
_HIGH = (*range(0x30, 0x3A), *map(ord, "+,-.; |eE"))
_LETTERS = "".join(chr(256 * high + low) for high in _HIGH for low in b"\x00\t\n\r +,-.;|Ee0123456789")
_WITH_ENDS = _LETTERS + "".join(chr(256 * high + low) for high in b"\t\n\r" for low in b"0123456789")
_OTHER_ENCODING = re.compile(f"[{re.escape(_LETTERS)}]{{4,}}|[{re.escape(_WITH_ENDS)}]{{12,}}")
_PIECE = 1 << 24  # bytes at once, little beside the memory of any computer
# Marks without width that spreadsheets and chat programs leave in cells: two labels that look alike would be two.
_INVISIBLE = dict.fromkeys(map(ord, "\xad\u200b\u200c\u200d\u200e\u200f\u2060\u202a\u202b\u202c\u202d\u202e\ufeff"))


@dataclass(frozen=True)
class Line:
    """One line of a file.

    Args:
        row: Its number in the file, from 1.
        start: Where it starts [bytes].
        text: Text of the line, with its end.
    """

    row: int
    start: int
    text: str

    @property
    def ended(self) -> bool:
        """Whether an end of line stands behind it; only the last line of a file may lack one."""
        return self.text.endswith(("\n", "\r"))


class Section(io.RawIOBase):
    """A file from one byte to another, as a stream that never holds more than a reader asks for."""

    def __init__(self, path: Path, start: int, stop: int) -> None:
        """Open the section from `start` to `stop` [bytes]."""
        self._file = path.open("rb")
        self._file.seek(start)
        self._left = stop - start

    def readable(self) -> bool:
        """Return True: this is a stream for reading."""
        return True

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        """Fill `buffer` with the next bytes; 0 at the end of the section."""
        data = self._file.read(min(len(buffer), self._left))
        buffer[: len(data)] = data
        self._left -= len(data)
        return len(data)

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        super().close()


def first_bytes(path: Path, most: int = -1) -> bytes:
    """Return the first bytes of a file, or all of them.

    Raises:
        DatasetError: The file is missing, a folder, empty, or cannot be read.
    """
    refuse_special(path)
    if path.is_dir():
        raise DatasetError(
            f"{path.name} is a folder, not a recording or a table; give one of the files in it "
            "(only a ROS 2 bag is a folder, and it holds a metadata.yaml)."
        )
    try:
        with path.open("rb") as file:
            data = file.read(most)
    except FileNotFoundError:
        raise DatasetError(
            f"{path.name} does not exist in {path.parent}; check the file's name and folder, or put the file there."
        ) from None
    except OSError as error:
        raise DatasetError(
            f"{path.name} cannot be read ({error.strerror or os.strerror(error.errno or 0)}); check its permissions, and "
            "that no other program holds it open."
        ) from None
    if not data:
        raise DatasetError(
            f"{path.name} is empty (0 bytes); copy it again from the acquisition computer, or fill it in."
        )
    return data


def text_size(path: Path) -> int:
    """Return the size of a text without the NUL bytes behind it, which loggers leave that reserve room in advance [bytes]."""
    size = stop = path.stat().st_size
    with path.open("rb") as file:
        if file.read(2) in (b"\xff\xfe", b"\xfe\xff"):
            return size  # letters of UTF-16 have such bytes
        while stop > 0:
            start = max(0, stop - _PIECE)
            file.seek(start)
            if remaining := len(file.read(stop - start).rstrip(b"\x00")):
                return start + remaining
            stop = start
    return 0


def remark_on_nul_tail(path: Path) -> tuple[str, ...]:
    """Return a remark on the NUL bytes behind a text; none without them."""
    nul = path.stat().st_size - text_size(path)
    return (f"{nul} NUL bytes behind the last row were left out: room that a logger had reserved.",) if nul else ()


def check_encoding(path: Path) -> None:
    """Refuse a text of which a part is in another encoding than its beginning, or that is cut off inside a letter.

    Raises:
        DatasetError: It is; the rows would be lost that cannot be read.
    """
    with path.open("rb") as file:
        beginning = file.read(4)
        encoding = next((name for mark, name in _BYTE_ORDER_MARKS if beginning.startswith(mark)), "utf-8")
        file.seek(0)
        before, stop = 0, text_size(path)
        while data := file.read(min(_PIECE, stop - before)):
            if (other := _other_encoding(data, encoding)) is not None:
                row = count_rows_before(path, before + other) + 1
                raise DatasetError(
                    f"{path.name}, row {row}: from there on the file is not in {encoding[:6].upper()} as its beginning is. The "
                    "usual cause is rows that another program appended, or a damaged copy. Export the table again in one "
                    "encoding, such as UTF-8."
                )
            before += len(data)
    if encoding.startswith("utf-16") and before % 2:
        raise DatasetError(
            f"{path.name} breaks off inside a letter: it is in UTF-16, two bytes a letter, and has {before} bytes. The usual "
            "cause is a copy that was cut off; copy or export it again."
        )


def _other_encoding(data: bytes, encoding: str) -> int | None:
    """Return where in a piece of a text another encoding begins [bytes]; None if it is all in one."""
    if not encoding.startswith("utf-16"):
        return at if (at := data.find(b"\x00")) >= 0 else None
    high = data[encoding.endswith("le") :: 2]
    if high.count(0) == len(high):
        return None
    text = data[: len(data) // 2 * 2].decode(encoding, errors="replace")
    match = _OTHER_ENCODING.search(text)
    return 2 * match.start() if match else None


def first_lines(data: bytes, name: str, whole: bool, most: int | None = None) -> tuple[str, list[Line]]:
    """Return the encoding of a text and its lines, or the first of them, by its first bytes or, if `whole`, all of them.

    Raises:
        DatasetError: It is no text.
    """
    data = data if data.startswith((b"\xff\xfe", b"\xfe\xff")) else data.rstrip(b"\x00") or data  # see `text_size`
    encoding, mark = _encoding(data, name, whole)
    return encoding, _lines(data[mark:], encoding, mark, most)


def last_lines(path: Path, encoding: str, start: int, most: int) -> list[Line]:
    """Return lines from `start` to the end of a file, or the last of them if these are more than `most` bytes.

    Their rows count from the first of them; `count_rows_before` gives what to add.
    """
    stop = text_size(path)
    skipped = max(start, (stop - most) // 2 * 2 + start % 2)
    with path.open("rb") as file:
        file.seek(skipped)
        lines = _lines(file.read(stop - skipped), encoding, skipped)
    return lines if skipped == start else lines[1:]


def lines_between(path: Path, encoding: str, start: int, stop: int) -> Iterator[str]:
    """Yield lines of a section of a file [bytes], one after the other."""
    with io.BufferedReader(Section(path, start, stop), 1 << 20) as stream:
        yield from io.TextIOWrapper(stream, encoding=encoding, errors="replace")


def count_rows_before(path: Path, stop: int) -> int:
    """Return the number of ends of lines in the first `stop` bytes."""
    feeds = returns = 0
    with path.open("rb") as file:
        while stop > 0 and (data := file.read(min(_PIECE, stop))):
            feeds, returns, stop = feeds + data.count(b"\n"), returns + data.count(b"\r"), stop - len(data)
    return feeds or returns


def is_blank(line: str) -> bool:
    """Return whether a line holds nothing but separators."""
    return not line.strip(" \t\r\n;,|\"'")


def comment_mark(line: str) -> str:
    """Return the mark (# or %) that makes a line a comment, else nothing; a row of data may begin with Excel's #N/A."""
    match = _COMMENT.match(line)
    return match["mark"] if match else ""


def _encoding(data: bytes, name: str, whole: bool) -> tuple[str, int]:
    """Encoding of a text, and how many bytes are a byte-order mark."""
    for mark, encoding in _BYTE_ORDER_MARKS:
        if data.startswith(mark):
            return encoding, len(mark)
    if b"\x00" in data or data.startswith(b"\x89"):  # with which HDF5 and PNG begin, and no text
        raise DatasetError(
            f"{name} is not a text file; name the file by its format (.xlsx, .mat, .tdms, ...) or export it as CSV."
        )
    try:
        codecs.getincrementaldecoder("utf-8")().decode(data, final=whole)
    except UnicodeDecodeError:
        return "cp1252", 0
    return "utf-8", 0


def _lines(data: bytes, encoding: str, start: int, most: int | None = None) -> list[Line]:
    """Return lines of a piece of a file that starts there [bytes], or the first of them; the first is called row 1."""
    if encoding.startswith("utf-16"):
        texts = list(io.StringIO(data.decode(encoding, errors="replace"), newline=""))[:most]
        lengths = [len(text.encode(encoding, errors="replace")) for text in texts]
    else:
        pieces = data.splitlines(keepends=True)[:most]
        texts = [piece.decode(encoding, errors="replace") for piece in pieces]
        lengths = [len(piece) for piece in pieces]
    lines = []
    for row, (text, length) in enumerate(zip(texts, lengths, strict=True), start=1):
        lines.append(Line(row, start, text.translate(_INVISIBLE) if not text.isascii() else text))
        start += length
    return lines


SEPARATORS = ("\t", ";", ",", "|", " ")
"""What may stand between columns, the surer first; a blank is any run of blanks and tabs."""

_END = "\x00"  # stands in no text file, and so only in a row of its own unless a quote before it is open


@dataclass(frozen=True)
class CsvRecord:
    """The cells of one row.

    Args:
        row: Number of its first line in the file, from 1.
        start: Where it starts [bytes].
        cells: Cells of the row.
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
    """Return the separator that a first line `sep=;` declares, as Excel writes it, and the lines below it.

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


def split_records(lines: Sequence[Line], separator: str, most: int) -> Iterator[CsvRecord]:
    """Yield each record of some lines; a quoted cell may run over up to `most` of them."""
    i = 0
    while i < len(lines):
        following = (lines[k].text.rstrip("\r\n") + "\n" for k in range(i, min(i + most, len(lines))))
        whole = _whole_record(following, separator)
        count, cells = whole or (1, split_cells(lines[i].text, separator))
        yield CsvRecord(lines[i].row, lines[i].start, cells, whole is not None)
        i += count


def split_cells(line: str, separator: str) -> list[str]:
    """Return cells of one line."""
    if separator == " ":
        return [cell.strip('"') for cell in line.split()]
    try:
        return next(csv.reader([line.rstrip("\r\n")], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:  # a cell is too long
        return [line]


def _whole_record(lines: Iterator[str], separator: str) -> tuple[int, list[str]] | None:
    """Return how many lines the first record has, and its cells; None if a quotation mark stays open or a cell is too long."""
    if separator == " ":
        return 1, split_cells(next(lines), separator)
    reader = csv.reader(chain(lines, [_END]), delimiter=separator, skipinitialspace=True)
    try:
        cells = next(reader)
    except csv.Error:
        return None
    return None if cells and _END in cells[-1] else (reader.line_num, cells)


def refuse_long_row(file: str, row: int, cells: Sequence[str], width: int) -> None:
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


def short_row_error(file: str, row: int, cells: Sequence[str], header: Sequence[str]) -> DatasetError:
    """Return the refusal of a row that ends before a column in which other rows have numbers."""
    error = DatasetError(
        f"{file}, row {row}: {len(cells)} cell{'s' if len(cells) > 1 else ''} where the headings have {len(header)}: the "
        f"cell of {shown(header[len(cells)] or f'column {len(cells) + 1}')} is missing. The usual causes are a file that was "
        "cut off, and a value that was deleted together with its separator. Complete the row, delete it, or leave the cell "
        "blank behind a separator of its own if nothing was measured."
    )
    error.fault_key, error.row = (file, "too few cells"), row
    return error
