r"""Hierarchical model of a population of cables that wear, from the likelihoods of single inspections.

Log coefficients of cable i at its inspection j, after c cycles, lubricated (l = 1) or not, at temperature T:

.. math:: \theta_{ijk} = a_{ik} + b_i \frac{c_{ij}}{c_{ref}} + \gamma l_{ij} + \alpha (T_{ij} - T_0), \qquad
          a_{ik} \sim \mathrm{Normal}(m_k, s_k), \quad b_i \sim \mathrm{Normal}(m_b, s_b)

Every inspection keeps its own scatter and noise, which single fits have integrated out. Cables are sampled in coordinates in
which each is nearly standard normal given its population, however informative its data are, so that there is no funnel.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.linalg import solve_triangular
from jaxtyping import Float

from bowdenfit.addons.fleet.population.likelihoods import JointReadings, Summaries
from bowdenfit.parameters.priors import HalfNormal, Normal, Prior

SPREAD, WEAR, WEAR_SPREAD = HalfNormal(0.5), Normal(0.0, 1.0), HalfNormal(0.3)
LUBRICATION, PER_DEGREE = Normal(0.0, 1.0), Normal(0.0, 0.05)
REFERENCE_TEMPERATURE = 20.0  # degC


@dataclass(frozen=True)
class Inspections:
    """Data of all inspections, in rows.

    Args:
        cable: Number of the cable of each inspection, from 0.
        cycles: Cycles over the reference; None where wear cannot be estimated.
        effects: Covariates by name, one value for each inspection: 1 after lubrication, and degrees above the reference.
        known: Whether an inspection has a coefficient, (inspection, coefficient).
        summaries: Likelihoods of their log coefficients.
        prior_mean, prior_sd: Prior of the mean log coefficients of the population, (coefficient,).
    """

    cable: np.ndarray
    cycles: np.ndarray | None
    effects: dict[str, np.ndarray]
    known: np.ndarray
    summaries: Summaries
    prior_mean: np.ndarray
    prior_sd: np.ndarray

    @property
    def cables(self) -> int:
        """Number of cables."""
        return int(self.cable.max()) + 1

    @property
    def coefficients(self) -> int:
        """Number of coefficients."""
        return int(self.known.shape[1])

    @cached_property
    def positions(self) -> np.ndarray:
        """Number of the cable, and position among its inspections, of every inspection, (inspection, 2)."""
        return np.array([(i, np.sum(self.cable[:j] == i)) for j, i in enumerate(self.cable)])

    @cached_property
    def data(self) -> dict[str, Any]:
        """Arrays from which the density is computed, (cable, inspection, ...)."""
        position = self.positions[:, 1]
        shape = self.cables, int(position.max()) + 1

        def spread(values: np.ndarray, empty: float = 0.0) -> np.ndarray:
            arranged = np.full((*shape, *values.shape[1:]), empty)
            arranged[self.cable, position] = values
            return arranged

        s, counts = self.summaries, self.known.sum(axis=1)
        root = whitening_roots(s.scale, self.known)
        information = np.einsum("jab,jac->jbc", root, root) * ((s.freedom + counts) / (s.freedom + counts + 2))[:, None, None]
        design = self.design
        moved = np.einsum("jkd,jkl,jle->jde", design, information, design)
        toward = np.einsum("jkd,jkl,jl->jd", design, information, s.center)
        ones = np.ones(self.coefficients)
        columns = np.stack([*self.effects.values(), np.zeros(len(counts))], axis=1)  # so that there is one at the least
        by_effect = np.einsum("jkd,jkl,l,je->jde", design, information, ones, columns)
        return {
            "center": spread(s.center), "root": spread(root), "freedom": spread(s.freedom, 1.0), "counts": spread(counts * 1.0),
            "effects": spread(columns), "cycles": spread(design[:, 0, -1]),
            "precision": spread(moved).sum(axis=1), "toward": spread(toward).sum(axis=1),
            "by_effect": spread(by_effect).sum(axis=1), "prior_mean": self.prior_mean, "prior_sd": self.prior_sd,
        }  # fmt: skip

    def data_with(self, readings: Sequence[JointReadings]) -> dict[str, Any]:
        """Return the data with readings of some inspections in place of their summaries; coordinates stay the same.

        Coordinates stay those that single fits suggest.
        """
        root = self.data["root"].copy()
        for part in readings:
            root[tuple(self.positions[list(part.rows)].T)] = 0.0
        return self.data | {"root": root, "readings": tuple(part.stack(self.positions) for part in readings)}

    @property
    def design(self) -> np.ndarray:
        """Derivatives of log coefficients by those of the new cable and its wear, (inspection, coefficient, ...)."""
        coefficients = np.broadcast_to(np.eye(self.coefficients), (len(self.cable), self.coefficients, self.coefficients))
        if self.cycles is None:
            return coefficients
        worn = np.broadcast_to(self.cycles[:, None, None], (len(self.cable), self.coefficients, 1))
        return np.concatenate([coefficients, worn], axis=2)


def whitening_roots(scale: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return matrices W with |W x|^2 = x' scale^-1 x over known coefficients, (inspection, row, coefficient).

    Args:
        scale: Scale matrices, (inspection, coefficient, coefficient).
        known: Whether an inspection has a coefficient, (inspection, coefficient).
    """
    roots = np.zeros_like(scale)
    for j, known_here in enumerate(known):
        inside = np.ix_(known_here, known_here)
        roots[j][inside] = np.linalg.inv(np.linalg.cholesky(scale[j][inside]))
    return roots


