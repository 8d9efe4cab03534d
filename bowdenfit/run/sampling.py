"""Sampling within a fit: which sampler, its compiled programs, and a posterior made of its draws."""

import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import Any

import jax
import numpy as np

from bowdenfit.inference.chain import Chain, SamplingRequest
from bowdenfit.inference.draws import for_each_draw, replicator
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.sampler_agreement import SAMPLER_NAMES, SamplerDraws, compare_samplers
from bowdenfit.inference.walkers import compile_walkers
from bowdenfit.model import Model
from bowdenfit.results.optimum import make_optimizer
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, DrawPrograms, Draws
from bowdenfit.results.route_draws import compile_along_route

PRIOR_DRAWS = 4096
LIBRARIES = {"emcee": "emcee", "nuts": "blackjax"}
_MODULES = {"emcee": "bowdenfit.inference.ensemble", "nuts": "bowdenfit.inference.nuts"}


def samplers_of(method: str) -> tuple[str, ...]:
    """Return the samplers that a method runs, in their order; the draws of the first are the result."""
    return ("emcee", "nuts") if method == "both" else (method,)


@dataclass
class Stopwatch:
    """Seconds spent in each stage of a fit."""

    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what runs inside."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


@dataclass(frozen=True)
class Programs:
    """What was compiled for sampling and what follows it.

    Args:
        samplers: What each sampler runs, by its name.
        optimum: Optimal length and efficiency of many z; None without a route.
        of_draws: What the draws will be asked.
    """

    samplers: dict[str, Any]
    optimum: Callable[[np.ndarray], Any] | None
    draw_programs: DrawPrograms

    def quantities(self, z: np.ndarray) -> Mapping[str, np.ndarray]:
        """What must converge besides the parameters, by name, of many z."""
        if self.optimum is None:
            return {}
        return dict(zip((OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY), self.optimum(z), strict=True))


def compile_programs(density: LogDensity, seed: int, beside: Executor) -> Programs:
    """Compile the programs that sampling needs and, in an executor beside it, those that its draws will need."""
    model, settings, programs = density.model, density.model.description.sampler, dict[str, Any]()
    for name in samplers_of(settings.method):
        if name == "emcee":
            programs[name] = compile_walkers(density, settings, beside=beside)
        else:
            programs[name] = import_module(_MODULES[name]).make_program(density, settings)
    optimum = for_each_draw(make_optimizer(model), model.space.size, beside=beside) if model.description.route else None
    implied = replicator(density, seed, beside)
    along_route = compile_along_route(model, beside) if model.description.route is not None else None
    return Programs(programs, optimum, DrawPrograms(lambda z: implied(z)["values"], implied, along_route))


def draw_posterior(programs: Programs, request: SamplingRequest, watch: Stopwatch) -> tuple[Draws, tuple[str, ...]]:
    """Sample the posterior by each of the samplers; return the draws, and why they should not be trusted."""
    model, chains = request.posterior.model, list[Chain]()
    for name, program in programs.samplers.items():
        with watch.stage(f"import {LIBRARIES[name]}"):
            sampler = import_module(_MODULES[name])
        with watch.stage(f"sample with {SAMPLER_NAMES[name]}" if chains else "sample"):
            chains.append(sampler.sample(request, program))
    with watch.stage("replicate"):
        posterior = _posterior(model, chains[0], programs.draw_programs.quantities, request.seed)
    if len(chains) == 1:
        return posterior, chains[0].reasons
    with watch.stage("compare samplers"):
        agreement = compare_samplers(*(_sampler_draws(model, chain) for chain in chains))
    of_other = [f"{SAMPLER_NAMES[chains[1].sampler]}: {reason}" for reason in chains[1].reasons]
    return replace(posterior, agreement=agreement), (*chains[0].reasons, *of_other, *agreement.reasons())


def _sampler_draws(model: Model, chain: Chain) -> SamplerDraws:
    draws = {p.name: chain.z[..., i] for i, p in enumerate(model.space.free)} | chain.quantities
    return SamplerDraws(chain.sampler, draws, chain.n_ensembles)


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
