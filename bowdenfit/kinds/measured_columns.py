"""Columns of measured numbers: values cut off at the end of a range, and forces that lie orders of magnitude from all others.

A reading beyond the end of a range is written as that end, so that several readings are equal where those around them are
not. Set points, coarse displays, readings of nothing and the flat top of a bell give equal values too. Equal values are
therefore reported only at the highest or lowest of a column, where equal values elsewhere are rare, and where the readings
around them say that they would lie beyond it: along a length or bend, neighbors scatter by more than the last digit and
drop off at once; of forces, the other end of the rope shows that the load went on rising.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import erf, gcd

import numpy as np

from bowdenfit.errors import DatasetError, combine_errors
from bowdenfit.kinds.plausibility import find_display_step, find_last_digit
from bowdenfit.kinds.rows import RowOrigin
from bowdenfit.types import Flags, Labels, Positions, Vector
from bowdenfit.words import few

# What decides that readings are cut off was chosen so that fewer than one in a thousand healthy tables is named, and most that
# are cut off where noise is several last digits: `scripts/check_healthy_benches.py`, tests/kinds/test_cut_off.py.
_FEWEST = 4  # equal extreme values, and other values, at least
_RARER = 3  # times as many equal ones as of any other value
_FALSE_ALARM = 1e-3  # probability that neighbors read alike although they scatter as the others do
_FINE = 2.0  # last digits that readings scatter by at least; below it they are equal because they are rounded
_CONVERTER, _FEWEST_STEPS = 6.0, 8  # last digits of a step, and values, from which a converter is seen
_NEAREST, _STEP_DOWN = 2.5, 5.0  # last digits that the reading beside equal ones lies off them, and the mean of the nearest two
_SDS = 3.0  # standard deviations by which a force is expected beyond its equal values
_BEYOND = 0.05  # least logarithm of the same, since friction may change with the load
# Judgements about forces that are far from all others.
_ONE_SIDED = 100.0  # factor on the ratio of the two ends of other rows; no rope that loses 99 % is measured
_ALONE = 5000.0  # factor from the next smaller force; of loads between 1 N and 10 kN others lie between
_FEWEST_FORCES = 4  # of a column, from which one may be far


@dataclass(frozen=True)
class MeasuredColumn:
    """Readings of one quantity in a table.

    Args:
        name: Heading of the column.
        unit: Unit of the readings.
        values: The readings; NaN where nothing was measured.
        along: Quantity that they change smoothly with, such as a length; None for forces.
        other_end: Forces at the other end of the rope, to which these are proportional within a group; None for others.
        group: Run and stroke of each reading, for forces.
    """

    name: str
    unit: str
    values: Vector
    along: Vector | None = None
    other_end: Vector | None = None
    group: Labels | None = None


def pair_forces(input_force: Vector, output_force: Vector, group: Labels) -> list[MeasuredColumn]:
    """Return the forces at both ends as columns, each with the other; `group` numbers the run and stroke of each row."""
    return [
        MeasuredColumn("input_force", "N", input_force, other_end=output_force, group=group),
        MeasuredColumn("output_force", "N", output_force, other_end=input_force, group=group),
    ]


def describe_cut_off(column: MeasuredColumn, origin: RowOrigin) -> str:
    """Describe equal highest or lowest values that end a range, without first capital or remedy; empty where there are none."""
    for rows, which in zip(find_cut_off(column), ("highest", "lowest"), strict=True):
        if len(rows):
            value = f"{column.values[rows[0]]:.6g} {column.unit}".rstrip()
            files = np.unique(origin.file[rows])
            places = few([str(row) for row in origin.row[rows[origin.file[rows] == files[0]]]], most=6)
            more = f" in {len(files)} files" if len(files) > 1 else ""
            return (
                f"{origin.files[files[0]]}, rows {places}, column {column.name!r}: the {which} value, {value}, "
                f"is there {len(rows)} times{more}, where the readings around it say more would follow"
            )
    return ""


def find_cut_off(column: MeasuredColumn) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows whose readings are cut off at the highest value, and those at the lowest; empty where none are."""
    ends = []
    for sign in (1.0, -1.0):
        values = sign * column.values
        there = np.isfinite(values if column.along is None else values + column.along)
        tied = there & np.isclose(values, np.max(values, where=there, initial=-np.inf), rtol=1e-9, atol=0.0)
        remaining = column.values[there & ~tied & (values != 0)]
        repeats = np.unique(remaining.round(12), return_counts=True)[1]
        fewest = max(_FEWEST, _RARER * (int(repeats.max(initial=1)) - 1))
        few_others = len(np.unique(remaining)) < _FEWEST or int(tied.sum()) < fewest
        rows = np.zeros(0, dtype=int)
        if not few_others and column.values[tied][0] != 0:
            if column.along is not None:
                rows = _cut_off_along(column.values, column.along, there, tied)
            elif column.other_end is not None and column.group is not None:
                rows = _cut_off_forces(column.values, column.other_end, column.group, tied, sign)
        ends.append(rows)
    return ends[0], ends[1]


def _resolution(values: Vector) -> float:
    """Return the step in which values are written: the largest that divides all of them, or that of a converter."""
    different = np.unique(values)
    digit, step = find_last_digit(np.abs(different[different != 0])), find_display_step(different)
    if digit and (step < _CONVERTER * digit or len(different) < _FEWEST_STEPS):
        return digit * gcd(*np.round(different / digit).astype(int).tolist())
    return step


