"""Text files of any size and encoding: their first and last lines, and sections of them as streams."""

import codecs
import io
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from bowdenfit.errors import DatasetError
from bowdenfit.inputs import refuse_special

_BYTE_ORDER_MARKS = ((b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"), (b"\xef\xbb\xbf", "utf-8"))
_COMMENT = re.compile(r"\s*\"?\s*(?P<mark>#(?!n/a|div/0!|value!|num!|ref!|na\b)|%)", re.IGNORECASE)
_PIECE = 1 << 24
# Marks without width that spreadsheets and chat programs leave in cells: two labels that look alike would be two.
_INVISIBLE = dict.fromkeys(map(ord, "\xad\u200b\u200c\u200d\u200e\u200f\u2060\u202a\u202b\u202c\u202d\u202e\ufeff"))


@dataclass(frozen=True)
class Line:
    """One line of a file.

    Args:
        row: Its number in the file, from 1.
        start: Where it starts [bytes].
        text: What it says, with the end of the line.
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
        """Streams for reading say so."""
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
    """The first bytes of a file, or all of them.

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


def first_lines(data: bytes, name: str, whole: bool, most: int | None = None) -> tuple[str, list[Line]]:
    """The encoding of a text and its lines, or the first of them, by its first bytes or, if `whole`, all of them.

    Raises:
        DatasetError: It is no text.
    """
    encoding, mark = _encoding(data, name, whole)
    return encoding, _lines(data[mark:], encoding, mark, most)


def last_lines(path: Path, encoding: str, start: int, most: int) -> list[Line]:
    """Lines from `start` to the end of a file, or the last of them if these are more than `most` bytes.

    Their rows count from the first of them; `rows_before` gives what to add.
    """
    skipped = max(start, (path.stat().st_size - most) // 2 * 2 + start % 2)
    with path.open("rb") as file:
        file.seek(skipped)
        lines = _lines(file.read(), encoding, skipped)
    return lines if skipped == start else lines[1:]


def lines_between(path: Path, encoding: str, start: int, stop: int) -> Iterator[str]:
    """Lines of a section of a file [bytes], one after the other."""
    with io.BufferedReader(Section(path, start, stop), 1 << 20) as stream:
        yield from io.TextIOWrapper(stream, encoding=encoding, errors="replace")


def rows_before(path: Path, stop: int) -> int:
    """Number of ends of lines in the first `stop` bytes."""
    feeds = returns = 0
    with path.open("rb") as file:
        while stop > 0 and (data := file.read(min(_PIECE, stop))):
            feeds, returns, stop = feeds + data.count(b"\n"), returns + data.count(b"\r"), stop - len(data)
    return feeds or returns


def is_blank(line: str) -> bool:
    """Whether a line holds nothing but separators."""
    return not line.strip(" \t\r\n;,|\"'")


def comment_mark(line: str) -> str:
    """The mark (# or %) that makes a line a comment, else nothing; a row of data may begin with Excel's #N/A."""
    match = _COMMENT.match(line)
    return match["mark"] if match else ""


def _encoding(data: bytes, name: str, whole: bool) -> tuple[str, int]:
    """Encoding of a text, and how many bytes are a byte-order mark."""
    for mark, encoding in _BYTE_ORDER_MARKS:
        if data.startswith(mark):
            return encoding, len(mark)
    if b"\x00" in data:
        raise DatasetError(
            f"{name} is not a text file; name the file by its format (.xlsx, .mat, .tdms, ...) or export it as CSV."
        )
    try:
        codecs.getincrementaldecoder("utf-8")().decode(data, final=whole)
    except UnicodeDecodeError:
        return "cp1252", 0
    return "utf-8", 0


def _lines(data: bytes, encoding: str, start: int, most: int | None = None) -> list[Line]:
    """Lines of a piece of a file that starts there [bytes], or the first of them; the first is called row 1."""
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
