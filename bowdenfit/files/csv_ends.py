"""The last lines of a CSV file: rows of statistics, marks of its end, and a line that breaks off."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bowdenfit.files.csv_start import Sheet, cells_of
from bowdenfit.files.layout import is_summary, kind_of
from bowdenfit.files.text_file import Line, is_comment, last_lines, rows_before

_LAST_BYTES = 1 << 16
_MOST_SUMMARY_ROWS = 40
_MOST_ROWS_AFTER_BLANK = 10


@dataclass(frozen=True)
class End:
    """Where the data end [bytes], and what stands after them."""

    stop: int
    remarks: tuple[str, ...]


def data_end(path: Path, sheet: Sheet, size: int) -> End:
    """Where the data of a file end."""
    lines = last_lines(path, sheet.encoding, sheet.start, size, _LAST_BYTES)
    if not lines:
        return End(size, ())
    rows = [cells_of(line.text, sheet.separator) for line in lines]
    remarks: list[str] = []
    stop = len(lines)
    if stop and _is_cut(lines, rows):
        stop -= 1
        remarks.append(f"The file breaks off in row {_row(path, lines, stop)}; that row was left out.")
    first = _first_summary(lines[:stop], rows[:stop], sheet)
    if first < stop:
        below = [i for i in range(first, stop) if not (lines[i].blank or is_comment(lines[i].text))]
        if below:
            top, bottom = _row(path, lines, below[0]), _row(path, lines, below[-1])
            where = f"Row {top} was" if top == bottom else f"Rows {top} to {bottom} were"
            remarks.append(f"{where} left out: they stand below the data, as statistics do.")
        stop = first
    return End(lines[stop].start if stop < len(lines) else size, tuple(remarks))


def _row(path: Path, lines: Sequence[Line], position: int) -> int:
    return rows_before(path, lines[position].start) + 1


def _first_summary(lines: Sequence[Line], rows: Sequence[Sequence[str]], sheet: Sheet) -> int:
    """Position of the first line below the data; the number of lines if there is none."""
    labels = [
        i for i, (line, row) in enumerate(zip(lines, rows, strict=True)) if not line.blank and _is_below(row, sheet)
    ]
    first = labels[0] if labels and len(lines) - labels[0] <= _MOST_SUMMARY_ROWS else len(lines)
    while first > 0 and (lines[first - 1].blank or _without_numbers(lines[first - 1], rows[first - 1], sheet)):
        first -= 1
    blanks = [i for i in range(first) if not lines[i].text.strip()]
    single = bool(blanks) and blanks == list(range(blanks[0], blanks[-1] + 1))
    if single and 0 < first - blanks[-1] - 1 <= _MOST_ROWS_AFTER_BLANK and blanks[0] > 2 * (first - blanks[-1]):
        first = blanks[0]
    return first


def _is_below(row: Sequence[str], sheet: Sheet) -> bool:
    """Whether a row is labeled as a statistic in a column that holds no words in the data."""
    texts = [cell for i, cell in enumerate(row) if _kind(sheet, i) != "text"]
    return is_summary(texts)


def _without_numbers(line: Line, row: Sequence[str], sheet: Sheet) -> bool:
    """Whether a line is text only, such as "End of data" or a comment."""
    kinds = {kind_of(cell, sheet.decimal) for cell in row}
    return is_comment(line.text) or ("text" in kinds and not kinds & {"number", "date"} and len(sheet.layout.kinds) > 1)


def _kind(sheet: Sheet, column: int) -> str:
    return sheet.layout.kinds[column] if column < len(sheet.layout.kinds) else "blank"


def _is_cut(lines: Sequence[Line], rows: Sequence[Sequence[str]]) -> bool:
    """Whether the file breaks off in its last line: it has no end, and fewer cells or digits than the lines before."""
    whole = [row for line, row in zip(lines[-51:-1], rows[-51:-1], strict=True) if not line.blank]
    last = rows[-1]
    if lines[-1].ended or lines[-1].blank or not whole or is_comment(lines[-1].text) or is_summary(last):
        return False
    if len(last) < min(map(len, whole)):
        return True
    ends = [row[-1].strip() for row in whole if len(row) == len(last)]
    return bool(ends) and (len(last[-1].strip()) < min(map(len, ends)) or last[-1].strip()[-1:] in {*"eE+-"})