def _cut_off_along(values: Vector, along: Vector, there: Flags, tied: Flags) -> Positions:
    """Return the rows of neighboring equal values that chance and the flat top of a curve do not explain.

    Of k neighbors with noise sigma about a flat curve, all fall into the last digit q of the first with a probability of at
    most erf(q / (2 sqrt(2) sigma))^(k - 1), at any of n places. A parabola that drops by less than q within four neighbors
    drops by less than 1.8 q to the next and 4.4 q to the one after that.
    """
    x = np.unique(along[there])
    equal = np.array([np.all(tied[there & (along == at)]) for at in x])
    mean = np.array([np.mean(values[there & (along == at)]) for at in x])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], equal, [False]]).astype(int)))
    start, stop = max(zip(edges[::2], edges[1::2], strict=True), key=lambda part: part[1] - part[0], default=(0, 0))
    k, step = int(stop - start), _resolution(values[there])
    sides = [np.abs(side - mean[start]) for side in (mean[max(start - 2, 0) : start], mean[stop : stop + 2]) if len(side)]
    if k < _FEWEST or any(side.min() < _NEAREST * step or side.mean() < _STEP_DOWN * step for side in sides):
        return np.zeros(0, dtype=int)
    scatter = _scatter(x, mean, equal)
    chance = len(x) * erf(step / np.sqrt(8) / scatter) ** (k - 1) if scatter > _FINE * step else 1.0
    return np.flatnonzero(tied) if chance < _FALSE_ALARM else np.zeros(0, dtype=int)


def _scatter(x: Vector, y: Vector, left_out: Flags) -> float:
    """Return the scatter of readings about lines between their neighbors; 0 where too few have any."""
    deviations = []
    for i in range(1, len(x) - 1):
        if not left_out[i - 1 : i + 2].any():
            share = (x[i] - x[i - 1]) / (x[i + 1] - x[i - 1])
            line = y[i - 1] + share * (y[i + 1] - y[i - 1])
            deviations.append(abs(y[i] - line) / np.sqrt(1 + share**2 + (1 - share) ** 2))
    return float(np.median(deviations)) / 0.6745 if len(deviations) >= _FEWEST else 0.0


def _cut_off_forces(values: Vector, other: Vector, groups: Labels, tied: Flags, sign: float) -> Positions:
    """Return the rows of equal forces that the other end of the rope expects to lie beyond them by more than the scatter.

    Within a run and stroke a force is in proportion to the other, by the median ratio of the rows that are not equal.
    """
    usable = (values > 0) & (other > 0)
    log_ratio = np.log(np.where(usable, values, 1.0) / np.where(usable, other, 1.0))
    expected = np.full(len(other), np.nan)
    for group in np.unique(groups):
        free = usable & ~tied & (groups == group)
        if free.sum() > 1:
            expected[groups == group] = np.median(log_ratio[free])
    free, held = usable & ~tied & np.isfinite(expected), usable & tied & np.isfinite(expected)
    scatter = float(np.sqrt(np.mean((log_ratio - expected)[free] ** 2))) if free.any() else np.inf
    beyond = held & (sign * (expected - log_ratio) > max(_SDS * scatter, _BEYOND))
    return np.flatnonzero(tied) if beyond.sum() >= max(_FEWEST, tied.sum() / 2) else np.zeros(0, dtype=int)


def refuse_far_forces(columns: Sequence[MeasuredColumn], origin: RowOrigin) -> None:
    """Refuse a force that lies orders of magnitude above the others of its column.

    Where both ends were read, by the ratio of the two, which no load changes as much; where all of a row is too large, and of
    forces that were read alone, by the next smaller force.

    Raises:
        DatasetError: Names its row, column and value, the usual cause and what to do.
    """
    faults = list[DatasetError]()
    for column in columns:
        for row in np.flatnonzero(_is_far(column)).tolist():
            value, typical = column.values[row], float(np.median(column.values[column.values > 0]))
            usual = "the usual cause is a missing decimal point or a wrong unit; correct the cell, or leave the row out."
            fault = DatasetError(
                f"{origin.describe_row(row)}, column {column.name!r}: {value:.6g} {column.unit} is far from the other forces, "
                f"half of which are at most {typical:.3g} {column.unit}; {usual}"
            )
            fault.fault_key, fault.row = (origin.files[origin.file[row]], column.name, usual), int(origin.row[row])
            faults.append(fault)
    if faults:
        raise combine_errors(faults)


def _is_far(column: MeasuredColumn) -> Flags:
    """Flag forces that are far above the others; see `refuse_far_forces`."""
    values = np.where(column.values > 0, column.values, np.nan)
    far = np.zeros(len(values), dtype=bool)
    if column.along is not None or np.isfinite(values).sum() < _FEWEST_FORCES:
        return far
    below, largest = np.sort(values[np.isfinite(values)])[-2:]
    far |= (values == largest) & (largest > _ALONE * below)
    if column.other_end is not None:
        ratio = values / np.where(column.other_end > 0, column.other_end, np.nan)
        lost = np.maximum(ratio, 1 / ratio)
        if np.isfinite(lost).any():  # forces of a loop may be negative at one end wherever they are positive at the other
            far |= (ratio > _ONE_SIDED * np.nanmedian(lost)) & (values > _ONE_SIDED * np.nanmedian(values))
    return far
