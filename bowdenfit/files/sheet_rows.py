"""What one row of a sheet is, in tables and recordings alike: headings, units, statistics, a remark, or readings."""

import re
from collections.abc import Callable, Collection, Sequence

from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import MISSING
from bowdenfit.files.clocks import is_date, names_time
from bowdenfit.files.headings import is_number, is_units_row, plain_name
from bowdenfit.files.measured_cells import is_measured, is_reading
from bowdenfit.files.row_account import AGAIN, BETWEEN
from bowdenfit.files.text_file import SEPARATORS, CsvRecord, split_cells
from bowdenfit.words import shown

_SUMMARY = re.compile(
    r"(?:(?:min|max|avg|average|mean|std|stdev|stddev|sd|sem|median|rms|sum|total|count|range|half range|peak|variance|"
    r"minimum|maximum|mittelwert|summe|anzahl|moyenne|media|standard deviation|standardabweichung)[\s:.=]*)",
    re.IGNORECASE,
)
_INSIDE = "statistics between the rows"


def count_words_and_numbers(row: CsvRecord, test: Callable[[str], bool] = is_measured) -> tuple[int, int]:
    """Return how many cells hold words, and how many numbers; marks for nothing are neither."""
    filled = [cell for cell in row.cells if cell.strip()]
    numbers = sum(map(test, filled))
    return sum(cell.strip().lower() not in MISSING for cell in filled) - numbers, numbers


def is_words(row: CsvRecord, least: int = 2) -> bool:
    """Return whether a row can be one of headings: nothing but words, or numbers with a unit."""
    words, numbers = count_words_and_numbers(row, is_bare_number)
    return not numbers and words >= least


def is_bare_number(text: str) -> bool:
    """Return whether a cell holds a number without a unit or an error, as no heading does."""
    return is_measured(text) and not is_reading(text)


def is_units(row: CsvRecord) -> bool:
    """Return whether a row holds nothing but units."""
    return not count_words_and_numbers(row)[1] and is_units_row(row.cells)


def is_same(row: CsvRecord, header: CsvRecord | None) -> bool:
    """Return whether a row has the headings again, in whatever spelling of letters and spaces."""
    return header is not None and list(map(plain_name, row.cells)) == list(map(plain_name, header.cells))


def is_summary(cells: Sequence[str]) -> bool:
    """Return whether a row below the data is one of minima, averages and the like."""
    return any(_SUMMARY.fullmatch(cell.strip()) for cell in cells)


def drop_label(cells: Sequence[str]) -> list[str]:
    """Return a row of numbers over columns ("Angle", 45, 45, 90) without the word before it that says what they are."""
    filled = [i for i, cell in enumerate(cells) if cell.strip()]
    labeled = len(filled) > 1 and not is_number(cells[filled[0]]) and all(is_number(cells[i]) for i in filled[1:])
    if labeled and not names_time(cells[filled[0]]):
        return ["" if i == filled[0] else cell for i, cell in enumerate(cells)]
    return list(cells)


def explain_row(row: CsvRecord, header: CsvRecord | None, numeric: Collection[int]) -> str:
    """Return why a row among the readings is none; empty where it is one.

    Args:
        row: The row.
        header: The row of headings; None without.
        numeric: Positions of the columns of numbers.
    """
    words, numbers = count_words_and_numbers(row)
    if not numbers and (is_same(row, header) or is_units(row)):
        return AGAIN
    if not numbers and words == 1 and len(numeric) > 1:
        return BETWEEN
    return _INSIDE if is_summary([cell for i, cell in enumerate(row.cells) if i in numeric]) else ""


def refuse_other_headings(place: str, row: CsvRecord, header: CsvRecord | None, width: int) -> None:
    """Refuse a row that has words in every column, as headings do, unless it is the headings or their units again.

    Args:
        place: File, and sheet where it has several.
        row: A row above further ones of numbers.
        header: The row of headings; None without.
        width: How many columns have headings, or cells where there are none.

    Raises:
        DatasetError: It is such a row.
    """
    words, numbers = count_words_and_numbers(row)
    if words >= max(width, 2) and not numbers and len({*row.cells}) > 1 and not is_units(row) and not is_same(row, header):
        raise DatasetError(
            f"{place}, row {row.row}: every column has words ({shown(' '.join(row.cells))}), as headings do, but not those "
            "at the top; the usual cause is a second table or recording below the first. Put what is below into a file of its "
            "own, or delete the row if its columns are the same."
        )


def refuse_other_separator(place: str, row: int, text: str, width: int, numeric: Collection[int]) -> None:
    """Refuse to leave out a text that is a row of readings when it is divided at another separator.

    Args:
        place: File, and sheet where it has several.
        row: Number of the row.
        text: All that stands in it.
        width: Number of columns.
        numeric: Positions of the columns of numbers and dates.

    Raises:
        DatasetError: It has as many cells as there are columns then, and numbers where they have them.
    """
    for separator in SEPARATORS:
        cells = [cell.strip() for cell in split_cells(text.strip().strip('"'), separator)]
        if len(cells) != width or width == 1:
            continue
        of_numbers = [cells[i] for i in numeric if i < width]
        if any(map(is_measured, of_numbers)) and all(map(_may_be_sample, of_numbers)):
            raise DatasetError(
                f"{place}, row {row}: {shown(text)} looks like a row of readings, but its cells are not separated as those of "
                "the other rows; the usual causes are rows that were pasted from another file, and quotation marks around a "
                "whole row. Separate its columns as in the other rows, or begin the row with # if it is a remark."
            )


def _may_be_sample(cell: str) -> bool:
    return is_measured(cell) or is_date(cell) or cell.lower() in MISSING
