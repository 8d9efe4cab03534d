"""What is known of a device as draws: Normal about what was measured and cut off at 0, or those of a fit that tells it."""

from collections.abc import Mapping

import numpy as np

from bowdenfit.description.device import Known

_ROUNDS = 200


def drawn(known: Mapping[str, Known], n: int, seed: int) -> dict[str, np.ndarray]:
    """So many draws of every quantity; the same number over and over of what is set.

    Draws of a fit are picked alike for all quantities that it tells, and what they hold besides is taken from them.

    Args:
        known: Quantities by key.
        n: Number of draws.
        seed: Of the fit.
    """
    found = {key: _one(each, np.random.default_rng([seed, 41, *key.encode()]), n) for key, each in known.items()}
    for key, each in known.items():
        if each.draws:
            picked = np.array(each.draws)[np.random.default_rng([seed, 47]).integers(len(each.draws), size=n)]
            found[key] = np.maximum(picked - found.get(each.beside, 0.0), 0.0)
    return found


def _one(known: Known, generator: np.random.Generator, n: int) -> np.ndarray:
    found = known.value + known.sd * generator.standard_normal(n)
    for _ in range(_ROUNDS):
        below = found < 0
        if not below.any():
            break
        found[below] = known.value + known.sd * generator.standard_normal(int(below.sum()))
    return np.maximum(found, 0.0)
