"""Simulated cables, fitted: do posterior intervals hold the truth as often as they say?"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import numpy as np
from scipy import stats

from bowdenfit.dataset import Dataset
from bowdenfit.description import Description, SamplerSettings
from bowdenfit.inference.ensemble import sample
from bowdenfit.inference.least_squares import LeastSquares, least_squares, make_objective, maximum_posterior
from bowdenfit.inference.posterior import Posterior
from bowdenfit.models.build import build_model
from bowdenfit.models.simulation import Design, empty_tables, simulate, true_values
from bowdenfit.predictions.draws import for_each_draw
from bowdenfit.predictions.optimal_length import optimum_of

SAMPLER = SamplerSettings(n_ensembles=4, n_walkers=64, max_steps=1500, target_ess=500, target_r_hat=1.03)
OPTIMUM = "optimal_length"
PROBABILITY = 0.9


@dataclass(frozen=True)
class Programs:
    """What is compiled once for all cables of one kind and one shape of data; nothing in it depends on the data."""

    posterior: Posterior
    sampler: SamplerSettings

    @cached_property
    def objective(self) -> Callable[..., Any]:
        return make_objective(self.posterior)

    @cached_property
    def log_density(self) -> Callable[..., Any]:
        return self.posterior.batched_log_density(self.sampler.n_ensembles * self.sampler.n_walkers // 2)

    @cached_property
    def optimum(self) -> Callable[..., Any]:
        return for_each_draw(optimum_of(self.posterior.model), self.posterior.model.space.size)


class Laboratory:
    """Simulates cables, fits them, and says for each whether its intervals hold the truth."""

    def __init__(self, disturb: Callable[[Dataset], Dataset] = lambda dataset: dataset, sampler=SAMPLER):
        self.disturb, self.sampler, self.programs = disturb, sampler, {}

    def least_squares(self, dataset: Dataset) -> LeastSquares:
        """Classical estimates, as a fit without MCMC gives them."""
        posterior = Posterior(build_model(dataset))
        objective = self._programs(posterior).objective
        return least_squares(posterior, objective, maximum_posterior(posterior, objective).z)

    def draws(self, posterior: Posterior, seed: int) -> np.ndarray:
        """Draws of the posterior in z, one a row."""
        programs = self._programs(posterior)
        start = maximum_posterior(posterior, programs.objective)
        z = sample(posterior, programs.log_density, start, self.sampler, seed, lambda z: {}).z
        return z.reshape(-1, posterior.model.space.size)

    def ranks(self, description: Description, design: Design, seed: int) -> dict[str, float]:
        """Share of the posterior below the truth, by parameter, and for the optimal length of a cable with a route.

        Uniform between 0 and 1 if all is right. An optimum at an end of the range has probability of its own there; a
        truth at the same end takes a place at random within it, which keeps its rank uniform.
        """
        of_truth, of_readings, of_ties = jax.random.split(jax.random.key(seed), 3)
        truth = true_values(description, empty_tables(description, design), {}, of_truth)
        posterior = Posterior(build_model(self.disturb(simulate(description, design, truth, of_readings))))
        space, z = posterior.model.space, self.draws(posterior, seed)
        z_true = np.asarray(space.unconstrain(truth))
        found = {p.name: float(np.mean(z[:, i] < z_true[i])) for i, p in enumerate(space.free)}
        if description.route is None:
            return found
        optimum = self._programs(posterior).optimum
        lengths, best = optimum(z)[0], optimum(z_true[None])[0]
        tie = float(jax.random.uniform(of_ties)) * np.mean(lengths == best)
        return found | {OPTIMUM: float(np.mean(lengths < best) + tie)}

    def _programs(self, posterior: Posterior) -> Programs:
        shapes = str(jax.tree.map(np.shape, posterior.data)) + str(posterior.model.space)
        return self.programs.setdefault(shapes, Programs(posterior, self.sampler))


def held(ranks: list[dict[str, float]]) -> dict[str, tuple[int, int]]:
    """For each parameter: in how many cables the central 90 % interval holds the truth, and of how many."""
    by_name: dict[str, list[float]] = {}
    for cable_ranks in ranks:
        for name, rank in cable_ranks.items():
            by_name.setdefault(name, []).append(rank)
    low, high = (1 - PROBABILITY) / 2, (1 + PROBABILITY) / 2
    return {name: (sum(low < rank < high for rank in values), len(values)) for name, values in by_name.items()}


def p_values(ranks: list[dict[str, float]]) -> dict[str, float]:
    """Of two-sided binomial tests of the rates of `held`."""
    return {name: stats.binomtest(hits, n, PROBABILITY).pvalue for name, (hits, n) in held(ranks).items()}


def table(ranks: list[dict[str, float]]) -> str:
    """The rates in words, for a failing test."""
    return ", ".join(f"{name} {hits}/{n}" for name, (hits, n) in held(ranks).items())
