"""The force that a recording's input may have had: as it was read, with as little of the reading's noise as can be.

The play operator remembers peaks. Led through a reading, it takes each new peak of the noise for motion of the rope: while the
force rises by less than its noise from block to block, friction and drag come out too large (by a fifth, where noise is 6 % of
the load and blocks are single samples), and the scatter too small. So the operator follows the likely force; what noise adds to
the reading of a rope that slides is in its output's deviation as it is, neither more nor less.

A recording that is measured again on the computer needs it too. Were the noise of the first measurement taken for motion, a
simulated rope would jump and turn round with each of its peaks, while the likelihood, for a noise that may have been drawn a
hundred times smaller, has it slide on evenly: as a delay makes it.
"""

import numpy as np

from bowdenfit.recordings.preparation.play import last_contact, play, white_noise
from bowdenfit.types import Vector

_WIDTH, _DEGREE = 7, 2  # blocks that a polynomial is laid through
_TURNS = 2.0  # of the noise: half of how far a force falls back where it really turns
_BEYOND = 3.0  # of the noise: what smoothing may change; more is a corner, or a spike, and stays
_NOISY = 0.5  # of the typical change from block to block: noise that hardly ever passes for motion


def smooth_input(force: Vector) -> Vector:
    """A series like a measured one that is smooth, and rises and falls by turns as that does beyond its noise.

    It is smoothed by polynomials over few blocks (Savitzky and Golay 1964) as far as noise goes, if there is much. Where it
    turns is found by an operator with play as wide as `_TURNS` standard deviations of the noise on either side; from one turn
    to the next it is the isotonic regression. Without noise it is the force itself.

    Args:
        force: Of the blocks of a recording [N].
    """
    noise = _noise(force)
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


def _noise(force: Vector) -> float:
    """Standard deviation of the white part of a series, of which a curve has less than in second differences alone."""
    fourth = np.diff(force, 4)
    by_fourth = float(1.4826 * np.median(np.abs(fourth)) / np.sqrt(70)) if len(fourth) else np.inf
    return min(white_noise(force), by_fourth)


def _smooth(force: Vector, noise: float) -> Vector:
    """The force smoothed over few blocks, and as it was read where that changes it by more than noise does."""
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
    """The rising series nearest to a force, by pooling neighbours that fall (Barlow et al. 1972).

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
