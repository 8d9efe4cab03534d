"""Where the headings and the data of a sheet are, for tables and recordings alike.

`find_headings` finds the row of headings, by the numbers below it, with the groups over it and the units under it;
`find_layout` says for a recording what its columns hold and where they begin.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, zip_longest

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import Kind, classify_cell, parse_number
from bowdenfit.files.clocks import names_time
from bowdenfit.files.headings import Heading, heading_of, is_number, refuse_two_units, strip_brackets
from bowdenfit.files.measured_cells import is_reading
from bowdenfit.files.sheet_rows import (
    count_words_and_numbers,
    drop_label,
    is_bare_number,
    is_same,
    is_summary,
    is_units,
    is_words,
)
from bowdenfit.files.spellings import parse_heading
from bowdenfit.files.text_file import CsvRecord
from bowdenfit.types import Vector
from bowdenfit.units import is_unit
from bowdenfit.words import shown

_KINDS: tuple[Kind, ...] = ("number", "date", "text")
_NEAR_TOP = 60  # judged: rows in which headings are looked for
_MOST_NUMBERS_OVER = 2  # judged: rows of numbers over the headings of a recording, such as angle and trial
_STEPS = 60  # judged: rows that are enough to see a clock rise in even steps
_UNEVEN = 3.0  # judged: largest step of a clock over its smallest
_FEWEST_ROWS = 4  # judged: rows from which one of numbers may be the headings of the others


@dataclass(frozen=True)
class Headings:
    """The headings of a sheet.

    Args:
        rows: The rows that hold headings and their units, from above.
        header: Of these the one that names the columns.
        names: Heading of each column, behind that of its group.
        units: The unit below each name; empty without one.
    """

    rows: tuple[CsvRecord, ...]
    header: CsvRecord
    names: tuple[str, ...]
    units: tuple[str, ...]


def find_headings(rows: Sequence[CsvRecord], place: str, groups: bool = True) -> Headings | None:
    """Return the headings of a sheet by all its rows, or the first of them; None where no row of words stands over numbers.

    Args:
        rows: The rows that are no comments.
        place: File, and sheet where it has several.
        groups: Whether words over headings that repeat themselves belong to them, as numbers always do.

    Raises:
        DatasetError: A unit below a heading is another than the one in it.
    """
    filled = [row for row in rows if not row.blank]
    position = header_position(filled)
    return None if position is None else read_headings(filled, position, place, groups)


def header_position(filled: Sequence[CsvRecord]) -> int | None:
    """Return which of the rows holds the headings: that of words alone over most numbers; None where there is none."""
    widest = max((len([cell for cell in row.cells if cell.strip()]) for row in filled), default=0)
    least = 2 if widest > 1 else 1
    best: int | None = None
    current: int | None = None
    most = score = 0
    for i, row in enumerate(filled):
        words = i < _NEAR_TOP and is_words(row, least) and not _has_units_as_neighbors(filled, i)
        below = current is not None and (is_same(row, filled[current]) or (i == current + 1 and is_units(row)))
        if words and not below:
            current, score = i, 0
        elif current is not None:
            score += count_words_and_numbers(row)[1]
            if score > most:
                best, most = current, score
    return best


def _has_units_as_neighbors(filled: Sequence[CsvRecord], i: int) -> bool:
    """Return whether a row has numbers with units or errors where a row next to it has them, as rows of readings do.

    A row of headings may have them too, such as 45° and 90° over forces.
    """
    columns = {k for k, cell in enumerate(filled[i].cells) if is_reading(cell)}
    neighbors = [filled[k] for k in (i - 1, i + 1) if 0 <= k < len(filled)] if columns else []
    return any(is_reading(row.cells[k]) for row in neighbors for k in columns if k < len(row.cells))


def read_headings(filled: Sequence[CsvRecord], position: int, place: str, groups: bool = True) -> Headings:
    """Return the headings in one of the rows that are not blank, with the units below and, with `groups`, any words above.

    Raises:
        DatasetError: A unit below a heading is another than the one in it.
    """
    header = filled[position]
    rows, units = [header], list[str]()
    if position + 1 < len(filled) and is_units(filled[position + 1]):
        below = filled[position + 1]
        rows.append(below)
        units = [strip_brackets(cell) for cell in below.cells]
        refuse_two_units(f"{place}, row {below.row}", header.cells, units)
    names = [" ".join(cell.split()) for cell in header.cells]
    above = list(filled[max(position - 2, 0) : position])
    if len(above) > 1 and not units and is_units(above[-1]) and _repeats(above[0]):  # names, units, and which end they are of
        units = [strip_brackets(cell) for cell in above[-1].cells]
        names, rows = _join_groups(above[0].cells, names), [*above, *rows]
    elif above and (_is_over(above[-1], names, groups) or _completes(above[-1], names) or _names_units(above[-1], names)):
        names = _join_groups(drop_label(above[-1].cells), names)
        rows.insert(0, above[-1])
    return Headings(tuple(rows), header, tuple(names), tuple(units))


def _is_over(above: CsvRecord, names: Sequence[str], groups: bool) -> bool:
    """Return whether a row is a first row of headings: numbers alone, or over numbers, or over headings that repeat."""
    written = [name.lower() for name in names if name]
    is_repeated, are_numbers = len(set(written)) < len(written), all(map(is_number, written))
    if len(above.cells) < 2:
        return False
    if all(is_number(cell) for cell in above.cells if cell.strip()):
        return True
    are_labeled = all(is_number(cell) for cell in drop_label(above.cells) if cell.strip())
    return (are_labeled and (is_repeated or are_numbers)) or (is_repeated and groups and is_words(above, 1))


def _repeats(row: CsvRecord) -> bool:
    """Return whether a row is one of words of which some stand over several columns, one by one, such as Time, Force, Force."""
    written = [cell.strip().lower() for cell in row.cells if cell.strip()]
    return is_words(row) and not is_units(row) and len(set(written)) < len(written)


def _completes(above: CsvRecord, names: Sequence[str]) -> bool:
    """Return whether a row of words has the only heading of a column, such as the time beside input and output.

    Its words repeat, or it has others over the first of several names, as merged cells are exported.
    """
    alone = [upper for upper, name in zip(above.cells, names, strict=False) if upper.strip() and not name]
    groups = [upper for upper, name in zip(above.cells, names, strict=False) if upper.strip() and name]
    is_quantity = any(heading_of(upper).unit or parse_heading(upper) or names_time(upper) for upper in alone)
    written = [name.lower() for name in names if name]
    is_merged = is_words(above) and is_quantity and 0 < len(groups) < len(written) == len(set(written))
    return bool(alone) and (_repeats(above) or is_merged)


def _names_units(above: CsvRecord, names: Sequence[str]) -> bool:
    """Return whether a row of words has the name of each column whose heading is a unit in brackets alone, such as [deg]."""
    pairs = zip([*above.cells, *[""] * len(names)], names, strict=False)
    unnamed = [upper.strip() for upper, name in pairs if name != strip_brackets(name) and is_unit(strip_brackets(name))]
    return bool(unnamed) and all(unnamed) and is_words(above)


def _join_groups(above: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return headings with the group before them that stands over the first of its columns, as merged cells are exported.

    A column that has a heading in the upper row alone, such as the time beside groups of runs, keeps that.
    """
    upper = [" ".join(cell.split()) for cell in (*above, *[""] * len(names))][: len(names)]
    joined, group = list[str](), ""
    for name, cell in zip(names, upper, strict=True):
        group = cell or group
        joined.append(f"{group} {name}".strip() if name else cell)
    return joined


