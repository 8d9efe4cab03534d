"""The play operator in NumPy, for recordings: what dry friction makes of a force that goes up and down."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.types import Labels, Vector

_BEYOND_NOISE = 6.0  # of two blocks, one the highest of many: with fewer, blocks would still be chosen by their noise


@dataclass(frozen=True)
class Hysteresis:
    """A hysteresis loop: the play operator whose output follows that of a recording best.

    Args:
        force_in, force_out: What it follows [N].
        exponent: Friction exponent, of a pull-pull loop that of one side [1].
        center: What sensors add, in the middle of the loop: log ratio of input to output force [1]; of a pull-pull loop
            input less output force [N].
        lost: Drag that makes the loop's width the same at all loads [N]; of a pull-pull loop the force lost while both
            sides are taut, 2 P Lambda [N].
        deviation: Of log(F_out + drag) from `followed`, block by block [1]; of a pull-pull loop of F_out [N].
        followed: Output of the operator, in the same units; of a single rope on its limit wherever it slides.
        state: Contact of each block; see `play_between`.
        sliding: The same of a single rope through noise; see `contact_through_noise`.
        cost: Robust sum of squares of the deviations, in units of their noise, over twice their number.
    """

    force_in: Vector
    force_out: Vector
    exponent: float
    center: float
    lost: float
    deviation: Vector
    followed: Vector
    state: Labels
    sliding: Labels
    cost: float


def play(x: Vector, exponent: float, start: float | None = None) -> tuple[Vector, Labels]:
    """Output of the play operator, y_t = clip(y_{t-1}, x_t - exponent, x_t + exponent), and where in the band it is.

    With x = log F_in this is y = log F_out of a cable with capstan friction: the output follows the input at a distance
    while the rope slides, and stands still while the input crosses the friction band after a reversal.

    Args:
        x: Input, in the scale in which friction is a constant distance [1].
        exponent: Friction exponent, half the width of the band, at least 0 [1].
        start: Output before the first value [1]; None for that of a cable without load history, x_0.

    Returns:
        See `play_between`.
    """
    if start is None:
        start = float(x[0]) if len(x) else 0.0
    return play_between(x - exponent, x + exponent, start)


def play_between(lower: Vector, upper: Vector, start: float) -> tuple[Vector, Labels]:
    """The play operator between two limits that move. A plain loop: meant for up to some 10^4 values.

    Returns:
        The output, and its contact: +1 at the lower limit (while pulling or moving forward), -1 at the upper (while returning
        or moving back), 0 between.
    """
    y, output, state = start, [], []
    for low, high in zip(lower.tolist(), upper.tolist(), strict=True):
        contact = 0
        if y <= low:
            y, contact = low, 1
        elif y >= high:
            y, contact = high, -1
        output.append(y)
        state.append(contact)
    return np.array(output), np.array(state, dtype=int)


def contact_through_noise(
    lower: Vector, upper: Vector, output: Vector, state: Labels, noise: Vector
) -> tuple[Vector, Labels]:
    """What `play_between` gives, with contact also where noise alone makes a sliding rope seem to stand.

    With noise on an input that rises, the operator touches its limit at new peaks alone. Blocks taken for sliding by that would
    be chosen by their own noise: they scatter less than all (by a tenth where noise is as large as the change from block to
    block), and their log ratio is too large. So between two contacts on one side the output counts as in contact throughout,
    if nowhere in between the limit is farther from it than noise makes it: `_BEYOND_NOISE` standard deviations.

    Args:
        lower, upper: Limits.
        output: The operator's output.
        state: Its contact.
        noise: Standard deviation of the limits.
    """
    output, state = output.copy(), state.copy()
    touched = np.flatnonzero(state)
    for before, after in zip(touched[:-1].tolist(), touched[1:].tolist(), strict=True):
        side, between = state[before], slice(before + 1, after)
        limit = lower[between] if side > 0 else upper[between]
        if state[after] == side and np.all(side * (output[between] - limit) < _BEYOND_NOISE * noise[between]):
            output[between], state[between] = limit, side
    return output, state


def white_noise(series: Vector) -> float:
    """Standard deviation of the white part of a smooth series, from its second differences."""
    second = np.diff(series, 2)
    return float(1.4826 * np.median(np.abs(second)) / np.sqrt(6)) if len(second) else 0.0
