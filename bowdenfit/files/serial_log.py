"""Logs of the serial line of a microcontroller: lines such as `1203 F1:39.84 F2:27.17`, boot lines and messages in between.

The keys are the headings; a number before them has none. Lines of other keys are left out and named in the account.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from bowdenfit.errors import DatasetError
from bowdenfit.files.channels import ChannelFile, UnreadNames, make_channel_file, refuse_larger
from bowdenfit.files.clocks import names_time
from bowdenfit.files.layout import find_layout
from bowdenfit.files.row_account import ABOVE, BETWEEN, BLANK, make_account
from bowdenfit.files.sheet_columns import SheetRows, make_channels, read_arrays
from bowdenfit.files.text_file import CsvRecord, check_encoding, first_bytes, first_lines
from bowdenfit.words import few, shown

LARGEST_BYTES = 1 << 28  # judged: a day of three numbers at 80 Hz
_FIRST_BYTES, _FIRST_LINES = 1 << 16, 300  # judged: in which most lines must have the same keys
_SHARE, _FEWEST = 0.6, 10  # judged: of such lines, beside those of a boot
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?|nan|inf|ovf"
_PAIR = re.compile(
    rf"(?P<key>[A-Za-z_]\w*)\s*[:=]\s*(?P<number>{_NUMBER})(?:\s?(?P<unit>[A-Za-z%°]+)(?!\s*[\w:=]))?", re.IGNORECASE
)
_BARE = re.compile(rf"(?P<number>{_NUMBER})", re.IGNORECASE)
_STAMP = re.compile(r"\s*(?P<stamp>\d{1,2}:\d\d:\d\d[.,]\d+)\s*->\s*")  # as the Arduino IDE shows times of arrival
_GAP = re.compile(r"[\s,;|]+")


def split_line(line: str) -> tuple[tuple[str, ...], list[str]]:
    """Return the headings and the numbers of a line that has nothing but numbers with keys; both empty for any other.

    Args:
        line: Such as "1203<TAB>F1:39.84<TAB>F2:27.17 N".
    """
    stamp = _STAMP.match(line)
    text, headings, numbers = (line[stamp.end() :] if stamp else line).strip(), list[str](), list[str]()
    while text:
        match = _PAIR.match(text) or (None if any(headings) else _BARE.match(text))
        gap = _GAP.match(text, match.end()) if match else None
        if match is None or (match.end() < len(text) and gap is None):
            return (), []
        parts = match.groupdict()
        unit = f" ({parts['unit']})" if parts.get("unit") else ""
        headings.append(f"{parts['key']}{unit}" if parts.get("key") else "")
        numbers.append(parts["number"])
        text = text[gap.end() if gap else match.end() :]
    if not any(headings):
        return (), []
    if stamp and not any(not heading or names_time(heading) for heading in headings):
        headings, numbers = ["Time", *headings], [stamp["stamp"].replace(",", "."), *numbers]
    return tuple(headings), numbers


def is_serial_log(path: Path) -> bool:
    """Return whether most of the first lines of a text have numbers with the same keys."""
    try:
        _, lines = first_lines(first_bytes(path, _FIRST_BYTES), path.name, whole=False, most=_FIRST_LINES)
    except DatasetError:
        return False
    return bool(_find_headings([line.text for line in lines]))


def _find_headings(lines: Sequence[str]) -> tuple[str, ...]:
    """Return the headings that most lines have, two at least; empty where there are none."""
    filled = [line for line in lines[:_FIRST_LINES] if line.strip()]
    counts = Counter(split_line(line)[0] for line in filled)
    counts.pop((), None)
    headings, count = next(iter(counts.most_common(1)), ((), 0))
    return headings if len(headings) > 1 and count >= max(_FEWEST, _SHARE * len(filled)) else ()


def read(path: Path) -> ChannelFile:
    """Read the numbers of a serial log, a channel for each key.

    Limits: files of up to 256 MiB (`LARGEST_BYTES`).

    Args:
        path: The file.

    Raises:
        DatasetError: The file is too large, or in two encodings.
    """
    refuse_larger(path, LARGEST_BYTES, "cut it into runs")
    check_encoding(path)
    _, lines = first_lines(first_bytes(path), path.name, whole=True)
    headings = _find_headings([line.text for line in lines])
    rows, reasons = list[list[str]](), dict[int, tuple[str, str]]()
    for line in lines:
        named, numbers = split_line(line.text)
        if named == headings:
            rows.append(["" if number.lower() in ("inf", "ovf") else number for number in numbers])
        else:
            text = " ".join(line.text.split())
            reasons[line.row] = ((BETWEEN if rows else ABOVE) if text else BLANK), text
    # Nameless columns are named by their place, as where no column has a heading.
    written = [heading or f"column{i}" for i, heading in enumerate(headings, start=1)]
    records = [CsvRecord(i, 0, row) for i, row in enumerate([written, *rows[:_FIRST_LINES]])]
    layout = find_layout(records, ".", path.name)
    if layout is None:
        raise DatasetError(f"{path.name} has no rows of numbers behind its keys; export the log again.")
    columns = read_arrays(SheetRows(path.name, layout, iter(rows), 1))
    channels, left_out = make_channels(layout, columns)
    account = make_account(path.name, len(lines), (), reasons, ())
    messages = [row for row, (reason, _) in reasons.items() if reason == BETWEEN]
    texts = [f"{shown(reasons[row][1])} in row {row}" for row in messages]
    remarks = [f"Lines between the readings that have other keys or none were left out: {few(texts)}."] if messages else []
    whole = make_channel_file(path, "serial log", channels, UnreadNames(), (*left_out, *remarks, *columns.remarks))
    return replace(whole, account=account)
