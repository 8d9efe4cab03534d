"""Fits of many data sets of one shape: what was compiled for one serves the next."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import jax
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.description import SamplerSettings
from bowdenfit.inference.chain import Chain, Sampling
from bowdenfit.inference.diagnostics import MAXIMUM_DRIFT, Diagnostics, diagnose_all
from bowdenfit.inference.draws import for_each_draw
from bowdenfit.inference.ensemble import sample
from bowdenfit.inference.least_squares import maximum_posterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.model import Model, build_model
from bowdenfit.results.optimum import optimum_of

SAMPLER = SamplerSettings(n_ensembles=2, n_walkers=128, max_steps=6000, target_ess=400, target_r_hat=1.03)


@dataclass(frozen=True)
class RefitPrograms:
    """What is compiled once for all data of one shape; nothing in it depends on the data."""

    posterior: LogDensity
    sampler: SamplerSettings

    @cached_property
    def objective(self) -> Callable[..., Any]:
        """Least squares, for the start."""
        return make_objective(self.posterior)

    @cached_property
    def log_density(self) -> Callable[..., Any]:
        """Log density of half of all walkers."""
        return self.posterior.batched_log_density(self.sampler.n_ensembles * self.sampler.n_walkers // 2)

    @cached_property
    def optimum(self) -> Callable[..., Any]:
        """Optimal length and efficiency of draws."""
        return for_each_draw(optimum_of(self.posterior.model), self.posterior.model.space.size)


@dataclass(frozen=True)
class Laboratory:
    """Fits one data set after the other with the tool's own sampler, and keeps what it has compiled.

    Args:
        sampler: Shorter than that of a fit: a rank needs a few hundred effective draws.
        programs: What has been compiled, by shape of the data.
    """

    sampler: SamplerSettings = SAMPLER
    programs: dict[str, RefitPrograms] = field(default_factory=dict)

    def chain(self, posterior: LogDensity, seed: int) -> Chain:
        """Draws of a posterior.

        Raises:
            ConvergenceError: The model cannot be computed at the prior medians.
        """
        programs = self.programs_for(posterior)
        start = maximum_posterior(posterior, programs.objective)
        asked = Sampling(posterior, start, self.sampler, seed, diagnose=diagnose_few_draws)
        return sample(asked, programs.log_density)

    def programs_for(self, posterior: LogDensity) -> RefitPrograms:
        """The programs for data of this shape."""
        shapes = str(jax.tree.map(lambda array: (array.shape, str(array.dtype)), posterior.data))
        key = shapes + str(posterior.model.space)
        return self.programs.setdefault(key, RefitPrograms(posterior, self.sampler))


def diagnose_few_draws(draws: Mapping[str, np.ndarray], n_ensembles: int) -> dict[str, Diagnostics]:
    """Diagnostics of a few hundred effective draws.

    Two halves of n effective draws differ by 2.5 / sqrt(n) of their spread by chance alone, which at a thousand is all that
    `MAXIMUM_DRIFT` allows; here twice what chance does is allowed, whatever n is.
    """
    found = diagnose_all(draws, n_ensembles)
    by_chance = {name: 2.5 / np.sqrt(max(min(d.ess_bulk, d.ess_tail), 1.0)) for name, d in found.items()}
    return {name: replace(d, drift=float(d.drift / by_chance[name]) / 2 * MAXIMUM_DRIFT) for name, d in found.items()}


def with_parameters_of(model: Model, dataset: Dataset) -> Model:
    """The model of other readings on the same bench: priors that look at the data stay those of the data they looked at."""
    terms = build_model(dataset).terms
    return Model(model.cable, model.space, tuple(replace(term, cable=model.cable) for term in terms))  # type: ignore[type-var]
