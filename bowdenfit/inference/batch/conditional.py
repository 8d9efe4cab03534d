"""Coordinates in which friction coefficients follow whatever else is said: their conditional posterior made standard normal.

Readings are nearly linear in the coefficients. Where readings are few and scatter little, the coefficients that go with a wrap
angle and a scatter lie in a narrow ridge, so narrow that walkers hardly ever find from the wide end of the posterior into the
narrow one, and small scatters are drawn too seldom. In units of that ridge, about its middle, there is none.

References:
    Neal 2003, "Slice sampling" (Annals of Statistics 31), section 8, for such a funnel.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.log_density import LogDensity


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
    def _coefficients(self) -> list[Any]:
        return [self.posterior.model.space.free[i] for i in self.which]

    @cached_property
    def _rubbing(self) -> list[int]:
        """Positions of the terms whose residuals the coefficients enter at all."""
        terms, data = self.posterior.model.terms, self.posterior.data
        others = self.posterior.model.space.constrain(jnp.zeros(self.posterior.model.space.size))
        own = {p.name: others[p.name] for p in self._coefficients}

        def depends(term: Any, data: Any) -> bool:
            return _depends(lambda coefficients: term.residuals(others | coefficients, data), own)

        return [i for i, each in enumerate(zip(terms, data, strict=True)) if depends(*each)]

    @property
    def is_told(self) -> bool:
        """Whether readings say anything of coefficients."""
        return len(self.which) > 0 and len(self._rubbing) > 0

    def to_w(self, z: Array, data: Any) -> Array:
        """W of one z."""
        center, root = self._ridge(z, data)
        values = jnp.stack([p.prior.constrain(z[i]) for p, i in zip(self._coefficients, self.which, strict=True)])
        return z.at[self.which].set(root.T @ (values - center))

    def from_w(self, w: Array, data: Any) -> tuple[Array, Array]:
        """Z of one w, and log of the volume of a unit of w there; NaN where a coefficient cannot be what w says."""
        center, root = self._ridge(w, data)
        along = jax.scipy.linalg.solve_triangular(root, w[self.which], trans=1, lower=True)
        found = [
            jax.jvp(p.prior.unconstrain, (value,), (jnp.ones(()),))
            for p, value in zip(self._coefficients, center + along, strict=True)
        ]
        z, slopes = (jnp.stack(part) for part in zip(*found, strict=True))
        return w.at[self.which].set(z), jnp.sum(jnp.log(slopes)) - jnp.sum(jnp.log(jnp.diagonal(root)))

    def _ridge(self, z: Array, data: Any) -> tuple[Array, Array]:
        """Middle of the coefficients and lower triangular root of their precision, from all of z but themselves."""
        model = self.posterior.model
        low, middle, high = (
            jnp.stack([p.prior.constrain(jnp.asarray(at)) for p in self._coefficients]) for at in (-1.0, 0.0, 1.0)
        )
        precision = jnp.diag((2 / (high - low)) ** 2)
        others = model.space.constrain(z.at[self.which].set(0.0))

        def residuals(coefficients: Array) -> Array:
            values = others | {p.name: coefficients[i] for i, p in enumerate(self._coefficients)}
            return jnp.concatenate([model.terms[i].residuals(values, data[i]) for i in self._rubbing])

        now, change = jax.linearize(residuals, middle)
        slopes = jax.vmap(change)(jnp.eye(len(self.which)))
        told = slopes @ slopes.T + precision
        root = jnp.linalg.cholesky(told, symmetrize_input=False)
        center = middle - jax.scipy.linalg.cho_solve((root, True), slopes @ now)
        known = jnp.all(jnp.isfinite(root)) & jnp.all(jnp.isfinite(center))
        return jnp.where(known, center, middle), jnp.where(known, root, jnp.sqrt(precision))


def _depends(function: Callable[[Any], Array], argument: Any) -> bool:
    """Whether anything of an argument is used on the way to what a function gives."""
    traced = jax.make_jaxpr(function)(argument).jaxpr
    reached = set(traced.invars)
    for step in traced.eqns:
        if any(isinstance(var, type(traced.invars[0])) and var in reached for var in step.invars):
            reached |= set(step.outvars)
    return any(var in reached for var in traced.outvars if isinstance(var, type(traced.invars[0])))
