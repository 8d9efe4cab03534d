"""Pareto-smoothed importance sampling (PSIS): weights of draws for another density, and how far they can be trusted.

`match_moments` estimates leave-one-out for an influential reading, where plain importance weights fail because the posterior
without the reading lies elsewhere, or is wider: an affine map moves half of the draws there, and all are weighted against the
mixture of both halves.

References:
    Vehtari, Simpson, Gelman, Yao and Gabry 2024, "Pareto smoothed importance sampling" (JMLR 25); Paananen, Piironen, Buerkner
    and Vehtari 2021, "Implicitly adaptive importance sampling" (Statistics and Computing 31), for moment matching.
"""

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from bowdenfit.inference.diagnostics import array_stats

RELIABLE_K = 0.7  # Pareto k up to which importance weights can be trusted (Vehtari and others 2024)
_NO_WEIGHT = 1e4  # distance from the largest log weight at which a weight is zero
_FLAT = 1e-9  # range of log ratios below which they are constant, as for a bound far off
_MOST_STEPS = 30  # of moment matching
_FLOOR = 1e-12  # least variance
_GOOD_ENOUGH = 0.5  # Pareto k below which the weights have a finite variance, so that no further step gains much
Evaluate = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def reliable_k(n_draws: int) -> float:
    """Return the Pareto k up to which importance weights of `n_draws` draws can be trusted; section 3.2.4."""
    return min(1 - 1 / np.log10(n_draws), RELIABLE_K) if n_draws > 10 else 0.0


def describe_uneven_weights(pareto_k: float, n_draws: int) -> tuple[str, ...]:
    """Say that importance weights cannot be trusted; empty if they can."""
    if pareto_k <= reliable_k(n_draws):
        return ()
    return (
        f"the importance weights are too uneven: Pareto k is {pareto_k:.2f}, and at most {reliable_k(n_draws):.2f} can be "
        "trusted",
    )


def smooth_weights(log_ratio: np.ndarray, share: float = 1.0) -> tuple[np.ndarray, float]:
    """Return smoothed log weights, whose exponentials sum to 1, and Pareto k.

    Ratios that cannot be computed have no weight; equal ratios give equal weights and k = 0. If a handful of draws carry so
    much weight, or so many draws are identical, that no Pareto distribution can be fitted, or no ratio can be computed, weights
    are equal and k is infinite.

    Args:
        log_ratio: Log importance ratio of every draw, up to a constant.
        share: Effective draws per draw.
    """
    usable, equal = np.isfinite(log_ratio), np.full(len(log_ratio), -np.log(len(log_ratio)))
    if not usable.any():
        return equal, float("inf")
    ratios = np.where(usable, log_ratio, np.max(log_ratio[usable], initial=0.0) - _NO_WEIGHT)
    if not np.ptp(ratios) > _FLAT:
        return equal, 0.0
    try:
        with _raise_without_tail():
            # ArviZ's function takes what is left out, the log likelihood, and turns its sign itself.
            log_weights, k = array_stats().psislw(-ratios, r_eff=share, axis=0)
    except (ValueError, UserWarning):
        return equal, float("inf")
    if not (np.isfinite(k) and np.all(np.isfinite(log_weights))):
        return equal, float("inf")
    return np.asarray(log_weights), float(k)


def weighted_elpd(log_ratio: np.ndarray, log_likelihood: np.ndarray, share: float) -> tuple[float, float, float]:
    """Return the elpd of one reading from weighted draws, its Pareto k, and its Monte Carlo standard error (3.2.3).

    Args:
        log_ratio: Log importance ratio of every draw, up to a constant.
        log_likelihood: Log likelihood of the reading at every draw.
        share: Effective draws per draw.
    """
    log_weights, k = smooth_weights(log_ratio, share)
    parts = log_weights + log_likelihood
    top = float(np.max(parts))
    elpd = top + float(np.log(np.sum(np.exp(parts - top))))
    relative = np.exp(parts - elpd) - np.exp(log_weights)  # weight times the relative deviation of the density
    return elpd, k, float(np.sqrt(np.sum(relative**2) / share))


def power_weights(part: np.ndarray, alpha: float) -> np.ndarray:
    """Return weights of draws for the density with one part of its logarithm multiplied by alpha, up to a factor.

    They are not smoothed where so many draws are identical, as those of walkers that stood still, or draws are so few, that no
    Pareto distribution can be fitted to the tail.

    Args:
        part: That part at every draw, (chain, draw).
        alpha: The power, near 1.
    """
    try:
        with _raise_without_tail():
            return np.exp(array_stats().power_scale_lw(part, alpha, axis=(-2, -1)))
    except (ValueError, UserWarning):
        return np.exp((alpha - 1) * part - np.max((alpha - 1) * part))


