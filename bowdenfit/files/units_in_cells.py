"""Recordings whose units stand in the cells, `10.2 N`, or in a column of their own behind the numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest

from bowdenfit.files.headings import refuse_two_units
from bowdenfit.files.layout import Layout
from bowdenfit.files.measured_cells import split_measured
from bowdenfit.files.text_file import CsvRecord
from bowdenfit.files.unit_columns import names_unit

_FEWEST = 3  # judged: cells with a unit that make a column of them


def find_units_in_cells(rows: Sequence[CsvRecord]) -> dict[int, str]:
    """Return the unit that most cells of a column have behind their numbers, by its position."""
    units = dict[int, str]()
    for i, column in enumerate(zip_longest(*(row.cells for row in rows if not row.blank), fillvalue="")):
        parts = [split_measured(cell) for cell in column if cell.strip()]
        written = [part.unit for part in parts if part and part.unit and not part.error]
        unit = max(set(written), key=written.count) if written else ""
        if unit and written.count(unit) >= max(_FEWEST, len(parts) / 2):
            units[i] = unit
    return units


def take_units_off(cells: Sequence[str], units: Mapping[int, str]) -> list[str]:
    """Return the cells of a row without the units behind their numbers."""
    return [_take_off(cell, units[i]) if i in units else cell for i, cell in enumerate(cells)]


def _take_off(cell: str, unit: str) -> str:
    number = cell.strip().removesuffix(unit).rstrip()
    return number if number[-1:].isdigit() or number[-1:] in (".", ",") else cell


def take_units_from_cells(
    file: str, layout: Layout, rows: Sequence[CsvRecord], units: dict[int, str]
) -> tuple[Layout, dict[int, str]]:
    """Return the layout with the units of cells and of columns of units, and these by position.

    Args:
        file: Name of the file.
        layout: Layout of the numbers.
        rows: The first rows, without the units in their cells.
        units: See `find_units_in_cells`.

    Raises:
        DatasetError: A heading states another unit.
    """
    below = [row.cells for row in rows if row.start >= layout.first.start and not row.blank]
    by_number = {i: unit for i, unit in units.items() if i < len(layout.kinds)}
    taken = dict(by_number)
    for i, (heading, kind) in enumerate(zip(layout.headings, layout.kinds, strict=True)):
        if i and kind == "text" and names_unit(heading.name) and layout.kinds[i - 1] == "number":
            written = next((cells[i].strip() for cells in below if i < len(cells) and cells[i].strip()), "")
            if split_measured(f"1 {written}"):
                by_number[i - 1], taken[i] = written, written
    if not by_number:
        return layout, {}
    listed = [by_number.get(i, "") for i in range(len(layout.headings))]
    refuse_two_units(f"{file}, row {layout.first.row}", layout.header.cells if layout.header else [], listed, "the cell")
    headings = [
        replace(heading, unit=heading.unit or unit) for heading, unit in zip(layout.headings, listed, strict=True)
    ]
    return replace(layout, headings=tuple(headings)), taken
