"""The first lines of a recording in a CSV file: its encoding, separator, decimal mark and headings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bowdenfit.errors import DatasetError
from bowdenfit.files.csv_rows import SEPARATORS, CsvRecord, cells_of, declared_separator, records, too_many_cells
from bowdenfit.files.headings import Heading, heading_of
from bowdenfit.files.layout import Layout, layout_of
from bowdenfit.files.row_account import ABOVE, BLANK, COMMENT
from bowdenfit.files.text_file import Line, comment_mark, first_lines, is_blank

_FIRST_LINES = 300
_HEADING_LINES = 12
# Equal readings of a file are decided by the order; "1,2" is two numbers before it is one with a decimal comma.
_HABITS = (*((s, d) for s in SEPARATORS for d in ".," if (s, d) != (",", ",")), (",", ","))


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
        headings: Rows of the headings and their units.
        above: Why the other rows above the data are not read, and what they say, by their numbers.
    """

    encoding: str
    separator: str
    decimal: str
    start: int
    layout: Layout
    metadata: tuple[str, ...]
    headings: tuple[int, ...]
    above: dict[int, tuple[str, str]]


def start_of(path: Path, data: bytes) -> Sheet:
    """What the first bytes of a file tell.

    Raises:
        DatasetError: They are no text, or hold no numbers in columns.
    """
    encoding, lines = first_lines(data, path.name, whole=False, most=_FIRST_LINES)
    if len(lines) > 1 and not lines[-1].ended:
        lines = lines[:-1]
    every = lines
    declared, lines = declared_separator(lines, path.name)
    texts = [line for line in lines if not comment_mark(line.text)]
    rows = {s: list(records(texts, s, _HEADING_LINES)) for s in _separators(texts, declared)}
    readings = [(layout_of([row.cells for row in rows[s]], d), s, d) for s, d in _HABITS if s in rows]
    layouts = [(layout, separator, decimal) for layout, separator, decimal in readings if layout is not None]
    if not layouts:
        raise DatasetError(
            f"{path.name} has no rows of numbers in columns; export the recording as CSV with one column for each signal."
        )
    layout, separator, decimal = max(layouts, key=lambda reading: _worth(reading[0]))
    below = rows[separator][layout.start :]
    above = [line for line in lines if line.start < below[0].start]
    layout = _fitting(path, layout, below, separator, above)
    over = tuple(rows[separator][i].row for i in layout.over)
    others = {line.row: _why_above(line) for line in every if line.start < below[0].start and line.row not in over}
    return Sheet(encoding, separator, decimal, below[0].start, layout, tuple(line.text for line in above), over, others)


def _worth(layout: Layout) -> tuple[bool, bool, int]:
    """How much speaks for a reading: headings in words that have room for all columns, any such, and numbers."""
    named = layout.named and layout.fits
    return named and not layout.by_numbers, named, layout.score


def _why_above(line: Line) -> tuple[str, str]:
    if is_blank(line.text):
        return BLANK, ""
    return (COMMENT, "") if comment_mark(line.text) else (ABOVE, " ".join(line.text.split()))


def _separators(lines: Sequence[Line], declared: str | None) -> list[str]:
    """What may separate the columns; of those that stand nowhere, which all make one column, the first, and blanks."""
    return [
        separator
        for separator in SEPARATORS
        if declared in (None, separator)
        and (separator in (declared, SEPARATORS[0], " ") or any(separator in line.text for line in lines))
    ]


def _fitting(path: Path, layout: Layout, below: Sequence[CsvRecord], separator: str, above: Sequence[Line]) -> Layout:
    """The layout with as many headings as columns; headings may stand in a comment.

    Raises:
        DatasetError: A row has more cells than there are headings.
    """
    if separator == " " and layout.named and layout.heading_cells != len(layout.kinds):
        return _from_comment(layout, separator, above)
    for row in () if layout.fits else below:
        too_many_cells(path.name, row.row, row.cells, layout.room)
    return layout.inside if layout.named else _from_comment(layout, separator, above)


def _from_comment(layout: Layout, separator: str, above: Sequence[Line]) -> Layout:
    width = len(layout.kinds)
    for line in reversed([line for line in above if comment_mark(line.text)]):
        cells = cells_of(line.text.strip().lstrip("#% "), separator)
        if len(cells) == width and all(cell.strip() for cell in cells):
            return replace(layout, named=True, headings=tuple(map(heading_of, cells)))
    return replace(layout, named=False, headings=tuple(Heading(f"column{i + 1}") for i in range(width)))
