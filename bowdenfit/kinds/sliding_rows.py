r"""Readings taken while the rope slides: their expected forces, their weights, and their runs.

A weight computed from the very readings that it weighs rises with the output's noise, as the efficiency does, and the mean of
a run comes out too high by about 1.5 (sd/F)^2, however many rows it has. So the readings of each run, stroke and bend are
projected on a line: :math:`F_\text{out} = k F_\text{in}` by total least squares (Deming 1943, with the ratio of the two cells'
noises), bent by what is left over where that is far beyond noise, as hidden tension and load dependence do, and off the origin
where the cells may have offsets. The distance to the line and the position along it have independent errors. What noise itself
adds to a log ratio, to second order,

.. math:: E[\log(F_\text{in}/F_\text{out})] - \log(k^{-1}) = \tfrac{\sigma^2}{2} (F_\text{out}^{-2} - \rho^2 F_\text{in}^{-2}),

is estimated too, with sigma from the distances. Where a standard deviation is stated for each reading, the line is that of York
(1966), in which every point has errors of its own in both coordinates.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from bowdenfit.kinds.row_angles import RowAngles
from bowdenfit.kinds.rows import UnusedColumn
from bowdenfit.kinds.term import LOAD, WRAP_ANGLE
from bowdenfit.types import Labels, Matrix, Vector

_FEWEST_TO_SHIFT = 3  # readings of a group from which its line need not go through the origin: one more than coefficients
_FEWEST_TO_BEND = 6  # readings of a group from which a parabola is looked for; a judgement
_FAR_BEYOND = 10.0  # F(3, n - 3) of the parabola: noise exceeds it in 1 group of 2000 of n = 20, 1 of 22 of n = 6
_FAR_OFF = 0.2  # distance of a log ratio from the line beyond which a small group is taken as it was read; a judgement
_LEAST_FREEDOM = 4  # degrees of freedom from which distances estimate the noise; a judgement
_YORK_STEPS = 20  # of a fixed-point iteration that gains a digit or more in each; a judgement
_MEDIAN = 0.6745  # median size of a standard normal deviate
ONE_LOAD = 1.05  # highest over lowest load of a run that counts as made at one load; a judgement
STROKE, SPEED, ORDER, ZERO, OFFSET = "Stroke", "Speed", "Order", "Zero", "Offset"
_MOST = 4000  # readings that are tested one by one; neighbors of more are joined, to bound the time. A judgement


@dataclass(frozen=True)
class SlidingRows:
    """Readings taken while the rope slides, in the order of the table.

    Args:
        input_force, output_force: Forces, those of tables as `expected_forces` has them [N].
        log_ratio: s log(F_in/F_out) of the readings, without what noise adds to it [1].
        stroke: +1 pulling, -1 return.
        run: Number of the run.
        velocity: Velocity; NaN where it is not known.
        drift: s d(log F_out)/dt, by which a delay of the output channel shifts the log ratio [1/s]; 0 without a clock.
        n_effective: How many independent readings each counts for [1].
        angles: Wrap angles of every row.
        information: Information of one such reading on its log ratio at unit noise of the output cell [N^2]; computed from
            the forces if omitted.
        unused: Columns that the fit does not use, by heading.
    """

    input_force: Vector
    output_force: Vector
    log_ratio: Vector
    stroke: Labels
    run: Labels
    velocity: Vector
    drift: Vector
    n_effective: Vector
    angles: RowAngles
    information: Vector | None = None
    unused: Mapping[str, UnusedColumn] = field(default_factory=dict[str, UnusedColumn])

    def weight(self, noise_ratio: float) -> Vector:
        """Information on the log ratio at unit noise of the output cell [N^2].

        Args:
            noise_ratio: Noise of the input cell over that of the output cell [1].
        """
        if self.information is not None:
            return self.n_effective * self.information
        return np.asarray(self.n_effective / (noise_ratio**2 / self.input_force**2 + 1 / self.output_force**2))


@dataclass(frozen=True)
class ExpectedForces:
    """Forces by the line through a group of readings.

    Args:
        input_force, output_force: Forces [N].
        log_ratio_error: Mean error of log(F_in/F_out) due to noise [1].
    """

    input_force: Vector
    output_force: Vector
    log_ratio_error: Vector


def expected_forces(
    input_force: Vector,
    output_force: Vector,
    group: Labels,
    noise_ratio: float,
    noise: float | None,
    offsets: bool = False,
    sd: Matrix | None = None,
) -> ExpectedForces:
    """Return the forces that the readings of each group together estimate.

    Args:
        input_force, output_force: Readings [N].
        group: Number of each reading's run, stroke and bend together.
        noise_ratio: rho, noise of the input over that of the output; 0 where a weight hangs there.
        noise: Standard deviation of an output's reading as stated [N]; None where the distances estimate it.
        offsets: Whether the cells may show a force where there is none, so that the line need not go through the origin.
        sd: Standard deviations of each input and output as stated [N], which take the place of the other two.
    """
    slope = _slopes(input_force, output_force, group, noise_ratio)
    in_variance: Vector | float = noise_ratio**2
    out_variance: Vector | float = 1.0
    if sd is not None:
        in_variance, out_variance = sd[:, 0] ** 2, sd[:, 1] ** 2
        slope, noise = _york_slopes(input_force, output_force, group, slope, (in_variance, out_variance)), 1.0
    slope = slope[group]
    across = out_variance + in_variance * slope**2
    distance = output_force - slope * input_force
    bend, freedom = np.zeros(len(distance)), float(len(distance) - np.max(group, initial=-1) - 1)
    along = input_force + in_variance * slope * distance / across
    roots = np.sqrt(np.broadcast_to(across, distance.shape))
    few = np.zeros(len(distance), dtype=bool)
    for rows in np.split(np.argsort(group, kind="stable"), np.cumsum(np.bincount(group))[:-1]):
        if offsets and len(rows) >= _FEWEST_TO_SHIFT:
            bend[rows], more = _fit_straight_line(along[rows], distance[rows], roots[rows])
            freedom -= more
        elif len(rows) >= _FEWEST_TO_BEND:
            bend[rows], more = _fit_parabola(along[rows], distance[rows], roots[rows])
            freedom -= more
        elif np.any(np.abs(np.log(output_force[rows] / (slope * input_force)[rows])) > _FAR_OFF):
            few[rows] = True
    left = np.where(few, 0.0, distance - bend)
    expected_in = input_force + in_variance * slope * left / across
    expected_out = output_force - out_variance * left / across
    if noise is None:
        sizes, freedom = np.abs(left)[~few] / np.sqrt(across[~few]), freedom - np.sum(few)
        noise = float(np.median(sizes) / _MEDIAN * np.sqrt(len(sizes) / freedom)) if freedom >= _LEAST_FREEDOM else 0.0
    possible = (expected_in > 0) & (expected_out > 0)
    expected_in, expected_out = (
        np.where(possible, expected, read)
        for expected, read in ((expected_in, input_force), (expected_out, output_force))
    )
    bias = noise**2 / 2 * (out_variance / expected_out**2 - in_variance / expected_in**2)
    return ExpectedForces(expected_in, expected_out, bias)


def _slopes(
    input_force: Vector, output_force: Vector, group: Labels, noise_ratio: float
) -> Float[np.ndarray, " groups"]:
    """Return the slope of each group's line through the origin, by total least squares."""
    of_input, of_both, of_output = (
        np.bincount(group, product) for product in (input_force**2, input_force * output_force, output_force**2)
    )
    difference = of_input - noise_ratio**2 * of_output
    root = np.sqrt(difference**2 + 4 * noise_ratio**2 * of_both**2)
    # One of two forms of the same root, whichever does not cancel; forces that no table has may be 0 or negative.
    steep = (root - difference) / np.where(of_both == 0, 1.0, 2 * noise_ratio**2 * of_both) if noise_ratio else root
    flat = 2 * of_both / np.where(difference < 0, 1.0, np.maximum(difference + root, 1e-300))
    return np.asarray(np.where(difference < 0, steep, flat))


