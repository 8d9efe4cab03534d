"""The parts of a table as laboratories keep it: what stands over it, its headings and units, its rows, and what is below.

The headings are decided once, near the top, by what stands below them: a bad cell in the body never becomes a heading.
The table ends where rows stop to agree with its columns; a block of text below it starts behind a blank row.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import BLANK
from bowdenfit.files.layout import Headings, find_headings, read_headings, refuse_readings_above
from bowdenfit.files.measured_cells import is_measured
from bowdenfit.files.row_account import ABOVE, BELOW
from bowdenfit.files.sheet_rows import (
    count_words_and_numbers,
    explain_row,
    is_summary,
    is_words,
    refuse_other_headings,
    refuse_other_separator,
)
from bowdenfit.files.text_file import CsvRecord
from bowdenfit.words import shown


@dataclass(frozen=True)
class TableParts:
    """What the rows of a file are.

    Args:
        headings: Its headings.
        body: The rows of readings.
        left_out: Why each of the other rows is not read, by its number, but for blank ones.
        beside: Row and text of remarks behind an empty column.
    """

    headings: Headings
    body: tuple[CsvRecord, ...]
    left_out: dict[int, str] = field(default_factory=dict)
    beside: tuple[tuple[int, str], ...] = ()


def split_table(rows: Sequence[CsvRecord], file: str) -> TableParts:
    """Return the parts of a table, by all rows of a file that are no comments.

    Raises:
        DatasetError: Rows of numbers stand above the headings.
    """
    gap = _find_gap(rows)
    parts = _split_columns([replace(row, cells=row.cells[:gap]) for row in rows], file)
    if gap is None:
        return parts
    whole = {row.row: row.cells for row in rows}
    if any(map(str.strip, whole[parts.headings.header.row][gap : gap + 1])):
        return _split_columns(rows, file)  # a column that nothing was written into
    used = [row.row for row in (*parts.headings.rows, *parts.body)]
    beside = [(row, " ".join(filter(None, map(str.strip, whole[row][gap:])))) for row in used]
    return replace(parts, beside=tuple((row, text) for row, text in beside if text))


def _find_gap(rows: Sequence[CsvRecord]) -> int | None:
    """Return the first empty column behind the table, where remarks rather than columns of numbers stand behind it."""
    measured = [row for row in rows if count_words_and_numbers(row)[1] > 1]
    width = max((len(row.cells) for row in measured), default=0)
    empty = [all(i >= len(row.cells) or not row.cells[i].strip() for row in measured) for i in range(width)]
    start = next((i for i, blank in enumerate(empty) if not blank), 0)
    gap = next((i for i in range(start, width) if empty[i]), None)
    if gap is None:
        return None
    behind = sum(any(map(is_measured, filter(str.strip, row.cells[gap:]))) for row in measured)
    return gap if 2 * behind < len(measured) else None


def _split_columns(rows: Sequence[CsvRecord], file: str) -> TableParts:
    filled = [row for row in rows if not row.blank]
    headings = find_headings(rows, file) or read_headings(filled, 0, file)
    refuse_readings_above(filled, headings, file)
    reasons = {row.row: ABOVE for row in filled if row.row < headings.header.row and row not in headings.rows}
    body, left_out = select_readings([row for row in rows if row.row > headings.rows[-1].row], headings.header, file)
    return TableParts(headings, tuple(body), reasons | left_out)


_MOST_STATISTICS = 8  # judged: rows of statistics that may stand below text columns
_FEWEST_ALIKE, _SHARE_ALIKE = 2, 0.05  # judged: rows below words, and share of those above, from which they may be data
_STATISTICS = "statistics below the table"


def select_readings(rows: Sequence[CsvRecord], header: CsvRecord, file: str) -> tuple[list[CsvRecord], dict[int, str]]:
    """Return the rows of readings below the headings, and why the others are none.

    Raises:
        DatasetError: A row that would be left out looks like a reading.
    """
    stop = _find_next_table(rows, header, file)
    width = sum(bool(cell.strip()) for cell in header.cells)
    last = max((i for i, row in enumerate(rows[:stop]) if count_words_and_numbers(row)[1]), default=0)
    for row in rows[1:last]:
        refuse_other_headings(file, row, header, width)
    numeric = _numeric_columns(rows[:stop])
    agree = [_agrees(row, numeric) for row in rows[:stop]]
    if not any(agree):
        return [row for row in rows if not row.blank], {}
    end = max(i for i, fits in enumerate(agree) if fits) + 1
    end = min(end, _statistics_start(rows, end, numeric))
    while end < stop and _count_in_columns(rows[end], numeric)[1] and not is_summary(rows[end].cells):
        end += 1  # a bad cell in the last rows is refused by name, not left out
    body, left_out = [], dict[int, str]()
    for i, row in enumerate(rows):
        if row.blank:
            continue
        reason = explain_row(row, header, numeric) if i < end else (_STATISTICS if is_summary(row.cells) else BELOW)
        if reason:
            filled = [cell for cell in row.cells if cell.strip()]
            if len(filled) == 1:
                refuse_other_separator(file, row.row, filled[0], width, numeric)
            left_out[row.row] = reason
        else:
            body.append(row)
    return body, left_out


def _find_next_table(rows: Sequence[CsvRecord], header: CsvRecord, file: str) -> int:
    """Return the position of the first row of several words behind a blank one, where the table ends; else the number of rows.

    Raises:
        DatasetError: So many rows that fit the table follow that they may belong to it.
    """
    seen = False
    for i, row in enumerate(rows):
        if seen and rows[i - 1].blank and is_words(row) and not count_words_and_numbers(row)[1] and row.cells != header.cells:
            numeric = _numeric_columns(rows[:i])
            filled = sorted(_count_in_columns(above, numeric)[1] for above in rows[:i] if _agrees(above, numeric))
            usual = filled[len(filled) // 2] if filled else 1
            below = sum(_agrees(above, numeric) and _count_in_columns(above, numeric)[1] >= usual for above in rows[i + 1 :])
            if below >= max(_FEWEST_ALIKE, _SHARE_ALIKE * len(filled)):
                raise DatasetError(
                    f"{file}, row {row.row}: it has words ({shown(' '.join(row.cells))}) behind a blank row, and {below} "
                    "rows of numbers in the same columns below them; if these belong to the table, delete the words or begin "
                    "that row with #, and if they are another table, put it into a file of its own."
                )
            return i
        seen = seen or count_words_and_numbers(row)[1] > 0
    return len(rows)


def _numeric_columns(rows: Sequence[CsvRecord]) -> set[int]:
    """Return columns that hold more numbers than words."""
    balance: dict[int, int] = {}
    for row in rows:
        if count_words_and_numbers(row)[1]:
            for i, cell in enumerate(row.cells):
                if cell.strip() and cell.strip().lower() not in BLANK and not is_summary([cell]):
                    balance[i] = balance.get(i, 0) + (1 if is_measured(cell) else -1)
    return {i for i, excess in balance.items() if excess > 0}


def _agrees(row: CsvRecord, numeric: set[int]) -> bool:
    """Return whether a row has numbers where the table has them, and no words there."""
    words, numbers = _count_in_columns(row, numeric)
    return not words and numbers > 0 and 2 * numbers >= len(numeric)


def _count_in_columns(row: CsvRecord, numeric: set[int]) -> tuple[int, int]:
    """Return how many words and how many numbers a row has where the table has numbers."""
    return count_words_and_numbers(replace(row, cells=[cell for i, cell in enumerate(row.cells) if i in numeric]))


def _statistics_start(rows: Sequence[CsvRecord], end: int, numeric: set[int]) -> int:
    """Return where statistics begin that stand at the end behind a blank row, each under a name of its own; else `end`."""
    start = next((i for i in range(end - 1, -1, -1) if rows[i].blank), -1) + 1
    last = rows[start:end]
    labels = [
        cell.strip().lower() for row in last for i, cell in enumerate(row.cells) if i not in numeric and cell.strip()
    ]
    is_block = start > 0 and len(last) <= _MOST_STATISTICS and len(set(labels)) == len(labels)
    return start if is_block and all(is_summary(row.cells) for row in last) else end
