"""What a recording of a single rope says of its phases: the capstan's play operator, with drag, that follows it best.

A recording without a reversal has no loop; other signs say where its rope slides (`sliding_one_way`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np

from bowdenfit.description import Phase
from bowdenfit.errors import DatasetError
from bowdenfit.recordings.preparation.hysteresis import (
    Deviations,
    Hysteresis,
    clear_of_turns,
    noise_about_curves,
    play,
    robust_minimum,
    smooth_input,
    white_noise,
)
from bowdenfit.recordings.recording import PULL, RETURN, SWITCH, Blocks, describe_exchange
from bowdenfit.types import Flags, Labels, Vector
from bowdenfit.words import percent

_FIT_BLOCKS = 1000  # more than these say no more about the loop
_GAIN_SD = 0.02  # how far two load cells may disagree before the loop is believed to be off center
# Judged: log ratio up to which a loop is centered. One that is not may be that of a rope which all but returns: a loop that is
# narrower by half of what it lacks, and as far off center, touches the same two forces.
_CENTERED = 0.005
_LEAST_EXPONENT = 1e-3  # judged: least friction exponent that a fit starts from
_LIMITS = np.array([[1e-9, -np.inf, 0.0], [np.inf] * 3])  # of exponent, center and drag
_CLEAR_OF_NOISE = 5.0  # a force below this many standard deviations of its noise may be that of a slack rope
_CLEARLY = 0.5  # a fit the other way round must leave less than this fraction of the deviations to be believed
_COST_OF_NOISE = 1.5  # cost up to which a loop follows its recording as well as noise lets it
_ONE_PHASE = 4.0  # spread of the log ratio, in units of its noise, below which there is only one phase
_LARGEST_GAIN_ERROR = 0.1  # log ratio that a bad calibration of load cells may add: ten times what their data sheets state
_WINDOW, _SHARE = 5, 20  # least blocks on both sides over which a force must rise, and one part in so many of the recording
_SURELY_RISES = 4.0  # standard errors by which it must
_STICKS = 0.2  # judged: share of the friction exponent by which the input must fall after a pull
_STILL = 0.05  # fraction of the highest speed below which the motor is taken to stand
OPPOSED = -0.5  # judged: correlation below which the forces go against each other
_FOLLOWS = 0.5  # correlation, and share of the output's variance that friction explains, below both of which it does not
_STEADY_WEIGHT = 0.03  # judged: relative scatter of the output up to which it is a constant load
_CHANGES = 3.0  # spread of the input, in units of its noise, from which the output could follow it


def fit_loop(force_in: Vector, force_out: Vector) -> Hysteresis:
    """Return the play operator that follows the output force best, with friction exponent, center and drag free.

    Args:
        force_in: Input force, all above 0 [N].
        force_out: Output force, all above 0 [N].
    """
    thin = slice(None, None, -(-len(force_in) // _FIT_BLOCKS))
    likely = smooth_input(force_in)
    few_in, few_likely, few_out = force_in[thin], likely[thin], force_out[thin]
    ratio = np.log(few_in / few_out)
    low, high = np.quantile(ratio, (0.05, 0.95))
    width, center = max((high - low) / 2, _LEAST_EXPONENT), (high + low) / 2
    level = float(np.median(few_out))
    noise_in, noise_out = (max(white_noise(force), 1e-6 * level) for force in (few_in, few_out))
    noise = float(np.median(np.hypot(white_noise(force_in) / few_in, white_noise(force_out) / few_out)))  # of neighbors
    around_other_ratio = [width, center, 0.0]
    if high - low < _ONE_PHASE * noise or low > 0 or high < 0:  # one phase: all of the ratio is friction
        width, center = max(abs(float(np.median(ratio))), _LEAST_EXPONENT), 0.0

    def model(p: np.ndarray) -> Deviations:
        return _residuals(few_in, few_likely, few_out, (noise_in, noise_out), level, p)

    fits = []
    never_returns = [max(high, -low, width), 0.0, 0.0025]
    for start in ([width, center, 0.0025], [width * 0.8, 0.0, 0.09], never_returns):
        fits.append(robust_minimum(model, np.array(start), *_LIMITS))
        (_, middle, _), cost = fits[-1]
        if cost < _COST_OF_NOISE * len(few_in) and abs(middle) < _CENTERED:
            break
    best, cost = min(fits, key=lambda fit: fit[1])
    if cost >= _COST_OF_NOISE * len(few_in):  # a loop whose two branches both lie on one side of a ratio of 1
        off_center = robust_minimum(model, np.array(around_other_ratio), *_LIMITS)
        best, cost = off_center if off_center[1] < _CLEARLY * cost else (best, cost)
    exponent, middle, drag = float(best[0]), float(best[1]), level * float(best[2])
    deviation, followed, state = _follow(force_in, likely, force_out, exponent, middle, drag)
    state = clear_of_turns(state, likely)
    return Hysteresis(force_in, force_out, exponent, middle, drag, deviation, followed, state, cost / len(few_in))


def _has_loop(loop: Hysteresis) -> bool:
    """Return whether the rope slides both ways, so that there are two branches."""
    return {PULL, RETURN} <= set(loop.state)


def _plain_loop(ratio: Vector, state: Labels) -> tuple[float, float]:
    """Return half the width of the loop and its middle, as log ratios, from the medians of its two branches."""
    pull, back = ratio[state == PULL], ratio[state == RETURN]
    if not len(pull) or not len(back):
        one = pull if len(pull) else -back
        return max(float(np.median(one)) if len(one) else 0.0, _LEAST_EXPONENT), 0.0
    upper, lower = float(np.median(pull)), float(np.median(back))
    return max((upper - lower) / 2, _LEAST_EXPONENT), (upper + lower) / 2


def _follow(
    force_in: Vector, likely: Vector, force_out: Vector, exponent: float, center: float, drag: float
) -> tuple[Vector, Vector, Labels]:
    """Deviation of the output from the operator, the operator's output, and its contact.

    The operator follows the likely input force; where the rope slides, the reading's noise is in its output as it is.
    """
    x, moved, y = (np.log(force + drag) for force in (force_in, likely, force_out))
    followed, state = play(moved, exponent, float(y[0] + center))
    followed += np.where(state != 0, x - moved, 0.0)
    return y + center - followed, followed, state


def _residuals(
    force_in: Vector, likely: Vector, force_out: Vector, noise: tuple[float, float], level: float, p: np.ndarray
) -> Deviations:
    """Return deviations in units of their noise and what is known beforehand of center and drag, with slopes by all parameters.

    Args:
        force_in, likely, force_out: Forces [N].
        noise: Standard deviations of the forces [N].
        level: Force that drag is measured in [N].
        p: Friction exponent, center, and drag over the level.
    """
    drag = level * float(p[2])
    deviation, _, state = _follow(force_in, likely, force_out, float(p[0]), float(p[1]), drag)
    touched = np.maximum.accumulate(np.where(state != 0, np.arange(len(state)), -1))
    known, one_in, one_out = touched >= 0, 1 / (force_in + drag), 1 / (force_out + drag)
    one_followed = np.where(state != 0, one_in, 1 / (likely + drag)[touched])
    scale = np.hypot(noise[0] * one_in, noise[1] * one_out)
    by_drag = one_out - np.where(known, one_followed, one_out[0])
    by_drag += deviation * (noise[0] ** 2 * one_in**3 + noise[1] ** 2 * one_out**3) / scale**2
    slopes = np.stack([np.where(known, state[touched], 0), known, level * by_drag], axis=1) / scale[:, None]
    weak = np.sqrt(len(force_in)) * 0.1
    prior = np.diag([0.0, weak / _GAIN_SD, weak])[1:]
    return np.append(deviation / scale, prior @ p), np.vstack([slopes, prior])


def sliding_one_way(loop: Hysteresis, velocity: Vector) -> Labels:
    """Return the contact of each block, where the recording has no reversal also by other signs that the rope slides.

    Friction lets the output rise while the input does only if the rope slides; and where the motor moves, the rope slides
    whatever the forces do, even if they stay the same.

    Args:
        loop: Hysteresis loop fitted by the play operator.
        velocity: Velocity of the blocks; NaN where it is not known.
    """
    ratio = np.log(loop.force_in / loop.force_out)
    if RETURN in loop.state or np.median(ratio) <= 0 or _sticks_after_pull(loop):
        return loop.state
    finite = np.isfinite(velocity)
    highest = np.max(np.abs(velocity[finite]), initial=0.0)
    signs = set(np.sign(velocity[finite & (np.abs(velocity) > _STILL * highest)]).tolist())
    if len(signs) > 1:
        return loop.state
    moves = finite & (np.abs(velocity) > _STILL * highest) if highest > 0 else np.zeros(len(finite), dtype=bool)
    rises = _rises(loop.force_in) & _rises(loop.force_out)
    return np.where(moves | (rises & ~finite), PULL, loop.state)


def _sticks_after_pull(loop: Hysteresis) -> bool:
    """Return whether the rope sticks while the input falls after a pull, by less than the return takes.

    Then the input reverses, and the operator knows where the rope slides: both forces may rise before its band is crossed.
    """
    pulls = np.flatnonzero(loop.state == PULL)
    if loop.cost >= _COST_OF_NOISE or not len(pulls):
        return False
    likely = np.log(smooth_input(loop.force_in))
    ends = [*pulls.tolist(), len(likely) - 1]
    return max(likely[a] - likely[a : b + 1].min() for a, b in pairwise(ends)) > _STICKS * loop.exponent


def _rises(force: Vector) -> Flags:
    """Return where a force is clearly higher after a block than before it."""
    n, window = len(force), max(_WINDOW, len(force) // _SHARE)
    if n <= 2 * window:
        return np.zeros(n, dtype=bool)
    total = np.append(0.0, np.cumsum(force))
    at = np.arange(n)
    before, after = np.maximum(at - window, 0), np.minimum(at + window, n - 1)
    earlier = (total[at + 1] - total[before]) / (at + 1 - before)
    later = (total[after + 1] - total[at]) / (after + 1 - at)
    error = white_noise(force) * np.sqrt(1 / (at + 1 - before) + 1 / (after + 1 - at))
    return later - earlier > _SURELY_RISES * error


@dataclass(frozen=True)
class RopeStrokes:
    """The steps of `strokes.find_strokes` that a single rope takes in its own way.

    Args:
        gain_sd: Stated standard deviation of the log ratio of both load cells' gains [1].
        fits_offsets: Whether the fit tares the load cells: an offset may put a loop anywhere.
        channels: Names of the channels of input and output force; see `RawRecording`.
    """

    gain_sd: float = 0.0
    fits_offsets: bool = False
    channels: tuple[str, str] = ("", "")

    follow = staticmethod(fit_loop)
    contact = staticmethod(sliding_one_way)
    unusable: ClassVar = (
        "have both forces above their noise and inside the range of the load cells; the usual cause is a sign, a unit or a "
        "tare that is wrong: see bowdenfit check."
    )

    def usable(self, blocks: Blocks) -> Flags:
        """Return where both forces are clear of their noise, so that their logarithms say something; not chosen by noise."""
        forces = (blocks.input_force, blocks.output_force)
        return ~blocks.saturated & np.all(
            [smooth_input(force) > _CLEAR_OF_NOISE * noise_about_curves(force) for force in forces], axis=0
        )

    def refuse(self, loop: Hysteresis, velocity: Vector, file: str, name: str, by_hand: Sequence[Phase]) -> None:
        """Refuse a recording whose channels are swapped or read at another ratio, or that holds nothing but the return."""
        if by_hand:
            return
        follows = loop.cost < _COST_OF_NOISE  # to within its noise, which swapped channels could not
        another_ratio = self._is_about_another_ratio(loop)
        swapped = None if follows and not another_ratio else fit_loop(loop.force_out, loop.force_in)
        is_swapped = swapped is not None and swapped.cost < _CLEARLY * loop.cost and _has_loop(swapped)
        if another_ratio and not is_swapped:
            raise _explain_other_ratio(loop, file, name)
        if swapped is not None and is_swapped and not follows:
            pulled = swapped.state == PULL
            above = float(np.median((loop.force_out - loop.force_in)[pulled])) if pulled.any() else 0.0
            raise DatasetError(
                f"{file}: while the rope of {name!r} is pulled, the output force is {above:.3g} N above the input force, which "
                "friction cannot do, and at the reversals it is the input that stands still while the output moves; the usual "
                f"cause is input and output swapped: {describe_exchange(self.channels)}."
            )
        refuse_dead(loop.force_in, loop.force_out, file, name, loop)
        swap = f"if the two ends are swapped, {describe_exchange(self.channels)}"
        pulling = velocity > 0
        if pulling.any() and np.median((loop.force_out - loop.force_in)[pulling]) > 0:
            raise DatasetError(
                f"{file}: the output force is above the input force while the rope of {name!r} is pulled toward the motor, "
                f"which friction cannot do; {swap}."
            )
        if set(loop.state) - {SWITCH} and np.mean(loop.force_out > loop.force_in) > 0.95:
            raise DatasetError(
                f"{file}: in {name!r} the output force is above the input force nearly throughout, as in a return stroke "
                f"alone; {swap}. If it really is a return without its pull, set its phase by hand in cable.toml, under its "
                '[[recording]]: strokes = [{ start = ..., end = ..., stroke = "return" }].'
            )

    def _is_about_another_ratio(self, loop: Hysteresis) -> bool:
        """Return whether a hysteresis loop lies about another ratio of the forces than 1, which no friction makes.

        Friction takes force on the pull and adds force on the return, so that a ratio of 1 lies between the two branches:
        the middle of the loop is no farther from 1 than half its width, save for errors of the gains.
        """
        error = max(_LARGEST_GAIN_ERROR, 4 * self.gain_sd)
        return not self.fits_offsets and _has_loop(loop) and abs(loop.center) > loop.exponent + error

    def estimate(
        self, loop: Hysteresis, state: Labels, strokes: set[int], correlation: float, name: str
    ) -> tuple[float, float, float, tuple[str, ...]]:
        """Return the exponent and center by the medians of the two branches, drag, and remarks."""
        del correlation
        ratio = np.log(loop.force_in / loop.force_out)
        exponent, center = _plain_loop(ratio, state)
        return exponent, center, loop.lost, _remarks(name, strokes, center)


def _explain_other_ratio(loop: Hysteresis, file: str, name: str) -> DatasetError:
    """Return the refusal of a loop about another ratio than 1: it says the ratio, and how to state it."""
    ratio, below = float(np.exp(-loop.center)), loop.center > 0
    what = "below the input force on the return too" if below else "above the input force on the pull too"
    return DatasetError(
        f"{file}: in {name!r} the output force follows a reversing input in a loop about {ratio:.2g} times the input "
        f"force, and is {what}, which friction cannot do. The usual causes are a lever, a pulley or a drum between rope "
        "and load cell, a unit that is not the one stated, and a load cell of another range. Correct the unit, or state "
        "exactly the force on the rope over the reading of its cell, of which the loop says about "
        f"{1 / ratio:.3g}: [sensors] output_ratio in cable.toml, or --set sensors.output_ratio={1 / ratio:.3g} "
        "(input_ratio for the input's)."
    )


def describe_off_center(name: str, center: float) -> str:
    """Return that a loop is off center by more than cells usually disagree, with causes and remedies; empty if it is not.

    Args:
        name: Name of the recording.
        center: Middle of its loop, as the log ratio of the forces; 0 without both strokes.
    """
    if abs(center) <= 2.5 * _GAIN_SD:
        return ""
    return (
        f"{name}: the hysteresis loop is off center by {percent(center, 1, '+')} of the force; the usual cause is "
        "a load cell with a wrong calibration or tare: give [sensors] input_gain_error_sd and output_gain_error_sd, or an "
        "offset_sd, or tare the recording."
    )


def _remarks(name: str, strokes: set[int], center: float) -> tuple[str, ...]:
    remarks = []
    if not strokes:
        remarks.append(
            f"{name}: no block lies safely inside a sliding phase, so the recording says nothing about friction."
        )
    elif len(strokes) == 1:
        which = "pulling" if PULL in strokes else "returning"
        remarks.append(
            f"{name} is {which} throughout and has no loop: a gain error, or a zero that is wrong, cannot be separated from "
            "friction by it, and where it slides is known by the motor's motion or by both forces changing together."
        )
    if len(strokes) == 2 and (sentence := describe_off_center(name, center)):
        remarks.append(sentence)
    return tuple(remarks)


def _hangs_still(force_in: Vector, force_out: Vector) -> bool:
    """Return whether the output stays at a force between the highest and the lowest input, as a dead weight makes it."""
    weight = float(np.mean(force_out))
    low, high = np.quantile(force_in, (0.05, 0.95))
    return bool(low < weight < high and np.std(force_out) < _STEADY_WEIGHT * weight)


def refuse_dead(force_in: Vector, force_out: Vector, file: str, name: str, loop: Hysteresis | None = None) -> None:
    """Refuse a recording whose output does not follow its input.

    Args:
        force_in, force_out: Forces of the blocks [N].
        file: File name, for errors.
        name: Name of the recording.
        loop: What friction makes of them; None where that cannot be said.

    Raises:
        DatasetError: The input changes, the output hardly with it, and friction does not explain it.
    """
    if len(force_in) < 2 or not np.std(force_in) > _CHANGES * white_noise(force_in):
        return
    alike = float(np.corrcoef(force_in, force_out)[0, 1]) if np.ptp(force_out) > 0 else 0.0
    spread = float(np.var(np.log(loop.force_out + loop.lost))) if loop is not None else 0.0
    explained = 1 - float(np.var(loop.deviation)) / spread if loop is not None and spread > 0 else 0.0
    if max(abs(alike), explained) < _FOLLOWS and _hangs_still(force_in, force_out):
        exponent = float(np.log(np.quantile(force_in, 0.95) / np.quantile(force_in, 0.05))) / 2
        raise DatasetError(
            f"{file}: the output of {name!r} stays at {np.mean(force_out):.4g} N while the input goes from "
            f"{force_in.min():.4g} to {force_in.max():.4g} N, on both sides of it. The usual cause is a dead weight at the "
            f"output (a friction exponent of about {exponent:.2g}), whose force does not show when the motor pulls and when "
            "it returns. State both in cable.toml, under its [[recording]]: strokes = "
            '[{ start = ..., end = ..., stroke = "pull" }].'
        )
    if alike < OPPOSED and explained < _FOLLOWS:
        raise DatasetError(
            f"{file}: the output falls where the input rises in {name!r}: correlation {alike:.2f}. The usual causes are the "
            "two tensions of a pull-pull pair, of which one falls while the other rises, a load cell with inverted sign, and "
            "an output that is late by half a period: map the channels at both ends of one rope, state the delay under "
            "prepare, or leave the recording out."
        )
    if alike < _FOLLOWS and explained < _FOLLOWS:
        raise DatasetError(
            f"{file}: the output does not follow the input in {name!r}: correlation {alike:.2f}, while the input goes from "
            f"{force_in.min():.4g} to {force_in.max():.4g} N and the output from {force_out.min():.4g} to "
            f"{force_out.max():.4g} N. The usual causes are a dead load cell, another channel than meant, and a rope that "
            "never slid; map the right channel, or leave the recording out."
        )
