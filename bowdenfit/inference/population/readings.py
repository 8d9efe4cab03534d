"""Inspections whose readings themselves stand in the density of a population, in place of what single fits say of them.

Single fits say little of where hardly any of their draws lie. Where the population puts an inspection there, a distribution
that was fitted to the draws is a guess, and the likelihood of the readings is not.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.inference.log_density import LogDensity


@dataclass(frozen=True, eq=False)
class JointReadings:
    """Inspections that one program serves; what else their fits drew, such as noise, is drawn with the population.

    Args:
        posterior: Of a single fit of them.
        names: Of its parameters those that are pooled, each with its place among the coefficients.
        rows: Which inspections they are, by number.
        data: Of each, what `posterior.data` is.
    """

    posterior: LogDensity
    names: Mapping[str, int]
    rows: tuple[int, ...]
    data: tuple[Any, ...]

    @property
    def others(self) -> tuple[int, ...]:
        """Places of the parameters that are not pooled, among all that are free."""
        return tuple(i for i, p in enumerate(self.posterior.model.space.free) if p.name not in self.names)

    @property
    def size(self) -> int:
        """Numbers that are drawn of all of them beside their coefficients."""
        return len(self.rows) * len(self.others)

    def stack(self, where: np.ndarray) -> dict[str, Any]:
        """Their data as one.

        Args:
            where: Number of the cable and place among its inspections, of every inspection.
        """
        stacked = jax.tree.map(lambda *leaves: np.stack(leaves), *self.data)
        return {"where": where[list(self.rows)], "counts": np.ones(len(self.rows)), "readings": stacked}

    def log_density(
        self,
        at: Float[Array, "cable inspection coefficient"],
        other_z: Float[Array, " size"],
        stacked: Mapping[str, Any],
    ) -> Float[Array, ""]:
        """Log likelihood of all readings, and log prior of what is not pooled, up to a constant.

        Args:
            at: Log coefficients at every inspection.
            rest: z of what is not pooled.
            given: See `given`.
        """
        here = at[stacked["where"][:, 0], stacked["where"][:, 1]]
        every = jax.vmap(self._log_density_of_one)(here, other_z.reshape(len(self.rows), -1), stacked["readings"])
        return jnp.sum(jnp.where(stacked["counts"] > 0, every, 0.0)) - jnp.sum(other_z**2) / 2

    def _log_density_of_one(
        self, logs: Float[Array, " coefficient"], other_z: Float[Array, " other"], data: Any
    ) -> Float[Array, ""]:
        free = self.posterior.model.space.free
        z = jnp.zeros(len(free)).at[np.array(self.others, dtype=int)].set(other_z)
        for i, p in enumerate(free):
            if p.name in self.names:
                z = z.at[i].set(p.prior.unconstrain(jnp.exp(logs[self.names[p.name]]) / p.shown_scale))
        total = sum((jnp.sum(term) for term in self.posterior.log_likelihoods(z, data).values()), jnp.zeros(()))
        return jnp.where(jnp.isnan(total), -jnp.inf, total)


def without_cables(stacked: Mapping[str, Any], cables: list[int]) -> dict[str, Any]:
    """Data of inspections without those of some cables.

    Args:
        given: See `JointReadings.given`.
        cables: By number.
    """
    return dict(stacked) | {"counts": stacked["counts"] * ~np.isin(stacked["where"][:, 0], cables)}
