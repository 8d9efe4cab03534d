"""The posterior density of a model in the coordinates z, where every prior is a standard normal."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from bowdenfit.models import Model


@dataclass(frozen=True)
class LogDensity:
    """Log density and residuals of one model, used by least squares and every sampler.

    Data are arguments of its functions, not constants inside them, so that other data of the same shape need no new
    compilation. Needs 64-bit floats: `jax.enable_x64(True)`.

    Args:
        model: The model.
        data_override: Data of all terms in place of the model's own, of the same shapes.
    """

    model: Model
    data_override: Any = None

    def __post_init__(self) -> None:
        if jax.dtypes.canonicalize_dtype(float) != jnp.float64:
            raise RuntimeError(
                "bowdenfit computes with 64-bit floats, but JAX is set to 32; the usual cause is calling its inner "
                "functions directly: wrap the call in `with jax.enable_x64(True):`, or use bowdenfit.fit, which does."
            )

    @cached_property
    def data(self) -> tuple[Any, ...]:
        """Data of all terms, in their order."""
        return tuple(term.data for term in self.model.terms) if self.data_override is None else self.data_override

    @cached_property
    def padded(self) -> tuple[Any, ...]:
        """Data padded to shapes that hardly depend on the number of readings, so that one program serves many tables.

        The log density is the same to rounding; single readings and residuals stand at other positions.
        """
        return tuple(getattr(term, "padded", term.data) for term in self.model.terms)

    @cached_property
    def with_spare_rows(self) -> tuple[Any, ...]:
        """Padded data with room for more mountings, so that one program serves a table that grows.

        The log density is the same to rounding: copies of readings fill the room, and do not count.
        """
        return tuple(getattr(term, "with_spare_rows", data) for term, data in zip(self.model.terms, self.padded, strict=True))

    def values(self, z: Float[Array, " free"], data: Any) -> dict[str, Array]:
        """Return named values of all parameters [internal units] at z; a subclass may scale them by `data`."""
        del data
        return self.model.space.constrain(z)

    def log_likelihoods(self, z: Float[Array, " free"], data: Any) -> dict[str, Array]:
        """Return the log likelihood of every reading, by term."""
        values = self.values(z, data)
        return {t.name: t.log_likelihood(values, d) for t, d in zip(self.model.terms, data, strict=False)}

    def log_density(self, z: Float[Array, " free"], data: Any) -> Float[Array, ""]:
        """Return the log posterior density in z, up to the evidence; minus infinity where it cannot be computed."""
        log_prior = -0.5 * jnp.sum(z**2 + jnp.log(2 * jnp.pi))
        likelihoods = zip(self.log_likelihoods(z, data).values(), data, strict=False)
        total = log_prior + sum(jnp.sum(_counted(likelihood, term)) for likelihood, term in likelihoods)
        return jnp.where(jnp.isnan(total), -jnp.inf, total)

    def residuals(self, z: Float[Array, " free"], data: Any) -> dict[str, Array]:
        """Return standardized residuals by term; half their sum of squares is minus log likelihood, up to a constant."""
        return self.residuals_at(self.values(z, data), data)

    def residuals_at(self, values: Mapping[str, Array], data: Any) -> dict[str, Array]:
        """Return standardized residuals by term at named values of all parameters [internal units]."""
        return {t.name: t.residuals(values, d) for t, d in zip(self.model.terms, data, strict=False)}


def _counted(likelihood: Array, data: Any) -> Array:
    """Return the log likelihoods of a term's readings, 0 of those that do not count."""
    counts = getattr(data, "counts", None)
    return likelihood if counts is None else jnp.where(counts, likelihood, 0.0)
