"""The rows of a table below its headings: which hold readings, and why the others do not.

The table ends where rows stop to agree with its columns; a block of text below it starts behind a blank row.
"""

from collections.abc import Sequence

from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import BLANK
from bowdenfit.files.csv_rows import SEPARATORS, CsvRecord, cells_of
from bowdenfit.files.layout import is_summary
from bowdenfit.files.row_account import AGAIN, BELOW, BETWEEN
from bowdenfit.files.table_rows import is_measured, is_units, is_words, words_and_numbers
from bowdenfit.words import shown

_MOST_STATISTICS = 8  # rows of statistics that may stand below text columns
_FEWEST_ALIKE, _SHARE_ALIKE = 2, 0.05  # rows below words, and of those above, from which they may belong to the table
_STATISTICS, _INSIDE = "statistics below the table", "statistics between the rows"


def readings(rows: Sequence[CsvRecord], header: CsvRecord, file: str) -> tuple[list[CsvRecord], dict[int, str]]:
    """The rows of readings below the headings, and why the others are none.

    Raises:
        DatasetError: A row that would be left out looks like a reading.
    """
    stop = _other_table(rows, header, file)
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
        why = _inside(row, header, numeric) if i < end else (_STATISTICS if is_summary(row.cells) else BELOW)
        if why:
            _refuse_reading(row, header, numeric, file)
            left_out[row.row] = why
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
        cells = cells_of(filled[0].strip().strip('"'), separator)
        numbers = sum(map(is_measured, cells))
        if len(cells) == width > 1 and numbers >= max(len(numeric), 1):
            raise DatasetError(
                f"{file}, row {row.row}: {shown(filled[0])} looks like a row of readings, but its cells are not separated as "
                "those of the rows above; the usual causes are rows that were pasted from another file, and quotation marks "
                "around a whole row. Separate its columns as in the other rows, or begin the row with # if it is a remark."
            )


def _other_table(rows: Sequence[CsvRecord], header: CsvRecord, file: str) -> int:
    """Position of the first row of several words behind a blank one, where the table ends; the number of rows if none.

    Raises:
        DatasetError: So many rows that fit the table follow that they may belong to it.
    """
    seen = False
    for i, row in enumerate(rows):
        if seen and rows[i - 1].blank and is_words(row) and row.cells != header.cells:
            numeric = _numeric_columns(rows[:i])
            filled = sorted(_filled(above, numeric) for above in rows[:i] if _agrees(above, numeric))
            usual = filled[len(filled) // 2] if filled else 1
            below = sum(_agrees(above, numeric) and _filled(above, numeric) >= usual for above in rows[i + 1 :])
            if below >= max(_FEWEST_ALIKE, _SHARE_ALIKE * len(filled)):
                raise DatasetError(
                    f"{file}, row {row.row}: words stand there ({shown(' '.join(row.cells))}) behind a blank row, and {below} "
                    "rows of numbers in the same columns below them; if these belong to the table, delete the words or begin "
                    "that row with #, and if they are another table, put it into a file of its own."
                )
            return i
        seen = seen or words_and_numbers(row)[1] > 0
    return len(rows)


def _numeric_columns(rows: Sequence[CsvRecord]) -> set[int]:
    """Columns that hold more numbers than words."""
    balance: dict[int, int] = {}
    for row in rows:
        if words_and_numbers(row)[1]:
            for i, cell in enumerate(row.cells):
                if cell.strip() and cell.strip().lower() not in BLANK:
                    balance[i] = balance.get(i, 0) + (1 if is_measured(cell) else -1)
    return {i for i, excess in balance.items() if excess > 0}


def _agrees(row: CsvRecord, numeric: set[int]) -> bool:
    """Whether a row has numbers where the table has them, and no words there."""
    cells = [row.cells[i] for i in numeric if i < len(row.cells) and row.cells[i].strip().lower() not in BLANK]
    return bool(cells) and 2 * len(cells) >= len(numeric) and all(map(is_measured, cells))


def _filled(row: CsvRecord, numeric: set[int]) -> int:
    """How many of the columns of numbers have one in a row."""
    return sum(i < len(row.cells) and is_measured(row.cells[i]) for i in numeric)


def _misfits(row: CsvRecord, numeric: set[int]) -> bool:
    """Whether a row holds a reading among words, as one with a bad cell does, and no statistics."""
    numbers = any(is_measured(row.cells[i]) for i in numeric if i < len(row.cells) and row.cells[i].strip())
    return numbers and not is_summary(row.cells)


def _statistics_start(rows: Sequence[CsvRecord], end: int, numeric: set[int]) -> int:
    """Where statistics begin that stand at the end behind a blank row, each under a name of its own; else `end`."""
    start = next((i for i in range(end - 1, -1, -1) if rows[i].blank), -1) + 1
    last = rows[start:end]
    labels = [cell.strip().lower() for row in last for i, cell in enumerate(row.cells) if i not in numeric and cell.strip()]
    is_block = start > 0 and len(last) <= _MOST_STATISTICS and len(set(labels)) == len(labels)
    return start if is_block and all(is_summary(row.cells) for row in last) else end


def _inside(row: CsvRecord, header: CsvRecord, numeric: set[int]) -> str:
    """Why a row among the readings is none; empty where it is one."""
    words, numbers = words_and_numbers(row)
    if not numbers and (row.cells == header.cells or is_units(row)):
        return AGAIN
    if not numbers and words == 1 and len(numeric) > 1:
        return BETWEEN
    at_number = [cell for i, cell in enumerate(row.cells) if i in numeric]
    return _INSIDE if is_summary(at_number) else ""
