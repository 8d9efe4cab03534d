"""Sampling within a fit: which sampler, its compiled programs, and a posterior made of its draws."""

from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import numpy as np

from bowdenfit.inference.chain import Chain
from bowdenfit.inference.diagnostics import diagnose_all
from bowdenfit.inference.draws import for_each_draw, replicator
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.log_density import LogDensity as Density
from bowdenfit.inference.samplers import NAMES, Drawn, compare_samplers
from bowdenfit.model import Model
from bowdenfit.results.optimum import optimum_of
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Draws
from bowdenfit.run.helpers import Assistants
from bowdenfit.run.stopwatch import Stopwatch

PRIOR_DRAWS = 4096


@dataclass(frozen=True)
class Programs:
    """Compiled for sampling, while least squares is; what follows it is compiled while it runs.

    Args:
        log_density: Of half of all walkers; None without emcee.
        block: Steps of all chains; None without NUTS.
        optimum: Optimal length and efficiency of many z; None without a route.
    """

    log_density: Callable[..., Any] | None
    block: Callable[..., Any] | None
    optimum: Callable[[np.ndarray], Any] | None

    def quantities(self, z: np.ndarray) -> Mapping[str, np.ndarray]:
        """What must converge besides the parameters, by name, of many z."""
        if self.optimum is None:
            return {}
        return dict(zip((OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY), self.optimum(z), strict=True))


def libraries(method: str) -> tuple[str, ...]:
    """What to load while something else compiles."""
    return tuple({"emcee": "emcee", "nuts": "blackjax"}[sampler] for sampler in samplers(method))


def samplers(method: str) -> tuple[str, ...]:
    """The samplers that a method runs, in their order; the draws of the first are the result."""
    return ("emcee", "nuts") if method == "both" else (method,)


def sampling_programs(density: Density) -> Programs:
    """The programs that sampling needs; called in a thread, for which 64-bit floats are switched on here."""
    model, settings = density.model, density.model.description.sampler
    log_density = block = None
    with jax.enable_x64(True):
        if "emcee" in samplers(settings.method):
            log_density = density.batched_log_density(settings.n_ensembles * settings.n_walkers // 2)
        if "nuts" in samplers(settings.method):
            from bowdenfit.inference.nuts import make_program

            block = make_program(density, settings)
        optimum = for_each_draw(optimum_of(model), model.space.size) if model.description.route else None
    return Programs(log_density, block, optimum)


def implied_program(density: Density, seed: int) -> Callable[[np.ndarray], Any]:
    """What computes everything else that a draw implies; called in a thread."""
    with jax.enable_x64(True):
        return replicator(density, seed)


def sampled(
    density: Density,
    programs: Programs,
    implied: "Future[Callable[[np.ndarray], Any]]",
    start: MaximumPosterior,
    seed: int,
    checkpoint: Path | None,
    resume: bool,
    progress: Callable[..., None] | None,
    watch: Stopwatch,
    helpers: Assistants,
) -> tuple[Draws, tuple[str, ...]]:
    """The posterior, and why it should not be trusted.

    Args:
        density: Its density.
        programs: Compiled for it.
        implied: What `implied_program` gives, once that is compiled.
        start: Center and covariance of the start.
        seed: Seed.
        checkpoint: File that draws are written to as they come, if any.
        resume: Whether the checkpoint has states to go on from.
        progress: Called while sampling.
        watch: Records the stages' times.
        helpers: Who does the statistics.
    """

    def diagnose(*arguments: Any) -> Any:
        return helpers.statistics.submit(diagnose_all, *arguments).result()

    settings, files = density.model.description.sampler, (checkpoint, resume)
    chains: list[Chain] = []
    for name in samplers(settings.method):
        with watch.stage(f"import {libraries(name)[0]}"):
            sample = _sampler(name)
        program = programs.log_density if name == "emcee" else programs.block
        with watch.stage("sample" if name == samplers(settings.method)[0] else f"sample with {NAMES[name]}"):
            common = (density, program, start, settings, seed, programs.quantities, *files, progress)
            chains.append(sample(*common, diagnose=diagnose))
    with watch.stage("replicate"):
        posterior = _posterior(density.model, chains[0], implied.result(), seed)
    if len(chains) == 1:
        return posterior, chains[0].reasons
    with watch.stage("compare samplers"):
        drawn = [_drawn(density.model, chain) for chain in chains]
        agreement = helpers.statistics.submit(compare_samplers, *drawn).result()
    of_other = [f"{NAMES[chains[1].sampler]}: {reason}" for reason in chains[1].reasons]
    return replace(posterior, agreement=agreement), (*chains[0].reasons, *of_other, *agreement.reasons())


def _sampler(name: str) -> Callable[..., Chain]:
    if name == "nuts":
        from bowdenfit.inference import nuts

        return nuts.sample
    from bowdenfit.inference import ensemble

    return ensemble.sample


def _drawn(model: Model, chain: Chain) -> Drawn:
    draws = {p.name: chain.z[..., i] for i, p in enumerate(model.space.free)} | chain.quantities
    return Drawn(chain.sampler, draws, chain.n_ensembles)


def _posterior(model: Model, chain: Chain, implied: Callable[[np.ndarray], Any], seed: int) -> Draws:
    values, groups, prior = _implied(model, implied, chain.z, seed)
    return Draws(
        chain.z,
        values,
        chain.quantities,
        groups["log_likelihood"],
        groups["expected"],
        groups["replicated"],
        prior,
        chain.diagnostics,
        chain.n_ensembles,
        chain.steps,
        chain.acceptance,
        chain.sampler,
        chain.trajectories,
    )


def _implied(
    model: Model, program: Callable[[np.ndarray], Any], z: np.ndarray, seed: int
) -> tuple[dict[str, np.ndarray], dict[str, dict[str, np.ndarray]], dict[str, np.ndarray]]:
    """Named values and what else the draws imply, and named values of draws from the prior."""
    space, shape, n = model.space, z.shape[:2], z.shape[0] * z.shape[1]
    prior_z = np.random.default_rng([seed, 2]).standard_normal((PRIOR_DRAWS, space.size))
    implied = program(np.concatenate([z.reshape(n, space.size), prior_z]))
    groups = {
        group: {name: v[:n].reshape(*shape, *v.shape[1:]) for name, v in values.items()}
        for group, values in implied.items()
    }
    prior = {p.name: implied["values"][p.name][n:][None] for p in space.free}
    return groups.pop("values"), groups, prior
