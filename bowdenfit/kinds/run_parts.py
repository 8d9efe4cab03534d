"""Parts of runs for leave-one-out: the readings of one load, or single readings, the mounting staying the same.

The effect of a run's mounting is integrated out of the run's likelihood in closed form, with any of its readings as well as
with all of them; the likelihood of a part, given the rest of its run, is the quotient of the two.
"""

from dataclasses import dataclass, replace
from typing import Literal

import jax
import numpy as np

from bowdenfit.errors import UsageError
from bowdenfit.kinds.runs import RunsData, RunsTerm, pad_cells, sum_runs
from bowdenfit.kinds.sliding_rows import SlidingRows
from bowdenfit.kinds.term import Term
from bowdenfit.types import Labels
from bowdenfit.words import significant

LeaveOut = Literal["run", "load", "reading"]
_MOST_LOADS = 8  # load levels of a stroke of a run that can be left out; a judgement
_MOST_PARTS = 400  # parts that are left out one by one: time and memory grow with them. A judgement


@dataclass(frozen=True)
class RunParts:
    """Parts of the runs of a term that can be left out one by one.

    Args:
        labels: Each in words.
        event_keys: What identifies the same event in every fit: count of readings, mean log ratio, mean load [N].
        run: Run of each.
        data: Arrays of the term without each part, stacked with the parts first.
    """

    labels: tuple[str, ...]
    event_keys: np.ndarray
    run: Labels
    data: RunsData


def has_rows(term: Term) -> bool:
    """Return whether a term is one of runs whose single readings are known."""
    return isinstance(term, RunsTerm) and term.rows is not None


def split_runs(term: Term, unit: LeaveOut) -> RunParts | None:
    """Split a term's runs into parts; None where only whole runs, or the readings as they are, can be left out.

    Args:
        term: A term of the model.
        unit: Unit of a part.

    Raises:
        UsageError: There are too many parts.
    """
    if unit == "run" or not isinstance(term, RunsTerm) or term.rows is None:
        return None
    part, names = _assign_parts(term, term.rows, unit)
    counts, runs = np.bincount(part), np.unique(term.rows.run, return_inverse=True)[1]
    of_part = np.zeros(len(counts), dtype=int)
    of_part[part] = runs
    if np.min(np.bincount(of_part)) < 2:
        return None  # a run in one part can only be left out whole
    if len(counts) > _MOST_PARTS:
        raise UsageError(
            f"{term.name} has {len(counts):,} parts, and at most {_MOST_PARTS} can be left out one by one; use --leave-out "
            f"{'load' if unit == 'reading' else 'run'}."
        )
    cells_per_run = len(term.data.cells.mean) // len(term.labels)
    left = [
        pad_cells(sum_runs(term.cable, _select_rows(term.rows, part != i)), len(term.labels), cells_per_run)
        for i in range(len(counts))
    ]
    ratio, load = (np.bincount(part, values) / counts for values in (term.rows.log_ratio, term.rows.input_force))
    stacked = jax.tree.map(lambda *arrays: np.stack(arrays), *left)
    return RunParts(names, np.column_stack([counts, ratio, load]), of_part, stacked)


def _select_rows(rows: SlidingRows, kept: np.ndarray) -> SlidingRows:
    """Return the kept readings."""
    arrays = {name: value[kept] for name, value in vars(rows).items() if isinstance(value, np.ndarray)}
    unused = {heading: replace(column, numbers=column.numbers[kept]) for heading, column in rows.unused.items()}
    return replace(rows, **arrays, angles=rows.angles.select(kept), unused=unused)


def _assign_parts(term: RunsTerm, rows: SlidingRows, unit: LeaveOut) -> tuple[Labels, tuple[str, ...]]:
    """Return the part of each reading, and each part in words."""
    run = np.unique(rows.run, return_inverse=True)[1]
    level = np.arange(len(run)) if unit == "reading" else _load_levels(rows, run)
    keys, part = np.unique(np.column_stack([run, rows.stroke > 0, level]), axis=0, return_inverse=True)
    part = part.ravel()
    load = np.bincount(part, rows.input_force) / np.bincount(part)
    strokes = ("return", "pull")
    names = [
        f"{term.labels[r]}, {strokes[s]} at {significant(f, 4)} N" for (r, s, _), f in zip(keys, load, strict=True)
    ]
    return part, tuple(names)


def _load_levels(rows: SlidingRows, run: Labels) -> Labels:
    """Return the load of each reading as one of a few levels of its run and stroke, with equal counts."""
    level = np.zeros(len(run), dtype=int)
    group = run * 2 + (rows.stroke > 0)
    for which in np.unique(group):
        rows_in_group = np.flatnonzero(group == which)
        order = rows_in_group[np.argsort(rows.input_force[rows_in_group], kind="stable")]
        level[order] = np.arange(len(rows_in_group)) * min(_MOST_LOADS, len(rows_in_group)) // len(rows_in_group)
    return level
