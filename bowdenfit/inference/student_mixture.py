"""Mixtures of Student t distributions: distributions with wide tails from which draws of a posterior are proposed.

References:
    Peel and McLachlan 2000, "Robust mixture modelling using the t distribution" (Statistics and Computing 10), for the steps
    of expectation and maximization.
"""

from dataclasses import dataclass
from functools import cached_property
from math import lgamma

import numpy as np

DEGREES_OF_FREEDOM = 5  # of the Student t distributions: tails wide enough that importance weights stay bounded
_EM_STEPS = 4  # steps of expectation and maximization that refine a mixture
_LEAST_PART_SHARE = 1e-3  # share below which a component keeps its center, since hardly any draw is near
_SHRINKAGE = 0.5  # factor on the covariance of all draws, toward which a component with few draws is shrunk


@dataclass(frozen=True)
class StudentMixture:
    """A mixture of multivariate Student t distributions.

    Args:
        center: Centers, (component, parameter).
        root: Roots R of the scale matrices R R^T, (component, parameter, parameter).
        share: Weights of the components, which sum to 1.
        freedom: Degrees of freedom of every component.
    """

    center: np.ndarray
    root: np.ndarray
    share: np.ndarray
    freedom: int = DEGREES_OF_FREEDOM

    @cached_property
    def _inverse(self) -> np.ndarray:
        return np.linalg.inv(self.root)

    def draw(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """Draw `count` points, one a row; each component gets its share, one component after the other."""
        part = np.searchsorted(np.cumsum(self.share), (np.arange(count) + generator.uniform()) / count)
        part = np.minimum(part, len(self.share) - 1)
        rows = generator.standard_normal((count, self.center.shape[1]))
        wide = np.sqrt(self.freedom / generator.chisquare(self.freedom, count))
        for i in range(len(self.share)):
            members = part == i
            rows[members] = self.center[i] + wide[members, None] * (rows[members] @ self.root[i].T)
        return rows

    def log_density(self, rows: np.ndarray) -> np.ndarray:
        """Return the log density at every row."""
        return _log_sum(self._log_components(self._squared_distances(rows)))

    def _squared_distances(self, rows: np.ndarray) -> np.ndarray:
        """Return squared Mahalanobis distances from every component, (row, component)."""
        count, size = self.center.shape
        flat = self._inverse.reshape(-1, size)
        scaled = (rows @ flat.T - np.einsum("kij,kj->ki", self._inverse, self.center).ravel()).reshape(-1, count, size)
        return np.einsum("nki,nki->nk", scaled, scaled)

    def _log_components(self, squares: np.ndarray) -> np.ndarray:
        """Return the log of weight times density of every component, (row, component)."""
        size, freedom = self.center.shape[1], self.freedom
        constant = lgamma((freedom + size) / 2) - lgamma(freedom / 2) - size / 2 * np.log(freedom * np.pi)
        log_factor = np.log(self.share) + constant - np.linalg.slogdet(self.root)[1]
        return log_factor - (freedom + size) / 2 * np.log1p(squares / freedom)

    def refine(self, rows: np.ndarray) -> "StudentMixture":
        """Return the mixture after some steps of expectation and maximization toward draws.

        Args:
            rows: Draws, one a row.
        """
        mixture, overall_covariance, (count, size) = self, regularized_covariance(rows), rows.shape
        for _ in range(_EM_STEPS):
            squares = mixture._squared_distances(rows)
            logs = mixture._log_components(squares)
            membership = np.exp(logs - _log_sum(logs)[:, None]) / count
            pulled = membership * (self.freedom + size) / (self.freedom + squares)
            share = np.maximum(membership.sum(axis=0), np.finfo(float).tiny)
            near = share > _LEAST_PART_SHARE
            middle = pulled.T @ rows / np.maximum(pulled.sum(axis=0), np.finfo(float).tiny)[:, None]
            center = np.where(near[:, None], middle, mixture.center)
            few = size / (share**2 / np.maximum(np.sum(membership**2, axis=0), np.finfo(float).tiny) + size)
            few = np.where(near, few, 1.0)[:, None, None]
            deviations = [rows - at for at in center]
            scale = np.stack(
                [(deviation * pull[:, None]).T @ deviation for deviation, pull in zip(deviations, pulled.T, strict=True)]
            )
            scale = (1 - few) * scale / share[:, None, None] + few * _SHRINKAGE * overall_covariance
            share = np.maximum(share, _LEAST_PART_SHARE)
            mixture = StudentMixture(center, np.linalg.cholesky(scale), share / share.sum(), self.freedom)
        return mixture

    def with_wide_component(self, rows: np.ndarray, times: float, share: float) -> "StudentMixture":
        """Return the mixture with one more, wide component about all draws.

        Args:
            rows: Draws, one a row.
            times: How much wider than the draws it is.
            share: Weight of the new component.
        """
        root = times * np.linalg.cholesky(regularized_covariance(rows))
        return StudentMixture(
            np.concatenate([self.center, rows.mean(axis=0, keepdims=True)]),
            np.concatenate([self.root, root[None]]),
            np.append((1 - share) * self.share, share),
            self.freedom,
        )


def start_mixture(rows: np.ndarray, parts: int, freedom: int = DEGREES_OF_FREEDOM) -> StudentMixture:
    """Return a mixture centered at some of many draws, evenly spaced in their order, to be refined.

    Args:
        rows: Draws, one a row.
        parts: Number of components.
        freedom: Degrees of freedom of every component.
    """
    some = ((np.arange(parts) + 0.5) / parts * len(rows)).astype(int)
    root = np.linalg.cholesky(_SHRINKAGE * regularized_covariance(rows))
    return StudentMixture(rows[some], np.stack([root] * parts), np.full(parts, 1 / parts), freedom)


def regularized_covariance(rows: np.ndarray) -> np.ndarray:
    """Return the covariance of draws, plus a little in each direction so that it always has a Cholesky factor."""
    sample_covariance = np.cov(rows.T).reshape(rows.shape[1], -1)
    return sample_covariance + (
        1e-9 * np.trace(sample_covariance) / len(sample_covariance) + np.finfo(float).tiny
    ) * np.eye(len(sample_covariance))


def _log_sum(logs: np.ndarray) -> np.ndarray:
    """Return the logarithm of the sum of exponentials of each row; minus infinity where all are 0."""
    top = np.maximum(logs.max(axis=1), np.finfo(float).min)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.sum(np.exp(logs - top[:, None]), axis=1)) + top)
