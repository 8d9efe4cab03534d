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

from bowdenfit.questions.fleet.cases import read_cases
from bowdenfit.questions.fleet.inspections import read_inspections

SPREAD, WEAR, WEAR_SPREAD, OIL, DEGREE = 0.5, 1.0, 0.3, 1.0, 0.05  # scales of the priors, as the model is written down
WARM_UP, CHAINS = 400, 4


@dataclass(frozen=True)
class Joint:
    """Draws of population and cables, (chain, draw, ...).

    Args:
        mean, spread: Of log coefficients and, last, of wear.
        effects: Of lubrication and of a degree.
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


def joint_draws(
    folder: Path, labels: tuple[str, ...], names: tuple[str, ...], about: np.ndarray, draws: int, seed: int
) -> Joint:
    """Draws of population and cables by NUTS on all readings at once; scatter and noise of each inspection are drawn too.

    Args:
        folder: Of the fleet's measurements; every inspection says its cycles, temperature and lubrication.
        labels: Of its inspections, those of a cable together.
        names: Of the coefficients.
        about: Where cables are thought to be, (draw, cable, number): the unit in which steps are taken, and where they begin.
        draws: Of each of four chains.
        seed: Of everything random.
    """
    read = {case.inspection.label: case for case in read_cases(folder, read_inspections(folder), {})}
    cases = [read[label] for label in labels]
    posterior, inspections = cases[0].shaped.posterior, [case.inspection for case in cases]
    free = posterior.model.space.free
    places = np.array([[p.name for p in free].index(name) for name in names])
    others = np.setdiff1d(np.arange(len(free)), places)
    median = np.log([float(free[i].prior.median) for i in places])
    sd = np.array([float(free[i].prior.log_sd) for i in places])
    cables = list(dict.fromkeys(each.cable for each in inspections))
    cable = np.array([cables.index(each.cable) for each in inspections])
    cycles = np.array([each.cycles for each in inspections])
    circumstances = np.array([[float(each.lubricated), each.temperature - 20.0] for each in inspections])
    readings = jax.tree.map(lambda *leaves: jnp.stack(leaves), *(case.shaped.data for case in cases))
    worn, n, k = cycles / cycles.max(), len(cables), len(names)
    center = about.mean(axis=0)
    root = np.linalg.cholesky(np.einsum("dia,dib->iab", about - center, about - center) / len(about))

    def values_of(z):
        """Population and cables; these in units of their own, which are constants and so change no density."""
        cables = center + jnp.einsum("iab,ib->ia", root, z["cables"])
        return z["mean"], jnp.exp(z["log_spread"]), z["effects"], cables

    def minus_log_density(z):
        mean, spread, effects, cables = values_of(z)
        minus = jnp.sum(((mean[:k] - median) / sd) ** 2) / 2 + (mean[k] / WEAR) ** 2 / 2
        scales = jnp.array([SPREAD] * k + [WEAR_SPREAD])
        minus += jnp.sum((spread / scales) ** 2 / 2 - z["log_spread"])
        minus += jnp.sum((effects / jnp.array([OIL, DEGREE])) ** 2) / 2
        minus += jnp.sum(((cables - mean) / spread) ** 2) / 2 + n * jnp.sum(z["log_spread"])
        minus += jnp.sum(z["rest"] ** 2) / 2
        at = cables[cable, :k] + (cables[cable, k] * worn + circumstances @ effects)[:, None]
        single = jnp.zeros((len(cases), len(free))).at[:, places].set((at - median) / sd).at[:, others].set(z["rest"])
        terms = jax.vmap(posterior.log_likelihoods)(single, readings)
        total = minus - sum(jnp.sum(term) for term in terms.values())
        return jnp.where(jnp.isnan(total), jnp.inf, total)

    generator = np.random.default_rng(seed)

    def start(*shape):
        return jnp.array(0.2 * generator.standard_normal((CHAINS, *shape)))

    z = {
        "mean": jnp.array([*median, 0.0]) + start(k + 1),
        "log_spread": np.log(0.2) + start(k + 1),
        "effects": 0.1 * start(2),
        "cables": start(n, k + 1),
        "rest": start(len(cases), len(others)),
    }
    kernel = NUTS(potential_fn=minus_log_density, target_accept_prob=0.85)
    chains = MCMC(
        kernel, num_warmup=WARM_UP, num_samples=draws, num_chains=CHAINS, chain_method="vectorized", progress_bar=False
    )
    chains.run(jax.random.key(seed), init_params=z, extra_fields=("diverging",))
    found = jax.jit(jax.vmap(jax.vmap(values_of)))(chains.get_samples(group_by_chain=True))
    return Joint(*map(np.asarray, found), int(chains.get_extra_fields()["diverging"].sum()))
