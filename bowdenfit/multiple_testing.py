"""Several hypothesis tests at once."""

from collections.abc import Sequence

import numpy as np


def adjust_p_values(p_values: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return Holm-adjusted p-values, in the order given.

    If every null hypothesis holds, the smallest of them is below alpha with probability alpha at most.

    Args:
        p_values: One for each test, taken by itself.

    References:
        Holm 1979, "A simple sequentially rejective multiple test procedure" (Scandinavian Journal of Statistics 6).
    """
    order, adjusted = np.argsort(p_values), np.empty(len(p_values))
    factors = np.arange(len(p_values), 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(np.asarray(p_values)[order] * factors), 1.0)
    return adjusted
