"""Phases of a recording, found by the play operator instead of by hand: pulling, switching, returning."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bowdenfit.description import Phase
from bowdenfit.errors import DatasetError
from bowdenfit.recordings.preparation.play import play
from bowdenfit.recordings.recording import PULL, RETURN, SWITCH, Blocks, Strokes
from bowdenfit.types import Flags, Labels, Vector

_FIT_BLOCKS = 1000  # more than these say no more about the loop
_GAIN_SD = 0.02  # how far two load cells may disagree before the loop is believed to be off center
_LEAST_EXPONENT = 1e-3
_FEWEST = 10  # blocks
_CLEAR_OF_NOISE = 5.0  # a force below this many standard deviations of its noise may be that of a slack rope
_STILL = 0.05  # fraction of the typical speed below which the rope is taken to stand still
_STEADY = 0.2  # relative change of speed from one block to the next up to which a block is of one speed
_CLEARLY = 0.5  # a fit the other way round must leave less than this fraction of the deviations to be believed
_WELL = 1.5  # cost up to which a loop follows its recording as well as noise lets it
_ONE_PHASE = 4.0  # spread of the log ratio, in units of its noise, below which there is only one phase

_SIGNS: dict[str, int] = {"pull": PULL, "return": RETURN, "hold": SWITCH, "ignore": SWITCH}


@dataclass(frozen=True)
class Loop:
    """A hysteresis loop: the play operator that follows a recording best.

    Args:
        exponent: Friction exponent [1].
        center: Log ratio of input to output force in the middle of the loop [1].
        drag: Drag that makes its width the same at all loads [N].
        deviation: Of log(F_out + drag) from the operator, block by block [1].
        state: Contact of each block.
        cost: Robust sum of squares of the deviations, in units of their noise, over twice their number.
    """

    exponent: float
    center: float
    drag: float
    deviation: Vector
    state: Labels
    cost: float


def find_strokes(blocks: Blocks, file: str, name: str, by_hand: Sequence[Phase] = ()) -> Strokes:
    """The phases of a recording, from the contact state of the play operator and, where recorded, the velocity.

    Args:
        blocks: The prepared recording.
        file: File name, for errors.
        name: Name of the recording, for errors and remarks.
        by_hand: Phases set by the user; they replace what is found where they apply.

    Raises:
        DatasetError: It is too short, or a phase lies outside it; hardly anything is under tension; input and
            output are swapped; only the return is there.
    """
    check_length(blocks, file, name, by_hand)
    usable = ~blocks.saturated & _under_tension(blocks.input_force) & _under_tension(blocks.output_force)
    if usable.sum() < _FEWEST:
        raise DatasetError(
            f"{file}: only {int(usable.sum())} blocks of the recording {name!r} have both forces above their noise and inside "
            "the range of the load cells; the usual cause is a sign, a unit or a tare that is wrong: see bowdenfit check."
        )
    force_in, force_out = blocks.input_force[usable], blocks.output_force[usable]
    loop = fit_loop(force_in, force_out)
    velocity = toward_motor(blocks.velocity[usable], loop.state)
    if not by_hand:
        _check_swapped(force_in, force_out, loop, velocity, file, name)
    state = np.zeros(len(usable), dtype=int)
    state[usable] = loop.state
    moving = np.ones(len(usable), dtype=bool)
    moving[usable] = moving_steadily(velocity, loop.state)
    used = inside_sliding(state) & usable & moving
    if by_hand:
        state, used = overridden(blocks.time, state, used & ~covered(blocks.time, by_hand), usable, by_hand)
    remarks = _remarks(name, state, used, loop)
    exponent, center = _plain_loop(np.log(force_in / force_out), state[usable])
    correlation = correlation_time(loop.deviation[used[usable]]) if used.any() else 1.0
    noise = float(1.4826 * np.median(np.abs(loop.deviation))) or 1e-12
    return Strokes(state, used, exponent, center, loop.drag, noise, correlation, bool(by_hand), remarks)


def fit_loop(force_in: Vector, force_out: Vector) -> Loop:
    """The play operator that follows the output force best, with friction exponent, center and drag free.

    Args:
        force_in: Input force, all above 0 [N].
        force_out: Output force, all above 0 [N].
    """
    from scipy.optimize import least_squares

    thin = slice(None, None, -(-len(force_in) // _FIT_BLOCKS))
    few_in, few_out = force_in[thin], force_out[thin]
    ratio = np.log(few_in / few_out)
    low, high = np.quantile(ratio, (0.05, 0.95))
    width, center = max((high - low) / 2, _LEAST_EXPONENT), (high + low) / 2
    level = float(np.median(few_out))
    noise_in, noise_out = (max(white_noise(force), 1e-6 * level) for force in (few_in, few_out))
    noise = float(np.median(np.hypot(noise_in / few_in, noise_out / few_out)))
    if high - low < _ONE_PHASE * noise or low > 0 or high < 0:  # one phase: all of the ratio is friction
        width, center = max(abs(float(np.median(ratio))), _LEAST_EXPONENT), 0.0

    def deviations(p: np.ndarray) -> Vector:
        exponent, middle, drag = float(np.exp(p[0])), float(p[1]), level * float(p[2]) ** 2
        deviation = _follow(few_in, few_out, exponent, middle, drag)[0]
        return deviation / np.hypot(noise_in / (few_in + drag), noise_out / (few_out + drag))

    def residuals(p: np.ndarray) -> np.ndarray:
        weak = np.sqrt(len(few_in)) * 0.1
        return np.append(deviations(p), [weak * p[1] / _GAIN_SD, weak * p[2] ** 2])

    fits = []
    for start in ([np.log(width), center, 0.05], [np.log(width * 0.8), 0.0, 0.3]):
        fits.append(least_squares(residuals, start, loss="soft_l1", x_scale=[0.1, 0.02, 0.1], max_nfev=40))
        if fits[-1].cost < _WELL * len(few_in):
            break
    best = min(fits, key=lambda fit: float(fit.cost))
    exponent, middle, drag = float(np.exp(best.x[0])), float(best.x[1]), level * float(best.x[2]) ** 2
    deviation, state = _follow(force_in, force_out, exponent, middle, drag)
    return Loop(exponent, middle, drag, deviation, state, float(best.cost) / len(few_in))


def _plain_loop(ratio: Vector, state: Labels) -> tuple[float, float]:
    """Half the width of the loop and its middle, as log ratios, from the medians of its two branches."""
    pull, back = ratio[state == PULL], ratio[state == RETURN]
    if not len(pull) or not len(back):
        one = pull if len(pull) else -back
        return max(float(np.median(one)) if len(one) else 0.0, _LEAST_EXPONENT), 0.0
    upper, lower = float(np.median(pull)), float(np.median(back))
    return max((upper - lower) / 2, _LEAST_EXPONENT), (upper + lower) / 2


def _follow(force_in: Vector, force_out: Vector, exponent: float, center: float, drag: float) -> tuple[Vector, Labels]:
    """Deviation of the output from the operator, and its contact."""
    x, y = np.log(force_in + drag), np.log(force_out + drag)
    followed, state = play(x, exponent, float(y[0] + center))
    return y + center - followed, state


def _under_tension(force: Vector) -> Flags:
    """Where a force stands clear of its noise, so that its logarithm says something."""
    return force > _CLEAR_OF_NOISE * white_noise(force)


def white_noise(series: Vector) -> float:
    """Standard deviation of the white part of a smooth series, from its second differences."""
    second = np.diff(series, 2)
    return float(1.4826 * np.median(np.abs(second)) / np.sqrt(6)) if len(second) else 0.0


def toward_motor(velocity: Vector, state: Labels) -> Vector:
    """Velocity with pulling as positive, whatever sign the recording gives it."""
    pulling = velocity[(state == PULL) & np.isfinite(velocity)]
    return -velocity if len(pulling) and np.median(pulling) < 0 else velocity


def moving_steadily(velocity: Vector, state: Labels) -> Flags:
    """Where the rope moves the way its contact says, and steadily; everywhere without a velocity.

    While the motor speeds up or slows down, a block is of several speeds, and at the slow end of a stroke the rope may stand
    already.
    """
    known = np.isfinite(velocity)
    if not known.any():
        return np.ones(len(velocity), dtype=bool)
    speeds = np.abs(velocity[known])
    typical = float(np.median(speeds[speeds > speeds.max() * _STILL])) if speeds.max() > 0 else np.inf
    steady = np.abs(np.gradient(velocity)) < _STEADY * np.abs(velocity) if len(velocity) > 1 else known
    return ~known | ((velocity * state > _STILL * typical) & steady)


def inside_sliding(state: Labels) -> Flags:
    """Blocks whose neighbors on both sides are in the same contact: where one phase meets the next, a block is both."""
    same = np.diff(state) == 0
    return (state != SWITCH) & np.append(True, same) & np.append(same, True)


def covered(time: Vector, by_hand: Sequence[Phase]) -> Flags:
    """Blocks whose phase the user has set."""
    return np.any([(time >= span.start) & (time <= span.end) for span in by_hand], axis=0)


def overridden(
    time: Vector, state: Labels, used: Flags, usable: Flags, by_hand: Sequence[Phase]
) -> tuple[Labels, Flags]:
    """Phases as the user has set them, where they were set; what was found, elsewhere."""
    state, used = state.copy(), used.copy()
    for span in by_hand:
        inside = (time >= span.start) & (time <= span.end)
        state[inside] = _SIGNS[span.stroke]
        used[inside] = usable[inside] & (_SIGNS[span.stroke] != SWITCH)
    return state, used


def check_length(blocks: Blocks, file: str, name: str, by_hand: Sequence[Phase]) -> None:
    """Refuse a recording of a few blocks, and phases that lie outside it."""
    if len(blocks.time) < _FEWEST:
        raise DatasetError(
            f"{file}: the recording {name!r} has too few blocks to tell its phases ({len(blocks.time)}, at least {_FEWEST} "
            "needed); the usual cause is a block that is too long or a recording that was cut off: state a shorter block "
            "under prepare in cable.toml, or leave the recording out."
        )
    for span in by_hand:
        if not covered(blocks.time, [span]).any():
            raise DatasetError(
                f"{file}: the phase {span.stroke!r} of {name!r} from {span.start:g} to {span.end:g} s holds nothing of the "
                f"recording, which goes from {blocks.time[0]:.4g} to {blocks.time[-1]:.4g} s; correct its start and end in "
                "cable.toml, in seconds of the recording's clock."
            )


def _check_swapped(force_in: Vector, force_out: Vector, loop: Loop, velocity: Vector, file: str, name: str) -> None:
    """Refuse a recording whose channels are the wrong way round, or that holds nothing but the return."""
    swap = (
        "if they are swapped, map them the other way round, such as --channel input_force=OUTPUT_CHANNEL --channel "
        "output_force=INPUT_CHANNEL"
    )
    pulling = velocity > 0
    if pulling.any() and np.median((force_out - force_in)[pulling]) > 0:
        raise DatasetError(
            f"{file}: the output force is above the input force while the rope of {name!r} is pulled toward the motor, "
            f"which friction cannot do; {swap}."
        )
    if set(loop.state) - {SWITCH} and np.mean(force_out > force_in) > 0.95:
        raise DatasetError(
            f"{file}: in {name!r} the output force is above the input force nearly throughout, as in a return stroke alone; "
            f"{swap}. If it really is a return without its pull, set its phase by hand in cable.toml, under its [[recording]]: "
            'strokes = [{ start = ..., end = ..., stroke = "return" }].'
        )
    if loop.cost < _WELL:  # it follows to within its noise, which a swapped one could not
        return
    other = fit_loop(force_out, force_in)
    if other.cost < _CLEARLY * loop.cost and {PULL, RETURN} <= set(other.state):
        raise DatasetError(
            f"{file}: at the reversals of {name!r} the input force stands still while the output force moves, which is the "
            f"wrong way round; {swap}."
        )


def _remarks(name: str, state: Labels, used: Flags, loop: Loop) -> tuple[str, ...]:
    remarks = []
    found = set(state[used])
    if not used.any():
        remarks.append(
            f"{name}: no block lies safely inside a sliding phase, so the recording says nothing of friction."
        )
    elif len(found) == 1:
        which = "pulling" if PULL in found else "returning"
        remarks.append(
            f"{name} is {which} throughout: a gain error of the load cells cannot be told from friction by it."
        )
    if abs(loop.center) > 2.5 * _GAIN_SD and len(found) == 2:
        remarks.append(
            f"{name}: the hysteresis loop is off center by {loop.center:+.1%} of the force; the usual cause is a load cell "
            "with a wrong calibration or tare: give [sensors] a gain_error_sd or an offset_sd, or tare the recording."
        )
    return tuple(remarks)


def correlation_time(deviation: Vector) -> float:
    """Integrated autocorrelation time of a series in steps, at least 1: how many of its values say as much as one.

    The sum of autocorrelations in pairs, until a pair is no longer positive.

    References:
        Geyer 1992, "Practical Markov chain Monte Carlo" (Statistical Science 7).
    """
    n = len(deviation)
    centered = deviation - deviation.mean()
    if n < 8 or not np.any(centered):
        return 1.0
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(centered, size)) ** 2
    correlation = np.fft.irfft(spectrum, size)[:n]
    correlation = correlation / correlation[0]
    pairs = correlation[0 : n - 1 : 2] + correlation[1:n:2]
    stop = int(np.argmax(pairs <= 0)) if np.any(pairs <= 0) else len(pairs)
    return float(np.clip(2 * pairs[:stop].sum() - 1, 1.0, n / 4))
