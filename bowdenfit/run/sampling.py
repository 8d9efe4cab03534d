"""Sampling within a fit: which sampler, its compiled programs, and a posterior made of its draws."""

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import jax
import numpy as np

from bowdenfit.inference.chain import Chain, Sampling
from bowdenfit.inference.draws import for_each_draw, replicator
from bowdenfit.inference.log_density import LogDensity as Density
from bowdenfit.inference.samplers import NAMES, Drawn, compare_samplers
from bowdenfit.inference.walkers import walker_programs
from bowdenfit.model import Model
from bowdenfit.questions.check.suspects import implied_program
from bowdenfit.questions.identify.judgment import values_program
from bowdenfit.results.optimum import optimum_of
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Draws, along_route_program
from bowdenfit.results.route_draws import compile_along_route
from bowdenfit.run.stopwatch import Stopwatch

PRIOR_DRAWS = 4096
LIBRARIES = {"emcee": "emcee", "nuts": "blackjax"}
_MODULES = {"emcee": "bowdenfit.inference.ensemble", "nuts": "bowdenfit.inference.nuts"}


def samplers(method: str) -> tuple[str, ...]:
    """The samplers that a method runs, in their order; the draws of the first are the result."""
    return ("emcee", "nuts") if method == "both" else (method,)


@dataclass(frozen=True)
class Programs:
    """Compiled for sampling and what follows it, while least squares is.

    Args:
        samplers: What each sampler runs, by its name.
        optimum: Optimal length and efficiency of many z; None without a route.
        implied: What each of many z implies for every reading.
        asked: What questions asked `once` will need, by question.
    """

    samplers: dict[str, Any]
    optimum: Callable[[np.ndarray], Any] | None
    implied: Callable[[np.ndarray], Any]
    asked: dict[Callable[..., Any], Any]

    def quantities(self, z: np.ndarray) -> Mapping[str, np.ndarray]:
        """What must converge besides the parameters, by name, of many z."""
        if self.optimum is None:
            return {}
        return dict(zip((OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY), self.optimum(z), strict=True))


def sampling_programs(density: Density, seed: int, beside: Executor) -> Programs:
    """The programs that sampling needs, compiled; and those that its draws will need, compiled beside it."""
    model, settings, programs = density.model, density.model.description.sampler, dict[str, Any]()
    for name in samplers(settings.method):
        if name == "emcee":
            programs[name] = walker_programs(density, settings, beside=beside)
        else:
            programs[name] = import_module(_MODULES[name]).make_program(density, settings)
    optimum = for_each_draw(optimum_of(model), model.space.size, beside=beside) if model.description.route else None
    implied = replicator(density, seed, beside)
    asked: dict[Callable[..., Any], Any] = {values_program: lambda z: implied(z)["values"], implied_program: implied}
    if model.description.route is not None:
        asked[along_route_program] = compile_along_route(model, beside)
    return Programs(programs, optimum, implied, asked)


def draws_of(programs: Programs, asked: Sampling, watch: Stopwatch) -> tuple[Draws, tuple[str, ...]]:
    """The posterior by each of the samplers, and why it should not be trusted."""
    model, chains = asked.posterior.model, list[Chain]()
    for name, program in programs.samplers.items():
        with watch.stage(f"import {LIBRARIES[name]}"):
            sampler = import_module(_MODULES[name])
        with watch.stage(f"sample with {NAMES[name]}" if chains else "sample"):
            chains.append(sampler.sample(asked, program))
    with watch.stage("replicate"):
        posterior = _posterior(model, chains[0], programs.implied, asked.seed)
    if len(chains) == 1:
        return posterior, chains[0].reasons
    with watch.stage("compare samplers"):
        agreement = compare_samplers(*(_drawn(model, chain) for chain in chains))
    of_other = [f"{NAMES[chains[1].sampler]}: {reason}" for reason in chains[1].reasons]
    return replace(posterior, agreement=agreement), (*chains[0].reasons, *of_other, *agreement.reasons())


def _drawn(model: Model, chain: Chain) -> Drawn:
    draws = {p.name: chain.z[..., i] for i, p in enumerate(model.space.free)} | chain.quantities
    return Drawn(chain.sampler, draws, chain.n_ensembles)


def _posterior(model: Model, chain: Chain, implied: Callable[[np.ndarray], Any], seed: int) -> Draws:
    """The chain with what its draws imply, and draws from the prior."""
    z, space, (walkers, draws, size) = chain.z, model.space, chain.z.shape
    n, of_chain = walkers * draws, vars(chain) | {"optimum": chain.quantities}
    prior_z = np.random.default_rng([seed, 2]).standard_normal((PRIOR_DRAWS, size))
    of_all = implied(np.concatenate([z.reshape(n, size), prior_z]))
    groups = jax.tree.map(lambda v: v[:n].reshape(walkers, draws, *v.shape[1:]), of_all)
    prior = {p.name: of_all["values"][p.name][n:][None] for p in space.free}
    kept = {name: value for name, value in of_chain.items() if name not in ("quantities", "reasons")}
    return Draws(**kept, **groups, prior=prior)
