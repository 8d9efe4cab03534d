"""How much later one load cell's channel is than the other's, as far as the recording tells.

While the rope slides at a constant rate a delay looks like friction: log F_in - log F_out = Lambda + rate * delay. What
tells them apart are kinks: starts, stops, reversals and uneven rates.

A drag looks like a delay, too, where the force changes at a constant rate, so that both are looked for together. The input is
led through the play operator as it may have been without noise (`smooth_input`), on a coarse clock that is coarser for slower
cycles.

COMMON_ERROR is what smoothing and noise shift in every recording of a bench alike [s]. What noise that stays alike and
friction of another kind shift is added to the standard error of each. Over 24 simulated benches (three wave forms, cycles of
0.8 to 30 s, noise of 0.3 to 5 % of the load, filters, drag) errors are 1.3 standard errors; they were 7 without all this.
"""

from dataclasses import dataclass, replace

import numpy as np

from bowdenfit.recordings.preparation.noise import correlation_time
from bowdenfit.recordings.preparation.segments import (
    USED,
    Rests,
    Segments,
    cut_segments,
    estimate_band,
    move_to_drag,
    play_along_rows,
    read_rests,
    reverses,
    shift_rows,
    sides,
    starts,
    with_drag,
)
from bowdenfit.types import ChosenVector, Flags, Labels, Matrix, OtherVector, Vector

RANGE = 0.25  # [s]; judged: filters and buses delay by less
BEYOND = "the best fit lies at the end of the range that was searched"
UNKNOWN = "How much later the output channel is than the input channel cannot be known from this recording"
COMMON_ERROR = 0.0015  # [s]; what is left over the 24 simulated benches (scripts/check_recordings.py simulates others)
_FRICTIONS = np.linspace(0.3, 1.2, 10)  # of half the width of the loop, which delay and noise make wider: the start of a search
_COARSE_ROWS = 3  # judged: stretches that the coarse search looks at
_ROUNDS, _DRAG_ROUNDS = 2, 3  # judged: of delay and rests in turn
_SOME_DRAG = 0.1  # of the typical force; judged: the drag at which a second search starts
_AS_WELL = 1.2  # judged: ratio of sums of squares up to which two drags describe a recording as well
_MOST_RATIO = 10.0  # judged: log ratio of the sensors beyond any gain
_MOVES = 0.05  # of the time; judged: how long the rope must slide each way
_MOST_STEPS = 3  # judged: Gauss-Newton steps from a start close by


@dataclass(frozen=True)
class Delay:
    """A delay of the output channel.

    Args:
        value: How much later it is [s].
        sd: Standard error [s]; NaN where it was not estimated.
        exponent: Friction exponent that goes with it [1]; NaN where it was not estimated.
        remark: A sentence where the recording does not tell; else empty.
        reason: Why it does not, as a clause behind "because".
    """

    value: float
    sd: float
    exponent: float
    remark: str = ""
    reason: str = ""


def estimate_delay(
    time: Vector, input_force: Vector, output_force: Vector, good: Flags, shortest: float, reach: float = RANGE
) -> Delay:
    """Least squares of the play operator over friction exponent, ratio of the sensors, and delay.

    Args:
        time: Common clock [s].
        input_force: Input force [N].
        output_force: Output force, not yet shifted [N].
        good: Samples that may be used.
        shortest: Length of a block [s]; a standard error of more than two of them is of no use.
        reach: Longest delay that is looked for [s].

    The standard error is that of the curvature, with the autocorrelation of the residuals, what noise shifts, how far a
    delay with much drag is from one with little, and COMMON_ERROR for what smoothing shifts in every recording alike.

    Returns:
        The delay with its standard error, or 0 with a remark where the recording does not tell.
    """
    segments = cut_segments(time, input_force, output_force, good, reach)
    if segments is None or not len(_usable(segments)):
        return _undetermined("it has too few good readings above zero force")
    if not reverses(segments):
        return _undetermined("the force never turns around")
    start = _coarse(segments)
    segments = _touched(segments, start)
    point = _refined(segments, None, start)
    for _ in range(_ROUNDS):
        point = _refined(segments, read_rests(segments, point), point)
    point, error = _with_drag_too(segments, point)
    sd = float(np.hypot(error, COMMON_ERROR))
    if not _slides_both_ways(segments, point):
        return _undetermined("the output does not follow the input both ways")
    if not np.isfinite(sd) or sd > min(RANGE / 2, 2 * max(shortest, segments.step)):
        return _undetermined(f"its standard error would be {sd:.2g} s")
    if abs(point[2]) > reach - segments.step:
        return _undetermined(f"{BEYOND}, {reach:.2g} s")
    return Delay(float(point[2]), sd, float(point[0]))


