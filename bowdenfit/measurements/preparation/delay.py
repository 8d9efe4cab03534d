"""How much later one load cell's channel is than the other's, as far as the recording tells.

While the rope slides at a constant rate a delay looks like friction: log F_in - log F_out = Lambda + rate * delay. What
tells them apart are kinks: starts, stops, reversals and uneven rates.
"""

from dataclasses import dataclass, replace

import numpy as np

from bowdenfit.measurements.preparation.noise import correlation_time
from bowdenfit.measurements.preparation.segments import Segments, reverses, segments_of
from bowdenfit.measurements.preparation.shapes import OtherVector
from bowdenfit.types import Flags, Matrix, Vector

RANGE = 0.25
COMMON_ERROR = 0.0015  # s; the largest shifts left on simulated benches are hardly larger
_FRICTIONS = np.linspace(0.3, 1.2, 10)
_COARSE_ROWS = 3
_ROUNDS = 2
_MOST_STEPS = 5
_MARGIN = 0.050
_AWAY = 6.0
_NEAR = 1.5


@dataclass(frozen=True)
class Delay:
    """A delay of the output channel.

    Args:
        value: How much later it is [s].
        sd: Standard error [s]; NaN where it was not estimated.
        exponent: Friction exponent that goes with it [1]; NaN where it was not estimated.
        remark: A sentence where the recording does not tell; else empty.
    """

    value: float
    sd: float
    exponent: float
    remark: str = ""


def estimate_delay(time: Vector, input_force: Vector, output_force: Vector, good: Flags, shortest: float) -> Delay:
    """Least squares of the play operator over friction exponent, ratio of the sensors, and delay.

    Args:
        time: Common clock [s].
        input_force: Input force [N].
        output_force: Output force, not yet shifted [N].
        good: Samples that may be used.
        shortest: Length of a block [s]; a standard error of more than two of them is of no use.

    The standard error is that of the curvature, with the autocorrelation of the residuals, and COMMON_ERROR for what noise
    and smoothing shift in every recording alike.

    Returns:
        The delay with its standard error, or 0 with a remark where the recording does not tell.
    """
    segments = segments_of(time, input_force, output_force, good)
    if segments is None:
        return _untold("it has too few good readings above zero force")
    if not reverses(segments):
        return _untold("the force never turns around")
    start = _coarse(segments)
    segments = _touched(segments, start)
    point, covariance = _refined(segments, None, start)
    for _ in range(_ROUNDS):
        point, covariance = _refined(segments, _rests(segments, point), point)
    sd = float(np.hypot(np.sqrt(covariance[2, 2]), COMMON_ERROR))
    if not np.isfinite(sd) or sd > min(RANGE / 2, 2 * max(shortest, segments.step)):
        return _untold(f"its standard error would be {sd:.2g} s")
    if abs(point[2]) > RANGE - segments.step:
        return _untold(f"the best fit lies at the end of the range of {RANGE} s that was searched")
    return Delay(float(point[2]), sd, float(point[0]))


def _untold(why: str) -> Delay:
    remark = f"How much later the output channel is than the input channel cannot be told from this recording, because {why}."
    return Delay(0.0, float("nan"), float("nan"), f"{remark} No delay was assumed; state one if it is known.")


@dataclass(frozen=True)
class Rests:
    """What the output itself says of where it stands still between contact on one side of the band and on the other.

    The play operator keeps the highest peak of the noise at the end of a pull, and touches the other side too early. From
    the end of a pull to that of the next return the output is rather `min(level, x + exponent)`, and after a return
    `max(level, x - exponent)`, with the level that the output is seen to have.

    Args:
        level: Level of the last rest [1].
        heading: -1 after a pull, +1 after a return, 0 where the play operator is left alone.
    """

    level: Matrix
    heading: Matrix


