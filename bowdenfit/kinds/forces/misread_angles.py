"""Wrap angles off by half or whole turns, as readings of one run whose friction differs by a factor show; and radians.

450 deg is easily written as 90. Nothing that a mounting does explains rows of one run at one angle and equal loads that lose
twice as much as others; the turns that would explain it are those with which all groups of rows have one friction coefficient.
"""

from dataclasses import dataclass

import numpy as np

from bowdenfit.description import Description
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.types import Labels, Vector
from bowdenfit.words import listed, percent

# Judgements, by which none of 4000 healthy benches is named (tests/kinds/forces/test_misread_angles.py).
_FACTOR = 2.0  # friction of one part of a run over that of the other, at equal loads
_CLEAR = 10.0  # the gap between both parts over the scatter inside them
_FEWEST = 2  # readings of each part, and loads at which both were read
_EQUAL_LOADS = 0.1  # relative difference
_ALIKE = 0.1  # relative difference of friction coefficients that turns have explained
_MOST_TURNS = 4  # half turns that a note of an angle may lack
_RADIANS = 15.0  # friction coefficient at angles that may be radians, over that at the others, of which 57 are a radian
_AGREE = 1.5  # ratio of friction coefficients of different mountings that are alike


@dataclass(frozen=True)
class _Group:
    """Rows at one angle that lose alike.

    Args:
        rows: Their numbers in the table.
        angle: Wrap angle as it was read [rad].
        loss: Median friction exponent [1].
        is_split: Whether other rows of the same run and angle lose otherwise.
    """

    rows: Labels
    angle: float
    loss: float
    is_split: bool


def describe_misread_angles(table: ForceTable, description: Description) -> str:
    """Describe runs whose readings at one angle and equal loads differ by a factor of two, or radians; empty without either.

    Only cables whose one contact has the angles of its rows are looked at.
    """
    if len(description.contact) != 1 or table.own.angle.shape[1] != 1 or not np.isfinite(table.own.angle).all():
        return ""
    groups = _group_rows(table)
    if sentence := _describe_radians(table, groups):
        return sentence
    split = [group for group in groups if group.is_split]
    if not split:
        return ""
    low, high = (group for group in split if group.angle == split[0].angle)
    seen = (
        f"Of the readings at {np.rad2deg(split[0].angle):.4g} deg in {listed(table.origin.files)}, some transmit about "
        f"{percent(np.exp(-low.loss), 0)} of the force, and others at equal loads in the same run "
        f"{percent(np.exp(-high.loss), 0)}, which no mounting explains"
    )
    turns = _find_turns(groups)
    if turns is None:
        return (
            f"{seen}. The usual causes are an angle noted wrongly, rows of several mountings without a column run, and a rope "
            "that was changed or greased in between; correct the rows, or add that column."
        )
    wrong = []
    for group, n in zip(groups, turns, strict=True):
        if n:
            degrees = float(np.rad2deg(group.angle))
            wrong.append(f"{degrees:.4g} deg in {_name_rows(table, group)}, where {degrees + 180 * n:.4g} deg fits")
    return (
        f"{seen}. All rows have one friction coefficient if these angles were noted wrongly by half or whole turns: "
        f"{'; '.join(wrong)}. Correct them if that is how the cable was wrapped."
    )


def _describe_radians(table: ForceTable, groups: list[_Group]) -> str:
    """Describe rows that lose as if their angles were radians in a column of degrees; empty if there are none."""
    coefficients = np.array([group.loss / group.angle for group in groups])
    order = np.argsort(coefficients)
    if len(groups) < 2 or coefficients[order[0]] <= 0:
        return ""
    cut = int(np.argmax(coefficients[order][1:] / coefficients[order][:-1])) + 1
    low, high = coefficients[order[:cut]], coefficients[order[cut:]]
    ends = np.append(low, np.deg2rad(high))
    if high.min() < _RADIANS * low.max() or ends.max() > _AGREE * ends.min():
        return ""
    wrong = []
    for group in (groups[i] for i in sorted(order[cut:])):
        read = float(np.rad2deg(table.own.angle[group.rows[0], 0]))
        wrong.append(f"{read:.4g} in {_name_rows(table, group)}, which would be {np.rad2deg(read):.0f} deg")
    return (
        f"Some wrap angles in {listed(table.origin.files)} seem to be radians in a column of degrees, since their readings "
        f"lose as the others do only then: {'; '.join(wrong)}. Correct them, with all angles in one unit."
    )