def _york_slopes(
    input_force: Vector,
    output_force: Vector,
    group: Labels,
    start: Float[np.ndarray, " groups"],
    variances: tuple[Vector, Vector],
) -> Float[np.ndarray, " groups"]:
    """Return the slope of each group's line through the origin where each reading has variances of its own [N^2].

    References:
        York, Least-squares fitting of a straight line, Can. J. Phys. 44 (1966), 1079.
    """
    slope, (of_input, of_output) = start, variances
    for _ in range(_YORK_STEPS):
        at = slope[group]
        weight = 1 / (of_output + of_input * at**2)
        along = input_force + of_input * at * weight * (output_force - at * input_force)
        slope = np.bincount(group, weight * along * output_force) / np.bincount(group, weight * along * input_force)
    return np.asarray(slope)


def _fit_straight_line(along: Vector, distance: Vector, sd: Vector) -> tuple[Vector, int]:
    """Return a straight line through distances of standard deviations `sd`, and the number of its further coefficients."""
    spread = np.ptp(along)
    if spread <= 1e-9 * np.max(along):
        return np.zeros(len(along)), 0
    columns = np.vander((along - along.mean()) / spread, 2)
    return columns @ np.linalg.lstsq(columns / sd[:, None], distance / sd, rcond=None)[0], 1


