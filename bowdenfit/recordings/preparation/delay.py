"""How much later one load cell's channel is than the other's, as far as the recording tells.

While the rope slides at a constant rate a delay looks like friction: log F_in - log F_out = Lambda + rate * delay. What
tells them apart are kinks: starts, stops, reversals and uneven rates.

COMMON_ERROR is what smoothing and noise shift in every recording of a bench alike [s]. On most simulated benches the shift
is less than half of it. It reaches 2 ms for strokes without pauses under a high preload, and several milliseconds where such
strokes are slow and noise is 1 N: state the delay there.
"""

from dataclasses import dataclass, replace

import numpy as np

from bowdenfit.recordings.preparation.noise import correlation_time
from bowdenfit.recordings.preparation.rests import USED, Rests, band_of, play_rows, rests_of, shift_rows, sides, starts
from bowdenfit.recordings.preparation.segments import Segments, reverses, segments_of
from bowdenfit.recordings.preparation.shapes import OtherVector
from bowdenfit.types import Flags, Labels, Matrix, Vector

RANGE = 0.25
COMMON_ERROR = 0.0015
_FRICTIONS = np.linspace(0.3, 1.2, 10)
_COARSE_ROWS = 3
_ROUNDS = 2
_MOST_STEPS = 3


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
    if segments is None or not len(_usable(segments)):
        return _untold("it has too few good readings above zero force")
    if not reverses(segments):
        return _untold("the force never turns around")
    start = _coarse(segments)
    segments = _touched(segments, start)
    point, covariance = _refined(segments, None, start)
    for _ in range(_ROUNDS):
        point, covariance = _refined(segments, rests_of(segments, point), point)
    sd = float(np.hypot(np.sqrt(covariance[2, 2]), COMMON_ERROR))
    if not np.isfinite(sd) or sd > min(RANGE / 2, 2 * max(shortest, segments.step)):
        return _untold(f"its standard error would be {sd:.2g} s")
    if abs(point[2]) > RANGE - segments.step:
        return _untold(f"the best fit lies at the end of the range of {RANGE} s that was searched")
    return Delay(float(point[2]), sd, float(point[0]))


def _untold(why: str) -> Delay:
    remark = f"How much later the output channel is than the input channel cannot be told from this recording, because {why}."
    return Delay(0.0, float("nan"), float("nan"), f"{remark} No delay was assumed; state one if it is known.")


def _inner(segments: Segments) -> Matrix:
    """Weights without the ends of the segments, where shifted points would be missing."""
    edge = min(round(RANGE / segments.step) + 1, segments.x.shape[1] // 4)
    weight = segments.weight.copy()
    weight[:, :edge] = 0
    weight[:, weight.shape[1] - edge :] = 0
    return weight


def _usable(segments: Segments) -> Labels:
    """Segments with good readings between their ends."""
    return np.flatnonzero((_inner(segments) > USED).any(axis=1))


def _coarse(every: Segments) -> Vector:
    """Best of a grid of exponents and delays for a few of the segments: exponent, ratio, delay."""
    usable = _usable(every)
    few = usable[:: max(1, len(usable) // _COARSE_ROWS)]
    segments = replace(every, x=every.x[few], y=every.y[few], weight=every.weight[few], jitter=every.jitter[few])
    weight = _inner(segments)
    center, half = band_of(segments)
    exponents = half * _FRICTIONS
    outputs = play_rows(segments.x, starts(segments, -center), exponents)
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
    output = play_rows(segments.x, starts(segments, float(point[1])), np.array([point[0]]))[0]
    _, side = sides(segments, output, float(point[0]))
    known = shift_rows((side != 0).astype(float), float(point[2]) / segments.step) == 1
    return replace(segments, weight=np.where(known, segments.weight, 0.0))


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

    The levels at which the model stands after a pull and after a return are free.
    """
    exponent, ratio, delay = (float(value) for value in point)
    change, wide, points = 0.01 * exponent, 4.0, delay / segments.step
    exponents = np.array([exponent, exponent + change, exponent - change])
    outputs = play_rows(segments.x, starts(segments, ratio), exponents, rests)
    model, more, less = (shift_rows(output, points) for output in outputs)
    later, earlier = (shift_rows(outputs[0], points + shift) for shift in (wide, -wide))
    slopes = [(more - less) / (2 * change), np.ones_like(model), (later - earlier) / (2 * wide * segments.step)]
    stands, side = sides(segments, outputs[0], exponent)
    if rests is not None:
        rested = (rests.heading != 0) & (outputs[0] == rests.level)
        stands, side = stands | rested, np.where(rested, -rests.heading, side)
    levels = [shift_rows((stands & (side == s)).astype(float), points) for s in (1, -1)]
    used = weight > 0
    columns = np.stack([(c * weight)[used] for c in (segments.y - model - ratio, *slopes, *levels)], axis=1)
    free, _ = np.linalg.qr(columns[:, 4:][:, np.any(columns[:, 4:] != 0, axis=0)])
    left = columns[:, :4] - free @ (free.T @ columns[:, :4])
    return left[:, 0], left[:, 1:]