@dataclass(frozen=True)
class PopulationDensity:
    """Log density of a population and its cables in coordinates z.

    Args:
        coefficients: Number of coefficients.
        wears: Whether wear is estimated.
        effects: Names of the other covariates.
        cables: Number of cables.
        readings: Inspections whose readings themselves enter.
    """

    coefficients: int
    wears: bool
    effects: tuple[str, ...]
    cables: int
    readings: tuple[JointReadings, ...] = ()

    @property
    def numbers_per_cable(self) -> int:
        """Number of parameters of a cable: its log coefficients when new, and its wear."""
        return self.coefficients + self.wears

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the population's parameters, in the order of z."""
        k = range(self.coefficients)
        wear = ("wear", "wear_spread") if self.wears else ()
        return (*(f"mean_{i}" for i in k), *(f"spread_{i}" for i in k), *wear, *self.effects)

    def describe_parameters(self, coefficient_names: Sequence[str]) -> tuple[str, ...]:
        """Describe the population's parameters in words, in the order of z.

        Args:
            coefficient_names: Names of the coefficients; numbered from 1 where empty.
        """
        every = coefficient_names or [f"coefficient {i + 1}" for i in range(self.coefficients)]
        wear = ("the wear", "the difference in wear between cables") if self.wears else ()
        effects = {"lubrication": "the effect of lubrication", "per_degree": "the effect of temperature"}
        middles, spreads = ([f"{what} of {name}" for name in every] for what in ("the typical value", "the spread"))
        return (*middles, *spreads, *wear, *(effects[name] for name in self.effects))

    @property
    def _fleet_size(self) -> int:
        """Number of parameters of the population and of all cables, which come first in z."""
        return len(self.names) + self.cables * self.numbers_per_cable

    @property
    def size(self) -> int:
        """Length of z."""
        return self._fleet_size + sum(part.size for part in self.readings)

    def population_at(self, z: Float[Array, " size"], data: dict[str, Any]) -> dict[str, Array]:
        """Return means, spreads (parameter of a cable,) and effects (effect,) of the population."""
        k = self.coefficients
        mean = data["prior_mean"] + data["prior_sd"] * z[:k]
        spread, remaining = SPREAD.constrain(z[k : 2 * k]), z[2 * k :]
        if self.wears:
            mean = jnp.append(mean, WEAR.constrain(remaining[0]))
            spread, remaining = jnp.append(spread, WEAR_SPREAD.constrain(remaining[1])), remaining[2:]
        priors: dict[str, Prior] = {"lubrication": LUBRICATION, "per_degree": PER_DEGREE}
        effects = [priors[name].constrain(remaining[i]) for i, name in enumerate(self.effects)]
        return {"mean": mean, "spread": spread, "effects": jnp.stack([*effects, jnp.zeros(())])}

    def cables_at(
        self, z: Float[Array, " size"], data: dict[str, Any], population: dict[str, Array]
    ) -> tuple[Float[Array, "cable each"], Float[Array, " cable"]]:
        """Return log coefficients when new and wear of every cable, and the log volume of the map from z."""
        inner = z[len(self.names) : self._fleet_size].reshape(self.cables, self.numbers_per_cable)
        weight = population["spread"] ** -2
        toward = data["toward"] - data["by_effect"] @ population["effects"] + weight * population["mean"]
        root = jnp.linalg.cholesky(data["precision"] + jnp.diag(weight))
        forward = solve_triangular(root, toward[..., None], lower=True)
        values = solve_triangular(root, forward + inner[..., None], trans="T", lower=True)[..., 0]
        return values, -jnp.sum(jnp.log(jnp.diagonal(root, axis1=1, axis2=2)), axis=1)

    def log_density(self, z: Float[Array, " size"], data: dict[str, Any]) -> Float[Array, ""]:
        """Return the log posterior density in z, up to a constant."""
        population = self.population_at(z, data)
        values, volume = self.cables_at(z, data, population)
        away = (values - population["mean"]) / population["spread"]
        of_cables = jnp.sum(volume) - jnp.sum(away**2) / 2 - self.cables * jnp.sum(jnp.log(population["spread"]))
        before = -jnp.sum(z[: len(self.names)] ** 2) / 2
        at, begin = self.log_coefficients(values, population, data), self._fleet_size
        total = before + of_cables + jnp.sum(log_likelihood(at, data))
        for part, stacked in zip(self.readings, data.get("readings", ()), strict=True):
            total = total + part.log_density(at, z[begin : begin + part.size], stacked)
            begin += part.size
        return total

    def log_coefficients(
        self, values: Float[Array, "cable each"], population: dict[str, Array], data: dict[str, Any]
    ) -> Float[Array, "cable inspection coefficient"]:
        """Return log coefficients at every inspection."""
        k = self.coefficients
        shift = data["effects"] @ population["effects"]
        if self.wears:
            shift = shift + data["cycles"] * values[:, k:]
        return values[:, None, :k] + shift[:, :, None]


def log_likelihood(
    at: Float[Array, "cable inspection coefficient"], data: dict[str, Any]
) -> Float[Array, "cable inspection"]:
    """Return the log likelihood of log coefficients at every inspection, up to a constant; 0 where there is no inspection."""
    away = jnp.einsum("ijkl,ijl->ijk", data["root"], at - data["center"])
    return -(data["freedom"] + data["counts"]) / 2 * jnp.log1p(jnp.sum(away**2, axis=2) / data["freedom"])
