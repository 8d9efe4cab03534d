"""The play operator in NumPy, for recordings: what dry friction makes of a force that goes up and down."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.types import Labels, Vector


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


def clear_of_turns(state: Labels, force: Vector) -> Labels:
    """Contact without the level on which it ends, where that is longer than a block: noise hides when in it the rope stopped.

    Args:
        state: Contact of each block with an operator that follows `force`.
        force: A likely input force, which noise makes level in steps; see `smooth_input`.
    """
    step = (np.diff(state) != 0) | (np.diff(force) != 0)
    level = np.append(0, np.cumsum(step))
    ends = np.flatnonzero(np.diff(state) != 0)
    stopping = np.isin(level, level[ends]) & (np.bincount(level)[level] > 1)
    return np.where(stopping, 0, state)


def last_contact(state: Labels) -> Labels:
    """The last contact up to each block; 0 before the first."""
    at = np.maximum.accumulate(np.where(state != 0, np.arange(len(state)), -1))
    return np.where(at >= 0, state[np.maximum(at, 0)], 0).astype(int)


def white_noise(series: Vector) -> float:
    """Standard deviation of the white part of a smooth series, from its second differences."""
    second = np.diff(series, 2)
    return float(1.4826 * np.median(np.abs(second)) / np.sqrt(6)) if len(second) else 0.0
