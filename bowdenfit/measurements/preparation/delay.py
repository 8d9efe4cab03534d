"""How much later one load cell's channel is than the other's, as far as the recording tells.

While the rope slides at a constant rate a delay looks like friction: log F_in - log F_out = Lambda + rate * delay. What
tells them apart are kinks: starts, stops, reversals and uneven rates.
"""

from dataclasses import dataclass

import numpy as np

from bowdenfit.measurements.preparation.noise import correlation_time, noise_of
from bowdenfit.measurements.preparation.shapes import OtherVector, Places
from bowdenfit.types import Flags, Labels, Matrix, Vector

RANGE = 0.25
_STEP = 0.005
_SEGMENT = 8.0
_MOST_POINTS = 5_000
_FRICTIONS = np.linspace(0.3, 1.2, 10)
_COARSE_ROWS = 3
_KERNEL = np.array([1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0]) / 64


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


@dataclass(frozen=True)
class Segments:
    """Stretches of a recording on a coarse clock, one a row.

    Args:
        step: Time between points [s].
        x: log input force [1].
        y: log output force [1].
        weight: Inverse relative variance of each point, 0 where it must not be used.
    """

    step: float
    x: Matrix
    y: Matrix
    weight: Matrix


def estimate_delay(time: Vector, input_force: Vector, output_force: Vector, good: Flags, shortest: float) -> Delay:
    """Least squares of the play operator over friction exponent, ratio of the sensors, and delay.

    Args:
        time: Common clock [s].
        input_force: Input force [N].
        output_force: Output force, not yet shifted [N].
        good: Samples that may be used.
        shortest: Length of a block [s]; a standard error of more than two of them is of no use.

    The standard error is that of the curvature, with the autocorrelation of the residuals, and half a step of the coarse
    clock for what the noise that the play operator latches onto shifts.

    Returns:
        The delay with its standard error, or 0 with a remark where the recording does not tell.
    """
    segments = segments_of(time, input_force, output_force, good)
    if segments is None:
        return _untold("it has too few good readings above zero force")
    if not _reverses(segments):
        return _untold("the force never turns around")
    start = _coarse(segments)
    point, covariance = _refined(segments, start)
    sd = float(np.hypot(np.sqrt(covariance[2, 2]), segments.step / 2))
    if not np.isfinite(sd) or sd > min(RANGE / 2, 2 * max(shortest, segments.step)):
        return _untold(f"its standard error would be {sd:.2g} s")
    if abs(point[2]) > RANGE - segments.step:
        return _untold(f"the best fit lies at the end of the range of {RANGE} s that was searched")
    return Delay(float(point[2]), sd, float(point[0]))


def _untold(why: str) -> Delay:
    remark = f"How much later the output channel is than the input channel cannot be told from this recording, because {why}."
    return Delay(0.0, float("nan"), float("nan"), f"{remark} No delay was assumed; state one if it is known.")


