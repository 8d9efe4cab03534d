"""The liveliest stretches of a recording on a coarse clock, on which the delay of a channel is looked for.

By itself the play operator keeps the highest peak of the noise at the end of a pull. From there it touches the other side
of the band too early, by milliseconds, as if the output channel were that much ahead. So the level at which the output
stands still is read from the output, over the whole rest (`read_rests`), and the operator along the stretches knows of it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from bowdenfit.files import pieces
from bowdenfit.recordings.preparation.blocks import main_frequency
from bowdenfit.recordings.preparation.hysteresis import smooth_input
from bowdenfit.recordings.preparation.noise import noise_of
from bowdenfit.types import ChosenVector, Flags, Labels, Matrix, OtherVector, Positions, Vector

# Judged; the errors over 24 simulated benches that the docstring of `delay` states are with these.
_STEP = 0.005  # [s] between points
_SEGMENT = 8.0  # [s]
_MOST_POINTS = 5_000  # in all stretches that are kept
_FEWEST_ROWS = 16  # stretches of a very long recording that are looked at
_CYCLES = 3  # in a segment, at least
_FEWEST_POINTS = 500  # that are left on a clock made coarser
_WIDTH = 0.012  # [s], of the Gaussian that smooths
_LIGHT = np.array([1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0]) / 64  # binomial weights, for the noise of neighbouring points
USED = 0.05  # weight of a point that counts
_MARGIN = 50 / 12  # of the width of smoothing: what it rounds at the ends of a rest
_AWAY = 6.0  # standard deviations by noise, within which the input is at the end of its pull
_NEAR = 1.5  # likewise, within which the rope is at its rest


@dataclass(frozen=True)
class Segments:
    """Stretches of a recording on a coarse clock, one a row.

    Args:
        step: Time between points [s].
        x: log input force, smoothed [1].
        y: log output force, smoothed alike [1].
        weight: Inverse relative variance of each point, 0 where it must not be used.
        jitter: Standard deviation of x by noise [1].
        reach: Longest delay that is looked for [s].
        width: Width of the Gaussian that both are smoothed with [s].
    """

    step: float
    x: Matrix
    y: Matrix
    weight: Matrix
    jitter: Matrix
    reach: float
    width: float = _WIDTH


@dataclass(frozen=True)
class Rests:
    """What the output itself says of where it stands still between contact on one side of the band and on the other.

    From the end of a pull to that of the next return the output is `min(level, x + exponent)`, and after a return
    `max(level, x - exponent)`, with the level that the output is seen to have.

    Args:
        level: Level of the last rest [1].
        heading: -1 after a pull, +1 after a return, 0 where the play operator is left alone.
    """

    level: Matrix
    heading: Matrix


def cut_segments(time: Vector, input_force: Vector, output_force: Vector, good: Flags, reach: float) -> Segments | None:
    """Average onto a coarse clock and cut into stretches of equal length, the liveliest of which are kept.

    Args:
        time: Common clock [s].
        input_force, output_force: Forces [N].
        good: Samples that may be used.
        reach: Longest delay that is looked for [s].
    """
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
    return Segments(step, moved, y[chosen], weight[chosen], jitter[chosen], reach, width)


def _sums(
    time: Vector, forces: tuple[Vector, Vector], good: Flags, step: float, points: int, length: int
) -> tuple[Positions, ChosenVector, ChosenVector]:
    """Return the number of good readings above zero at each point of the coarse clock, and sums of both forces.

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
        for part in pieces.split_pieces(ends[1] - ends[0]):
            some = slice(ends[0] + part.start, ends[0] + part.stop)
            x, y = (pieces.to_floats(force, some) for force in forces)
            usable = good[some] & (x > 0) & (y > 0)
            place = np.clip(((time[some] - time[0]) / step).astype(int) - begin, 0, wide - 1)[usable]
            for total, weights in zip(sums, (None, x[usable], y[usable]), strict=True):
                total += np.bincount(place, weights, minlength=wide)
        totals.append(sums)
    count, of_input, of_output = (np.concatenate(column) for column in zip(*totals, strict=True))
    return count, of_input, of_output


def _filled(total: Vector, count: Labels) -> Vector:
    positions = np.flatnonzero(count)
    return np.interp(np.arange(len(count)), positions, total[positions] / count[positions])