@contextmanager
def _raise_without_tail() -> Iterator[None]:
    """Make ArviZ raise instead of warn where a tail has too few different draws.

    Where the lower quarter of a tail is constant ArviZ divides by zero; the caller checks for values that are not finite.
    """
    with warnings.catch_warnings(), np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        warnings.simplefilter("error", UserWarning)
        yield


@dataclass(frozen=True)
class Affine:
    """The map from u to matrix (u - center) + center + shift, where the center is the mean of the draws."""

    matrix: np.ndarray
    shift: np.ndarray
    center: np.ndarray

    def __call__(self, draws: np.ndarray) -> np.ndarray:
        """Return the draws moved, one a row."""
        return (draws - self.center) @ self.matrix.T + self.center + self.shift

    def move_back(self, draws: np.ndarray) -> np.ndarray:
        """Return the draws moved back."""
        return np.linalg.solve(self.matrix, (draws - self.center - self.shift).T).T + self.center

    @property
    def log_volume(self) -> float:
        """Log of the factor on volumes."""
        return float(np.linalg.slogdet(self.matrix)[1])


def match_moments(draws: np.ndarray, evaluate: Evaluate, share: float) -> tuple[float, float, float]:
    """Return the elpd of one reading left out, its Pareto k, and its Monte Carlo standard error.

    Args:
        draws: Draws of the posterior with the reading, one a row.
        evaluate: Log posterior density with the reading, up to a constant, and log likelihood of the reading, at any draws.
        share: Effective draws per draw.

    References:
        Paananen, Piironen, Buerkner and Vehtari 2021, "Implicitly adaptive importance sampling" (Statistics and Computing
        31). arviz_stats.loo_moment_match is the same in intention; its version 0.8, the last for Python 3.11, subtracts the
        shift twice where it maps draws back, and its weights are then not those of the mixture.
    """
    best = find_best_map(draws, evaluate(draws)[0], evaluate, share)
    # Every other draw is moved, and all are weighted against the mixture of where both kinds come from.
    mixed = np.where(np.arange(len(draws))[:, None] % 2 == 0, best(draws), draws)
    density, likelihood = evaluate(mixed)
    from_moved = evaluate(best.move_back(mixed))[0] - best.log_volume
    return weighted_elpd(density - likelihood - np.logaddexp(density, from_moved), likelihood, share)


def find_best_map(draws: np.ndarray, log_density: np.ndarray, evaluate: Evaluate, share: float) -> Affine:
    """Return the affine map with the smallest Pareto k that moment matching reaches step by step; see `match_moments`."""
    size, center = draws.shape[1], draws.mean(axis=0)
    best = Affine(np.eye(size), np.zeros(size), center)

    def smooth_at(candidate: Affine) -> tuple[np.ndarray, float]:
        density, likelihood = evaluate(candidate(draws))
        return smooth_weights(density - likelihood - log_density, share)

    log_weights, k = smooth_at(best)
    for _ in range(_MOST_STEPS):
        if k <= _GOOD_ENOUGH:
            break
        for candidate in _propose_maps(best, draws, np.exp(log_weights)):
            candidate_weights, candidate_k = smooth_at(candidate)
            if candidate_k < k:
                best, log_weights, k = candidate, candidate_weights, candidate_k
                break
        else:
            break
    return best


def _propose_maps(current: Affine, draws: np.ndarray, weights: np.ndarray) -> Iterator[Affine]:
    """Yield maps onto the weighted mean, then also the weighted standard deviations, then the weighted covariance."""
    moved = current(draws)
    mean = weights @ moved
    shift = mean - current.center
    yield Affine(current.matrix, shift, current.center)
    target, present = _covariance(moved, weights), _covariance(moved)
    ratio = np.sqrt(np.maximum(np.diag(target), _FLOOR) / np.maximum(np.diag(present), _FLOOR))
    yield Affine(ratio[:, None] * current.matrix, shift, current.center)
    if np.linalg.eigvalsh(target)[0] > _FLOOR < np.linalg.eigvalsh(present)[0]:
        stretch = np.linalg.solve(np.linalg.cholesky(present).T, np.linalg.cholesky(target).T).T
        yield Affine(stretch @ current.matrix, shift, current.center)


def _covariance(draws: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    return np.atleast_2d(np.cov(draws.T, aweights=weights, ddof=0))
