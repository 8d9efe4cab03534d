"""How far simulated readings may be from what a bench hands in; the limits are wide, and the same for every kind."""

import numpy as np

GAIN_ERROR = 0.01  # of a reading, that load cells may gain against each other where nothing is stated
LOWEST, HIGHEST = 0.2, 0.99  # efficiency
_LEAST_LOSS, _LARGEST_LOSS = -np.log(HIGHEST), -np.log(LOWEST)
FACTOR = 10.0  # between what is simulated and what was measured, at most
SCATTER = 0.1  # of log ratios of forces about their stroke's mean, at most


def beyond(loss: np.ndarray, what: str) -> str:
    """Why friction exponents are none of a cable's, in words; empty if they may be.

    Args:
        loss: Friction exponents [1].
        what: What has them.
    """
    if np.any(loss > _LARGEST_LOSS):
        return f"{what} is below 20 %"
    return f"{what} is above 99 %" if np.any(loss < _LEAST_LOSS) else ""


def parts(group: np.ndarray, values: np.ndarray) -> list[np.ndarray]:
    """The values of each group."""
    return [values[group == each] for each in np.unique(group)]


def within_factor(real: float, made: float) -> bool:
    """Whether a simulated quantity is within a factor of ten of the measured one."""
    return bool(real / FACTOR <= made <= real * FACTOR)
