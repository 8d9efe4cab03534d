"""Text files of any size and encoding: their first and last lines, and sections of them as streams."""

import io
import re
from dataclasses import dataclass
from pathlib import Path

from bowdenfit.errors import DatasetError

_BYTE_ORDER_MARKS = ((b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"), (b"\xef\xbb\xbf", "utf-8"))
_PIECE = 1 << 24


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

    @property
    def blank(self) -> bool:
        """Whether it holds nothing but separators."""
        return not self.text.strip(" \t\r\n;,|\"'")


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


def beginning(path: Path, most: int) -> tuple[bytes, int]:
    """First bytes of a file, and the size of all of it.

    Raises:
        DatasetError: The file is missing or cannot be read.
    """
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            data = file.read(most)
    except FileNotFoundError:
        raise DatasetError(
            f"{path.name} does not exist in {path.parent}; check the file's name and folder, or put the file there."
        ) from None
    except OSError as error:
        raise DatasetError(
            f"{path.name} cannot be read ({error.strerror}); check that it is a file you may open."
        ) from None
    return data, size


def encoding_of(data: bytes, name: str) -> tuple[str, int]:
    """Encoding of a text by its first bytes, and how many of them are a byte-order mark.

    Raises:
        DatasetError: It is no text.
    """
    for mark, encoding in _BYTE_ORDER_MARKS:
        if data.startswith(mark):
            return encoding, len(mark)
    if b"\x00" in data:
        raise DatasetError(
            f"{name} is not a text file; name the file by its format (.xlsx, .mat, .tdms, ...) or export it as CSV."
        )
    whole = data.rpartition(b"\n")[0] or data
    try:
        whole.decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252", 0
    return "utf-8", 0


def lines_of(data: bytes, encoding: str, row: int, start: int) -> list[Line]:
    """Lines of a piece of a file.

    Args:
        data: The piece.
        encoding: Its encoding.
        row: Number of its first line.
        start: Where it starts [bytes].
    """
    if encoding.startswith("utf-16"):
        texts = list(io.StringIO(data.decode(encoding, errors="replace"), newline=""))
        lengths = [len(text.encode(encoding, errors="replace")) for text in texts]
    else:
        pieces = data.splitlines(keepends=True)
        texts = [piece.decode(encoding, errors="replace") for piece in pieces]
        lengths = [len(piece) for piece in pieces]
    lines = []
    for text, length in zip(texts, lengths, strict=True):
        lines.append(Line(row, start, text))
        row, start = row + 1, start + length
    return lines


def last_lines(path: Path, encoding: str, start: int, size: int, most: int) -> list[Line]:
    """Lines from `start` to the end of a file, or the last of them if these are more than `most` bytes.

    The rows of the latter are counted from the first line as 0: `rows_before` gives what to add.
    """
    skipped = max(start, (size - most) // 2 * 2 + start % 2)
    with path.open("rb") as file:
        file.seek(skipped)
        lines = lines_of(file.read(), encoding, 0, skipped)
    return lines if skipped == start else lines[1:]


def rows_before(path: Path, stop: int) -> int:
    """Number of ends of lines in the first `stop` bytes."""
    feeds = returns = 0
    with path.open("rb") as file:
        while stop > 0 and (data := file.read(min(_PIECE, stop))):
            feeds, returns, stop = feeds + data.count(b"\n"), returns + data.count(b"\r"), stop - len(data)
    return feeds or returns


def is_comment(text: str) -> bool:
    """Whether a line is a comment (# or %); a data row may begin with Excel's #N/A, which is none."""
    return bool(re.match(r"\s*\"?\s*(?:#(?!n/a|div/0!|value!|num!|ref!|na\b)|%)", text, re.IGNORECASE))
