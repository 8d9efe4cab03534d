"""The force that a recording's input may have had: as it was read, with as little of the reading's noise as can be.

A recording is measured again on the computer with the input that was measured, and cells read it with noise of their own.
Were the noise of the first measurement taken for motion, a simulated rope would jump and turn round with each of its peaks,
while the likelihood, for a noise that may have been drawn a hundred times smaller, has it slide on evenly: as a delay makes it.
"""

import numpy as np

from bowdenfit.kinds.recordings.blocks import last_contact
from bowdenfit.recordings.preparation.play import play, white_noise
from bowdenfit.types import Vector

_WIDTH, _DEGREE = 7, 2  # blocks that a polynomial is laid through
_TURNS = 4.0  # of the noise: half of how far a force falls back where it really turns


def likely_input(force: Vector) -> Vector:
    """A series like a measured one that is smooth, and rises and falls by turns as that does beyond its noise.

    It is smoothed by polynomials over few blocks (Savitzky and Golay 1964). Where it turns is found by an operator with play as
    wide as `_TURNS` standard deviations of the noise on either side; from one turn to the next it is the isotonic regression.

    Args:
        force: Of the blocks of a recording, at least as many as the polynomial is laid through [N].
    """
    from scipy.optimize import isotonic_regression
    from scipy.signal import savgol_filter

    smooth = savgol_filter(force, _WIDTH, _DEGREE)
    heading = last_contact(play(smooth, _TURNS * white_noise(force))[1])
    heading[heading == 0] = heading[np.argmax(heading != 0)]
    likely, start = np.empty(len(force)), 0
    while start < len(force):
        ahead = heading[start:] == heading[start]
        stop = len(force) if ahead.all() else start + int(np.argmin(ahead))
        if stop < len(force):  # the operator sees a turn when its band is crossed: the force was at its extreme before
            found = start + int(np.argmax(heading[start] * smooth[start:stop])) + 1
            heading[found:stop] = heading[stop]
            stop = found
        likely[start:stop] = isotonic_regression(smooth[start:stop], increasing=bool(heading[start] >= 0)).x
        start = stop
    return likely
