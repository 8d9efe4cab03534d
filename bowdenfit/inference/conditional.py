"""Coordinates in which friction coefficients follow whatever else is said: their conditional posterior made standard normal.

Readings are nearly linear in the coefficients. Where readings are few and scatter little, the coefficients that go with a wrap
angle and a scatter lie in a narrow ridge, so narrow that walkers hardly ever find from the wide end of the posterior into the
narrow one, and small scatters are drawn too seldom. In units of that ridge, about its middle, there is none.

References:
    Neal 2003, "Slice sampling" (Annals of Statistics 31), section 8, for such a funnel.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.linalg import cho_solve, solve_triangular

from bowdenfit.inference.log_density import LogDensity
from bowdenfit.parameters.space import ParameterSpace

_SPARE_READINGS = 4  # readings more than coefficients


@dataclass(frozen=True)
class Conditional:
    """Friction coefficients of one model given everything else.

    Args:
        posterior: Its posterior.
    """

    posterior: LogDensity

    @cached_property
    def indices(self) -> np.ndarray:
        """Positions of the coefficients."""
        return np.flatnonzero([p.role == "friction" for p in self.posterior.model.space.free])

    @cached_property
    def _coefficients(self) -> ParameterSpace:
        return ParameterSpace(tuple(self.posterior.model.space.free[i] for i in self.indices))

    @property
    def has_coefficients(self) -> bool:
        """Whether any coefficient is free."""
        return len(self.indices) > 0

    @property
    def is_narrow(self) -> bool:
        """Whether the ridge may be so narrow somewhere that walkers hardly find there without these coordinates.

        It may where few readings tell a scatter, and where a coefficient goes with an angle of which only a guess is known. By
        simulated funnels whose scatter has a known density: with two readings more than coefficients, walkers without these
        coordinates put 0.5 to 1 of 100 draws below its 1 % quantile; with three 0.85 to 1.1; with four and more 0.9 to 1.1,
        which is chance. Readings that are alike to the last digit count once: of a scatter that may be none they tell nothing.
        """
        model = self.posterior.model
        varying = [varying for term in model.terms for _, varying in term.residual_blocks if varying]
        distinct = [len(np.unique(term.observed())) for term in model.terms]
        informative = min(varying + distinct, default=0)
        return any(p.role == "angle" for p in model.space.free) or informative < len(self.indices) + _SPARE_READINGS

    def map_point(self, point: Array, is_z: Array, data: Any) -> tuple[Array, Array, Array]:
        """W and z, and log of the volume in z of a unit of w there, of one of the two; NaN where w has no z.

        Args:
            given: One z or one w.
            is_z: Whether it is z.
            data: Of the posterior.
        """
        ridge, own = self._ridge(point, data), point[self.indices]
        z = jnp.where(is_z, own, self._to_z(own, ridge))
        w = jnp.where(is_z, self._to_w(own, ridge), own)
        return point.at[self.indices].set(w), point.at[self.indices].set(z), -self._log_volume(z, ridge)

    def _to_w(self, z: Array, ridge: "_Ridge") -> Array:
        return ridge.root.T @ (self._coefficients.vector(z) - ridge.center)

    def _to_z(self, w: Array, ridge: "_Ridge") -> Array:
        return self._coefficients.z_of(ridge.center + solve_triangular(ridge.root, w, trans="T", lower=True))

    def _log_volume(self, z: Array, ridge: "_Ridge") -> Array:
        """Log of the volume in w of a unit of the coefficients' z."""
        _, slopes = jax.jvp(self._coefficients.vector, (z,), (jnp.ones_like(z),))
        return jnp.sum(jnp.log(slopes)) + jnp.sum(jnp.log(jnp.diagonal(ridge.root)))

    def _ridge(self, z: Array, data: Any) -> "_Ridge":
        """The ridge where everything but the coefficients says; that of the priors where it cannot be computed."""
        own = self._coefficients
        low, middle, high = jax.vmap(own.vector)(jnp.tile(jnp.array([[-1.0], [0.0], [1.0]]), own.size))
        width = 2 / (high - low)
        others = self.posterior.values(z.at[self.indices].set(0.0), data)

        def residuals(coefficients: Array) -> Array:
            values = others | {p.name: coefficients[i] for i, p in enumerate(own.free)}
            return jnp.concatenate(list(self.posterior.residuals_at(values, data).values()))

        slopes = jax.jacfwd(residuals)(middle)
        root = jnp.linalg.cholesky(slopes.T @ slopes + jnp.diag(width**2))
        center = middle - cho_solve((root, True), slopes.T @ residuals(middle))
        known = jnp.all(jnp.isfinite(root)) & jnp.all(jnp.isfinite(center))
        return _Ridge(jnp.where(known, center, middle), jnp.where(known, root, jnp.diag(width)))


class _Ridge(NamedTuple):
    """Middle of the coefficients, and the lower Cholesky factor of their precision."""

    center: Array
    root: Array
