"""Assign rows of a force table to mountings of the cable, and to groups such as old and new ropes."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from bowdenfit.description import Route, Table
from bowdenfit.errors import DatasetError, combine_errors
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column, Quantity
from bowdenfit.kinds.rows import OwnAngles, number_names
from bowdenfit.types import Labels, Vector
from bowdenfit.words import few, listed, shown

# Gaps between readings above which one label stands for several mountings: judgements.
SAME_BEND = float(np.deg2rad(1.99))  # of wrap angles: just under 2 deg
_SDS = 4.0  # the same in stated standard deviations of a wrap angle: one reading in 16,000 is beyond
SAME_LENGTH = 0.005  # of lengths, as a share of the range of the route
_NAMED = 4  # labels that a remark names


GROUP = Quantity("group", "text")
NO_GROUP = "(no group)"  # name of what is of none, where all share their coefficients
_MOST_GROUPS = 12  # a judgement: more names than that are remarks, dates or runs


class ForceSettings(Table):
    """The table of forces; which of its rows were read in one mounting of the cable, and what its groups are called.

    A label of a run that comes back at another length or bend or in another group is another mounting by default: runs are
    usually numbered anew there. With "each row" every reading had a mounting of its own, as trials have for which the cable
    was laid anew each time. Groups are called by words, because a number may be a quantity, unless it is said that they are
    called by numbers.
    """

    run: Literal["at one length", "across lengths", "across bends", "across groups", "each row"] = "at one length"
    groups: Literal["called by words", "called by numbers"] = "called by words"


def find_mountings(
    labels: Sequence[str], group: Sequence[str], route: Vector, own: OwnAngles, limits: Route | None
) -> tuple[Labels, list[str]]:
    """Return the mounting of each row and the name of each mounting: a label at one length and one bend, in one group.

    Args:
        labels: Label of the run of each row, as the table has it.
        group: Group of each row; empty without groups.
        route: Route variable; NaN where the cable has no route.
        own: Wrap angles measured with the row.
        limits: The route; None without.
    """
    named, _ = number_names(labels)
    rows_of = np.split(np.argsort(named, kind="stable"), np.cumsum(np.bincount(named))[:-1])
    sds = np.nan_to_num(own.sd)
    steps = [np.full(len(route), SAME_LENGTH * np.ptp(limits.range) if limits else np.inf)]
    steps += [np.maximum(SAME_BEND, _SDS * sd) for sd in sds.T]
    cluster = np.zeros((len(labels), len(steps)), dtype=int)
    for rows in rows_of:
        for k, (values, step) in enumerate(zip((route, *own.angle.T), steps, strict=True)):
            cluster[rows, k] = _cluster_values(values[rows], float(np.max(step[rows])))
    groups = group or [""] * len(labels)
    keys = [(label, which, *where) for label, which, where in zip(labels, groups, cluster.tolist(), strict=True)]
    distinct = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    run = np.array([distinct[key] for key in keys])
    mountings_of = Counter(key[:2] for key in distinct)
    in_groups = Counter(label for label, _ in mountings_of)
    names = []
    for i, (label, which, *_) in enumerate(distinct):
        details = [which] if in_groups[label] > 1 else []
        details += [_describe_mounting(run == i, route, own, limits)] if mountings_of[label, which] > 1 else []
        names.append(f"{label} ({', '.join(details)})" if details else label)
    return run, names


def remark_on_reused_labels(
    labels: Sequence[str], group: Sequence[str], n_mountings: int, file: str, route: Route | None
) -> str:
    """Return a remark on labels that come back at another length or in another group; empty where none does."""
    distinct = list(dict.fromkeys(labels))
    if n_mountings == len(distinct):
        return ""
    noun = "length" if route else "bend"
    place = f"at another {noun}"
    if group and (in_groups := len(set(zip(labels, group, strict=True)))) > len(distinct):
        place = f"{place} or in another group" if n_mountings > in_groups else "in another group"
        noun = noun if n_mountings > in_groups else "group"
    return (
        f"{file}: the {len(distinct)} labels of its runs ({few(distinct, _NAMED)}) come back {place}, which is "
        f"taken as another mounting of the cable each time: {n_mountings} mountings in all. If the cable stayed mounted while "
        f'its {noun} changed, write run = "across {noun}s" next to the file in cable.toml.'
    )


def remark_on_one_row_runs(n_rows: int, file: str) -> str:
    """Return a remark on what it means that every row is a run of its own."""
    return (
        f"{file}: each of its {n_rows} rows is taken as a mounting of its own, as cable.toml states. So {n_rows} rows "
        "determine a coefficient as precisely as that many mountings do, and the scatter from mounting to mounting cannot be "
        "separated from the noise of the load cells unless that is stated. If the cable in fact stayed mounted over several "
        "rows, these share the effect of its mounting, and intervals come out too narrow: give those rows one run."
    )


def _cluster_values(values: Vector, step: float) -> Labels:
    """Return cluster numbers of values, parted wherever there is a gap wider than `step`."""
    known = np.nan_to_num(values, nan=-1e300)
    order = np.argsort(known, kind="stable")
    group = np.empty(len(values), dtype=int)
    group[order] = np.cumsum(np.append(0, np.diff(known[order]) > step))
    return group


def _describe_mounting(rows: np.ndarray, route: Vector, own: OwnAngles, limits: Route | None) -> str:
    """Return the length of a mounting in words, or its bends where there is none."""
    if limits is not None:
        return f"{np.mean(route[rows]):g} {limits.unit}"
    angles = [float(np.rad2deg(np.mean(column[rows]))) for column in own.angle.T if np.isfinite(column[rows]).all()]
    return f"{listed([f'{angle:.4g}' for angle in angles])} deg"


def read_groups(
    columns: Mapping[str, Column], file: str, may_be_numbers: bool, by_group: bool
) -> tuple[tuple[str, ...], list[str]]:
    """Return the group of each row, empty where the table has none, and remarks on them.

    Args:
        columns: Columns of the table.
        file: Its file.
        may_be_numbers: Whether groups may be called by numbers.
        by_group: Whether groups are to have friction coefficients of their own.

    Raises:
        DatasetError: Groups are asked for, and there is no such column, a row is of none, or the column is a number or has
            too many names.
    """
    column = columns.get(GROUP.name)
    if column is None and by_group:
        raise DatasetError(
            f'{file} has no column group, but friction_model has "by-group", which gives each group of readings its own '
            'friction coefficients; add the column, or map it in cable.toml: columns = { group = { name = "rope" } }.'
        )
    if column is None or not column.known:
        return (), []
    names = tuple(" ".join(cell.text.split()) for cell in column.cells)
    distinct = list(dict.fromkeys(names))
    wrong = _explain_no_groups(column, distinct, may_be_numbers)
    if wrong and by_group:
        raise DatasetError(f"{file}: {wrong}")
    if wrong:
        return (), [f"{file}: {wrong} It is not used."]
    reason = (
        "the cell is blank, so this row is of no group; write the name of its group "
        f"({few([shown(name) for name in distinct if name], _NAMED)}), or leave the row out."
    )
    if blank := [cell.refuse(reason) for cell, name in zip(column.cells, names, strict=True) if by_group and not name]:
        raise combine_errors(blank)
    names = tuple(name or NO_GROUP for name in names)
    if by_group or len(distinct) == 1:
        return names, []
    return names, [
        f"{file}: its column {shown(column.heading)} names {len(distinct)} groups ({few(distinct, _NAMED)}), which share their "
        "friction coefficients; --friction by-group gives each its own, and bowdenfit compare says which describes them better."
    ]


def group_numbers(groups: Sequence[str], names: Sequence[str], n_rows: int) -> Labels:
    """Return the number of each row's group among those of the cable; 0 where all share their coefficients.

    Args:
        groups: Groups of the cable that have coefficients of their own.
        names: Group of each row.
        n_rows: How many rows there are.
    """
    if not groups:
        return np.zeros(n_rows, dtype=int)
    return np.array([groups.index(name) for name in names], dtype=int)


def _explain_no_groups(column: Column, distinct: Sequence[str], may_be_numbers: bool) -> str:
    """Return why a column does not name groups, in a sentence; empty where it does."""
    named = [cell for cell in column.cells if cell.text.strip()]
    heading, values = shown(column.heading), few([shown(name) for name in distinct if name], _NAMED)
    if named and not may_be_numbers and all(_is_number(cell) for cell in named):
        return (
            f"the column {heading} holds numbers ({values}), which may be a quantity rather than names of groups. If they are "
            'names, write groups = "called by numbers" next to the file in cable.toml, or give the groups words; a quantity '
            "that friction depends on, such as a temperature, cannot be fitted."
        )
    if len(distinct) > _MOST_GROUPS:
        return (
            f"the column {heading} has {len(distinct)} different names ({values}), more than groups that a coefficient each "
            f"can be fitted to ({_MOST_GROUPS}): the usual cause is a column of remarks, dates or runs; map the right one, as "
            'in columns = { group = { name = "rope" } }.'
        )
    return ""


def _is_number(cell: Cell) -> bool:
    try:
        cell.number()
    except DatasetError:
        return False
    return True


def describe_groups(groups: Sequence[str]) -> str:
    """Return the groups in words, such as "the groups new and old"."""
    return f"the groups {listed(list(groups))}"