def _name_rows(table: ForceTable, group: _Group) -> str:
    """Name the rows of a group: the first ones, and how many more."""
    rows = [str(table.origin.row[row]) for row in group.rows[:4]]
    more = len(group.rows) - len(rows)
    return f"{'rows' if len(group.rows) > 1 else 'row'} {listed([*rows, *([f'{more} more'] if more else [])])}"


def _group_rows(table: ForceTable) -> list[_Group]:
    """Group sliding rows by angle, and those of one angle by how much they lose if that differs inside a run."""
    sliding = np.flatnonzero((table.stroke != 0) & (table.own.angle[:, 0] > 0))
    log_ratio = np.log(table.input_force / table.output_force) * table.stroke
    degrees = np.round(np.rad2deg(table.own.angle[:, 0]), 1)
    labels = np.array(table.group) if table.group else np.zeros(len(table.run), dtype=int)
    groups = list[_Group]()
    for angle in np.unique(degrees[sliding]):
        rows = sliding[degrees[sliding] == angle]
        of_runs = [
            rows[(table.run[rows] == run) & (labels[rows] == label)]
            for label in np.unique(labels[rows])
            for run in np.unique(table.run[rows])
        ]
        limits = [_split_loss(log_ratio[part], table.input_force[part], table.stroke[part]) for part in of_runs]
        limit = max((limit for limit in limits if limit is not None), default=None)
        parts = [rows] if limit is None else [rows[log_ratio[rows] < limit], rows[log_ratio[rows] >= limit]]
        groups += [
            _Group(part, float(np.deg2rad(angle)), float(np.median(log_ratio[part])), len(parts) > 1) for part in parts
        ]
    return groups


def _split_loss(loss: Vector, load: Vector, stroke: Labels) -> float | None:
    """Friction exponent between two parts of a run that differ by `_FACTOR` at equal loads; None if they do not.

    Two parts that are the two strokes differ by the gain of the load cells, not by an angle.
    """
    order = np.argsort(loss)
    gaps = np.diff(loss[order])[_FEWEST - 1 : len(loss) - _FEWEST]
    if len(gaps) == 0:
        return None
    cut = int(np.argmax(gaps)) + _FEWEST
    low, high = order[:cut], order[cut:]
    if len(np.unique(stroke[low])) == len(np.unique(stroke[high])) == 1 and stroke[low[0]] != stroke[high[0]]:
        return None
    squares = sum(float(np.sum((loss[part] - loss[part].mean()) ** 2)) for part in (low, high))
    scatter = np.sqrt(squares / max(len(loss) - 2, 1))
    if loss[order[0]] <= 0 or loss[high].min() < _FACTOR * loss[low].max() or np.max(gaps) < _CLEAR * scatter:
        return None
    pairs = np.abs(np.log(load[low][:, None] / load[high])) < _EQUAL_LOADS
    both = min(int(pairs.any(axis=1).sum()), int(pairs.any(axis=0).sum()))
    return float(loss[high].min() + loss[low].max()) / 2 if both >= _FEWEST else None


def _find_turns(groups: list[_Group]) -> list[int] | None:
    """Half turns by which each group's angle is off, the fewest groups with which all have one coefficient; None without."""
    angle, loss = np.array([group.angle for group in groups]), np.array([group.loss for group in groups])
    best: list[int] | None = None
    for coefficient in loss / angle:
        turns = np.clip(np.round((loss / coefficient - angle) / np.pi), -_MOST_TURNS, _MOST_TURNS).astype(int)
        fitted = coefficient * (angle + turns * np.pi)
        right = turns == 0
        explained = np.all(fitted > 0) and np.all(np.abs(loss / np.where(fitted > 0, fitted, 1.0) - 1) < _ALIKE)
        if not explained or np.sum(right) < 2 or len(np.unique(angle[right])) < 2 or np.sum(~right) > np.sum(right):
            continue
        if best is None or np.sum(~right) < np.count_nonzero(best):
            best = [int(n) for n in turns]
    return best
