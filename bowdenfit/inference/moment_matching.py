"""Leave-one-out of a reading that moves the posterior: draws moved to where they would be without it.

Importance weights fail where the posterior without a reading lies elsewhere, or is wider, than with it. An affine map takes
the draws there; half of them are moved, and all are weighted against the mixture of both halves.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from bowdenfit.inference.psis import smooth_weights, weighted_elpd

_MOST_STEPS = 30
_FLOOR = 1e-12
_GOOD_ENOUGH = 0.5  # Pareto k below which the weights have a finite variance, so that no step can gain much

Evaluate = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Affine:
    """The map from u to matrix (u - center) + center + shift, where the center is the mean of the draws."""

    matrix: np.ndarray
    shift: np.ndarray
    center: np.ndarray

    def __call__(self, draws: np.ndarray) -> np.ndarray:
        """Draws moved, one a row."""
        return (draws - self.center) @ self.matrix.T + self.center + self.shift

    def back(self, draws: np.ndarray) -> np.ndarray:
        """Draws moved back."""
        return np.linalg.solve(self.matrix, (draws - self.center - self.shift).T).T + self.center

    @property
    def log_volume(self) -> float:
        """Log of how much larger a volume becomes."""
        return float(np.linalg.slogdet(self.matrix)[1])


def match_moments(draws: np.ndarray, evaluate: Evaluate, share: float) -> tuple[float, float, float]:
    """Expected log density of one reading left out, its Pareto k, and its Monte Carlo standard error.

    Args:
        draws: Draws of the posterior with the reading, one a row.
        evaluate: Log posterior density with the reading, up to a constant, and log likelihood of the reading, at any draws.
        share: Effective draws a draw.

    References:
        Paananen, Piironen, Buerkner and Vehtari 2021, "Implicitly adaptive importance sampling" (Statistics and Computing
        31). arviz_stats.loo_moment_match is the same in intention; its version 0.8, the last for Python 3.11, subtracts the
        shift twice where it maps draws back, and its weights are then not those of the mixture.
    """
    best = find_best_map(draws, evaluate(draws)[0], evaluate, share)
    # Every other draw is moved, and all are weighted against the mixture of where both kinds come from.
    mixed = np.where(np.arange(len(draws))[:, None] % 2 == 0, best(draws), draws)
    density, likelihood = evaluate(mixed)
    from_moved = evaluate(best.back(mixed))[0] - best.log_volume
    return weighted_elpd(density - likelihood - np.logaddexp(density, from_moved), likelihood, share)


def find_best_map(draws: np.ndarray, log_density: np.ndarray, evaluate: Evaluate, share: float) -> Affine:
    """The affine map with the least Pareto k that moments of the weighted draws lead to, step by step; see `match_moments`."""
    size, center = draws.shape[1], draws.mean(axis=0)
    best = Affine(np.eye(size), np.zeros(size), center)

    def weighed(candidate: Affine) -> tuple[np.ndarray, float]:
        density, likelihood = evaluate(candidate(draws))
        return smooth_weights(density - likelihood - log_density, share)

    log_weights, k = weighed(best)
    for _ in range(_MOST_STEPS):
        if k <= _GOOD_ENOUGH:
            break
        for candidate in _propose_maps(best, draws, np.exp(log_weights)):
            candidate_weights, candidate_k = weighed(candidate)
            if candidate_k < k:
                best, log_weights, k = candidate, candidate_weights, candidate_k
                break
        else:
            break
    return best


def _propose_maps(current: Affine, draws: np.ndarray, weights: np.ndarray) -> Iterator[Affine]:
    """Maps onto the weighted mean; and the weighted standard deviations; and the weighted covariance."""
    moved = current(draws)
    mean = weights @ moved
    shift = mean - current.center
    yield Affine(current.matrix, shift, current.center)
    wanted, present = _covariance(moved, weights), _covariance(moved)
    ratio = np.sqrt(np.maximum(np.diag(wanted), _FLOOR) / np.maximum(np.diag(present), _FLOOR))
    yield Affine(ratio[:, None] * current.matrix, shift, current.center)
    if np.linalg.eigvalsh(wanted)[0] > _FLOOR < np.linalg.eigvalsh(present)[0]:
        stretch = np.linalg.solve(np.linalg.cholesky(present).T, np.linalg.cholesky(wanted).T).T
        yield Affine(stretch @ current.matrix, shift, current.center)


def _covariance(draws: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    return np.atleast_2d(np.cov(draws.T, aweights=weights, ddof=0))
