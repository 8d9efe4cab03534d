"""The liveliest stretches of a recording on a coarse clock, on which the delay of a channel is looked for."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.files import pieces
from bowdenfit.recordings.preparation.bandwidth import main_frequency
from bowdenfit.recordings.preparation.input_smoothing import smooth_input
from bowdenfit.recordings.preparation.noise import noise_of
from bowdenfit.recordings.preparation.shapes import ChosenVector, Positions
from bowdenfit.types import Flags, Labels, Matrix, Vector

_STEP = 0.005
_SEGMENT = 8.0
_MOST_POINTS = 5_000
_FEWEST_ROWS = 16
_CYCLES = 3  # in a segment, at least
_FEWEST_POINTS = 500
_WIDTH = 0.012
_LIGHT = np.array([1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0]) / 64


@dataclass(frozen=True)
class Segments:
    """Stretches of a recording on a coarse clock, one a row.

    Args:
        step: Time between points [s].
        x: log input force, smoothed [1].
        y: log output force, smoothed alike [1].
        weight: Inverse relative variance of each point, 0 where it must not be used.
        jitter: Standard deviation of x by noise [1].
        width: Of the Gaussian that both are smoothed with [s].
    """

    step: float
    x: Matrix
    y: Matrix
    weight: Matrix
    jitter: Matrix
    width: float = _WIDTH


def cut_segments(time: Vector, input_force: Vector, output_force: Vector, good: Flags) -> Segments | None:
    """Average onto a coarse clock and cut into stretches of equal length, the liveliest of which are kept."""
    span = float(time[-1] - time[0])
    rate = (len(time) - 1) / span
    step = max(round(_STEP * rate), 1) / rate
    points = int(span / step)
    if points < 20:
        return None
    length = min(max(round(_SEGMENT / step), 20), points)
    count, *sums = _sums(time, (input_force, output_force), good, step, points, length)
    if count.sum() < 20:
        return None
    coarser = _coarser([_filled(total, count) for total in sums], step)
    whole = len(count) // coarser * coarser
    count, *sums = (column[:whole].reshape(-1, coarser).sum(axis=1) for column in (count, *sums))
    step, length, width = coarser * step, max(min(length, len(count)), 1), coarser * _WIDTH
    points, forces = len(count), [_filled(total, count) for total in sums]
    x, y = (np.log(force) for force in forces)
    weights, jitters = _weight(forces[0], forces[1], count), _jitter(forces[0], step, width)
    columns = _smooth(x, step, width), _smooth(y, step, width), weights, jitters, forces[0]
    rows = points // length
    x, y, weight, jitter, pulled = (v[: rows * length].reshape(rows, length) for v in columns)
    chosen = _most_varied(x, max(1, _MOST_POINTS // length))
    moved = np.stack([_smooth(np.log(smooth_input(force)), step, width) for force in pulled[chosen]])
    return Segments(step, moved, y[chosen], weight[chosen], jitter[chosen], width)


def _sums(
    time: Vector, forces: tuple[Vector, Vector], good: Flags, step: float, points: int, length: int
) -> tuple[Positions, ChosenVector, ChosenVector]:
    """Number of good readings above zero at each point of the coarse clock, and sums of both forces.

    Of a recording with very many points, those of stretches evenly from all of it.

    Args:
        time: Common clock [s].
        forces: Input and output force [N].
        good: Samples that may be used.
        step: Time between points [s].
        points: Number of all of them.
        length: Points of a stretch.
    """
    looked_at = max(pieces.PLENTY // length, _FEWEST_ROWS)
    rows, every = points // length, points <= looked_at * length
    stretches = [(0, points)]
    if not every:
        stretches = [(row * length, length) for row in np.linspace(0, rows - 1, looked_at).astype(int).tolist()]
    totals: list[tuple[np.ndarray, ...]] = []
    for begin, wide in stretches:
        ends = (
            [0, len(time)]
            if every
            else np.searchsorted(time, time[0] + step * np.array([begin, begin + wide])).tolist()
        )
        sums = np.zeros(wide, dtype=int), np.zeros(wide), np.zeros(wide)
        for part in pieces.parts(ends[1] - ends[0]):
            some = slice(ends[0] + part.start, ends[0] + part.stop)
            x, y = (pieces.numbers(force, some) for force in forces)
            usable = good[some] & (x > 0) & (y > 0)
            place = np.clip(((time[some] - time[0]) / step).astype(int) - begin, 0, wide - 1)[usable]
            for total, weights in zip(sums, (None, x[usable], y[usable]), strict=True):
                total += np.bincount(place, weights, minlength=wide)
        totals.append(sums)
    count, of_input, of_output = (np.concatenate(column) for column in zip(*totals, strict=True))
    return count, of_input, of_output


def _filled(total: Vector, count: Labels) -> Vector:
    where = np.flatnonzero(count)
    return np.interp(np.arange(len(count)), where, total[where] / count[where])


def _coarser(forces: list[Vector], step: float) -> int:
    """How many points to join, for a segment to hold some cycles: noise averages out over longer parts of slower ones."""
    main = main_frequency(forces[0], forces[1], 1 / step)
    return min(max(1, round(_CYCLES / (main * _SEGMENT))), max(1, len(forces[0]) // _FEWEST_POINTS)) if main > 0 else 1


def _smooth(values: Vector, step: float, width: float) -> Vector:
    """Convolved with a Gaussian of a few coarse steps, so that the play operator does not follow every peak of the noise."""
    reach = int(np.ceil(3 * width / step))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) * step / width) ** 2)
    return _convolved(values, kernel / kernel.sum())


def _convolved(values: Vector, kernel: np.ndarray) -> Vector:
    return np.convolve(np.pad(values, len(kernel) // 2, mode="edge"), kernel, mode="valid")


def _weight(input_force: Vector, output_force: Vector, count: Labels) -> Vector:
    variance = 1e-3**2 + np.zeros(len(count))
    for force in (input_force, output_force):
        noise = max(noise_of(_convolved(force, _LIGHT)), 1e-4 * float(force.max()))
        variance += (noise / force) ** 2
    return np.where(count > 0, np.min(variance) / variance, 0.0)


def _jitter(force: Vector, step: float, width: float) -> Vector:
    """Relative standard deviation of the force after smoothing, for noise that was white before."""
    points = max(2 * np.sqrt(np.pi) * width / step, 1.0)
    return max(noise_of(force) / np.sqrt(points), 1e-4 * float(force.max())) / force


def _most_varied(x: Matrix, most: int) -> Positions:
    """Rows in which the rate changes most, in order."""
    lag = max(1, x.shape[1] // 50)
    bends = np.abs(x[:, 2 * lag :] - 2 * x[:, lag:-lag] + x[:, : -2 * lag]).sum(axis=1)
    return np.sort(np.argsort(-bends, kind="stable")[:most])


def reverses(segments: Segments) -> bool:
    """Whether the input turns around by more than a fifth of its range within a segment."""
    fifth = 0.2 * float(np.ptp(segments.x))
    fall = np.max(np.maximum.accumulate(segments.x, axis=1) - segments.x)
    rise = np.max(segments.x - np.minimum.accumulate(segments.x, axis=1))
    return bool(fall > fifth and rise > fifth)
