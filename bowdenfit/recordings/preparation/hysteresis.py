"""The play operator in NumPy, for recordings: what dry friction makes of a force that goes up and down.

The operator remembers peaks. Led through a reading, it takes each new peak of the noise for motion of the rope: while the
force rises by less than its noise from block to block, friction and drag come out too large (by a fifth, where noise is 6 % of
the load and blocks are single samples), and the scatter too small. So the operator follows the likely force
(`smooth_input`); what noise adds to the reading of a rope that slides is in its output's deviation as it is, neither more nor
less. Loops are fitted by the least robust cost (`robust_minimum`).

A recording that is measured again on the computer needs smoothing too. Were the noise of the first measurement taken for
motion, a simulated rope would jump and turn round with each of its peaks, while the likelihood, for a noise that may have been
drawn a hundred times smaller, has it slide on evenly: as a delay makes it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from bowdenfit.types import Labels, OtherVector, Vector

_MOST_STEPS = 200  # judged: far more than a search takes
_LEAST_CHANGE = 1e-14  # of the cost: rounding
_DAMPING = 1e-3  # to begin with, as Levenberg and Marquardt have it
_MOST_DAMPING = 1e12  # where no step lowers the cost any more

Deviations: TypeAlias = tuple[Float[np.ndarray, " residuals"], Float[np.ndarray, "residuals parameters"]]
"""Residuals [standard deviations], and their slopes: a column for each parameter."""

Model: TypeAlias = Callable[[np.ndarray], Deviations]
"""Deviations at parameters."""

_WIDTH, _DEGREE = 7, 2  # judged: blocks that a polynomial is laid through, and its degree
_TURNS = 2.0  # judged, of the noise: half of how far a force falls back where it really turns
_BEYOND = 3.0  # judged, of the noise: what smoothing may change; more is a corner, or a spike, and stays
_NOISY = 0.5  # judged, of the typical change from block to block: noise that hardly ever passes for motion


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
        deviation: Deviation of log(F_out + drag) from `followed`, block by block [1]; of a pull-pull loop of F_out [N].
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
    """Return the output of the play operator, y_t = clip(y_{t-1}, x_t - exponent, x_t + exponent), and where in the band it is.

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
    """Return the play operator between two limits that move. A plain loop: meant for up to some 10^4 values.

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
    """Return the contact without the level on which it ends, if that is longer than a block: noise hides when the rope stopped.

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
    """Return the last contact up to each block; 0 before the first."""
    at = np.maximum.accumulate(np.where(state != 0, np.arange(len(state)), -1))
    return np.where(at >= 0, state[np.maximum(at, 0)], 0).astype(int)


def white_noise(series: Vector) -> float:
    """Return the standard deviation of the white part of a smooth series, from its second differences."""
    second = np.diff(series, 2)
    return float(1.4826 * np.median(np.abs(second)) / np.sqrt(6)) if len(second) else 0.0


def robust_cost(residuals: Vector) -> float:
    """Return the sum of sqrt(1 + r^2) - 1: half the square of a small residual, the size of a large one."""
    return float(np.sum(np.sqrt(1 + residuals**2) - 1))


def robust_minimum(model: Model, start: OtherVector, least: OtherVector, most: OtherVector) -> tuple[np.ndarray, float]:
    """Return parameters of the least robust cost near a start, and that cost.

    Newton's steps, damped as Levenberg and Marquardt do until the cost falls; a parameter that wants beyond its limits stays
    there. The curvature is that of the cost with the model as a plane, which the play operator is between kinks.

    Args:
        model: Residuals and slopes.
        start: Where to begin, inside the limits.
        least, most: Limits of each parameter.
    """
    point, damping = start, _DAMPING
    residuals, slopes = model(point)
    cost = robust_cost(residuals)
    for _ in range(_MOST_STEPS):
        root = np.sqrt(1 + residuals**2)
        gradient, curvature = slopes.T @ (residuals / root), (slopes.T / root**3) @ slopes
        free = ((point > least) | (gradient < 0)) & ((point < most) | (gradient > 0))
        own = np.where(free, curvature.diagonal(), 0.0)
        curvature = np.where(free[:, None] & free, curvature, 0.0)
        own = np.maximum(own, 1e-12 * own.max())
        while damping < _MOST_DAMPING and own.any():
            step = np.linalg.solve(curvature + np.diag(damping * own + ~free), np.where(free, -gradient, 0.0))
            tried = np.clip(point + step, least, most)
            residuals, slopes = model(tried)
            lower = robust_cost(residuals)
            if lower < cost:
                break
            damping *= 8
        else:
            break
        change, point, cost, damping = cost - lower, tried, lower, max(damping / 8, 1e-9)
        if change < _LEAST_CHANGE * cost:
            break
    return point, cost


