"""Moves of ensemble samplers: emcee's stretch and differential evolution, and draws from a t fitted to other walkers.

A move takes random numbers and the two halves of one ensemble, (walker, parameter): the half that moves and the half that
rests. It returns proposed positions for the moving half, and the log of the factor by which the ratio of densities there is
multiplied. Random numbers come from outside because XLA is slow to compile generators.

References:
    Goodman and Weare 2010, "Ensemble samplers with affine invariance" (Communications in Applied Mathematics and
    Computational Science 5); ter Braak 2006, "A Markov chain Monte Carlo version of the genetic algorithm differential
    evolution" (Statistics and Computing 16); Nelson, Ford and Payne 2014 (Astrophysical Journal Supplement 210), for both.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from bowdenfit.description.defaults import WALKERS_PER_PARAMETER

WIDEST_STRETCH = 2.0  # a of Goodman and Weare, emcee's default
GAMMA_SPREAD = 1e-5  # relative spread of gamma, emcee's default
FREEDOM = 5  # degrees of freedom of the t distribution: tails wider than a posterior's in z, and still a good fit; odd
JITTER = 1e-10  # relative increase of each variance; keeps the covariance of walkers on a narrow ridge positive definite


class RandomNumbers(NamedTuple):
    """Random numbers of a move, (walker, `count_move_numbers`).

    Args:
        uniform: Uniform between 0 and 1.
        normal: Standard normal quantiles of the uniform numbers; a move uses either.
    """

    uniform: Array
    normal: Array


Move = Callable[[RandomNumbers, Array, Array], tuple[Array, Array]]
Moves = Sequence[tuple[Move, float]]


def count_move_numbers(size: int) -> int:
    """Return how many random numbers a walker of `size` parameters needs for any move."""
    return size + FREEDOM


def random_numbers(uniform: Array) -> RandomNumbers:
    """Return uniform numbers with their normal quantiles, for all steps at once; in moves XLA would recompute them."""
    return RandomNumbers(uniform, 2**0.5 * jax.lax.erf_inv(2 * uniform - 1))


def stretch(numbers: RandomNumbers, moving: Array, resting: Array) -> tuple[Array, Array]:
    """Propose positions on the line through a resting walker; `emcee.moves.StretchMove` (equation 7 of Goodman and Weare)."""
    factor = ((WIDEST_STRETCH - 1) * numbers.uniform[:, 0] + 1) ** 2 / WIDEST_STRETCH
    anchor = resting[_whole_number(numbers.uniform[:, 1], len(resting))]
    return anchor - (anchor - moving) * factor[:, None], (moving.shape[1] - 1) * jnp.log(factor)


def differential_evolution(
    numbers: RandomNumbers, moving: Array, resting: Array, gamma: float | None = None
) -> tuple[Array, Array]:
    """Propose positions shifted by the difference of two resting walkers; `emcee.moves.DEMove` (Nelson and others).

    Args:
        numbers: Random numbers.
        moving: Half that moves.
        resting: Half that rests.
        gamma: Factor on the difference; 2.38 / sqrt(2 parameters) if omitted.
    """
    (n, size), count, uniform = moving.shape, len(resting), numbers.uniform
    first = _whole_number(uniform[:, 0], count)
    second = (first + 1 + _whole_number(uniform[:, 1], count - 1)) % count  # any but the first
    gamma = 2.38 / (2 * size) ** 0.5 if gamma is None else gamma
    spread = gamma * (1 + GAMMA_SPREAD * (2 * uniform[:, 2:3] - 1))
    return moving + spread * (resting[second] - resting[first]), jnp.zeros(n)


def fitted_t(numbers: RandomNumbers, moving: Array, resting: Array) -> tuple[Array, Array]:
    """Propose draws from a t distribution fitted to the resting half, as `emcee.moves.KDEMove` does from a kernel density.

    It brings walkers in from far outside in tens of steps, and gives independent draws where the posterior is about normal.
    """
    size, normal = moving.shape[1], numbers.normal
    standard_draws = normal[:, :size] * jnp.sqrt(FREEDOM / jnp.sum(normal[:, size:] ** 2, axis=1, keepdims=True))
    mean = resting.mean(axis=0)
    covariance = (resting - mean).T @ (resting - mean) / (len(resting) - 1)
    root = jnp.linalg.cholesky(covariance * (1 + JITTER * jnp.eye(size)), symmetrize_input=False)
    present = jax.scipy.linalg.solve_triangular(root, (moving - mean).T, lower=True).T
    return mean + standard_draws @ root.T, _log_t(present) - _log_t(standard_draws)


def _whole_number(uniform: Array, count: int) -> Array:
    """Return integers from 0 to `count` - 1."""
    return (uniform * count).astype(int)


def _log_t(standardized: Array) -> Array:
    """Return the log density of the standard t distribution, up to a constant."""
    return -(FREEDOM + standardized.shape[-1]) / 2 * jnp.log1p(jnp.sum(standardized**2, axis=-1) / FREEDOM)


def weighted_moves(fitted: Move = fitted_t) -> Moves:
    """Return the moves of an ensemble with their shares, chosen by measurements on the data sets in `datasets/`.

    Draws from a fitted t distribution find the bulk, and mix best where the posterior is about normal; differential evolution
    mixes along bent ridges, and stretch moves in narrow ends; gamma 1 jumps between modes.

    Args:
        fitted: Move that draws from a distribution fitted to the resting walkers.
    """
    jumps = partial(differential_evolution, gamma=1.0)
    return (stretch, 0.1), (differential_evolution, 0.35), (jumps, 0.05), (fitted, 0.5)


def default_moves(size: int, n_walkers: int) -> Moves:
    """Return the moves for an ensemble; see `weighted_moves`.

    Args:
        size: Number of parameters.
        n_walkers: Walkers of an ensemble; few of them do not determine a t distribution.
    """
    return weighted_moves(fitted_t if n_walkers >= WALKERS_PER_PARAMETER * size else differential_evolution)
