"""Pivot tables: a column for each wrap angle or load, and in its cells what came out, made into a row for each reading."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import Cell
from bowdenfit.files.headings import heading_of, is_number
from bowdenfit.files.measured_cells import MeasuredCell, split_measured
from bowdenfit.files.spellings import likely_wrap_angle, parse_heading
from bowdenfit.units import dimension_of, is_unit
from bowdenfit.words import few, shown

_FEWEST = 2  # headings that are values, from which they are those of a pivot table
_FOLLOWS = (0.5, 2.0)  # judged: slope of log output on log input; forces have about 1, efficiencies and losses about 0


@dataclass(frozen=True)
class LongTable:
    """A table with a row for each reading.

    Args:
        header: Heading of each column.
        units: The unit of each column; empty without one.
        rows: Cells, which keep their place in the file.
        remark: Remark on how headings were read.
    """

    header: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    remark: str


def find_pivot_headings(header: Sequence[str]) -> list[str]:
    """Return the headings that are values, as in a pivot table, where there are several; empty for any other table."""
    values = [heading for heading in header if is_number(heading) or split_measured(heading)]
    return values if len(values) >= _FEWEST else []


def unpivot(header: Sequence[str], units: Sequence[str], rows: Sequence[tuple[Cell, ...]]) -> LongTable | None:
    """Return a pivot table of output forces with a row for each of its cells; None for any other table.

    It must have wrap angles with their unit over its columns and a column of input forces, or input forces over its columns
    and a column of wrap angles; and its cells must follow the input, as forces do and efficiencies do not.

    Args:
        header: Heading of each column.
        units: The unit below each heading; empty without one.
        rows: The cells below.
    """
    values = {i: value for i, heading in enumerate(header) if (value := split_measured(heading)) and not value.error}
    dimensions = {dimension_of(value.unit) if is_unit(value.unit) else "" for value in values.values()}
    if len(values) < _FEWEST or len(dimensions) > 1 or len({value.unit for value in values.values()}) > 1:
        return None
    is_by_angle = dimensions == {"angle"}
    remaining = [i for i, heading in enumerate(header) if heading and i not in values]
    if any(map(is_number, (header[i] for i in remaining))) or not (is_by_angle or dimensions == {"force"}):
        return None
    find_unit = _unit_of_input if is_by_angle else _unit_of_angle
    beside = [unit for i in remaining if (unit := find_unit(header[i], units[i]))]
    if len(beside) != 1 or any(_unit_of_output(header[i], units[i]) for i in remaining):
        return None
    over = next(iter(values.values())).unit
    unit_of_force = beside[0] if is_by_angle else over
    long = [_make_row(row, remaining, i, value) for i, value in values.items() for row in rows if not row[i].blank]
    if not _follows_input(long, next(k for k, i in enumerate(remaining) if find_unit(header[i], units[i])), is_by_angle):
        return None
    name, meaning = ("wrap_angle", "wrap angles") if is_by_angle else ("input_force", "input forces")
    return LongTable(
        (*(header[i] for i in remaining), name, "output_force"),
        (*(units[i] for i in remaining), over, unit_of_force),
        tuple(long),
        f"{few([shown(header[i]) for i in values])} over columns are taken as {meaning}, as in a pivot table, and what stands "
        f"below them as output forces in {unit_of_force}, a reading for each cell.",
    )


def _unit_of_input(heading: str, below: str) -> str:
    spelling = parse_heading(heading, below)
    is_input = spelling is not None and spelling.quantity == "input_force" and spelling.pair != "said"
    return (spelling.unit or "") if spelling and is_input else _unit_of_name(heading, below, "input_force")


def _unit_of_output(heading: str, below: str) -> str:
    spelling = parse_heading(heading, below)
    is_output = spelling is not None and spelling.quantity == "output_force"
    return (spelling.unit or "") if spelling and is_output else _unit_of_name(heading, below, "output_force")


def _unit_of_angle(heading: str, below: str) -> str:
    spelling = likely_wrap_angle(heading, below)
    return (spelling.unit or "") if spelling else _unit_of_name(heading, below, "wrap_angle")


def _unit_of_name(heading: str, below: str, name: str) -> str:
    """Return the unit of a heading that begins with the name of a quantity, such as input_force_N; else empty."""
    return (heading_of(heading, below).unit or "") if heading.lower().startswith(name) else ""


def _make_row(row: tuple[Cell, ...], others: Sequence[int], i: int, value: MeasuredCell) -> tuple[Cell, ...]:
    """Return the cells of one reading: those of the other columns, the value over its column, and what stands below it."""
    over = replace(row[i], text=value.number, measured=None, unit="", is_code=False)
    return (*(row[k] for k in others), over, row[i])


def _follows_input(rows: Sequence[tuple[Cell, ...]], beside: int, is_by_angle: bool) -> bool:
    """Return whether the cells are about in proportion to the input force where the bend is the same.

    Args:
        rows: Readings, whose last two cells are the value over the column and what stands below it.
        beside: Position of the column of input forces, or of wrap angles.
        is_by_angle: Whether it is that of input forces.
    """
    logs: dict[float, list[tuple[float, float]]] = {}
    for row in rows:
        try:
            other, over, output = (abs(row[k].number()) for k in (beside, -2, -1))
        except DatasetError:
            continue  # a cell that is no number is refused by those who read the table
        angle, force = (over, other) if is_by_angle else (other, over)
        if force > 0 and output > 0:
            logs.setdefault(angle, []).append((np.log(force), np.log(output)))
    within = [np.array(pairs) - np.mean(pairs, axis=0) for pairs in logs.values()]
    x, y = np.concatenate(within).T if within else (np.zeros(1), np.zeros(1))
    return bool(np.sum(x * x) > 0 and _FOLLOWS[0] < np.sum(x * y) / np.sum(x * x) < _FOLLOWS[1])