def _undetermined(why: str) -> Delay:
    remark = f"{UNKNOWN}, because {why}."
    return Delay(0.0, float("nan"), float("nan"), f"{remark} No delay was assumed; state one if it is known.", why)


def _with_drag_too(segments: Segments, point: Vector) -> tuple[ChosenVector, float]:
    """Return exponent, ratio, delay and drag, and the standard error of the delay but for what all recordings have in common.

    A drag looks like a delay where the force changes at a constant rate: it is looked for from none and from some of it, and
    where both explain the recording about as well, how far they are apart is an error. Each point is judged with the rests
    that are read at it: with those of another a step that only leads away along the drag seems to be a better one.
    """
    some, weight = _SOME_DRAG * float(np.exp(np.median(segments.y))), np.sqrt(_inner(segments))
    fits = []
    for start in (np.append(point, 0.0), np.array([point[0], point[1], 0.0, some])):
        seen = []
        for _ in range(_DRAG_ROUNDS + 1):
            rests = read_rests(with_drag(segments, float(start[3])), start[:3])
            residuals, slopes = _linearized(segments, rests, weight, start, start[3:])
            seen.append((float(residuals @ residuals), start, residuals, slopes))
            start = _refined(segments, rests, start)
        fits.append(min(seen, key=lambda fit: fit[0]))
    (least, best, residuals, slopes), (more, other, *_) = sorted(fits, key=lambda fit: fit[0])
    apart = (best[2] - other[2]) / 2 if more < _AS_WELL * least else 0.0
    variance = _covariance(residuals, slopes)[2, 2]
    return best, float(np.sqrt(variance + _by_noise(segments, residuals) ** 2 + apart**2))


def _slides_both_ways(segments: Segments, point: ChosenVector) -> bool:
    """Return whether the rope slides, for more than moments, toward the motor and back."""
    seen, exponent = with_drag(segments, float(point[3])), float(point[0])
    output = play_along_rows(seen.x, starts(seen, float(point[1])), point[:1])[0]
    stands, side = sides(seen, output, exponent)
    used = _inner(segments) > USED
    return all(np.count_nonzero(~stands & used & (side == sign)) > _MOVES * np.count_nonzero(used) for sign in (1, -1))


def _by_noise(segments: Segments, residuals: ChosenVector) -> float:
    """Return the time in which the force moves by as much as the model is off, or noise is [s].

    Noise that stays alike, and what the model leaves out, shift the delay by that much; the curvature does not know.
    """
    used = _inner(segments) > USED
    if not used.any():
        return float("inf")
    rate = np.gradient(segments.x, axis=1)[used] / segments.step
    off = np.hypot(1.4826 * np.median(np.abs(residuals)), np.median(segments.jitter[used]))
    return float(off / np.sqrt(np.mean(rate**2)))