def refuse_readings_above(filled: Sequence[CsvRecord], headings: Headings, place: str, most: int = 0) -> None:
    """Refuse readings above the headings, rather than leave them out.

    Args:
        filled: The rows that are not blank.
        headings: The headings.
        place: File, and sheet where it has several.
        most: Rows of numbers that may be a part of the headings.

    Raises:
        DatasetError: There are more rows of numbers than that, as wide as the headings, or some behind other headings.
    """
    header, columns = headings.header, sum(map(bool, headings.names))
    above = [row for row in filled if row.row < header.row]
    counts = [count_words_and_numbers(row, is_bare_number) for row in above]
    samples = [row for row, (words, numbers) in zip(above, counts, strict=True) if numbers >= max(columns, 2) and not words]
    if len(samples) > most:
        raise DatasetError(
            f"{place}, row {samples[0].row}: it has numbers ({shown(samples[0].cells[0])}, ...) above the headings in row "
            f"{header.row}; put the headings over all rows of the table, or delete the rows above them."
        )
    for i, (row, (words, numbers)) in enumerate(zip(above, counts, strict=True)):
        if words + numbers == columns and numbers > max(most, 1) and any(is_words(other, columns) for other in above[:i]):
            raise DatasetError(
                f"{place}, row {row.row}: a row of a table ({shown(' '.join(row.cells))}) is above the headings in row "
                f"{header.row}; put what is above these into a file of its own, or delete it, and row {header.row} too if its "
                "columns are the same."
            )


