"""Columns that say the unit of the numbers before them, row by row, as meters with several ranges write them."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import Cell
from bowdenfit.files.headings import is_number, plain_name
from bowdenfit.files.measured_cells import is_measured
from bowdenfit.files.table_parts import TableParts
from bowdenfit.units import conversion_factor, dimension_of

_WORDS = {"unit", "units", "uom", "einheit", "einheiten", "unite", "unité", "unites", "unités", "unidad", "unidades", "unità"}


def names_unit(heading: str) -> bool:
    """Return whether a heading says that its column holds the units of the column before it."""
    return plain_name(heading).rstrip("0123456789_") in _WORDS


def _find_unit_columns(parts: TableParts) -> dict[int, list[str]]:
    """Return the units of columns of numbers that the column behind them says, one per row, by the position of the numbers."""
    units = dict[int, list[str]]()
    for i, name in enumerate(parts.headings.names):
        cells = [row.cells[i].strip() if i < len(row.cells) else "" for row in parts.body]
        numbers = [row.cells[i - 1] for row in parts.body if i and i <= len(row.cells)]
        are_units = any(cells) and all(is_measured(f"1 {cell}") and not is_number(cell) for cell in cells if cell)
        if names_unit(name) and i and are_units and any(map(is_measured, numbers)):
            units[i - 1] = cells
    return units


def join_unit_columns(parts: TableParts) -> tuple[TableParts, list[str]]:
    """Return a table with units behind its numbers in place of columns of their own, and the headings of these numbers."""
    units = _find_unit_columns(parts)
    if not units:
        return parts, []
    headings = parts.headings
    remaining = [i for i, _ in enumerate(headings.names) if i - 1 not in units]
    below = (*headings.units, *[""] * len(headings.names))[: len(headings.names)]
    body = []
    for number, row in enumerate(parts.body):
        cells = [
            f"{cell.strip()} {units[i][number]}".strip() if i in units and cell.strip() else cell
            for i, cell in enumerate(row.cells)
        ]
        behind = cells[len(headings.names) :]
        body.append(replace(row, cells=[*(cells[i] for i in remaining if i < len(cells)), *behind]))
    names = tuple(headings.names[i] for i in remaining)
    headings = replace(headings, names=names, units=tuple(below[i] for i in remaining))
    return replace(parts, headings=headings, body=tuple(body)), [parts.headings.names[i] for i in units]


def in_one_unit(cells: Sequence[Cell]) -> list[Cell]:
    """Return the cells of a column whose units differ from row to row in the first of these units, where they can be."""
    common = next((cell.unit for cell in cells if cell.unit), "")
    converted = []
    for cell in cells:
        with suppress(DatasetError):
            if cell.unit not in ("", common) and dimension_of(cell.unit) == dimension_of(common):
                dimension = dimension_of(common)
                factor = conversion_factor(cell.unit, dimension) / conversion_factor(common, dimension)
                cell = replace(cell, measured=repr(cell.number() * factor), unit=common)
        converted.append(cell)
    return converted
