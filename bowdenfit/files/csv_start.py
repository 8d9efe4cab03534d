"""The first lines of a CSV file: its encoding, separator, decimal mark and headings."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path

from bowdenfit.errors import DatasetError
from bowdenfit.files.headings import Heading, heading_of
from bowdenfit.files.layout import Layout, layout_of
from bowdenfit.files.text_file import Line, encoding_of, is_comment, lines_of

_FIRST_LINES = 300
_HEADING_LINES = 12
# Equal readings of a file are decided by this order; "1,2" is two numbers before it is one with a decimal comma.
_HABITS = (
    ("\t", "."),
    ("\t", ","),
    (";", "."),
    (";", ","),
    (",", "."),
    ("|", "."),
    ("|", ","),
    (" ", "."),
    (" ", ","),
    (",", ","),
)


@dataclass(frozen=True)
class Sheet:
    """What the first lines of a file tell about all of it.

    Args:
        encoding: Name of the encoding.
        separator: What stands between columns; a blank for any run of blanks and tabs.
        decimal: Decimal mark.
        start: Where the data start [bytes].
        layout: Headings and kinds of the columns.
        metadata: The lines above the data.
        remarks: What was assumed.
    """

    encoding: str
    separator: str
    decimal: str
    start: int
    layout: Layout
    metadata: tuple[str, ...]
    remarks: tuple[str, ...] = ()


def cells_of(line: str, separator: str) -> list[str]:
    """Cells of one line."""
    plain = line.rstrip("\r\n")
    if separator == " ":
        return [cell.strip('"') for cell in plain.split()]
    return next(csv.reader([plain], delimiter=separator, skipinitialspace=True, strict=False), [])


def start_of(path: Path, data: bytes) -> Sheet:
    """What the first bytes of a file tell.

    Raises:
        DatasetError: They are no text, or hold no numbers in columns.
    """
    encoding, mark = encoding_of(data, path.name)
    lines = lines_of(data[mark:], encoding, 1, mark)[:_FIRST_LINES]
    if len(lines) > 1 and not lines[-1].ended:
        lines = lines[:-1]
    separator, lines = _declared(lines)
    records = _records([line for line in lines if not is_comment(line.text)])
    readings = [_reading(records, *habit) for habit in _HABITS if separator in (None, habit[0])]
    found = [(layout, habit) for layout, habit in readings if layout is not None]
    if not found:
        raise DatasetError(
            f"{path.name} has no rows of numbers in columns; export the recording as CSV with one column for each signal."
        )
    layout, (separator, decimal) = max(
        found, key=lambda reading: (reading[0].named and reading[0].fits, reading[0].score)
    )
    first = records[layout.start]
    above = [line for line in lines if line.start < first.start]
    layout = _fitting(path, layout, first, separator, above)
    return Sheet(encoding, separator, decimal, first.start, layout, tuple(line.text for line in above))


def _reading(records: Sequence[Line], separator: str, decimal: str) -> tuple[Layout | None, tuple[str, str]]:
    rows = [cells_of(record.text, separator) for record in records]
    return layout_of(rows, decimal), (separator, decimal)


def _declared(lines: list[Line]) -> tuple[str | None, list[Line]]:
    """The separator that a first line `sep=;` declares, and the other lines."""
    first = lines[0].text.strip().strip('"').lower() if lines else ""
    if first.startswith("sep=") and len(first) <= 5:
        return (first[4:] or "\t"), lines[1:]
    return None, lines


def _records(lines: Sequence[Line]) -> list[Line]:
    """Lines, with those joined to one that a quoted heading of several lines runs over."""
    records: list[Line] = []
    i = 0
    while i < len(lines):
        count = _lines_of_record(lines[i : i + _HEADING_LINES])
        joined = " ".join(line.text.rstrip("\r\n") for line in lines[i : i + count])
        records.append(replace(lines[i], text=joined))
        i += count
    return records


def _lines_of_record(lines: Sequence[Line]) -> int:
    """Number of lines until the quotes that open in the first are closed; 1 if they never are."""
    quotes = accumulate(line.text.count('"') for line in lines)
    return next((i for i, count in enumerate(quotes, start=1) if count % 2 == 0), 1)


def _fitting(path: Path, layout: Layout, first: Line, separator: str, above: Sequence[Line]) -> Layout:
    """The layout with as many headings as columns; headings may stand in a comment.

    Raises:
        DatasetError: A row has more cells than there are headings.
    """
    if separator == " " and layout.named and layout.given != len(layout.kinds):
        return _from_comment(layout, separator, above)
    if not layout.fits:
        raise DatasetError(
            f"{path.name}, row {first.row}: {len(layout.kinds)} cells under {layout.given} headings; the usual cause is a "
            "decimal comma in a file separated by commas: separate the columns with semicolons, or write decimal points."
        )
    return layout if layout.named else _from_comment(layout, separator, above)


def _from_comment(layout: Layout, separator: str, above: Sequence[Line]) -> Layout:
    width = len(layout.kinds)
    for line in reversed([line for line in above if is_comment(line.text)]):
        cells = cells_of(line.text.strip().lstrip("#% "), separator)
        if len(cells) == width and all(cell.strip() for cell in cells):
            return replace(layout, named=True, headings=tuple(map(heading_of, cells)))
    return replace(layout, named=False, headings=tuple(Heading(f"column{i + 1}") for i in range(width)))