def _inner(segments: Segments) -> Matrix:
    """Return weights without the ends of the segments, where shifted points would be missing."""
    edge = min(round(segments.reach / segments.step) + 1, segments.x.shape[1] // 4)
    weight = segments.weight.copy()
    weight[:, :edge] = 0
    weight[:, weight.shape[1] - edge :] = 0
    return weight


def _usable(segments: Segments) -> Labels:
    """Return segments with good readings between their ends."""
    return np.flatnonzero((_inner(segments) > USED).any(axis=1))


def _coarse(every: Segments) -> Vector:
    """Best of a grid of exponents and delays for a few of the segments: exponent, ratio, delay."""
    usable = _usable(every)
    few = usable[:: max(1, len(usable) // _COARSE_ROWS)]
    segments = replace(every, x=every.x[few], y=every.y[few], weight=every.weight[few], jitter=every.jitter[few])
    weight = _inner(segments)
    center, half = estimate_band(segments)
    exponents = half * _FRICTIONS
    outputs = play_along_rows(segments.x, starts(segments, -center), exponents)
    stride = max(1, round(0.01 / segments.step))
    reach = round(segments.reach / segments.step) // stride * stride
    best, best_point = np.inf, np.zeros(3)
    for shift in range(-reach, reach + 1, stride):
        rests = segments.y - outputs[:, :, np.clip(np.arange(weight.shape[1]) - shift, 0, weight.shape[1] - 1)]
        ratios = np.tensordot(rests, weight, axes=2) / weight.sum()
        losses = np.tensordot(rests**2, weight, axes=2) - weight.sum() * ratios**2
        least = int(np.argmin(losses))
        if losses[least] < best:
            best, best_point = losses[least], np.array([exponents[least], ratios[least], shift * segments.step])
    return best_point


def _touched(segments: Segments, point: OtherVector) -> Segments:
    """Return the weight only where the model knows the output: since it first touched the band in a segment."""
    output = play_along_rows(segments.x, starts(segments, float(point[1])), np.array([point[0]]))[0]
    _, side = sides(segments, output, float(point[0]))
    known = shift_rows((side != 0).astype(float), float(point[2]) / segments.step) == 1
    return replace(segments, weight=np.where(known, segments.weight, 0.0))


def _refined(segments: Segments, rests: Rests | None, start: Vector) -> Vector:
    """Return the last point of Gauss-Newton from a good start, each step taken only if it helps."""
    weight = np.sqrt(_inner(segments))
    point, damping, initial_drag = start, 1.0, start[3:]
    residuals, slopes = _linearized(segments, rests, weight, point, initial_drag)
    for _ in range(_MOST_STEPS):
        step = damping * np.linalg.lstsq(slopes, residuals, rcond=None)[0]
        tried = np.array(
            [max(point[0] + step[0], 1e-6), np.clip(point[1] + step[1], -_MOST_RATIO, _MOST_RATIO)]
            + [np.clip(point[2] + step[2], -segments.reach, segments.reach)]
            + [np.clip(point[3] + change, 0.0, np.exp(np.max(segments.y))) for change in step[3:]]
        )
        new_residuals, new_slopes = _linearized(segments, rests, weight, tried, initial_drag)
        if new_residuals @ new_residuals > residuals @ residuals:
            damping /= 4
            continue
        point, residuals, slopes = tried, new_residuals, new_slopes
        if abs(step[2]) < 5e-5:
            break
    return point


def _covariance(residuals: np.ndarray, slopes: np.ndarray) -> Matrix:
    """Return the covariance of the parameters by what `_linearized` returns."""
    freedom = max(len(residuals) - 5, 1)
    variance = float(residuals @ residuals) / freedom * correlation_time(residuals)
    return np.asarray(variance * np.linalg.pinv(slopes.T @ slopes))


def _linearized(
    segments: Segments, rests: Rests | None, weight: Matrix, point: OtherVector, initial_drag: ChosenVector
) -> tuple[np.ndarray, np.ndarray]:
    """Weighted residuals at exponent, ratio, delay and, if that is asked about, drag, and how the model changes with each.

    The levels at which the model stands after a pull and after a return are free.

    Args:
        segments: The recording.
        rests: Rests of the recording with the drag that was begun with.
        weight: Roots of weights.
        point: The parameters.
        initial_drag: The drag that was begun with [N]; empty if it is not asked about.
    """
    exponent, ratio, delay = (float(value) for value in point[:3])
    plain = segments
    if len(initial_drag):
        segments = with_drag(plain, float(point[3]))
        rests = move_to_drag(rests, ratio, float(point[3] - initial_drag[0])) if rests else None
        weight = weight * np.exp(segments.y - plain.y)
    change, wide, points = 0.01 * exponent, 4.0, delay / segments.step
    exponents = np.array([exponent, exponent + change, exponent - change])
    outputs = play_along_rows(segments.x, starts(segments, ratio), exponents, rests)
    model, more, less = shift_rows(outputs, points)
    later, earlier = (shift_rows(outputs[0], points + shift) for shift in (wide, -wide))
    slopes = [(more - less) / (2 * change), np.ones_like(model), (later - earlier) / (2 * wide * segments.step)]
    if len(initial_drag):
        more_drag = 0.01 * float(np.exp(np.median(plain.y)))
        other = with_drag(plain, float(point[3]) + more_drag)
        other_rests = move_to_drag(rests, ratio, more_drag) if rests else None
        moved = play_along_rows(other.x, starts(other, ratio), exponents[:1], other_rests)[0]
        slopes.append((shift_rows(moved, points) - model - other.y + segments.y) / more_drag)
    stands, side = sides(segments, outputs[0], exponent)
    if rests is not None:
        rested = (rests.heading != 0) & (outputs[0] == rests.level)
        stands, side = stands | rested, np.where(rested, -rests.heading, side)
    levels = shift_rows(np.stack([stands & (side == s) for s in (1, -1)]).astype(float), points)
    used = weight > 0
    columns = np.stack([(c * weight)[used] for c in (segments.y - model - ratio, *slopes, *levels)], axis=1)
    known = 1 + len(slopes)
    free, _ = np.linalg.qr(columns[:, known:][:, np.any(columns[:, known:] != 0, axis=0)])
    left = columns[:, :known] - free @ (free.T @ columns[:, :known])
    return left[:, 0], left[:, 1:]
