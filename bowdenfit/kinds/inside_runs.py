"""Readings inside runs one by one: the likelihood sums them up, and what it takes for scatter may have a cause."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from bowdenfit.kinds.sliding_rows import SlidingRows
from bowdenfit.kinds.term import LOAD, WRAP_ANGLE
from bowdenfit.types import Labels, Vector

STROKE, SPEED, ORDER, ZERO = "Stroke", "Speed", "Order", "Zero"
_MOST = 4000  # readings of a table that are looked at one by one; of more, so many neighbors are taken together


@dataclass(frozen=True)
class InsideRuns:
    """Readings of runs, of which the likelihood takes several for one cell.

    Args:
        cell: Cell of each reading, in the order of the term's residuals.
        run: Run of each.
        weight: Information on the log ratio at unit noise [N^2].
        apart: Log ratio less the mean of its cell [1].
        log_ratio: Log ratio [1].
        within: Weighted sum of squares inside what was taken together [N^2].
        count: How many independent readings there are [1].
        at: Where they were taken, by axis label.
    """

    cell: Labels
    run: Labels
    weight: Vector
    apart: Vector
    log_ratio: Vector
    within: float
    count: float
    at: Mapping[str, Vector]


def inside_runs(cell: Labels, run: Labels, rows: SlidingRows, noise_ratio: float) -> InsideRuns:
    """Readings as they were taken; of very many, neighbors in one cell together.

    Args:
        cell: Cell of each reading.
        run: Number of its run, from 0.
        rows: The readings.
        noise_ratio: Noise of the input cell over that of the output cell [1].
    """
    weight, worth, log_ratio, at = rows.weight(noise_ratio), rows.worth, rows.log_ratio, _places(run, rows)
    order = np.argsort(cell, kind="stable")
    first = np.searchsorted(cell[order], cell[order])
    together = (np.arange(len(cell)) - first) // max(1, -(-len(cell) // _MOST))
    _, where = np.unique(np.column_stack([cell[order], together]), axis=0, return_inverse=True)
    group = np.empty(len(cell), dtype=int)
    group[order] = where.ravel()
    total = np.bincount(group, weight)

    def mean(values: Vector) -> Float[np.ndarray, " readings"]:
        return np.asarray(np.bincount(group, weight * values) / total)

    one = np.unique(group, return_index=True)[1]
    ratio = mean(log_ratio)
    of_cell = np.bincount(cell, weight * log_ratio) / np.maximum(np.bincount(cell, weight), 1e-300)
    places = {label: mean(values) for label, values in at.items()}
    return InsideRuns(
        cell[one], run[one], total, ratio - of_cell[cell[one]], ratio,
        float(np.sum(weight * (log_ratio - ratio[group]) ** 2)), float(np.sum(worth)), places,
    )  # fmt: skip


def _places(run: Labels, rows: SlidingRows) -> dict[str, Vector]:
    """Load, stroke, speed, order inside the run and wrap angle of every reading; with a clock, what a zero of the output that
    drifts by a newton from the middle of the run to its end adds to the log ratio.
    """
    first, last = np.full(int(run.max()) + 1, len(run)), np.zeros(int(run.max()) + 1, dtype=int)
    np.minimum.at(first, run, np.arange(len(run)))
    np.maximum.at(last, run, np.arange(len(run)))
    own = np.where(rows.angles["is_own"], rows.angles["own"], 0.0)
    order = (np.arange(len(run)) - first[run]).astype(float)
    later = 2 * order / np.maximum(last - first, 1)[run] - 1
    drifting = {ZERO: -rows.stroke * later / rows.output_force} if np.any(rows.drift) else {}
    return drifting | {
        LOAD: rows.input_force,
        STROKE: rows.stroke.astype(float),
        SPEED: np.abs(rows.velocity),
        ORDER: order,
        WRAP_ANGLE: np.rad2deg(own.sum(axis=1)),
    }
