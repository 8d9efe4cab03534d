"""Cells that were merged in a spreadsheet: exported, the number stands in the first row of a block and the rest is blank."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column
from bowdenfit.files.headings import Quantity
from bowdenfit.files.tables import RawTable
from bowdenfit.words import shown

_REPEATED = ("angle", "route")  # dimensions of what one mounting has in several rows


def fill_merged_cells(
    table: RawTable, columns: Mapping[str, Column], wanted: Sequence[Quantity]
) -> tuple[RawTable, dict[str, Column]]:
    """Return a table and its columns with lengths and wrap angles filled down where they stand once over blocks of rows.

    Only a number that every row must have is filled; a blank where one may be missing stays as it is. The account says it.

    Args:
        table: The table.
        columns: Its columns, by quantity.
        wanted: The quantities, which say what may be blank.
    """
    filled, by_quantity = list[str](), dict(columns)
    for quantity in wanted:
        column = columns.get(quantity.name)
        if column is not None and quantity.dimension in _REPEATED and not quantity.optional and is_merged(column.cells):
            by_quantity[quantity.name] = replace(column, cells=_fill_down(column.cells))
            filled.append(shown(column.heading))
    if not filled:
        return table, by_quantity
    note = f"blank cells of {' and '.join(filled)} are taken to be merged with the last number above them"
    lines = replace(table.lines, note="; ".join(filter(None, [table.lines.note, note])))
    return replace(table, lines=lines), by_quantity


def is_merged(cells: Sequence[Cell]) -> bool:
    """Return whether a column has at least two blocks, each a number over blank cells."""
    starts = [i for i, cell in enumerate(cells) if not cell.blank]
    follows = [i + 1 < len(cells) and cells[i + 1].blank for i in starts]
    return len(starts) > 1 and starts[0] == 0 and all(follows) and not any(cell.is_code for cell in cells)


def _fill_down(cells: Sequence[Cell]) -> tuple[Cell, ...]:
    """Return the cells with the last number above in the place of blank ones."""
    filled = list[Cell]()
    for cell in cells:
        filled.append(replace(filled[-1], row=cell.row) if cell.blank else cell)
    return tuple(filled)
