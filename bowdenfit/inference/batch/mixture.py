"""Mixtures of Student-t's to draw from.

References:
    Owen and Zhou 2000, "Safe and effective importance sampling" (Journal of the American Statistical Association 95), for the
    draws from the prior, which bound the weights.
"""

from dataclasses import dataclass
from functools import cached_property
from math import lgamma

import numpy as np

_FREEDOM = 5  # of the Student-t's
_PRIOR_SHARE = 0.05  # of the draws that the prior has


@dataclass(frozen=True)
class Mixture:
    """Student-t's and the prior, a standard normal.

    Args:
        center: Of every part, (part, parameter).
        root: A root R of its scale matrix R R^T.
        share: Of the draws that are not the prior's.
    """

    center: np.ndarray
    root: np.ndarray
    share: np.ndarray

    @cached_property
    def _inverse(self) -> np.ndarray:
        return np.linalg.inv(self.root)

    def draw(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """So many z, one a row."""
        ends = np.cumsum(self.share) * (1 - _PRIOR_SHARE)
        part = np.searchsorted(ends, (np.arange(count) + generator.uniform()) / count)  # each part gets its share
        z = generator.standard_normal((count, self.center.shape[1]))
        wide = np.sqrt(_FREEDOM / generator.chisquare(_FREEDOM, count))
        for i in range(len(self.share)):
            here = part == i
            z[here] = self.center[i] + wide[here, None] * (z[here] @ self.root[i].T)
        return z

    def log_density(self, z: np.ndarray) -> np.ndarray:
        """Of every row."""
        of_parts = self._parts(z)
        of_prior = np.log(_PRIOR_SHARE) - 0.5 * (np.einsum("ni,ni->n", z, z) + z.shape[1] * np.log(2 * np.pi))
        top = of_parts.max(axis=1)
        within = np.log(np.sum(np.exp(of_parts - top[:, None]), axis=1)) + top
        return np.logaddexp(within + np.log1p(-_PRIOR_SHARE), of_prior)

    def _parts(self, z: np.ndarray) -> np.ndarray:
        """Log of share times density of every part, (row, part)."""
        count, size = self.center.shape
        flat = self._inverse.reshape(-1, size)
        apart = (z @ flat.T - np.einsum("kij,kj->ki", self._inverse, self.center).ravel()).reshape(len(z), count, size)
        squares = np.einsum("nki,nki->nk", apart, apart)
        constant = lgamma((_FREEDOM + size) / 2) - lgamma(_FREEDOM / 2) - size / 2 * np.log(_FREEDOM * np.pi)
        of_part = np.log(self.share) + constant - np.linalg.slogdet(self.root)[1]
        return of_part - (_FREEDOM + size) / 2 * np.log1p(squares / _FREEDOM)
