"""Simulated cables, fitted: do posterior intervals contain the truth as often as they claim?"""

from collections.abc import Callable, Iterable
from typing import Any

import jax
import numpy as np
from scipy import stats

from bowdenfit.dataset import Dataset
from bowdenfit.description import Description, SamplerSettings
from bowdenfit.inference.batch.fitting import diagnose_few_draws
from bowdenfit.inference.batch.programs import BatchSettings
from bowdenfit.inference.chain import SamplingRequest
from bowdenfit.inference.ensemble import sample
from bowdenfit.inference.least_squares import LeastSquares, find_maximum_posterior, fit_least_squares
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.inference.walkers import compile_walkers
from bowdenfit.kinds.kind import Design
from bowdenfit.models import build_model
from bowdenfit.questions.calibrate.replicator import BatchFitter, CalibrationPlan, Replicator
from bowdenfit.questions.simulate.tables import empty_tables

SAMPLER = SamplerSettings(n_ensembles=4, n_walkers=64, max_steps=1500, target_ess=500, target_r_hat=1.03)
PROBABILITY = 0.9
SEED = 0


def anything(measured: Dataset, simulated: Dataset) -> str:
    """Every table that is drawn is fitted; for descriptions whose priors keep to plausible cables."""
    return ""


class Laboratory:
    """Simulates cables, fits them, and says for each whether its intervals hold the truth."""

    def __init__(self, disturb: Callable[[Dataset], Dataset] = lambda dataset: dataset, sampler=SAMPLER):
        self.disturb, self.sampler, self.programs = disturb, sampler, {}
        self.fits, self.benches = BatchFitter(BatchSettings(sampler, target_sd_error=np.inf)), {}

    def least_squares(self, dataset: Dataset) -> LeastSquares:
        """Classical estimates, as a fit without MCMC gives them."""
        posterior = LogDensity(build_model(dataset))
        objective = self.program(posterior, make_objective)
        return fit_least_squares(posterior, objective, find_maximum_posterior(posterior, objective).z)

    def draws(self, posterior: LogDensity, seed: int) -> np.ndarray:
        """Draws of one posterior in z, one a row, by the package's usual sampler."""
        start = find_maximum_posterior(posterior, self.program(posterior, make_objective))
        programs = self.program(posterior, lambda p: compile_walkers(p, self.sampler))
        request = SamplingRequest(posterior, start, self.sampler, seed, diagnose=diagnose_few_draws)
        return sample(request, programs).z.reshape(-1, posterior.model.space.size)

    def program(self, posterior: LogDensity, make: Callable[[LogDensity], Any]) -> Any:
        """What is compiled once for all data of one shape."""
        shapes = jax.tree.map(lambda array: (array.shape, str(array.dtype)), posterior.data)
        key = f"{make.__qualname__} {shapes} {posterior.model.space}"
        if key not in self.programs:
            self.programs[key] = make(posterior)
        return self.programs[key]

    def ranks(self, description: Description, design: Design, seeds: Iterable[int]) -> list[dict[str, float]]:
        """Of each cable: share of the posterior below the truth, by parameter, and for the optimum of a cable with a route.

        Uniform between 0 and 1 if all is right.
        """
        key = description.model_dump_json() + repr(design)
        if key not in self.benches:
            dataset = Dataset(description, empty_tables(description, design), {})
            plan = CalibrationPlan(dataset, dataset, SEED)
            self.benches[key] = Replicator(plan, self.fits, self.disturb, anything)
        replications = self.benches[key].replicate(list(seeds))
        return [{name: ranks.rank for name, ranks in replication.ranked.items()} for replication in replications]


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
