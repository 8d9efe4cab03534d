"""The play operator in NumPy, for recordings: what dry friction makes of a force that goes up and down."""

import numpy as np

from bowdenfit.types import Labels, Vector

PULLING, RETURNING, BETWEEN = 1, -1, 0


def play(x: Vector, exponent: float, start: float | None = None) -> tuple[Vector, Labels]:
    """Output of the play operator, y_t = clip(y_{t-1}, x_t - exponent, x_t + exponent), and where in the band it is.

    With x = log F_in this is y = log F_out of a cable with capstan friction: the output follows the input at a distance
    while the rope slides, and stands still while the input crosses the friction band after a reversal. A plain loop:
    meant for up to some 10^4 values.

    Args:
        x: Input, in the scale in which friction is a constant distance [1].
        exponent: Friction exponent, half the width of the band, at least 0 [1].
        start: Output before the first value [1]; None for that of a cable without load history, x_0.

    Returns:
        The output, and its state: +1 where y = x - exponent (contact while pulling), -1 where y = x + exponent (contact
        while returning), 0 between.
    """
    if not len(x):
        return np.zeros(0), np.zeros(0, dtype=int)
    y = float(x[0]) if start is None else start
    output, state = [], []
    for value in x.tolist():
        lower, upper = value - exponent, value + exponent
        contact = BETWEEN
        if y <= lower:
            y, contact = lower, PULLING
        elif y >= upper:
            y, contact = upper, RETURNING
        output.append(y)
        state.append(contact)
    return np.array(output), np.array(state, dtype=int)
