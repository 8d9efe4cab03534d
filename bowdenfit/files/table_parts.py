"""The parts of a table as laboratories keep it: what stands over it, its headings and units, its rows, and what is below.

The headings are decided once, near the top, by what stands below them: a bad cell in the body never becomes a heading.
The table ends where rows stop to agree with its columns; a block of text below it starts behind a blank row.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import BLANK, is_plain_number
from bowdenfit.files.headings import is_units_row, plain_name, refuse_two_units, strip_brackets
from bowdenfit.files.layout import is_summary
from bowdenfit.files.measured_cells import is_reading
from bowdenfit.files.row_account import ABOVE, AGAIN, BELOW, BETWEEN
from bowdenfit.files.text_file import SEPARATORS, CsvRecord, other_separator_error, split_cells
from bowdenfit.words import shown

_NEAR_TOP = 60  # judged: rows in which headings are looked for


@dataclass(frozen=True)
class TableParts:
    """What the rows of a file are.

    Args:
        headings: The rows that hold headings and their units, from above.
        header: Of these the one that names the columns.
        names: Heading of each column.
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
    if any(map(str.strip, whole[parts.header.row][gap : gap + 1])):
        return _split_columns(rows, file)  # a column that nothing was written into
    used = [row.row for row in (*parts.headings, *parts.body)]
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
    at = _header_position(filled)
    over, below = [filled[at]], at + 1
    units: list[str] = []
    if below < len(filled) and is_units(filled[below]):
        units = [strip_brackets(cell) for cell in filled[below].cells]
        over.append(filled[below])
        refuse_two_units(f"{file}, row {filled[below].row}", filled[at].cells, units)
    names = [" ".join(cell.split()) for cell in filled[at].cells]
    if at and _is_over(filled[at - 1], names):
        names = _join_groups(filled[at - 1].cells, names)
        over.insert(0, filled[at - 1])
    reasons = {row.row: ABOVE for row in filled[:at] if row not in over}
    _check_above(filled[:at], sum(map(bool, names)), filled[at], file)
    body, left_out = select_readings([row for row in rows if row.row > over[-1].row], filled[at], file)
    return TableParts(tuple(over), filled[at], tuple(names), tuple(units), tuple(body), reasons | left_out)


def _header_position(filled: Sequence[CsvRecord]) -> int:
    """Return which of the rows holds the headings: that of words alone over most numbers; the first where there is none."""
    widest = max((len([cell for cell in row.cells if cell.strip()]) for row in filled), default=0)
    least = 2 if widest > 1 else 1
    best, most, current = 0, 0, -1
    score = 0
    for i, row in enumerate(filled):
        words = i < _NEAR_TOP and is_words(row, least) and not _has_units_as_neighbors(filled, i)
        below = current >= 0 and (_is_same(row, filled[current]) or (i == current + 1 and is_units(row)))
        if words and not below:
            current, score = i, 0
        elif current >= 0:
            score += count_words_and_numbers(row)[1]
            if score > most:
                best, most = current, score
    return best


def _has_units_as_neighbors(filled: Sequence[CsvRecord], i: int) -> bool:
    """Return whether a row has numbers with units or errors where a row beside it has them, as rows of readings do.

    A row of headings may have them too, such as 45° and 90° over forces.
    """
    here = {k for k, cell in enumerate(filled[i].cells) if is_reading(cell)}
    beside = [filled[k] for k in (i - 1, i + 1) if 0 <= k < len(filled)] if here else []
    return any(is_reading(row.cells[k]) for row in beside for k in here if k < len(row.cells))


def _is_over(above: CsvRecord, names: Sequence[str]) -> bool:
    """Return whether a row is a first row of headings over others that need it, because two of them are the same."""
    written = [name.lower() for name in names if name]
    return len(set(written)) < len(written) and is_words(above, 1) and len(above.cells) > 1