def _fit_parabola(along: Vector, distance: Vector, sd: Vector) -> tuple[Vector, int]:
    """Return a parabola through such distances, and its further coefficients; zeros where it may be noise."""
    spread = np.ptp(along)
    if spread <= 1e-9 * np.max(along):
        return np.zeros(len(along)), 0
    columns = np.vander((along - along.mean()) / spread, 3)
    fitted = columns @ np.linalg.lstsq(columns / sd[:, None], distance / sd, rcond=None)[0]
    noise = np.sum(((distance - fitted) / sd) ** 2) / (len(along) - 3)
    return (fitted, 2) if np.sum((fitted / sd) ** 2) > 3 * _FAR_BEYOND * noise else (np.zeros(len(along)), 0)


@dataclass(frozen=True)
class InsideRuns:
    """Single readings of runs whose likelihood joins several in one cell.

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


def list_readings_inside_runs(cell: Labels, run: Labels, rows: SlidingRows, noise_ratio: float) -> InsideRuns:
    """Return single readings; where there are very many, neighbors in one cell joined.

    Args:
        cell: Cell of each reading.
        run: Number of its run, from 0.
        rows: The readings.
        noise_ratio: Noise of the input cell over that of the output cell [1].
    """
    weight, n_effective, log_ratio, at = rows.weight(noise_ratio), rows.n_effective, rows.log_ratio, _covariates(run, rows)
    order = np.argsort(cell, kind="stable")
    first = np.searchsorted(cell[order], cell[order])
    together = (np.arange(len(cell)) - first) // max(1, -(-len(cell) // _MOST))
    _, positions = np.unique(np.column_stack([cell[order], together]), axis=0, return_inverse=True)
    group = np.empty(len(cell), dtype=int)
    group[order] = positions.ravel()
    total = np.bincount(group, weight)

    def mean(values: Vector) -> Float[np.ndarray, " readings"]:
        return np.asarray(np.bincount(group, weight * values) / total)

    one = np.unique(group, return_index=True)[1]
    ratio = mean(log_ratio)
    of_cell = np.bincount(cell, weight * log_ratio) / np.maximum(np.bincount(cell, weight), 1e-300)
    covariates = {label: mean(values) for label, values in at.items()}
    return InsideRuns(
        cell[one], run[one], total, ratio - of_cell[cell[one]], ratio,
        float(np.sum(weight * (log_ratio - ratio[group]) ** 2)), float(np.sum(n_effective)), covariates,
    )  # fmt: skip


def _covariates(run: Labels, rows: SlidingRows) -> dict[str, Vector]:
    """Return load, stroke, speed, order inside the run, wrap angle and unused columns of every reading.

    Where both strokes were read, also what an offset of the output of a newton adds to the log ratio; and with a clock what a
    zero of the output does that drifts by a newton from the middle of the run to its end.
    """
    first, last = np.full(int(run.max()) + 1, len(run)), np.zeros(int(run.max()) + 1, dtype=int)
    np.minimum.at(first, run, np.arange(len(run)))
    np.maximum.at(last, run, np.arange(len(run)))
    own_angles = np.where(rows.angles.is_own, rows.angles.own, 0.0)
    order = (np.arange(len(run)) - first[run]).astype(float)
    later = 2 * order / np.maximum(last - first, 1)[run] - 1
    offset = -rows.stroke / rows.output_force
    zeros = {OFFSET: offset} if np.ptp(rows.stroke) > 0 else {}
    zeros |= {ZERO: offset * later} if np.any(rows.drift) else {}
    return {heading: column.numbers for heading, column in rows.unused.items()} | zeros | {
        LOAD: _loads(2 * run + (rows.stroke > 0), rows),
        STROKE: rows.stroke.astype(float),
        SPEED: np.abs(rows.velocity),
        ORDER: order,
        WRAP_ANGLE: np.rad2deg(own_angles.sum(axis=1)),
    }


def _loads(stroke_of_run: Labels, rows: SlidingRows) -> Vector:
    """Return the load of every reading: its input force, or the mean of a stroke that was made at one load.

    It was if one of the forces hardly changes, such as under a hung weight: the other differs by friction and noise alone.
    """
    ranges = [range_by_group(force, stroke_of_run) for force in (rows.input_force, rows.output_force)]
    at_one_load = np.minimum(*(high / low for low, high in ranges)) <= ONE_LOAD**2
    mean = np.bincount(stroke_of_run, rows.input_force) / np.maximum(np.bincount(stroke_of_run), 1)
    return np.where(at_one_load[stroke_of_run], mean[stroke_of_run], rows.input_force)


def range_by_group(force: Vector, group: Labels) -> tuple[Float[np.ndarray, " groups"], Float[np.ndarray, " groups"]]:
    """Return the lowest and the highest force of each group, numbered from 0."""
    low, high = np.full(group.max() + 1, np.inf), np.zeros(group.max() + 1)
    np.minimum.at(low, group, force)
    np.maximum.at(high, group, force)
    return low, high
