"""A rope whose input force swings between two forces, by a play operator of its own: it may hardly slide."""

import numpy as np


def swing(time, highest, exponent, period):
    """Input and output [N] where the input swings from 30 N to a multiple of it and back, from equal forces at the start."""
    force = 30.0 * (1 + (highest - 1) * (1 - np.cos(2 * np.pi * time / period)) / 2)
    y, output = force[0], []
    for x in force:
        y = min(max(y, x * np.exp(-exponent)), x * np.exp(exponent))
        output.append(y)
    return force, np.array(output)