@dataclass(frozen=True)
class Layout:
    """What the columns of a recording hold and where they begin.

    Args:
        decimal: Decimal mark of its numbers.
        first: The first row of data.
        headings: One for each column; `named` says whether the file gave them.
        kinds: Kind of the cells of each column.
        named: Whether there is a row of headings.
        header: That row; None without.
        heading_cells: Number of cells in the row of headings.
        over: Numbers of the rows of headings and units.
    """

    decimal: str
    first: CsvRecord
    headings: tuple[Heading, ...]
    kinds: tuple[Kind, ...]
    named: bool = False
    header: CsvRecord | None = None
    heading_cells: int = 0
    over: tuple[int, ...] = ()

    @property
    def numeric(self) -> list[int]:
        """Positions of the columns of numbers and dates."""
        return [i for i, kind in enumerate(self.kinds) if kind in ("number", "date")]

    @property
    def room(self) -> int:
        """Number of columns that the headings leave room for; a nameless one may be that of an index."""
        return self.heading_cells + any(not heading.name for heading in self.headings[: self.heading_cells])

    @property
    def fits(self) -> bool:
        """Whether no column stands outside the headings, as happens where decimal commas are taken for separators."""
        return not self.named or all(kind in ("blank", "text") for kind in self.kinds[self.room :])

    def name(self, column: int) -> str:
        """Return what a column is called, by its place where it has no heading."""
        return self.headings[column].name or f"column{column + 1}"


