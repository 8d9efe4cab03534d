"""Coordinates in which friction coefficients follow whatever else is said: their conditional posterior made standard normal.

Readings are nearly linear in the coefficients. Where readings are few and scatter little, the coefficients that go with a wrap
angle and a scatter lie in a narrow ridge, so narrow that walkers hardly ever find from the wide end of the posterior into the
narrow one, and small scatters are drawn too seldom. In units of that ridge, about its middle, there is none.

References:
    Neal 2003, "Slice sampling" (Annals of Statistics 31), section 8, for such a funnel.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.log_density import LogDensity
from bowdenfit.parameters.places import put, taken
from bowdenfit.parameters.space import ParameterSpace

_TELL_A_SCATTER = 4  # readings more than coefficients


@dataclass(frozen=True)
class Conditional:
    """Friction coefficients of one model given everything else.

    Args:
        posterior: Its posterior.
    """

    posterior: LogDensity

    @cached_property
    def which(self) -> np.ndarray:
        """Positions of the coefficients."""
        return np.flatnonzero([p.role == "friction" for p in self.posterior.model.space.free])

    @cached_property
    def _coefficients(self) -> ParameterSpace:
        return ParameterSpace(tuple(self.posterior.model.space.free[i] for i in self.which))

    @cached_property
    def _rubbing(self) -> list[int]:
        """Positions of the terms whose residuals the coefficients enter at all."""
        space, own = self.posterior.model.space, self._coefficients
        free, coefficients = (jax.ShapeDtypeStruct((each.size,), jnp.float64) for each in (space, own))

        def depends(term: Any, data: Any) -> bool:
            def residuals(coefficients: Array, z: Array) -> Array:
                return term.residuals(self.posterior.values(z, every) | own.constrain(coefficients), data)

            return _depends(residuals, coefficients, free)

        every = self.posterior.data
        terms = enumerate(zip(self.posterior.model.terms, every, strict=False))
        return [i for i, each in terms if depends(*each)]

    @property
    def is_told(self) -> bool:
        """Whether readings say anything of coefficients."""
        return len(self.which) > 0 and len(self._rubbing) > 0

    @property
    def is_narrow(self) -> bool:
        """Whether the ridge may be so narrow somewhere that walkers hardly find there without these coordinates.

        It may where few readings tell a scatter, and where a coefficient goes with an angle of which only a guess is known. By
        simulated funnels whose scatter has a known density: with two readings more than coefficients, walkers without these
        coordinates put 0.5 to 1 of 100 draws below its 1 % quantile; with three 0.85 to 1.1; with four and more 0.9 to 1.1,
        which is chance. Readings that are alike to the last digit count once: of a scatter that may be none they tell nothing.
        """
        model = self.posterior.model
        each = [varying for term in model.terms for _, varying in term.residual_blocks if varying]
        unlike = [len(np.unique(term.observed())) for term in model.terms]
        tell = min(each + unlike, default=0)
        return any(p.role == "angle" for p in model.space.free) or tell < len(self.which) + _TELL_A_SCATTER

    def at(self, given: Array, is_z: Array, data: Any) -> tuple[Array, Array, Array]:
        """W and z, and log of the volume in z of a unit of w there, of one of the two; NaN where w has no z.

        Args:
            given: One z or one w.
            is_z: Whether it is z.
            data: Of the posterior.
        """
        ridge, own = self._ridge(given, data), taken(given, self.which)
        z = jnp.where(is_z, own, self._back(own, ridge))
        w = jnp.where(is_z, self._along(own, ridge), own)
        return put(given, self.which, w), put(given, self.which, z), -self._log_volume(z, ridge)

    def _along(self, z: Array, ridge: "_Ridge") -> Array:
        return ridge.root.T @ (self._coefficients.vector(z) - ridge.center)

    def _back(self, w: Array, ridge: "_Ridge") -> Array:
        return self._coefficients.z_of(ridge.center + ridge.inverse.T @ w)

    def _log_volume(self, z: Array, ridge: "_Ridge") -> Array:
        """Log of the volume in w of a unit of the coefficients' z."""
        _, slopes = jax.jvp(self._coefficients.vector, (z,), (jnp.ones_like(z),))
        return jnp.sum(jnp.log(slopes)) + jnp.sum(jnp.log(jnp.diagonal(ridge.root)))

    def _ridge(self, z: Array, data: Any) -> "_Ridge":
        """The ridge where everything but the coefficients says."""
        model, own = self.posterior.model, self._coefficients
        low, middle, high = jax.vmap(own.vector)(jnp.tile(jnp.array([[-1.0], [0.0], [1.0]]), own.size))
        precision = (2 / (high - low)) ** 2
        others = self.posterior.values(put(z, self.which, jnp.zeros(own.size)), data)

        def residuals(coefficients: Array) -> Array:
            values = others | {p.name: coefficients[i] for i, p in enumerate(own.free)}
            return jnp.concatenate([model.terms[i].residuals(values, data[i]) for i in self._rubbing])

        now, change = jax.linearize(residuals, middle)
        slopes = jax.vmap(change)(jnp.eye(own.size))
        root, inverse = _root_and_inverse(slopes @ slopes.T + jnp.diag(precision))
        center = middle - inverse.T @ (inverse @ (slopes @ now))
        known, width = jnp.all(jnp.isfinite(inverse)) & jnp.all(jnp.isfinite(center)), jnp.sqrt(precision)
        prior = _Ridge(middle, jnp.diag(width), jnp.diag(1 / width))
        return jax.tree.map(partial(jnp.where, known), _Ridge(center, root, inverse), prior)


class _Ridge(NamedTuple):
    """Middle of the coefficients, lower triangular root of their precision, and its inverse."""

    center: Array
    root: Array
    inverse: Array


def _root_and_inverse(matrix: Array) -> tuple[Array, Array]:
    """Lower triangular root of a small matrix, and its inverse; NaN where it has none.

    Number by number: for many matrices at once that takes half of the time of LAPACK, which takes them one by one.
    """
    size, nothing = len(matrix), jnp.zeros(())
    root, inverse = ([[nothing] * size for _ in range(size)] for _ in range(2))
    for i in range(size):
        for j in range(i + 1):
            rest = matrix[i, j] - sum((root[i][k] * root[j][k] for k in range(j)), start=nothing)
            root[i][j] = jnp.sqrt(rest) if i == j else rest / root[j][j]
        inverse[i][i] = 1 / root[i][i]
        for j in range(i):
            inverse[i][j] = -inverse[i][i] * sum((root[i][k] * inverse[k][j] for k in range(j, i)), start=nothing)
    return jnp.array(root), jnp.array(inverse)


def _depends(function: Callable[..., Array], *arguments: Any) -> bool:
    """Whether anything of the first argument is used on the way to what a function gives."""
    traced = jax.make_jaxpr(function)(*arguments).jaxpr
    reached = {traced.invars[0]}
    for step in traced.eqns:
        if any(isinstance(var, type(traced.invars[0])) and var in reached for var in step.invars):
            reached |= set(step.outvars)
    return any(var in reached for var in traced.outvars if isinstance(var, type(traced.invars[0])))