def segments_of(time: Vector, input_force: Vector, output_force: Vector, good: Flags) -> Segments | None:
    """Average onto a coarse clock and cut into stretches of equal length, the liveliest of which are kept."""
    span = float(time[-1] - time[0])
    rate = (len(time) - 1) / span
    step = max(round(_STEP * rate), 1) / rate
    points = int(span / step)
    usable = good & (input_force > 0) & (output_force > 0)
    if points < 20 or usable.sum() < 20:
        return None
    place = np.minimum(((time - time[0]) / step).astype(int), points - 1)
    count = np.bincount(place[usable], minlength=points)
    sums = [np.bincount(place[usable], f[usable], minlength=points) for f in (input_force, output_force)]
    x, y = (np.log(_filled(total, count)) for total in sums)
    x, y, weight = _smooth(x), _smooth(y), _weight(x, y, count)
    length = min(max(round(_SEGMENT / step), 20), points)
    rows = points // length
    cut = slice(0, rows * length)
    x, y, weight = (v[cut].reshape(rows, length) for v in (x, y, weight))
    chosen = _liveliest(x, max(1, _MOST_POINTS // length))
    return Segments(step, x[chosen], y[chosen], weight[chosen])


def _filled(total: Vector, count: Labels) -> Vector:
    where = np.flatnonzero(count)
    return np.interp(np.arange(len(count)), where, total[where] / count[where])


def _smooth(values: Vector) -> Vector:
    return np.convolve(np.pad(values, len(_KERNEL) // 2, mode="edge"), _KERNEL, mode="valid")


def _weight(x: Vector, y: Vector, count: Labels) -> Vector:
    noise = [max(noise_of(np.exp(v)), 1e-4 * float(np.exp(v).max())) for v in (x, y)]
    weight = 1 / ((noise[0] / np.exp(x)) ** 2 + (noise[1] / np.exp(y)) ** 2 + 1e-3**2)
    return np.where(count > 0, weight / weight.max(), 0.0)


def _liveliest(x: Matrix, most: int) -> Places:
    """Rows in which the rate changes most, in order."""
    lag = max(1, x.shape[1] // 50)
    bends = np.abs(x[:, 2 * lag :] - 2 * x[:, lag:-lag] + x[:, : -2 * lag]).sum(axis=1)
    return np.sort(np.argsort(-bends, kind="stable")[:most])


def _reverses(segments: Segments) -> bool:
    """Whether the input turns around by more than a fifth of its range within a segment."""
    fifth = 0.2 * float(np.ptp(segments.x))
    fall = np.max(np.maximum.accumulate(segments.x, axis=1) - segments.x)
    rise = np.max(segments.x - np.minimum.accumulate(segments.x, axis=1))
    return bool(fall > fifth and rise > fifth)


def play_rows(x: Matrix, start: Vector, exponent: OtherVector) -> np.ndarray:
    """Play operator along each row for each exponent at once: an array of exponents, rows and points."""
    output = np.empty((x.shape[1], len(exponent), x.shape[0]))
    band = exponent[:, None]
    lower, upper = x.T[:, None, :] - band, x.T[:, None, :] + band
    y = np.broadcast_to(start, output.shape[1:])
    for t in range(x.shape[1]):
        y = np.minimum(np.maximum(y, lower[t]), upper[t])
        output[t] = y
    return np.moveaxis(output, 0, -1)


def _difference(segments: Segments) -> tuple[float, float]:
    """Middle and half width of the band of x - y [1]."""
    low, high = np.quantile((segments.x - segments.y)[segments.weight > 0.05], (0.05, 0.95))
    return float(low + high) / 2, float(high - low) / 2


def _model(segments: Segments, exponent: Vector, delay: Vector) -> np.ndarray:
    """Log output force for pairs of exponent and delay, but for the ratio of the sensors."""
    center, _ = _difference(segments)
    outputs = play_rows(segments.x, np.mean(segments.y[:, :3], axis=1) + center, exponent)
    return np.stack([_shifted(y, d / segments.step) for y, d in zip(outputs, delay, strict=True)])


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
    segments = Segments(every.step, every.x[few], every.y[few], every.weight[few])
    weight = _inner(segments)
    _, half = _difference(segments)
    exponents = half * _FRICTIONS
    center, _ = _difference(segments)
    outputs = play_rows(segments.x, np.mean(segments.y[:, :3], axis=1) + center, exponents)
    stride = max(1, round(0.01 / segments.step))
    reach = round(RANGE / segments.step) // stride * stride
    best, found = np.inf, np.zeros(3)
    for exponent, output in zip(exponents, outputs, strict=True):
        for shift in range(-reach, reach + 1, stride):
            rest = segments.y - _shifted(output, float(shift))
            ratio = float(np.vdot(weight, rest) / weight.sum())
            loss = float(np.vdot(weight, (rest - ratio) ** 2))
            if loss < best:
                best, found = loss, np.array([exponent, ratio, shift * segments.step])
    return found


def _refined(segments: Segments, start: Vector) -> tuple[Vector, Matrix]:
    """Gauss-Newton from a good start, each step taken only if it helps; the last point and its covariance."""
    weight = np.sqrt(_inner(segments))
    point, damping = start, 1.0
    rest, slopes = _linearized(segments, weight, point)
    for _ in range(8):
        step = damping * np.linalg.lstsq(slopes, rest, rcond=None)[0]
        tried = np.array(
            [max(point[0] + step[0], 1e-6), point[1] + step[1], np.clip(point[2] + step[2], -RANGE, RANGE)]
        )
        new_rest, new_slopes = _linearized(segments, weight, tried)
        if new_rest @ new_rest > rest @ rest:
            damping /= 4
            continue
        point, rest, slopes = tried, new_rest, new_slopes
        if abs(step[2]) < 1e-5:
            break
    freedom = max(int(np.count_nonzero(weight)) - 3, 1)
    variance = float(rest @ rest) / freedom * correlation_time(rest)
    return point, variance * np.linalg.pinv(slopes.T @ slopes)


def _linearized(segments: Segments, weight: Matrix, point: OtherVector) -> tuple[np.ndarray, np.ndarray]:
    """Weighted residuals at exponent, ratio and delay, and how the model changes with each."""
    exponent, ratio, delay = (float(value) for value in point)
    change, wide = 0.01 * exponent, 4 * segments.step
    model, more, less, later, earlier = _model(
        segments,
        np.array([exponent, exponent + change, exponent - change, exponent, exponent]),
        np.array([delay, delay, delay, delay + wide, delay - wide]),
    )
    used = weight > 0
    slopes = [(more - less) / (2 * change), np.ones_like(model), (later - earlier) / (2 * wide)]
    rest = (segments.y - model - ratio) * weight
    return rest[used], np.stack([(s * weight)[used] for s in slopes], axis=1)