def _join_groups(above: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return headings with the group before them that stands over the first of its columns, as merged cells are exported.

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
    for i, row in enumerate(above):
        words, numbers = count_words_and_numbers(row, _is_bare_number)
        if numbers >= max(columns, 2) and not words:
            raise DatasetError(
                f"{file}, row {row.row}: it has numbers ({shown(row.cells[0])}, ...) above the headings in row "
                f"{header.row}; put the headings over all rows of the table, or delete the rows above them."
            )
        if words + numbers == columns and numbers > 1 and any(is_words(other, columns) for other in above[:i]):
            raise DatasetError(
                f"{file}, row {row.row}: a row of a table ({shown(' '.join(row.cells))}) is above the headings in row "
                f"{header.row}; put what is above these into a file of its own, or delete it, and row {header.row} too if its "
                "columns are the same."
            )


_MOST_STATISTICS = 8  # judged: rows of statistics that may stand below text columns
_FEWEST_ALIKE, _SHARE_ALIKE = 2, 0.05  # judged: rows below words, and share of those above, from which they may be data
_STATISTICS, _INSIDE = "statistics below the table", "statistics between the rows"


def select_readings(rows: Sequence[CsvRecord], header: CsvRecord, file: str) -> tuple[list[CsvRecord], dict[int, str]]:
    """Return the rows of readings below the headings, and why the others are none.

    Raises:
        DatasetError: A row that would be left out looks like a reading.
    """
    stop = _find_next_table(rows, header, file)
    _refuse_other_headings(rows[:stop], header, file)
    numeric = _numeric_columns(rows[:stop])
    agree = [_agrees(row, numeric) for row in rows[:stop]]
    if not any(agree):
        return [row for row in rows if not row.blank], {}
    end = max(i for i, fits in enumerate(agree) if fits) + 1
    end = min(end, _statistics_start(rows, end, numeric))
    while end < stop and not rows[end].blank and _misfits(rows[end], numeric):
        end += 1  # a bad cell in the last rows is refused by name, not left out
    body, left_out = [], dict[int, str]()
    for i, row in enumerate(rows):
        if row.blank:
            continue
        reason = _explain_row_inside(row, header, numeric) if i < end else (_STATISTICS if is_summary(row.cells) else BELOW)
        if reason:
            _refuse_reading(row, header, numeric, file)
            left_out[row.row] = reason
        else:
            body.append(row)
    return body, left_out


def _refuse_reading(row: CsvRecord, header: CsvRecord, numeric: set[int], file: str) -> None:
    """Refuse to leave out a row that is a reading when its single cell is divided at another separator.

    Raises:
        DatasetError: It has as many cells as the headings then, and numbers where the table has them.
    """
    filled = [cell for cell in row.cells if cell.strip()]
    if len(filled) != 1:
        return
    width = len([cell for cell in header.cells if cell.strip()])
    for separator in SEPARATORS:
        cells = split_cells(filled[0].strip().strip('"'), separator)
        numbers = sum(map(is_measured, cells))
        if len(cells) == width > 1 and numbers >= max(len(numeric), 1):
            raise other_separator_error(file, row.row, filled[0])


def _refuse_other_headings(rows: Sequence[CsvRecord], header: CsvRecord, file: str) -> None:
    """Refuse a row of words in every column among rows of numbers, unless it is the headings again.

    Raises:
        DatasetError: There is such a row.
    """
    width = max(sum(bool(cell.strip()) for cell in header.cells), 2)
    last = max((i for i, row in enumerate(rows) if count_words_and_numbers(row)[1]), default=0)
    for row in rows[1:last]:
        words, numbers = count_words_and_numbers(row)
        if words >= width > numbers == 0 and len({*row.cells}) > 1 and not is_units(row) and not _is_same(row, header):
            raise DatasetError(
                f"{file}, row {row.row}: every column has words ({shown(' '.join(row.cells))}) above further rows of "
                f"numbers, as headings do, but not those of row {header.row}; put what is below into a file of its own, or "
                "delete the row if its columns are the same."
            )


def _is_same(row: CsvRecord, header: CsvRecord) -> bool:
    """Return whether a row has the headings again, in whatever spelling of letters and spaces."""
    return [plain_name(cell) for cell in row.cells] == [plain_name(cell) for cell in header.cells]


def _find_next_table(rows: Sequence[CsvRecord], header: CsvRecord, file: str) -> int:
    """Return the position of the first row of several words behind a blank one, where the table ends; else the number of rows.

    Raises:
        DatasetError: So many rows that fit the table follow that they may belong to it.
    """
    seen = False
    for i, row in enumerate(rows):
        if seen and rows[i - 1].blank and is_words(row) and not count_words_and_numbers(row)[1] and row.cells != header.cells:
            numeric = _numeric_columns(rows[:i])
            filled = sorted(_filled(above, numeric) for above in rows[:i] if _agrees(above, numeric))
            usual = filled[len(filled) // 2] if filled else 1
            below = sum(_agrees(above, numeric) and _filled(above, numeric) >= usual for above in rows[i + 1 :])
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
                if cell.strip() and cell.strip().lower() not in BLANK:
                    balance[i] = balance.get(i, 0) + (1 if is_measured(cell) else -1)
    return {i for i, excess in balance.items() if excess > 0}


def _agrees(row: CsvRecord, numeric: set[int]) -> bool:
    """Return whether a row has numbers where the table has them, and no words there."""
    cells = [row.cells[i] for i in numeric if i < len(row.cells) and row.cells[i].strip().lower() not in BLANK]
    return bool(cells) and 2 * len(cells) >= len(numeric) and all(map(is_measured, cells))


def _filled(row: CsvRecord, numeric: set[int]) -> int:
    """Return how many of the columns of numbers have one in a row."""
    return sum(i < len(row.cells) and is_measured(row.cells[i]) for i in numeric)


def _misfits(row: CsvRecord, numeric: set[int]) -> bool:
    """Return whether a row holds a reading among words, as one with a bad cell does, and no statistics."""
    numbers = any(is_measured(row.cells[i]) for i in numeric if i < len(row.cells) and row.cells[i].strip())
    return numbers and not is_summary(row.cells)


def _statistics_start(rows: Sequence[CsvRecord], end: int, numeric: set[int]) -> int:
    """Return where statistics begin that stand at the end behind a blank row, each under a name of its own; else `end`."""
    start = next((i for i in range(end - 1, -1, -1) if rows[i].blank), -1) + 1
    last = rows[start:end]
    labels = [
        cell.strip().lower() for row in last for i, cell in enumerate(row.cells) if i not in numeric and cell.strip()
    ]
    is_block = start > 0 and len(last) <= _MOST_STATISTICS and len(set(labels)) == len(labels)
    return start if is_block and all(is_summary(row.cells) for row in last) else end


def _explain_row_inside(row: CsvRecord, header: CsvRecord, numeric: set[int]) -> str:
    """Return why a row among the readings is none; empty where it is one."""
    words, numbers = count_words_and_numbers(row)
    if not numbers and (_is_same(row, header) or is_units(row)):
        return AGAIN
    if not numbers and words == 1 and len(numeric) > 1:
        return BETWEEN
    at_number = [cell for i, cell in enumerate(row.cells) if i in numeric]
    return _INSIDE if is_summary(at_number) else ""


_TOGETHER = re.compile(r"\d\s*[,;|\t ]\s*[-+]?\d")


@lru_cache(1 << 14)  # it is asked of every cell again and again, and many cells hold the same
def is_measured(text: str) -> bool:
    """Return whether a cell holds what a table measures: a number with or without a unit, a percentage, a limit such as <10."""
    return is_plain_number(text.strip().rstrip("%").lstrip("<≤=")) or is_reading(text)


def _is_bare_number(text: str) -> bool:
    """Return whether a cell holds a number without a unit or an error, as no heading does."""
    return is_measured(text) and not is_reading(text)


def count_numbers(rows: Sequence[CsvRecord], separator: str) -> int:
    """Return how many cells hold numbers, less those in which two numbers stand together: the most for the right separator.

    Blanks, which separate words too, count for less by every word between them.
    """
    total = 0
    for row in rows:
        filled = [cell for cell in row.cells if cell.strip()]
        numbers = sum(map(is_measured, filled))
        wrong = filled if separator == " " else list(filter(_TOGETHER.search, filled))
        total += numbers - sum(not is_measured(cell) for cell in wrong) * (1 if separator == " " else 2)
    return total


def count_words_and_numbers(row: CsvRecord, is_number: Callable[[str], bool] = is_measured) -> tuple[int, int]:
    """Return how many cells hold words, and how many numbers; marks for nothing are neither."""
    filled = [cell for cell in row.cells if cell.strip()]
    numbers = sum(map(is_number, filled))
    return sum(cell.strip().lower() not in BLANK for cell in filled) - numbers, numbers


def is_words(row: CsvRecord, least: int = 2) -> bool:
    """Return whether a row can be one of headings: nothing but words, or numbers with a unit."""
    words, numbers = count_words_and_numbers(row, _is_bare_number)
    return not numbers and words >= least


def is_units(row: CsvRecord) -> bool:
    """Return whether it holds nothing but units."""
    return not count_words_and_numbers(row)[1] and is_units_row(row.cells)
