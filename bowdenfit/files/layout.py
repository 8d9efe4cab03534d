"""Where the numbers of a sheet begin and what stands over them, seen from its first rows."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bowdenfit.files.cells import Kind, classify_cell, parse_number
from bowdenfit.files.clocks import names_time
from bowdenfit.files.headings import Heading, heading_of, is_number, is_units_row
from bowdenfit.types import Vector

Rows = Sequence[Sequence[str]]
_SUMMARY = re.compile(
    r"(?:(?:min|max|avg|average|mean|std|stdev|stddev|sd|sem|median|rms|sum|total|count|range|half range|peak|variance|"
    r"minimum|maximum|mittelwert|summe|anzahl|moyenne|media|standard deviation|standardabweichung)[\s:.=]*)",
    re.IGNORECASE,
)
_STEPS = 60  # judged: rows that are enough to see a clock rise in even steps
_UNEVEN = 3.0  # judged: largest step of a clock over its smallest


@dataclass(frozen=True)
class Layout:
    """What a sheet holds and where.

    Args:
        start: Position of the first row of data.
        headings: One for each column; `named` says whether the file gave them.
        kinds: Kind of the cells of each column.
        named: Whether there is a row of headings.
        score: How much speaks for this reading of the sheet: the number of cells that are numbers.
        heading_cells: Number of cells in the row of headings.
        over: Positions of the rows of headings and units.
        by_numbers: Whether the headings are a row of numbers, which may be data.
        names, units: Heading of each column, and its unit in a row of units below that; empty if there is none.
    """

    start: int
    headings: tuple[Heading, ...]
    kinds: tuple[Kind, ...]
    named: bool
    score: int
    heading_cells: int = 0
    over: tuple[int, ...] = ()
    by_numbers: bool = False
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()

    @property
    def room(self) -> int:
        """Number of columns that the headings leave room for; a nameless one may be that of an index."""
        return self.heading_cells + any(not heading.name for heading in self.headings[: self.heading_cells])

    @property
    def fits(self) -> bool:
        """Whether no column stands outside the headings, as happens where decimal commas are taken for separators."""
        return not self.named or all(kind in ("blank", "text") for kind in self.kinds[self.room :])

    @property
    def inside(self) -> "Layout":
        """The layout without columns outside the headings, in which only remarks stand."""
        room = self.room if self.named and self.fits else len(self.kinds)
        return replace(self, headings=self.headings[:room], kinds=self.kinds[:room])

    def name(self, column: int) -> str:
        """Return what a column is called, by its place where it has no heading."""
        return self.headings[column].name or f"column{column + 1}"


def find_layout(rows: Rows, decimal: str) -> Layout | None:
    """Return how the first rows of a sheet are laid out; None if they hold no data.

    The data are the longest run of rows that agree on which columns are numbers. A row of whole numbers at its top
    counts as headings where no other headings stand and the clocks below it say so.
    """
    kinds = [[classify_cell(cell, decimal) for cell in row] for row in rows]
    start, stop, score = _longest_run(kinds, [is_summary(row) for row in rows])
    if score <= 0:
        return None
    start = _below_headings(rows, kinds, start)
    width = max(len(row) for row in rows[start:stop])
    header, units, over = _header_rows(rows, start, stop)
    by_numbers = not header and _is_numeric_heading(rows[start:stop], kinds[start:stop], decimal)
    if by_numbers:
        header, over, start = [rows[start]], [start], start + 1
    columns = tuple(_kind_of_column(kinds[start:stop], i) for i in range(width))
    rising = [_rises(rows[start:stop], i, decimal) for i in range(width)]
    if not header:
        return Layout(start, tuple(Heading(f"column{i + 1}") for i in range(width)), columns, False, score)
    names = _join_headings([drop_label(row) for row in header], width)
    written = [heading_of(name, unit) for name, unit in zip(names, [*units, *[""] * width], strict=False)][:width]
    return Layout(
        start,
        pair_clocks(written, rising, [kind == "number" for kind in columns]),
        columns,
        True,
        score,
        max(map(len, header)),
        tuple(over),
        by_numbers,
        tuple(names),
        tuple(units),
    )


def is_summary(cells: Sequence[str]) -> bool:
    """Return whether a row below the data is one of minima, averages and the like."""
    return any(_SUMMARY.fullmatch(cell.strip()) for cell in cells)


def is_index(values: Vector) -> bool:
    """Return whether a column without heading only counts its rows, as pandas writes its index."""
    return len(values) > 1 and values[0] in (0, 1) and bool(np.all(values[1:] == values[:-1] + 1))


def _longest_run(kinds: Sequence[Sequence[Kind]], summaries: Sequence[bool]) -> tuple[int, int, int]:
    """Return start, stop and score of the rows that agree on their columns and hold most numbers."""
    best, start, score = (0, 0, 0), 0, 0
    for i, row in enumerate(kinds):
        worth = sum(1 if kind in ("number", "date") else -1 for kind in row if kind != "blank")
        blank = all(kind == "blank" for kind in row)
        worth = 0 if summaries[i] else worth
        if (worth <= 0 and not blank) or (i > start and not _agree(_last_filled(kinds, start, i), row)):
            start, score = (i, worth) if worth > 0 else (i + 1, 0)
        else:
            score += worth
            start = i if score == 0 else start
        best = max(best, (start, i + 1, score), key=lambda run: run[2])
    return best


def _below_headings(rows: Rows, kinds: Sequence[Sequence[Kind]], start: int) -> int:
    """Return where the data start that agree from `start` on: below the headings, if only data with bad cells are between.

    A bad cell, a remark or the headings once more near the top would else make a heading of the row that has it.
    """
    numeric = [i for i, kind in enumerate(kinds[start]) if kind in ("number", "date")]
    first = start
    for i in range(start - 1, -1, -1):
        filled = [cell for cell in rows[i] if cell.strip()]
        if not filled or (first < start and is_units_row(rows[i])):
            continue
        if any(k < len(kinds[i]) and kinds[i][k] in ("number", "date") for k in numeric):
            if first == start and drop_label(rows[i]) != list(rows[i]):
                return start
            first = i
        elif len(filled) >= max(len(numeric), 2) and list(rows[i]) not in [list(row) for row in rows[:i]]:
            return first
    return start


def _last_filled(kinds: Sequence[Sequence[Kind]], start: int, stop: int) -> Sequence[Kind]:
    return next((kinds[i] for i in range(stop - 1, start - 1, -1) if set(kinds[i]) - {"blank"}), [])


def _agree(above: Sequence[Kind], below: Sequence[Kind]) -> bool:
    return all(a == b or "blank" in (a, b) for a, b in zip(above, below, strict=False))


def _header_rows(rows: Rows, start: int, stop: int) -> tuple[list[Sequence[str]], list[str], list[int]]:
    """Return the rows of headings right over the data, from above, the units below them, and the positions of all."""
    above = [i for i in range(start) if any(cell.strip() for cell in rows[i])]
    width = sorted(map(_filled_width, rows[start:stop]))[(stop - start) // 2]
    units: list[str] = []
    places: list[int] = []
    if len(above) > 1 and is_units_row(rows[above[-1]]) and _is_over_units(rows[above[-2]], width):
        units = [cell.strip() for cell in rows[above[-1]]]
        places, above = above[-1:], above[:-1]
    header: list[Sequence[str]] = []
    below: list[int] = []
    for i in reversed(above):
        over = [cell for cell in drop_label(rows[i]) if cell.strip()]
        second = bool(header) and not (len(over) > 1 and all(map(is_number, over)) and [i + 1] == below)
        if second or not _is_heading(rows[i], width):
            break
        below = [i]
        header = [rows[i], *header]
        places = [i, *places]
    return header, units, places


def _is_heading(row: Sequence[str], width: int) -> bool:
    """Return whether a row can stand over that many columns: metadata have two cells, headings about as many as the data."""
    return len(row) * 2 >= width and (width == 1 or len(row) > 1)


def _is_over_units(row: Sequence[str], width: int) -> bool:
    """Return whether headings stand over a line of units: all words or all numbers, unlike a line such as "Rate", 1000."""
    return _is_heading(row, width) and len({is_number(cell) for cell in row if cell.strip()}) == 1


def _filled_width(row: Sequence[str]) -> int:
    return max((i + 1 for i, cell in enumerate(row) if cell.strip()), default=0)


def _is_numeric_heading(rows: Rows, kinds: Sequence[Sequence[Kind]], decimal: str) -> bool:
    first = rows[0]
    if len(rows) < 4 or not all(is_number(cell) for cell in first if cell.strip()):
        return False
    bare = any(a == "blank" and b == "number" and not first[i].strip() for i, (a, b) in enumerate(zip(*kinds[:2])))  # noqa: B905
    whole = all(float(cell.replace(",", ".")).is_integer() for cell in first if cell.strip())
    jumps = [_rises(rows[1:], i, decimal) and not _rises(rows, i, decimal) for i in range(len(first))]
    return whole and (bare or any(jumps))


def _rises(rows: Rows, column: int, decimal: str) -> bool:
    """Return whether the column rises in even steps."""
    cells = (parse_number(row[column], decimal) for row in rows[:_STEPS] if column < len(row))
    values = [value for value in cells if value is not None and value == value]
    steps = [after - before for before, after in pairwise(values)]
    return len(steps) > 1 and min(steps) > 0 and max(steps) < _UNEVEN * min(steps)


def _kind_of_column(kinds: Sequence[Sequence[Kind]], column: int) -> Kind:
    filled = [row[column] for row in kinds if column < len(row) and row[column] != "blank"]
    return max(set(filled), key=filled.count) if filled else "blank"


def _join_headings(header: Sequence[Sequence[str]], width: int) -> list[str]:
    """Return one name a column out of one or more rows of headings."""
    width = max(width, *map(len, header))
    padded = [[*row, *[""] * (width - len(row))] for row in header]
    return [" ".join(" ".join(cells).split()) for cells in zip(*padded, strict=True)]


def drop_label(cells: Sequence[str]) -> list[str]:
    """Return a row of numbers over columns ("Angle", 45, 45, 90) without the word before it that says what they are."""
    filled = [i for i, cell in enumerate(cells) if cell.strip()]
    labeled = len(filled) > 1 and not is_number(cells[filled[0]]) and all(is_number(cells[i]) for i in filled[1:])
    if labeled and not names_time(cells[filled[0]]):
        return ["" if i == filled[0] else cell for i, cell in enumerate(cells)]
    return list(cells)


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
