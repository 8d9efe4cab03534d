"""What is known of a device as draws: Normal about what was measured, cut off at 0."""

from collections.abc import Mapping

import numpy as np

from bowdenfit.description.device import Known

_ROUNDS = 200


def drawn(known: Mapping[str, Known], n: int, seed: int) -> dict[str, np.ndarray]:
    """So many draws of every quantity; the same number over and over of what is set.

    Args:
        known: Quantities by key.
        n: Number of draws.
        seed: Of the fit.
    """
    return {key: _one(each, np.random.default_rng([seed, 41, *key.encode()]), n) for key, each in known.items()}


def _one(known: Known, generator: np.random.Generator, n: int) -> np.ndarray:
    found = known.value + known.sd * generator.standard_normal(n)
    for _ in range(_ROUNDS):
        below = found < 0
        if not below.any():
            break
        found[below] = known.value + known.sd * generator.standard_normal(int(below.sum()))
    return np.maximum(found, 0.0)
