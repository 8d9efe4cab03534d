"""Where the output of a recording stands still, and the play operator that knows of it.

By itself the play operator keeps the highest peak of the noise at the end of a pull. From there it touches the other side
of the band too early, by milliseconds, as if the output channel were that much ahead. So the level of each rest is read
from the output, over the whole rest.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from bowdenfit.recordings.preparation.segments import Segments
from bowdenfit.recordings.preparation.shapes import OtherVector
from bowdenfit.types import Matrix, Vector

USED = 0.05  # weight of a point that counts
_MARGIN = 50 / 12  # of the width of smoothing
_AWAY = 6.0
_NEAR = 1.5


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
    """The same as `np.clip`, which takes longer to call than these few numbers to compare."""
    return np.minimum(np.maximum(x, low), high, out=out)


def with_drag(segments: Segments, drag: float) -> Segments:
    """The segments on the scale log(F + drag), on which friction with drag is a constant distance.

    Args:
        segments: On the scale log F.
        drag: Force [N].
    """
    if drag == 0:
        return segments
    x, y = (np.log(np.exp(log_force) + drag) for log_force in (segments.x, segments.y))
    return replace(segments, x=x, y=y, jitter=segments.jitter * np.exp(segments.x - x))


def at_drag(rests: Rests, ratio: float, more: float) -> Rests:
    """Rests on the scale of more drag [N]."""
    if more == 0:
        return rests
    there = np.isfinite(rests.level)
    force = np.exp(np.where(there, rests.level, 0.0) + ratio) + more
    return replace(rests, level=np.where(there, np.log(np.maximum(force, 1e-300)) - ratio, rests.level))


def band_of(segments: Segments) -> tuple[float, float]:
    """Middle and half width of the band of x - y [1]."""
    low, high = np.quantile((segments.x - segments.y)[segments.weight > USED], (0.05, 0.95))
    return float(low + high) / 2, float(high - low) / 2


def starts(segments: Segments, ratio: float) -> Vector:
    """Log output force with which each segment starts, without the log ratio of the sensors [1]."""
    return np.mean(segments.y[:, :3], axis=1) - ratio


def shift_rows(y: np.ndarray, points: float) -> np.ndarray:
    """Each row later by a number of points, with straight lines between them; the ends are held."""
    whole = int(np.floor(points))
    share = points - whole
    place = np.arange(y.shape[-1]) - whole
    last = y.shape[-1] - 1
    return (1 - share) * y[..., _between(place, 0, last)] + share * y[..., _between(place - 1, 0, last)]


def sides(segments: Segments, output: Matrix, exponent: float) -> tuple[np.ndarray, np.ndarray]:
    """Whether the model stands still at each point, and the side of the band that it last touched, 0 for none yet."""
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
    """Row, first point, end, and end of the next one, of all stretches in which the band is touched on one side."""
    for row, values in enumerate(side):
        ends = [0, *(np.flatnonzero(np.diff(values)) + 1).tolist(), len(values), len(values)]
        for begin, end, after in zip(ends[:-2], ends[1:-1], ends[2:], strict=True):
            yield row, begin, end, after
