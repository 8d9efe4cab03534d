"""The parts of a table as laboratories keep it: what stands over it, its headings and units, its rows, and what is below.

The headings are decided once, near the top, by what stands below them: a bad cell in the body never becomes a heading.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from bowdenfit.errors import DatasetError
from bowdenfit.files.csv_rows import CsvRecord
from bowdenfit.files.headings import without_brackets
from bowdenfit.files.row_account import ABOVE
from bowdenfit.files.table_body import readings
from bowdenfit.files.table_rows import is_measured, is_units, is_words, words_and_numbers
from bowdenfit.words import shown

_NEAR_TOP = 60  # rows in which headings are looked for


@dataclass(frozen=True)
class TableParts:
    """What the rows of a file are.

    Args:
        headings: The rows that hold headings and their units, from above.
        header: Of these the one that names the columns.
        names: What stands over each column.
        units: The unit below each name; empty without one.
        body: The rows of readings.
        left_out: Why each of the other rows is not read, by its number, but for blank ones.
        beside: Row and text of remarks behind an empty column.
    """

    headings: tuple[CsvRecord, ...]
    header: CsvRecord
    names: tuple[str, ...]
    units: tuple[str, ...]
    body: tuple[CsvRecord, ...]
    left_out: dict[int, str] = field(default_factory=dict)
    beside: tuple[tuple[int, str], ...] = ()


def parts_of(rows: Sequence[CsvRecord], file: str) -> TableParts:
    """The parts of a table, by all rows of a file that are no comments.

    Raises:
        DatasetError: Rows of numbers stand above the headings.
    """
    gap = _gap(rows)
    parts = _parts([replace(row, cells=row.cells[:gap]) for row in rows], file)
    if gap is None:
        return parts
    whole = {row.row: row.cells for row in rows}
    if any(map(str.strip, whole[parts.header.row][gap : gap + 1])):
        return _parts(rows, file)  # a column that nothing was written into
    used = [row.row for row in (*parts.headings, *parts.body)]
    beside = [(row, " ".join(filter(None, map(str.strip, whole[row][gap:])))) for row in used]
    return replace(parts, beside=tuple((row, text) for row, text in beside if text))


def _gap(rows: Sequence[CsvRecord]) -> int | None:
    """The first empty column behind the table, where what stands behind it are remarks rather than columns of numbers."""
    measured = [row for row in rows if words_and_numbers(row)[1] > 1]
    width = max((len(row.cells) for row in measured), default=0)
    empty = [all(i >= len(row.cells) or not row.cells[i].strip() for row in measured) for i in range(width)]
    start = next((i for i, blank in enumerate(empty) if not blank), 0)
    gap = next((i for i in range(start, width) if empty[i]), None)
    if gap is None:
        return None
    behind = sum(any(map(is_measured, filter(str.strip, row.cells[gap:]))) for row in measured)
    return gap if 2 * behind < len(measured) else None


def _parts(rows: Sequence[CsvRecord], file: str) -> TableParts:
    filled = [row for row in rows if not row.blank]
    at = _header_position(filled)
    over, below = [filled[at]], at + 1
    units: list[str] = []
    if below < len(filled) and is_units(filled[below]):
        units = [without_brackets(cell) for cell in filled[below].cells]
        over.append(filled[below])
    names = [" ".join(cell.split()) for cell in filled[at].cells]
    if at and _is_over(filled[at - 1], names):
        names = _joined(filled[at - 1].cells, names)
        over.insert(0, filled[at - 1])
    reasons = {row.row: ABOVE for row in filled[:at] if row not in over}
    _check_above(filled[:at], sum(map(bool, names)), filled[at], file)
    body, left_out = readings([row for row in rows if row.row > over[-1].row], filled[at], file)
    return TableParts(tuple(over), filled[at], tuple(names), tuple(units), tuple(body), reasons | left_out)


def _header_position(filled: Sequence[CsvRecord]) -> int:
    """Which of the rows holds the headings: that of words alone over most numbers; the first where there is none."""
    widest = max((len([cell for cell in row.cells if cell.strip()]) for row in filled), default=0)
    least = 2 if widest > 1 else 1
    best, most, current = 0, 0, -1
    score = 0
    for i, row in enumerate(filled):
        words = i < _NEAR_TOP and is_words(row, least)
        if words and not (i == current + 1 and current >= 0 and is_units(row)) and not _again(row, filled, current):
            current, score = i, 0
        elif current >= 0:
            score += words_and_numbers(row)[1]
            if score > most:
                best, most = current, score
    return best


def _again(row: CsvRecord, filled: Sequence[CsvRecord], current: int) -> bool:
    return current >= 0 and row.cells == filled[current].cells


def _is_over(above: CsvRecord, names: Sequence[str]) -> bool:
    """Whether a row is a first row of headings over others that need it, because two of them are the same."""
    written = [name.lower() for name in names if name]
    return len(set(written)) < len(written) and is_words(above, 1) and len(above.cells) > 1


def _joined(above: Sequence[str], names: Sequence[str]) -> list[str]:
    """Headings with the group before them that stands over the first of its columns, as merged cells are exported.

    A column that has a heading in the upper row alone, such as the time beside groups of runs, keeps that.
    """
    groups, group = [], ""
    for i, _ in enumerate(names):
        group = (above[i].strip() if i < len(above) else "") or group
        groups.append(group)
    own = [" ".join(above[i].split()) if i < len(above) else "" for i, _ in enumerate(names)]
    return [
        " ".join(f"{group} {name}".split()) if name else alone
        for group, name, alone in zip(groups, names, own, strict=True)
    ]


def _check_above(above: Sequence[CsvRecord], columns: int, header: CsvRecord, file: str) -> None:
    """Refuse rows of numbers alone, as many as there are columns, above the headings.

    Raises:
        DatasetError: There is such a row.
    """
    for row in above:
        words, numbers = words_and_numbers(row)
        if numbers >= max(columns, 2) and not words:
            raise DatasetError(
                f"{file}, row {row.row}: numbers stand there ({shown(row.cells[0])}, ...) above the headings in row "
                f"{header.row}; put the headings over all rows of the table, or delete the rows above them."
            )


