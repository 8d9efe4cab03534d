"""Text files as rows of cells, for tables and recordings alike: what separates the columns, and what the other lines are."""

import re
from collections.abc import Mapping, Sequence

from bowdenfit.files.cells import parse_number
from bowdenfit.files.layout import header_position
from bowdenfit.files.measured_cells import is_measured
from bowdenfit.files.row_account import BLANK, COMMENT
from bowdenfit.files.text_file import (
    SEPARATORS,
    CsvRecord,
    Line,
    comment_mark,
    declared_separator,
    is_blank,
    split_cells,
    split_records,
)

_TOGETHER = re.compile(r"\d\s*[,;|\t ]\s*[-+]?\d")
_FIRST_ROWS = 300  # judged: rows by which the separator is chosen
_SEPARATOR, _CONTINUED = "the separator", "the rest of a cell that runs over several rows"


def split_rows(lines: Sequence[Line], file: str, comments: str, most: int) -> tuple[str, list[CsvRecord]]:
    """Return what separates the columns of a text, and its rows but for comments.

    Args:
        lines: All lines, or the first of them.
        file: Name of the file.
        comments: Marks of comments, such as "#%".
        most: Lines over which a quoted cell may run.

    Raises:
        DatasetError: A first line declares what separates nothing.
    """
    declared, below = declared_separator(list(lines), file)
    texts = [line for line in below if not _is_comment(line, comments)]
    separator = declared or _choose_separator(texts[:_FIRST_ROWS])
    return separator, list(split_records(texts, separator, most))


def explain_lines(
    lines: Sequence[Line], rows: Sequence[CsvRecord], left_out: Mapping[int, tuple[str, str]], comments: str
) -> dict[int, tuple[str, str]]:
    """Return why lines are not read and what they say, by their numbers.

    Args:
        lines: Lines of a text.
        rows: The rows that `split_rows` made of them.
        left_out: Why rows with cells are not read, and what they say, by their numbers.
        comments: Marks of comments.
    """
    by_number = {row.row: row for row in rows}
    reasons: dict[int, tuple[str, str]] = {}
    for line in lines:
        row = by_number.get(line.row)
        if line.text.strip().strip('"').lower().startswith("sep="):
            reasons[line.row] = _SEPARATOR, ""
        elif _is_comment(line, comments) and row is None:
            reasons[line.row] = COMMENT, ""
        elif is_blank(line.text) or (row and row.blank):
            reasons[line.row] = BLANK, ""
        elif line.row in left_out:
            reasons[line.row] = left_out[line.row]
        elif row is None:
            reasons[line.row] = _CONTINUED, ""
    return reasons


def find_headings_in_comments(lines: Sequence[Line], width: int, separator: str) -> CsvRecord | None:
    """Return the last comment of some lines that has a name for each column; None without one.

    Args:
        lines: The lines over the data.
        width: Number of columns.
        separator: What separates them.
    """
    for line in reversed([line for line in lines if comment_mark(line.text)]):
        cells = split_cells(line.text.strip().lstrip("#% "), separator)
        if len(cells) == width and all(cell.strip() for cell in cells):
            return CsvRecord(line.row, line.start, cells)
    return None


def _is_comment(line: Line, comments: str) -> bool:
    mark = comment_mark(line.text)
    return bool(mark) and mark in comments


def _choose_separator(lines: Sequence[Line]) -> str:
    """Return what separates the columns of some lines: the separator by which headings fit and most cells are numbers."""
    text = "".join(line.text for line in lines)
    return max((s for s in SEPARATORS if s in (SEPARATORS[0], " ") or s in text), key=lambda s: _score_separator(lines, s))


def _score_separator(lines: Sequence[Line], separator: str) -> tuple[bool, int, bool, bool, int]:
    """Return how well a separator splits rows: headings over all numbers, most numbers, equally many cells, most cells.

    Blanks, which stand in headings too, separate columns only where nothing else does.
    """
    rows = [row for row in split_records(lines, separator, len(lines)) if not row.blank]
    numbers = _count_numbers(rows, separator)
    position = header_position(rows) if numbers > 0 else None
    room = len(rows[position].cells) if position is not None else 0
    fits = position is not None and not any(is_measured(cell) for row in rows[position:] for cell in row.cells[room:])
    widths = [len(row.cells) for row in rows] or [0]
    alike = widths[0] > 1 and len(set(widths)) == 1 and all(row.closed for row in rows)
    return fits, numbers, separator != " ", alike, widths[0]


def _count_numbers(rows: Sequence[CsvRecord], separator: str) -> int:
    """Return how many cells hold numbers, less those in which two numbers stand together: the most for the right separator.

    Blanks, which separate words too, count for less by every word between them, except where words stand once over each
    column of numbers.
    """
    if separator == " " and _has_one_word_over_each_column(rows):
        rows = rows[1:]
    total = 0
    for row in rows:
        filled = [cell for cell in row.cells if cell.strip()]
        numbers = sum(map(is_measured, filled))
        wrong = filled if separator == " " else list(filter(_TOGETHER.search, filled))
        total += numbers - sum(not is_measured(cell) for cell in wrong) * (1 if separator == " " else 2)
    return total


def _has_one_word_over_each_column(rows: Sequence[CsvRecord]) -> bool:
    columns = {len(row.cells) for row in rows}
    return len(columns) == 1 and columns != {1} and all(is_measured(cell) for row in rows[1:] for cell in row.cells)


def choose_decimal(rows: Sequence[CsvRecord]) -> str:
    """Return the decimal mark by which most cells are numbers."""
    cells = [cell for row in rows for cell in row.cells]
    return max(".,", key=lambda mark: sum(parse_number(cell, mark) is not None for cell in cells))
