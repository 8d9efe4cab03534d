"""Draws of the quantities of a device: Normal and truncated at 0, or taken from a fit."""

from collections.abc import Mapping

import numpy as np

from bowdenfit.description.device import Known

_MAX_REDRAWS = 200


def draw_device(known: Mapping[str, Known], n: int, seed: int) -> dict[str, np.ndarray]:
    """Draw every quantity `n` times; a quantity that is set is constant.

    Draws of a fit are picked alike for all quantities that it tells, and what they hold besides is taken from them.

    Args:
        known: Quantities by key.
        n: Number of draws.
        seed: Of the fit.
    """
    draws = {
        key: _draw_truncated_normal(quantity, np.random.default_rng([seed, 41, *key.encode()]), n)
        for key, quantity in known.items()
    }
    for key, quantity in known.items():
        if quantity.draws:
            picked = np.array(quantity.draws)[np.random.default_rng([seed, 47]).integers(len(quantity.draws), size=n)]
            draws[key] = np.maximum(picked - draws.get(quantity.beside, 0.0), 0.0)
    return draws


def _draw_truncated_normal(known: Known, generator: np.random.Generator, n: int) -> np.ndarray:
    draws = known.value + known.sd * generator.standard_normal(n)
    for _ in range(_MAX_REDRAWS):
        below = draws < 0
        if not below.any():
            break
        draws[below] = known.value + known.sd * generator.standard_normal(int(below.sum()))
    return np.maximum(draws, 0.0)