def play_rows(x: Matrix, start: Vector, exponent: OtherVector, rests: Rests | None = None) -> np.ndarray:
    """Play operator along each row for each exponent at once: an array of exponents, rows and points."""
    output = np.empty((x.shape[1], len(exponent), x.shape[0]))
    band = exponent[:, None]
    lower, upper = x.T[:, None, :] - band, x.T[:, None, :] + band
    if rests is not None:
        level, heading = rests.level.T[:, None, :], rests.heading.T[:, None, :]
        falls, rises = np.minimum(level, upper), np.maximum(level, lower)
        seen = np.where(heading < 0, falls, rises)
        lower, upper = np.where(heading == 0, lower, seen), np.where(heading == 0, upper, seen)
    y = np.broadcast_to(start, output.shape[1:])
    for here, low, high in zip(output, lower, upper, strict=True):
        np.maximum(y, low, out=here)
        y = np.minimum(here, high, out=here)
    return np.moveaxis(output, 0, -1)


def _difference(segments: Segments) -> tuple[float, float]:
    """Middle and half width of the band of x - y [1]."""
    low, high = np.quantile((segments.x - segments.y)[segments.weight > 0.05], (0.05, 0.95))
    return float(low + high) / 2, float(high - low) / 2


def _starts(segments: Segments) -> Vector:
    """Log output force, but for the ratio of the sensors, with which each segment starts."""
    return np.mean(segments.y[:, :3], axis=1) + _difference(segments)[0]


def _shifted(y: Matrix, points: float) -> Matrix:
    """Each row later by a number of points, with straight lines between them; the ends are held."""
    whole = int(np.floor(points))
    share = points - whole
    place = np.arange(y.shape[1]) - whole
    last = y.shape[1] - 1
    return (1 - share) * y[:, np.clip(place, 0, last)] + share * y[:, np.clip(place - 1, 0, last)]


