"""Mixtures of Student-t's: to draw from, and to move to where draws are.

References:
    Peel and McLachlan 2000, "Robust mixture modelling using the t distribution" (Statistics and Computing 10), for the steps
    that move a mixture.
"""

from dataclasses import dataclass
from functools import cached_property
from math import lgamma

import numpy as np

_DEGREES_OF_FREEDOM = 5  # of the Student-t's
_STEPS = 4  # in which a mixture is moved
_LEAST_SHARE = 1e-3  # of a part that draws have left
_SHRINKAGE = 0.5  # of the covariance of all draws, which is what a part has that few draws are near


@dataclass(frozen=True)
class StudentMixture:
    """Student-t's.

    Args:
        center: Of every part, (part, parameter).
        root: A root R of its scale matrix R R^T.
        share: Of the draws.
    """

    center: np.ndarray
    root: np.ndarray
    share: np.ndarray

    @cached_property
    def _inverse(self) -> np.ndarray:
        return np.linalg.inv(self.root)

    def draw(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """So many, one a row; each part gets its share, and parts follow each other."""
        part = np.searchsorted(np.cumsum(self.share), (np.arange(count) + generator.uniform()) / count)
        part = np.minimum(part, len(self.share) - 1)
        rows = generator.standard_normal((count, self.center.shape[1]))
        wide = np.sqrt(_DEGREES_OF_FREEDOM / generator.chisquare(_DEGREES_OF_FREEDOM, count))
        for i in range(len(self.share)):
            here = part == i
            rows[here] = self.center[i] + wide[here, None] * (rows[here] @ self.root[i].T)
        return rows

    def log_density(self, rows: np.ndarray) -> np.ndarray:
        """Of every row."""
        return _log_sum(self._log_components(self._squared_distances(rows)))

    def _squared_distances(self, rows: np.ndarray) -> np.ndarray:
        """Distance from every part in its own units, squared, (row, part)."""
        count, size = self.center.shape
        flat = self._inverse.reshape(-1, size)
        apart = (rows @ flat.T - np.einsum("kij,kj->ki", self._inverse, self.center).ravel()).reshape(-1, count, size)
        return np.einsum("nki,nki->nk", apart, apart)

    def _log_components(self, squares: np.ndarray) -> np.ndarray:
        """Log of share times density of every part, (row, part)."""
        size = self.center.shape[1]
        constant = (
            lgamma((_DEGREES_OF_FREEDOM + size) / 2)
            - lgamma(_DEGREES_OF_FREEDOM / 2)
            - size / 2 * np.log(_DEGREES_OF_FREEDOM * np.pi)
        )
        of_part = np.log(self.share) + constant - np.linalg.slogdet(self.root)[1]
        return of_part - (_DEGREES_OF_FREEDOM + size) / 2 * np.log1p(squares / _DEGREES_OF_FREEDOM)

    def refined(self, rows: np.ndarray) -> "StudentMixture":
        """The mixture that is likelier to have given draws, some steps of expectation and maximization away.

        Args:
            rows: Draws, one a row.
        """
        mixture, of_all, (count, size) = self, regularized_covariance(rows), rows.shape
        for _ in range(_STEPS):
            squares = mixture._squared_distances(rows)
            logs = mixture._log_components(squares)
            of_part = np.exp(logs - _log_sum(logs)[:, None]) / count
            pulled = of_part * (_DEGREES_OF_FREEDOM + size) / (_DEGREES_OF_FREEDOM + squares)
            share = np.maximum(of_part.sum(axis=0), np.finfo(float).tiny)
            near = share > _LEAST_SHARE
            middle = pulled.T @ rows / np.maximum(pulled.sum(axis=0), np.finfo(float).tiny)[:, None]
            center = np.where(near[:, None], middle, mixture.center)
            few = size / (share**2 / np.maximum(np.sum(of_part**2, axis=0), np.finfo(float).tiny) + size)
            few = np.where(near, few, 1.0)[:, None, None]
            apart = [rows - at for at in center]
            scale = np.stack(
                [(deviation * pull[:, None]).T @ deviation for deviation, pull in zip(apart, pulled.T, strict=True)]
            )
            scale = (1 - few) * scale / share[:, None, None] + few * _SHRINKAGE * of_all
            share = np.maximum(share, _LEAST_SHARE)
            mixture = StudentMixture(center, np.linalg.cholesky(scale), share / share.sum())
        return mixture

    def with_wide_component(self, rows: np.ndarray, times: float, share: float) -> "StudentMixture":
        """The same with one more part, about all of many draws.

        Args:
            rows: Draws, one a row.
            times: How much wider than they.
            share: Of the draws.
        """
        root = times * np.linalg.cholesky(regularized_covariance(rows))
        return StudentMixture(
            np.concatenate([self.center, rows.mean(axis=0, keepdims=True)]),
            np.concatenate([self.root, root[None]]),
            np.append((1 - share) * self.share, share),
        )


def start_mixture(rows: np.ndarray, parts: int) -> StudentMixture:
    """Student-t's about some of many draws, to be moved.

    Args:
        rows: Draws, one a row.
        parts: How many.
    """
    some = ((np.arange(parts) + 0.5) / parts * len(rows)).astype(int)
    root = np.linalg.cholesky(_SHRINKAGE * regularized_covariance(rows))
    return StudentMixture(rows[some], np.stack([root] * parts), np.full(parts, 1 / parts))


def regularized_covariance(rows: np.ndarray) -> np.ndarray:
    """Of draws, with a little more in each direction, so that it always has a root."""
    sample_covariance = np.cov(rows.T).reshape(rows.shape[1], -1)
    return sample_covariance + (
        1e-9 * np.trace(sample_covariance) / len(sample_covariance) + np.finfo(float).tiny
    ) * np.eye(len(sample_covariance))


def _log_sum(logs: np.ndarray) -> np.ndarray:
    """Logarithm of the sum of each row's exponentials; minus infinity where all are 0."""
    top = np.maximum(logs.max(axis=1), np.finfo(float).min)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.sum(np.exp(logs - top[:, None]), axis=1)) + top)