def find_layout(rows: Sequence[CsvRecord], decimal: str, place: str) -> Layout | None:
    """Return how the columns of a recording are laid out, by its first rows; None if they hold no data.

    Headings may be numbers: those in a row with a label before them, and whole ones right over the data where the clocks below
    say so.

    Raises:
        DatasetError: A unit below a heading is another than the one in it.
    """
    filled = [row for row in rows if not row.blank]
    headings = find_headings(filled, place, groups=False)
    data = _rows_of_data(filled, headings, decimal)
    if not data:
        return None
    width = sorted(map(_filled_width, data))[len(data) // 2]
    if headings and _can_head(headings.header, width) and not _is_message(headings.rows[-1], width, filled, data[0]):
        refuse_readings_above(filled, headings, place, _MOST_NUMBERS_OVER)
    else:
        headings, data = _find_numeric_headings(filled, data, decimal, place)
    kinds = _kinds_of_columns(data, decimal)
    if headings is None:
        return Layout(decimal, data[0], tuple(Heading(f"column{i + 1}") for i in range(len(kinds))), kinds)
    units = headings.units[: len(headings.names)]
    written = [heading_of(name, unit) for name, unit in zip_longest(headings.names, units, fillvalue="")]
    named = (*written, *[Heading("")] * len(kinds))[: len(kinds)]
    rising = [_rises(data, i, decimal) for i in range(len(kinds))]
    return Layout(
        decimal,
        data[0],
        pair_clocks(named, rising, [kind == "number" for kind in kinds]),
        kinds,
        True,
        headings.header,
        max(len(row.cells) for row in headings.rows),
        tuple(row.row for row in headings.rows),
    )


def _rows_of_data(filled: Sequence[CsvRecord], headings: Headings | None, decimal: str) -> list[CsvRecord]:
    """Return the rows that hold more numbers and dates than words, and below headings those between them too."""
    above = headings.rows[-1].row if headings else 0
    below = [row for row in filled if row.row > above and not is_summary(row.cells)]
    data = [row for row in below if _holds_data(row, decimal)]
    if not (headings and data):
        return data
    first = next(row.row for row in below if row.row == data[0].row or count_words_and_numbers(row) != (1, 0))
    return [row for row in below if first <= row.row <= data[-1].row]


def _find_numeric_headings(
    filled: Sequence[CsvRecord], data: list[CsvRecord], decimal: str, place: str
) -> tuple[Headings | None, list[CsvRecord]]:
    """Return headings that are numbers, or numbers and words, right over the data, and the rows below them; None without."""
    kinds = _kinds_of_columns(data, decimal)
    start = next((i for i, row in enumerate(data) if _agrees(row, kinds, decimal)), 0)
    above = [replace(row, cells=drop_label(row.cells)) for row in filled if row.row < data[start].row]
    if not (above and _can_head(above[-1], len(kinds))):
        if not _is_numeric_heading(data[start:], decimal):
            return None, data[start:]
        above, start = [*above, data[start]], start + 1
    return read_headings(above, len(above) - 1, place), data[start:]


def is_index(values: Vector) -> bool:
    """Return whether a column without heading only counts its rows, as pandas writes its index."""
    return len(values) > 1 and values[0] in (0, 1) and bool(np.all(values[1:] == values[:-1] + 1))


def _holds_data(row: CsvRecord, decimal: str) -> bool:
    """Return whether a row holds more numbers and dates than words."""
    kinds = [classify_cell(cell, decimal) for cell in row.cells]
    return kinds.count("number") + kinds.count("date") > kinds.count("text")


def _agrees(row: CsvRecord, columns: Sequence[Kind], decimal: str) -> bool:
    """Return whether the cells of a row are of the kinds that the columns have."""
    kinds = [classify_cell(cell, decimal) for cell in row.cells]
    return all("blank" in pair or pair[0] == pair[1] for pair in zip(kinds, columns, strict=False))


def _kinds_of_columns(data: Sequence[CsvRecord], decimal: str) -> tuple[Kind, ...]:
    """Return the kind that most cells of each column have, blank ones aside."""
    columns = zip_longest(*(row.cells for row in data), fillvalue="")
    of_cells: list[list[Kind]] = [[classify_cell(cell, decimal) for cell in column] for column in columns]
    return tuple(max(_KINDS, key=kinds.count) if {*kinds} - {"blank"} else "blank" for kinds in of_cells)


def _can_head(row: CsvRecord, width: int) -> bool:
    """Return whether a row can stand over that many columns: metadata have two cells, headings about as many as the data."""
    return len(row.cells) * 2 >= width and (width == 1 or len(row.cells) > 1)


def _is_message(row: CsvRecord, width: int, filled: Sequence[CsvRecord], first: CsvRecord) -> bool:
    """Return whether words over the data are no headings, as boot lines: they have fewer cells, and other words are between."""
    return _filled_width(row) < width and any(row.row < other.row < first.row for other in filled)


def _filled_width(row: CsvRecord) -> int:
    return max((i + 1 for i, cell in enumerate(row.cells) if cell.strip()), default=0)


def _is_numeric_heading(data: Sequence[CsvRecord], decimal: str) -> bool:
    """Return whether the first row of data, of whole numbers, is one of headings: a column has none, or rises evenly below."""
    first = data[0].cells
    filled = [cell for cell in first if cell.strip()]
    if len(data) < _FEWEST_ROWS or not all(map(is_number, filled)):
        return False
    whole = all(float(cell.replace(",", ".")).is_integer() for cell in filled)
    bare = any(not a.strip() and classify_cell(b, decimal) == "number" for a, b in zip(first, data[1].cells, strict=False))
    jumps = (_rises(data[1:], i, decimal) and not _rises(data, i, decimal) for i in range(len(first)))
    return whole and (bare or any(jumps))


def _rises(data: Sequence[CsvRecord], column: int, decimal: str) -> bool:
    """Return whether the column rises in even steps."""
    cells = (parse_number(row.cells[column], decimal) for row in data[:_STEPS] if column < len(row.cells))
    values = [value for value in cells if value is not None and value == value]
    steps = [after - before for before, after in pairwise(values)]
    return len(steps) > 1 and min(steps) > 0 and max(steps) < _UNEVEN * min(steps)


def pair_clocks(headings: Sequence[Heading], rising: Sequence[bool], numeric: Sequence[bool]) -> tuple[Heading, ...]:
    """Return names for the nameless clocks of sheets that have one heading for each pair of time and force.

    The heading stands over the force, over the time (as a merged cell does), or over both.

    Args:
        headings: One for each column.
        rising: Whether the values of the column rise in even steps.
    """
    named = list(headings)
    for i in range(len(named) - 1):
        here, right = named[i], named[i + 1]
        if not rising[i] or rising[i + 1] or not numeric[i + 1] or names_time(here.name):
            continue
        if not here.name and right.name and not names_time(right.name):
            named[i] = Heading(f"time of {right.name}", here.unit)
        elif here.name and (not right.name or (right.name == here.name and is_number(here.name))):
            named[i], named[i + 1] = Heading(f"time of {here.name}"), replace(here, unit=right.unit or here.unit)
    return tuple(named)
