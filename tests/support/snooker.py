"""The move that samples the wrong distribution, for controls that must fail."""

import emcee
import numpy as np

from bowdenfit.inference.proposals import differential_evolution


def snooker(moving: np.ndarray, resting: np.ndarray, random: np.random.RandomState) -> tuple[np.ndarray, np.ndarray]:
    """Emcee's snooker move, ensemble by ensemble; it wants the resting walkers in three sets."""
    move = emcee.moves.DESnookerMove()
    each = [move.get_proposal(s, np.array_split(c, 3), random) for s, c in zip(moving, resting, strict=True)]
    places, factors = zip(*each, strict=True)
    return np.stack(places), np.stack(factors)


def snooker_mixture():
    """The popular mixture."""
    return [(differential_evolution, 0.8), (snooker, 0.2)]
