"""Several tests at once."""

from collections.abc import Sequence

import numpy as np


def holm(chances: Sequence[float] | np.ndarray) -> np.ndarray:
    """Probabilities, each that of any as small among so many: below alpha by chance with probability alpha at most.

    Args:
        chances: By themselves.

    References:
        Holm 1979, "A simple sequentially rejective multiple test procedure" (Scandinavian Journal of Statistics 6).
    """
    order, found = np.argsort(chances), np.empty(len(chances))
    found[order] = np.minimum(np.maximum.accumulate(np.asarray(chances)[order] * np.arange(len(chances), 0, -1)), 1.0)
    return found
