"""What an inspection contributes to a population: a multivariate t fitted to the draws of its fit, or its readings themselves.

`Summaries` approximate the likelihood of log coefficients. Scatter between mountings that is known from few of them makes the
draws of single fits heavy-tailed; a normal distribution of the same covariance would give their center too little weight and
their tails too much.

`JointReadings` put the likelihood of the readings themselves into the density of the population. They are for inspections that
the population moves to where their own fit has hardly any draws, so that a distribution fitted to the draws would be a guess.

References:
    Lange, Little and Taylor 1989, "Robust statistical modeling using the t distribution" (Journal of the American
    Statistical Association 84); Liu and Rubin 1995, "ML estimation of the t distribution using EM" (Statistica Sinica 5).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float
from scipy.special import gammaln

from bowdenfit.inference.log_density import LogDensity

_LEAST_FREEDOM, _MOST_FREEDOM = 1.5, 200.0  # limits of the degrees of freedom
# Factors that degrees of freedom are tried with in each round. Small ones are among them: scale and freedom are found in turn,
# and steps of a quarter end a quarter too high, with tails that are too light.
_STEPS = (0.5, 0.8, 0.95, 0.99, 1.0, 1.01, 1.05, 1.25, 2.0)
_ROUNDS = 40  # of expectation and maximization
_CLIPPED = 0.999  # quantile of the weights at which they are clipped


@dataclass(frozen=True)
class Summaries:
    """Multivariate t distributions, one for each inspection.

    Args:
        center: Centers of the log coefficients, (inspection, coefficient).
        scale: Scale matrices, (inspection, coefficient, coefficient).
        freedom: Degrees of freedom, (inspection,).
    """

    center: np.ndarray
    scale: np.ndarray
    freedom: np.ndarray

    def log_density(self, values: np.ndarray) -> np.ndarray:
        """Return log densities (inspection, draw) of log coefficients.

        Args:
            values: Log coefficients, (inspection, draw, coefficient).
        """
        return _log_t(_distances(values, self.center, self.scale), self.scale, self.freedom)


def summarize_likelihoods(values: np.ndarray, prior_mean: np.ndarray, prior_sd: np.ndarray) -> Summaries:
    """Fit the likelihood of log coefficients to draws, by maximum likelihood, with the prior of the draws removed.

    Args:
        values: Draws of log coefficients of equal weight, (inspection, draw, coefficient).
        prior_mean, prior_sd: Prior of the log coefficients in the single fits, (coefficient,); an infinite standard deviation
            where it was flat.
    """
    weights = _remove_prior(values, prior_mean, prior_sd)
    dimensions = values.shape[2]
    center = np.median(values, axis=1)
    scale, freedom = _covariances(values, center, weights), np.full(len(values), 5.0)
    for _ in range(_ROUNDS):
        distances = _distances(values, center, scale)
        pull = weights * (freedom[:, None] + dimensions) / (freedom[:, None] + distances)
        center = np.einsum("js,jsk->jk", pull, values) / pull.sum(axis=1)[:, None]
        scale = _covariances(values, center, pull)
        distances = _distances(values, center, scale)
        tried = np.clip(np.multiply.outer(_STEPS, freedom), _LEAST_FREEDOM, _MOST_FREEDOM)
        fits = [np.sum(weights * _log_t(distances, scale, nu), axis=1) for nu in tried]
        freedom = np.take_along_axis(tried, np.argmax(fits, axis=0)[None], axis=0)[0]
    return Summaries(center, scale, freedom)


def _remove_prior(values: np.ndarray, mean: np.ndarray, sd: np.ndarray) -> np.ndarray:
    """Return weights under which draws are those of a flat prior; they sum to 1, (inspection, draw)."""
    log = np.sum(((values - mean) / sd) ** 2, axis=2) / 2
    weights = np.exp(log - log.max(axis=1, keepdims=True))
    weights = np.minimum(weights, np.quantile(weights, _CLIPPED, axis=1)[:, None])
    return weights / weights.sum(axis=1, keepdims=True)


def _covariances(values: np.ndarray, center: np.ndarray, weights: np.ndarray) -> np.ndarray:
    away = values - center[:, None]
    covariances = np.einsum("js,jsk,jsl->jkl", weights, away, away, optimize=True)
    tiny = np.finfo(float).eps * (1 + np.trace(covariances, axis1=1, axis2=2))
    return covariances + tiny[:, None, None] * np.eye(values.shape[2])


def _distances(values: np.ndarray, center: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Return squared Mahalanobis distances, (inspection, draw)."""
    away = np.linalg.solve(np.linalg.cholesky(scale), (values - center[:, None]).transpose(0, 2, 1))
    return np.sum(away**2, axis=1)


def _log_t(distances: np.ndarray, scale: np.ndarray, freedom: np.ndarray) -> np.ndarray:
    dimensions, nu = scale.shape[-1], freedom[:, None]
    constant = gammaln((nu + dimensions) / 2) - gammaln(nu / 2) - dimensions / 2 * np.log(nu * np.pi)
    return constant - np.linalg.slogdet(scale)[1][:, None] / 2 - (nu + dimensions) / 2 * np.log1p(distances / nu)


@dataclass(frozen=True, eq=False)
class JointReadings:
    """Inspections of one shape whose readings enter the density; their other parameters are sampled with the population.

    Args:
        posterior: Posterior of a single fit of them.
        names: Names of its pooled parameters, with their positions among the coefficients.
        rows: Numbers of these inspections.
        data: `posterior.data` of each.
    """

    posterior: LogDensity
    names: Mapping[str, int]
    rows: tuple[int, ...]
    data: tuple[Any, ...]

    @property
    def others(self) -> tuple[int, ...]:
        """Positions of the parameters that are not pooled, among the free ones."""
        return tuple(i for i, p in enumerate(self.posterior.model.space.free) if p.name not in self.names)

    @property
    def size(self) -> int:
        """Number of sampled parameters of all of them, beside their coefficients."""
        return len(self.rows) * len(self.others)

    def stack(self, positions: np.ndarray) -> dict[str, Any]:
        """Return their data, stacked.

        Args:
            positions: Number of the cable, and position among its inspections, of every inspection.
        """
        stacked = jax.tree.map(lambda *leaves: np.stack(leaves), *self.data)
        return {"where": positions[list(self.rows)], "counts": np.ones(len(self.rows)), "readings": stacked}

    def log_density(
        self,
        at: Float[Array, "cable inspection coefficient"],
        other_z: Float[Array, " size"],
        stacked: Mapping[str, Any],
    ) -> Float[Array, ""]:
        """Return the log likelihood of all readings plus the log prior of other parameters, up to a constant.

        Args:
            at: Log coefficients at every inspection.
            other_z: z of the parameters that are not pooled.
            stacked: See `stack`.
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
    """Remove some cables from stacked data of inspections.

    Args:
        stacked: See `JointReadings.stack`.
        cables: Numbers of the cables.
    """
    return dict(stacked) | {"counts": stacked["counts"] * ~np.isin(stacked["where"][:, 0], cables)}
