"""Smooth departures of a wrap angle from its family's curve.

No real route is exactly a bell. The angle of a contact is its family's curve plus a Gaussian process (Matern, nu = 5/2) over
the route variable, less that process's constant and straight line, which the family has already. The process enters by its
leading Karhunen-Loève functions, scaled to a mean square of 1 over the range in all.

References:
    Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), equation 4.17 and section 4.3.2 (quadrature).
"""

from functools import cache

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

N_FUNCTIONS = 4  # they have 97.6 % of the variance of the process; the next would add 1.2 %
_LENGTH_SCALE = 0.6  # of half the range; shorter ones describe the noise of angles read at some twenty lengths, a judgement
_N_NODES = 32  # of the quadrature


def departure_functions(z: Float[Array, " rows"]) -> Float[Array, "rows functions"]:
    """Leading functions of the process at z, -1 to 1 over the range; outside the range as at its nearer end [1]."""
    nodes, weights, lines, _ = _expansion()
    z = jnp.clip(z, -1.0, 1.0)
    return _covariance(jnp.abs(z[..., None] - nodes)) @ weights - jnp.stack([jnp.ones_like(z), z], axis=-1) @ lines


def departure_variances() -> Float[np.ndarray, " functions"]:
    """Mean square of each function over the range; they are orthogonal there, and 1 in all [1]."""
    return _expansion()[3]


@cache
def _expansion() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Nodes, weights of each function's covariances with them, constant and slope to be subtracted, and mean squares."""
    nodes, measure = np.polynomial.legendre.leggauss(_N_NODES)
    root = np.sqrt(measure / 2)
    line = np.stack([np.ones(_N_NODES), np.sqrt(3) * nodes])  # orthonormal over the range
    free = np.eye(_N_NODES) - (line * root).T @ (line * root)
    covariance = _covariance(np.abs(nodes[:, None] - nodes))
    variances, vectors = np.linalg.eigh(free @ (root[:, None] * covariance * root) @ free)
    variances, vectors = variances[::-1][:N_FUNCTIONS], vectors[:, ::-1][:, :N_FUNCTIONS]
    vectors = vectors * np.sign(vectors[-1])  # each ends above 0
    shares = variances / variances.sum()
    weights = root[:, None] * vectors / variances * np.sqrt(shares)
    lines = (line * root**2) @ covariance @ weights
    return nodes, weights, np.stack([lines[0], np.sqrt(3) * lines[1]]), shares


def _covariance(distance: Float[Array, "..."] | np.ndarray) -> Float[Array, "..."]:
    """Matern covariance (nu = 5/2) of values at a distance in half ranges."""
    d = np.sqrt(5) * distance / _LENGTH_SCALE
    return (1 + d + d**2 / 3) * (jnp.exp(-d) if isinstance(d, Array) else np.exp(-d))
