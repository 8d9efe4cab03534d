"""What stands in the rows of a table: numbers, words, or units."""

import re
from collections.abc import Sequence
from functools import lru_cache

from bowdenfit.files.cells import BLANK, is_plain_number
from bowdenfit.files.csv_rows import CsvRecord
from bowdenfit.files.headings import is_units_row

_TOGETHER = re.compile(r"\d\s*[,;|\t ]\s*[-+]?\d")


@lru_cache(1 << 14)  # it is asked of every cell again and again, and many cells hold the same
def is_measured(text: str) -> bool:
    """Whether a cell holds what a table measures: a number, a percentage, or a limit such as <10."""
    return is_plain_number(text.strip().rstrip("%").lstrip("<≤="))


def numbers_found(rows: Sequence[CsvRecord], separator: str) -> int:
    """How many cells hold numbers, less those in which two numbers stand together: the most for the right separator.

    Blanks, which separate words too, count for less by every word between them.
    """
    total = 0
    for row in rows:
        filled = [cell for cell in row.cells if cell.strip()]
        numbers = sum(map(is_measured, filled))
        wrong = filled if separator == " " else list(filter(_TOGETHER.search, filled))
        total += numbers - sum(not is_measured(cell) for cell in wrong) * (1 if separator == " " else 2)
    return total


def words_and_numbers(row: CsvRecord) -> tuple[int, int]:
    """How many cells hold words, and how many numbers; marks for nothing are neither."""
    filled = [cell for cell in row.cells if cell.strip()]
    numbers = sum(map(is_measured, filled))
    return sum(cell.strip().lower() not in BLANK for cell in filled) - numbers, numbers


def is_words(row: CsvRecord, least: int = 2) -> bool:
    """Whether a row can be one of headings: nothing but words."""
    words, numbers = words_and_numbers(row)
    return not numbers and words >= least


def is_units(row: CsvRecord) -> bool:
    """Whether it holds nothing but units."""
    return not words_and_numbers(row)[1] and is_units_row(row.cells)