def _inner(segments: Segments) -> Matrix:
    """Weights without the ends of the segments, where shifted points would be missing."""
    edge = min(round(RANGE / segments.step) + 1, segments.x.shape[1] // 4)
    weight = segments.weight.copy()
    weight[:, :edge] = 0
    weight[:, weight.shape[1] - edge :] = 0
    return weight


def _coarse(every: Segments) -> Vector:
    """Best of a grid of exponents and delays for a few of the segments: exponent, ratio, delay."""
    few = slice(None, None, max(1, len(every.x) // _COARSE_ROWS))
    segments = replace(every, x=every.x[few], y=every.y[few], weight=every.weight[few], jitter=every.jitter[few])
    weight = _inner(segments)
    exponents = _difference(segments)[1] * _FRICTIONS
    outputs = play_rows(segments.x, _starts(segments), exponents)
    stride = max(1, round(0.01 / segments.step))
    reach = round(RANGE / segments.step) // stride * stride
    best, found = np.inf, np.zeros(3)
    for shift in range(-reach, reach + 1, stride):
        rests = segments.y - outputs[:, :, np.clip(np.arange(weight.shape[1]) - shift, 0, weight.shape[1] - 1)]
        ratios = np.tensordot(rests, weight, axes=2) / weight.sum()
        losses = np.tensordot(rests**2, weight, axes=2) - weight.sum() * ratios**2
        least = int(np.argmin(losses))
        if losses[least] < best:
            best, found = losses[least], np.array([exponents[least], ratios[least], shift * segments.step])
    return found


def _touched(segments: Segments, point: OtherVector) -> Segments:
    """Weight only where the model knows the output: since it first touched the band in a segment."""
    output = play_rows(segments.x, _starts(segments), np.array([point[0]]))[0]
    _, side = _sides(segments, output, float(point[0]))
    known = _shifted((side != 0).astype(float), float(point[2]) / segments.step) == 1
    return replace(segments, weight=np.where(known, segments.weight, 0.0))


def _sides(segments: Segments, output: Matrix, exponent: float) -> tuple[np.ndarray, np.ndarray]:
    """Whether the model stands still at each point, and the side of the band that it last touched, 0 for none yet."""
    gap = segments.x - output
    touch = np.where(np.abs(gap) >= exponent * (1 - 1e-9), np.sign(gap), 0.0)
    last = np.maximum.accumulate(np.where(touch != 0, np.arange(touch.shape[1]), -1), axis=1)
    side = np.where(last >= 0, np.take_along_axis(touch, np.maximum(last, 0), axis=1), 0.0)
    return touch == 0, side


def _rests(segments: Segments, point: OtherVector) -> Rests:
    exponent, ratio, delay = (float(value) for value in point)
    output = play_rows(segments.x, _starts(segments), np.array([exponent]))[0]
    stands, side = _sides(segments, output, exponent)
    seen = _shifted(segments.y, -delay / segments.step) - ratio
    away = exponent - side * (segments.x - output) > _AWAY * segments.jitter
    level, heading = np.zeros(side.shape), np.zeros(side.shape)
    margin = round(_MARGIN / segments.step)
    for row in range(len(side)):
        ends = np.append(np.flatnonzero(np.diff(side[row])) + 1, side.shape[1])
        last = None
        for begin, end in zip(np.append(0, ends[:-1]), ends, strict=True):
            touched = np.flatnonzero(~stands[row, begin:end])
            since = begin + (touched[-1] if len(touched) else 0)
            level[row, begin:since] = -side[row, begin] * np.inf if last is None and side[row, begin] else last or 0.0
            heading[row, begin:since] = np.where(away[row, begin:since], 0, side[row, begin])
            last = None
            if len(touched) and since + 2 * margin + 3 <= end:
                last = float(np.mean(seen[row, since + margin : end - margin]))
                sign = side[row, begin]
                below = sign * (last - segments.x[row, begin:since]) + exponent > _NEAR * segments.jitter[row, begin:since]
                since = begin + (np.flatnonzero(below)[-1] + 1 if below.any() else 0)
                level[row, since:end] = last
                heading[row, since:end] = -side[row, begin]
    return Rests(level, heading)


def _refined(segments: Segments, rests: Rests | None, start: Vector) -> tuple[Vector, Matrix]:
    """Gauss-Newton from a good start, each step taken only if it helps; the last point and its covariance."""
    weight = np.sqrt(_inner(segments))
    point, damping = start, 1.0
    rest, slopes = _linearized(segments, rests, weight, point)
    for _ in range(_MOST_STEPS):
        step = damping * np.linalg.lstsq(slopes, rest, rcond=None)[0]
        tried = np.array(
            [max(point[0] + step[0], 1e-6), point[1] + step[1], np.clip(point[2] + step[2], -RANGE, RANGE)]
        )
        new_rest, new_slopes = _linearized(segments, rests, weight, tried)
        if new_rest @ new_rest > rest @ rest:
            damping /= 4
            continue
        point, rest, slopes = tried, new_rest, new_slopes
        if abs(step[2]) < 5e-5:
            break
    freedom = max(int(np.count_nonzero(weight)) - 5, 1)
    variance = float(rest @ rest) / freedom * correlation_time(rest)
    return point, variance * np.linalg.pinv(slopes.T @ slopes)


def _linearized(
    segments: Segments, rests: Rests | None, weight: Matrix, point: OtherVector
) -> tuple[np.ndarray, np.ndarray]:
    """Weighted residuals at exponent, ratio and delay, and how the model changes with each.

    Noise lifts the level at which the model stands after a pull, and lowers it after a return; both levels are free.
    """
    exponent, ratio, delay = (float(value) for value in point)
    change, wide, points = 0.01 * exponent, 4.0, delay / segments.step
    exponents = np.array([exponent, exponent + change, exponent - change])
    outputs = play_rows(segments.x, _starts(segments), exponents, rests)
    model, more, less = (_shifted(output, points) for output in outputs)
    later, earlier = (_shifted(outputs[0], points + shift) for shift in (wide, -wide))
    slopes = [(more - less) / (2 * change), np.ones_like(model), (later - earlier) / (2 * wide * segments.step)]
    stands, side = _sides(segments, outputs[0], exponent)
    if rests is not None:
        rested = (rests.heading != 0) & (outputs[0] == rests.level)
        stands, side = stands | rested, np.where(rested, -rests.heading, side)
    levels = [_shifted((stands & (side == s)).astype(float), points) for s in (1, -1)]
    used = weight > 0
    columns = np.stack([(c * weight)[used] for c in (segments.y - model - ratio, *slopes, *levels)], axis=1)
    free, _ = np.linalg.qr(columns[:, 4:][:, np.any(columns[:, 4:] != 0, axis=0)])
    left = columns[:, :4] - free @ (free.T @ columns[:, :4])
    return left[:, 0], left[:, 1:]
