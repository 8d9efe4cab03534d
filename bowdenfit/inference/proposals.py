"""How walkers are moved: proposals of all ensembles at once, each from the places of its own ensemble's other half.

A proposal takes the half that moves and the half that rests, (ensemble, walker, parameter), and random numbers. It gives places
for the moving half, and the log of what the ratio of densities there is to be multiplied by.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

Proposal = Callable[[np.ndarray, np.ndarray, np.random.RandomState], tuple[np.ndarray, np.ndarray]]

WIDEST_STRETCH = 2.0
GAMMA_SPREAD = 1e-5
FREEDOM = 5  # degrees of freedom of the t distribution: tails wider than a posterior's in z, and still a good fit; odd
JITTER = 1e-10  # of each variance; keeps the covariance of walkers on a narrow ridge positive


def shares_of_moves(stretch: Any, differential_evolution: Any, fitted: Any) -> Sequence[tuple[Any, float]]:
    """The moves of an ensemble, single or in a batch, and how often each is made, by measurement on every data set here.

    Draws from a fitted t distribution find the bulk, and mix best where the posterior is about normal; differential evolution
    does along bent ridges, stretch moves do in narrow ends; gamma 1 jumps between modes.

    Args:
        stretch, differential_evolution: Moves, in NumPy or in JAX.
        fitted: What draws from a distribution fitted to the resting walkers.
    """
    jumps = partial(differential_evolution, gamma=1.0)
    return (stretch, 0.1), (differential_evolution, 0.35), (jumps, 0.05), (fitted, 0.5)


def stretch(moving: np.ndarray, resting: np.ndarray, random: np.random.RandomState) -> tuple[np.ndarray, np.ndarray]:
    """Places on the line through a resting walker; `emcee.moves.StretchMove`.

    References:
        Goodman and Weare 2010, "Ensemble samplers with affine invariance" (CAMCoS 5), equation 7.
    """
    ensembles, n, size = moving.shape
    factor = ((WIDEST_STRETCH - 1) * random.rand(ensembles, n) + 1) ** 2 / WIDEST_STRETCH
    anchor = resting[_rows(resting), random.randint(resting.shape[1], size=(ensembles, n))]
    return anchor - (anchor - moving) * factor[..., None], (size - 1) * np.log(factor)


def differential_evolution(
    moving: np.ndarray, resting: np.ndarray, random: np.random.RandomState, gamma: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Places shifted by the difference of two resting walkers; `emcee.moves.DEMove`.

    Args:
        moving: Half that moves.
        resting: Half that rests.
        random: Random numbers.
        gamma: What the difference is multiplied by; 2.38 / sqrt(2 parameters) if omitted.

    References:
        Nelson, Ford and Payne 2014, "RUN DMC" (ApJS 210), section 2.
    """
    (ensembles, n, size), count = moving.shape, resting.shape[1]
    first = random.randint(count, size=(ensembles, n))
    second = (first + random.randint(1, count, size=(ensembles, n))) % count  # any but the first
    gamma = 2.38 / np.sqrt(2 * size) if gamma is None else gamma
    spread = gamma * (1 + GAMMA_SPREAD * random.randn(ensembles, n, 1))
    difference = resting[_rows(resting), second] - resting[_rows(resting), first]
    return moving + spread * difference, np.zeros((ensembles, n))


def independent(moving: np.ndarray, resting: np.ndarray, random: np.random.RandomState) -> tuple[np.ndarray, np.ndarray]:
    """Places drawn from a t distribution fitted to the resting half, as `emcee.moves.KDEMove` draws from a kernel density.

    It brings walkers in from far outside in tens of steps, and forgets where they were where the posterior is about normal.
    """
    ensembles, n, size = moving.shape
    mean = resting.mean(axis=1, keepdims=True)
    deviations = resting - mean
    covariance = np.matmul(deviations.transpose(0, 2, 1), deviations) / (resting.shape[1] - 1)
    root = np.linalg.cholesky(covariance * (1 + JITTER * np.eye(size)))
    mixing = np.sqrt(FREEDOM / random.chisquare(FREEDOM, size=(ensembles, n, 1)))
    drawn = random.standard_normal((ensembles, n, size)) * mixing
    present = np.matmul(moving - mean, np.linalg.inv(root).transpose(0, 2, 1))
    places = mean + np.matmul(drawn, root.transpose(0, 2, 1))
    return places, _log_t(present) - _log_t(drawn)


def _log_t(standardized: np.ndarray) -> np.ndarray:
    """Log density of the standard t distribution, up to a constant."""
    return -(FREEDOM + standardized.shape[-1]) / 2 * np.log1p(np.sum(standardized**2, axis=-1) / FREEDOM)


def _rows(resting: np.ndarray) -> np.ndarray:
    """Index of the own ensemble, to go with one of walkers."""
    return np.arange(len(resting))[:, None]