def smooth_input(force: Vector) -> Vector:
    """Return a series like a measured one that is smooth, and rises and falls by turns as that does beyond its noise.

    It is smoothed by polynomials over few blocks (Savitzky and Golay 1964) as far as noise goes, if there is much. Where it
    turns is found by an operator with play as wide as `_TURNS` standard deviations of the noise on either side; from one turn
    to the next it is the isotonic regression. Without noise it is the force itself.

    Args:
        force: Force of the blocks of a recording [N].
    """
    noise = noise_about_curves(force)
    smooth = _smooth(force, noise)
    heading = last_contact(play(smooth, _TURNS * noise)[1])
    heading[heading == 0] = heading[np.argmax(heading != 0)]
    likely, start = np.empty(len(force)), 0
    while start < len(force):
        ahead = heading[start:] == heading[start]
        stop = len(force) if ahead.all() else start + int(np.argmin(ahead))
        if stop < len(force):  # the operator sees a turn when its band is crossed: the force was at its extreme before
            turn = start + int(np.argmax(heading[start] * smooth[start:stop])) + 1
            heading[turn:stop] = heading[stop]
            stop = turn
        up = 1.0 if heading[start] >= 0 else -1.0
        likely[start:stop] = up * _isotonic(up * smooth[start:stop])
        start = stop
    return likely


def noise_about_curves(force: Vector) -> float:
    """Return the standard deviation of the white part of a series; a curve adds less than to second differences alone."""
    fourth = np.diff(force, 4)
    by_fourth = float(1.4826 * np.median(np.abs(fourth)) / np.sqrt(70)) if len(fourth) else np.inf
    return min(white_noise(force), by_fourth)


def _smooth(force: Vector, noise: float) -> Vector:
    """Return the force smoothed over few blocks, and as it was read where that changes it by more than noise does."""
    if len(force) < _WIDTH:
        return force
    powers = np.vander(np.linspace(-1.0, 1.0, _WIDTH), _DEGREE + 1)
    through = powers @ np.linalg.pinv(powers)  # what the polynomial through a window says of each block in it
    half, ahead, behind = _WIDTH // 2, through @ force[:_WIDTH], through @ force[-_WIDTH:]
    smooth = np.concatenate([ahead[:half], np.correlate(force, through[half], "valid"), behind[-half:]])
    if noise < _NOISY * float(np.median(np.abs(np.diff(smooth)))):
        return force
    return np.where(np.abs(smooth - force) < _BEYOND * noise, smooth, force)


def _isotonic(force: Vector) -> Vector:
    """Return the rising series nearest to a force, by pooling neighbours that fall (Barlow et al. 1972).

    SciPy has this and the polynomials too, but loading it takes longer than reading recordings.
    """
    means, counts = np.empty(len(force)), np.empty(len(force), int)
    last = -1
    for value in force:
        mean, count = value, 1
        while last >= 0 and means[last] >= mean:
            mean = (means[last] * counts[last] + mean * count) / (counts[last] + count)
            count += counts[last]
            last -= 1
        last += 1
        means[last], counts[last] = mean, count
    return np.repeat(means[: last + 1], counts[: last + 1])