def _coarser(forces: list[Vector], step: float) -> int:
    """Return how many points to join, so that a segment holds some cycles: noise averages out over longer parts."""
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
    """Return rows in which the rate changes most, in order."""
    lag = max(1, x.shape[1] // 50)
    bends = np.abs(x[:, 2 * lag :] - 2 * x[:, lag:-lag] + x[:, : -2 * lag]).sum(axis=1)
    return np.sort(np.argsort(-bends, kind="stable")[:most])


def reverses(segments: Segments) -> bool:
    """Return whether the input turns around by more than a fifth of its range within a segment."""
    fifth = 0.2 * float(np.ptp(segments.x))
    fall = np.max(np.maximum.accumulate(segments.x, axis=1) - segments.x)
    rise = np.max(segments.x - np.minimum.accumulate(segments.x, axis=1))
    return bool(fall > fifth and rise > fifth)


def play_along_rows(x: Matrix, start: Vector, exponent: OtherVector, rests: Rests | None = None) -> np.ndarray:
    """Play operator along each row for each exponent at once: an array of exponents, rows and points.

    Keeping a value between two limits, and then between two others, keeps it between two limits again: so the limits of
    1, 2, 4, ... points before each point are joined (Blelloch 1990, "Prefix sums and their applications"), to the last bit.
    """
    band = exponent[:, None, None]
    lower, upper = x - band, x + band
    if rests is not None:
        falls, rises = np.minimum(rests.level, upper), np.maximum(rests.level, lower)
        seen = np.where(rests.heading < 0, falls, rises)
        lower, upper = np.where(rests.heading == 0, lower, seen), np.where(rests.heading == 0, upper, seen)
    reach = 1
    while reach < x.shape[1]:
        low, high = lower[..., reach:].copy(), upper[..., reach:]
        _between(lower[..., :-reach], low, high, out=lower[..., reach:])
        _between(upper[..., :-reach], low, high, out=high)
        reach *= 2
    return np.clip(start[:, None], lower, upper)


def _between(x: np.ndarray, low: np.ndarray | int, high: np.ndarray | int, out: np.ndarray | None = None) -> np.ndarray:
    """Return the same as `np.clip`, which takes longer to call than these few numbers to compare."""
    return np.minimum(np.maximum(x, low), high, out=out)


def with_drag(segments: Segments, drag: float) -> Segments:
    """Return the segments on the scale log(F + drag), on which friction with drag is a constant distance.

    Args:
        segments: On the scale log F.
        drag: Force [N].
    """
    if drag == 0:
        return segments
    x, y = (np.log(np.exp(log_force) + drag) for log_force in (segments.x, segments.y))
    return replace(segments, x=x, y=y, jitter=segments.jitter * np.exp(segments.x - x))


def move_to_drag(rests: Rests, ratio: float, more: float) -> Rests:
    """Return the rests on the scale of more drag [N]."""
    if more == 0:
        return rests
    there = np.isfinite(rests.level)
    force = np.exp(np.where(there, rests.level, 0.0) + ratio) + more
    return replace(rests, level=np.where(there, np.log(np.maximum(force, 1e-300)) - ratio, rests.level))


def estimate_band(segments: Segments) -> tuple[float, float]:
    """Return middle and half width of the band of x - y [1]."""
    low, high = np.quantile((segments.x - segments.y)[segments.weight > USED], (0.05, 0.95))
    return float(low + high) / 2, float(high - low) / 2


def starts(segments: Segments, ratio: float) -> Vector:
    """Log output force with which each segment starts, without the log ratio of the sensors [1]."""
    return np.mean(segments.y[:, :3], axis=1) - ratio


def shift_rows(y: np.ndarray, points: float) -> np.ndarray:
    """Return each row later by a number of points, with straight lines between them; the ends are held."""
    whole = int(np.floor(points))
    share = points - whole
    place = np.arange(y.shape[-1]) - whole
    last = y.shape[-1] - 1
    return (1 - share) * y[..., _between(place, 0, last)] + share * y[..., _between(place - 1, 0, last)]


def sides(segments: Segments, output: Matrix, exponent: float) -> tuple[np.ndarray, np.ndarray]:
    """Return whether the model stands still at each point, and the side of the band that it last touched, 0 for none yet."""
    gap = segments.x - output
    touch = np.where(np.abs(gap) >= exponent * (1 - 1e-9), np.sign(gap), 0.0)
    last = np.maximum.accumulate(np.where(touch != 0, np.arange(touch.shape[1]), -1), axis=1)
    side = np.where(last >= 0, np.take_along_axis(touch, np.maximum(last, 0), axis=1), 0.0)
    return touch == 0, side


def read_rests(segments: Segments, point: OtherVector) -> Rests:
    """Read the level of each rest from the output.

    A rest starts where the input comes close to the end of its pull or return, and ends where the play operator touches
    the other side of the band. A level is the mean of the output over the rest, but for its ends that smoothing rounds.

    Args:
        segments: The recording.
        point: Friction exponent [1], log ratio of the sensors [1], and delay [s], all of them roughly right.
    """
    exponent, ratio, delay = (float(value) for value in point)
    output = play_along_rows(segments.x, starts(segments, ratio), np.array([exponent]))[0]
    stands, side = sides(segments, output, exponent)
    seen = shift_rows(segments.y, -delay / segments.step) - ratio
    attached = exponent - side * (segments.x - output) <= _AWAY * segments.jitter
    level, heading = np.where(side > 0, -np.inf, np.inf), np.where(attached, side, 0.0)
    margin = round(_MARGIN * segments.width / segments.step)
    for row, begin, end, after in _half_cycles(side):
        touched = np.flatnonzero(~stands[row, begin:end])
        if not len(touched) or begin + touched[-1] + 2 * margin + 3 > end:
            continue
        turn = begin + int(touched[-1])
        value = float(np.mean(seen[row, turn + margin : end - margin]))
        away = side[row, begin] * (value - segments.x[row, begin:turn]) + exponent
        far = np.flatnonzero(away > _NEAR * segments.jitter[row, begin:turn])
        since = begin + int(far[-1]) + 1 if len(far) else begin
        level[row, since:after], heading[row, since:end] = value, -side[row, begin]
    return Rests(level, heading)


def _half_cycles(side: Matrix) -> Iterator[tuple[int, int, int, int]]:
    """Yield row, first point, end, and end of the next one, of all stretches in which the band is touched on one side."""
    for row, values in enumerate(side):
        ends = [0, *(np.flatnonzero(np.diff(values)) + 1).tolist(), len(values), len(values)]
        for begin, end, after in zip(ends[:-2], ends[1:-1], ends[2:], strict=True):
            yield row, begin, end, after
