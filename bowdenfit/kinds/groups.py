"""Groups of readings, such as of a new and of an old rope: a column of names, read row by row."""

from collections.abc import Mapping, Sequence

import numpy as np

from bowdenfit.errors import DatasetError, combine_errors
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column, Quantity
from bowdenfit.types import Labels
from bowdenfit.words import few, listed, shown

GROUP = Quantity("group", "text")
NO_GROUP = "(no group)"  # name of what is of none, where all share their coefficients
_MOST = 12  # groups; more names than that are remarks, dates or runs
_NAMED = 4  # names that a remark gives


def read_groups(
    found: Mapping[str, Column], file: str, may_be_numbers: bool, asked: bool
) -> tuple[tuple[str, ...], list[str]]:
    """Group of each row, empty where the table has none, and what is said of them.

    Args:
        found: Columns of the table.
        file: Its file.
        may_be_numbers: Whether groups may be called by numbers.
        asked: Whether groups are to have friction coefficients of their own.

    Raises:
        DatasetError: Groups are asked for, and there is no such column, a row is of none, or the column is a number or has
            too many names.
    """
    column = found.get(GROUP.name)
    if column is None and asked:
        raise DatasetError(
            f'{file} has no column group, but friction_model has "by-group", which gives each group of readings its own '
            'friction coefficients; add the column, or map it in cable.toml: columns = { group = { name = "rope" } }.'
        )
    if column is None or not column.known:
        return (), []
    names = tuple(" ".join(cell.text.split()) for cell in column.cells)
    distinct = list(dict.fromkeys(names))
    wrong = _why_no_groups(column, distinct, may_be_numbers)
    if wrong and asked:
        raise DatasetError(f"{file}: {wrong}")
    if wrong:
        return (), [f"{file}: {wrong} It is not used."]
    why = (
        "the cell is blank, so this row is of no group; write the name of its group "
        f"({few([shown(each) for each in distinct if each], _NAMED)}), or leave the row out."
    )
    if blank := [cell.refuse(why) for cell, name in zip(column.cells, names, strict=True) if asked and not name]:
        raise combine_errors(blank)
    names = tuple(name or NO_GROUP for name in names)
    if asked or len(distinct) == 1:
        return names, []
    return names, [
        f"{file}: its column {shown(column.heading)} names {len(distinct)} groups ({few(distinct, _NAMED)}), which share their "
        "friction coefficients; --friction by-group gives each its own, and bowdenfit compare tells which describes them."
    ]


def group_numbers(groups: Sequence[str], names: Sequence[str], n_rows: int) -> Labels:
    """Number of each row's group among those of the cable, 0 where they share their coefficients.

    Args:
        groups: Groups of the cable that have coefficients of their own.
        names: Group of each row.
        n_rows: How many rows there are.
    """
    if not groups:
        return np.zeros(n_rows, dtype=int)
    return np.array([groups.index(name) for name in names], dtype=int)


def _why_no_groups(column: Column, distinct: Sequence[str], may_be_numbers: bool) -> str:
    """Why a column does not name groups; empty where it does."""
    named = [cell for cell in column.cells if cell.text.strip()]
    heading, values = shown(column.heading), few([shown(each) for each in distinct if each], _NAMED)
    if named and not may_be_numbers and all(_is_number(cell) for cell in named):
        return (
            f"the column {heading} holds numbers ({values}), which may be a quantity rather than names of groups. If they are "
            'names, write groups = "called by numbers" beside the file in cable.toml, or give the groups words; a quantity '
            "that friction depends on, such as a temperature, cannot be fitted."
        )
    if len(distinct) > _MOST:
        return (
            f"the column {heading} has {len(distinct)} different names ({values}), more than groups that a coefficient each "
            f"can be fitted to ({_MOST}): the usual cause is a column of remarks, dates or runs; map the right one, as in "
            'columns = { group = { name = "rope" } }.'
        )
    return ""


def _is_number(cell: Cell) -> bool:
    try:
        cell.number()
    except DatasetError:
        return False
    return True


def groups_in_words(groups: Sequence[str]) -> str:
    """'the groups new and old'"""
    return f"the groups {listed(list(groups))}"
