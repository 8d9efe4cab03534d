"""A fleet in one density, every reading of every cable with its population: the check on draws that are pooled afterwards.

Population, priors and coordinates are written out here, and NumPyro samples: nothing is shared with `bowdenfit pool` but what
its draws came from, the likelihood of one inspection's readings.
"""

from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from numpyro.infer import MCMC, NUTS

from bowdenfit.addons.fleet.inspections import read_cases, read_inspections
from bowdenfit.addons.fleet.population.sampling import PopulationDraws

SPREAD, WEAR, WEAR_SPREAD, OIL, DEGREE = 0.5, 1.0, 0.3, 1.0, 0.05  # scales of the priors, as the model is written down
WARM_UP, CHAINS = 400, 4


@dataclass(frozen=True)
class Joint:
    """Draws of population and cables, (chain, draw, ...).

    Args:
        mean, spread: Of log coefficients and, last, of wear.
        effects: Of lubrication and of a degree, each only if it was not always the same.
        cables: Log coefficients of each cable when new, and its wear.
        divergent: How many trajectories were.
    """

    mean: np.ndarray
    spread: np.ndarray
    effects: np.ndarray
    cables: np.ndarray
    divergent: int

    @property
    def population(self) -> np.ndarray:
        """Numbers of the population, (chain, draw, number)."""
        return np.concatenate([self.mean, self.spread, self.effects], axis=2)


@dataclass(frozen=True)
class Straight:
    """A straight map from numbers of mean 0 and covariance 1.

    Args:
        center: Mean of what it gives, (number,).
        root: Of its covariance, (number, number).
        away: Draws of what it gives, less their mean, (draw, number).
    """

    center: np.ndarray
    root: np.ndarray
    away: np.ndarray

    @classmethod
    def through(cls, draws: np.ndarray) -> "Straight":
        """That which gives draws their mean and covariance, (draw, number)."""
        away = draws - draws.mean(axis=0)
        return cls(draws.mean(axis=0), np.linalg.cholesky(away.T @ away / len(away)), away)


def joint_draws(
    folder: Path, labels: tuple[str, ...], names: tuple[str, ...], about: PopulationDraws, draws: int, seed: int
) -> Joint:
    """Draws of population and cables by NUTS on all readings at once; scatter and noise of each inspection are drawn too.

    Steps are taken in units in which population and cables are about uncorrelated and of unit size, if they are where they are
    thought to be: a straight map with constants changes no density, wherever it puts them. Effects shift all cables together,
    and of a hundred cables in units of their own every trajectory took 1023 steps; so it takes 31.

    Args:
        folder: Of the fleet's measurements; every inspection says its cycles, temperature and lubrication.
        labels: Of its inspections, those of a cable together.
        names: Of the coefficients.
        about: Where population and cables are thought to be.
        draws: Of each of four chains.
        seed: Random seed.
    """
    read = {case.inspection.label: case for case in read_cases(folder, read_inspections(folder), {})}
    cases = [read[label] for label in labels]
    posterior, inspections = cases[0].shaped.posterior, [case.inspection for case in cases]
    free = posterior.model.space.free
    places = np.array([[p.name for p in free].index(name) for name in names])
    remaining = np.setdiff1d(np.arange(len(free)), places)
    median = np.log([float(free[i].prior.median) for i in places])
    sd = np.array([float(free[i].prior.log_sd) for i in places])
    cables = list(dict.fromkeys(inspection.cable for inspection in inspections))
    cable = np.array([cables.index(inspection.cable) for inspection in inspections])
    cycles = np.array([inspection.cycles for inspection in inspections])
    circumstances = np.array([[float(inspection.lubricated), inspection.temperature - 20.0] for inspection in inspections])
    varies = np.ptp(circumstances, axis=0) > 0
    circumstances, of_effects = circumstances[:, varies], np.array([OIL, DEGREE])[varies]
    readings = jax.tree.map(lambda *leaves: jnp.stack(leaves), *(case.shaped.data for case in cases))
    worn, n, k = cycles / cycles.max(), len(cables), len(names)
    of_all = Straight.through(np.concatenate([about.mean, np.log(about.spread), about.effects], axis=1))
    with_all = np.linalg.lstsq(of_all.away, about.cables.reshape(len(about.cables), -1), rcond=None)[0].reshape(-1, n, k + 1)
    of_cables = [Straight.through(about.cables[:, i] - of_all.away @ with_all[:, i]) for i in range(n)]
    center, root = (np.stack([getattr(item, name) for item in of_cables]) for name in ("center", "root"))

    def values_of(z):
        """Population and cables."""
        population = of_all.center + of_all.root @ z["population"]
        cables = center + jnp.einsum("iab,ib->ia", root, z["cables"])
        cables += jnp.einsum("pia,p->ia", with_all, population - of_all.center)
        return population[: k + 1], jnp.exp(population[k + 1 : 2 * k + 2]), population[2 * k + 2 :], cables

    def minus_log_density(z):
        mean, spread, effects, cables = values_of(z)
        minus = jnp.sum(((mean[:k] - median) / sd) ** 2) / 2 + (mean[k] / WEAR) ** 2 / 2
        scales = jnp.array([SPREAD] * k + [WEAR_SPREAD])
        minus += jnp.sum((spread / scales) ** 2 / 2 - jnp.log(spread))
        minus += jnp.sum((effects / of_effects) ** 2) / 2
        minus += jnp.sum(((cables - mean) / spread) ** 2) / 2 + n * jnp.sum(jnp.log(spread))
        minus += jnp.sum(z["rest"] ** 2) / 2
        expected = cables[cable, :k] + (cables[cable, k] * worn + circumstances @ effects)[:, None]
        single = jnp.zeros((len(cases), len(free))).at[:, places].set((expected - median) / sd).at[:, remaining].set(z["rest"])
        terms = jax.vmap(posterior.log_likelihoods)(single, readings)
        total = minus - sum(jnp.sum(term) for term in terms.values())
        return jnp.where(jnp.isnan(total), jnp.inf, total)

    generator = np.random.default_rng(seed)

    z = {
        "population": jnp.array(generator.standard_normal((CHAINS, len(of_all.center)))),
        "cables": jnp.array(generator.standard_normal((CHAINS, n, k + 1))),
        "rest": jnp.array(0.2 * generator.standard_normal((CHAINS, len(cases), len(remaining)))),
    }
    kernel = NUTS(potential_fn=minus_log_density, target_accept_prob=0.85)
    chains = MCMC(
        kernel, num_warmup=WARM_UP, num_samples=draws, num_chains=CHAINS, chain_method="sequential", progress_bar=False
    )
    chains.run(jax.random.key(seed), init_params=z, extra_fields=("diverging",))
    drawn_values = jax.jit(jax.vmap(jax.vmap(values_of)))(chains.get_samples(group_by_chain=True))
    return Joint(*map(np.asarray, drawn_values), int(chains.get_extra_fields()["diverging"].sum()))
