"""The stages of a batch: weighted draws, a round of walkers and what their paths say, NUTS; each for a chunk of data sets."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bowdenfit.description import SamplerSettings
from bowdenfit.inference.batch_diagnostics import (
    diagnose_few_draws,
    diagnose_weighted,
    effective_draws,
    weight_shortfalls,
)
from bowdenfit.inference.batch_ensembles import STEPS, STORED
from bowdenfit.inference.batch_laplace import Mixture, mixtures
from bowdenfit.inference.batch_programs import BLOCK, CHUNK, BatchPrograms, stack
from bowdenfit.inference.chain import Sampling, stuck_walkers
from bowdenfit.inference.diagnostics import Diagnostics, shortfalls
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.psis import smooth_weights

_KEPT_PER_WALKER = 20
_SPREAD = 2  # effective draws for every walker that the starts of ensembles are drawn from, at the least
_UNKNOWN = (
    "the model cannot be computed at the prior medians or anywhere near; the usual cause is a prior or a fixed value that is "
    "orders of magnitude off"
)


@dataclass(frozen=True)
class BatchFit:
    """What came of one data set.

    Args:
        z: Draws of the posterior, equally weighted, (draw, parameter); none where nothing could be computed.
        engine: "laplace" (weighted draws), "ensembles" or "nuts".
        pareto_k: Of the importance weights; infinite where there are none.
        diagnostics: By parameter; weighted draws have no R-hat and no drift.
        reasons: Why the draws should not be trusted; empty if they may.
        steps: Of each walker or chain; 0 of weighted draws.
    """

    z: np.ndarray
    engine: str
    pareto_k: float
    diagnostics: dict[str, Diagnostics]
    reasons: tuple[str, ...]
    steps: int = 0


@dataclass(frozen=True)
class Case:
    """One data set on its way.

    Args:
        number: Its place in the batch.
        data: Its data.
        seed: Its seed.
        z: Weighted draws, with their log densities.
        log_density: Of those.
        log_weights: Of those, of sum 1.
        fit: What is known so far.
        rounds: How many its walkers have gone.
        walkers: Where they are, (ensemble, walker, parameter), with their log densities.
        path: Their stored states of late, (state, ensemble, walker, parameter).
    """

    number: int
    data: Any
    seed: int
    z: np.ndarray
    log_density: np.ndarray
    log_weights: np.ndarray
    fit: BatchFit
    rounds: int = 0
    walkers: tuple[np.ndarray, np.ndarray] = (np.zeros(0), np.zeros(0))
    path: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0, 0)))


def weigh(programs: BatchPrograms, parts: list[tuple[int, Any, int]]) -> list[Case]:
    """Weighted draws of a chunk of data sets."""
    seeds, data = np.array([seed for *_, seed in parts]), stack([data for _, data, _ in parts])
    padded = np.concatenate([seeds, np.repeat(seeds[-1:], CHUNK - len(seeds))])
    found = mixtures(lambda z: programs.gradients(z, data), programs.noise, padded)
    count, size = programs.settings.n_draws, len(programs.names)
    generators = [np.random.default_rng([int(seed), 1]) for seed in padded]
    z = np.stack([m.draw(g, count) if m else np.zeros((count, size)) for m, g in zip(found, generators, strict=True)])
    blocks = [np.asarray(programs.densities(z[:, i : i + BLOCK], data)) for i in range(0, count, BLOCK)]
    log_density = np.concatenate(blocks, axis=1)
    return [_case(programs, part, z[i], log_density[i], found[i], generators[i]) for i, part in enumerate(parts)]


def _case(
    programs: BatchPrograms,
    part: tuple[int, Any, int],
    z: np.ndarray,
    log_density: np.ndarray,
    mixture: Mixture | None,
    generator: np.random.Generator,
) -> Case:
    """A data set with what its weights say."""
    sampler, none = programs.settings.sampler, np.zeros(0)
    usable = np.isfinite(log_density)
    if mixture is None or usable.sum() < _SPREAD * sampler.n_ensembles * sampler.n_walkers:
        nothing = BatchFit(np.zeros((0, z.shape[1])), "laplace", float("inf"), {}, (_UNKNOWN,))
        return Case(*part, nothing.z, none, none, nothing)
    log_weights, k = smooth_weights(log_density - mixture.log_density(z))
    diagnostics = diagnose_weighted(dict(zip(programs.names, z.T, strict=True)), np.exp(log_weights))
    reasons = weight_shortfalls(k, len(z), diagnostics, sampler.target_ess)
    kept = _resample(np.exp(log_weights), programs.settings.n_kept, generator)
    return Case(*part, z, log_density, log_weights, BatchFit(z[kept], "laplace", k, diagnostics, reasons))


def _resample(weights: np.ndarray, count: int, generator: np.random.Generator) -> np.ndarray:
    """Systematic: every draw as often as its weight says, to less than one."""
    places = (np.arange(count) + generator.uniform()) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), places), len(weights) - 1)


def walk(programs: BatchPrograms, cases: list[Case]) -> list[Case]:
    """A round of the walkers of a chunk of data sets."""
    begun = [case if case.rounds else _on_the_way(programs.settings.sampler, case) for case in cases]
    padded = [*begun, *[begun[-1]] * (CHUNK - len(begun))]
    seeds, rounds = (np.array([getattr(c, name) for c in padded], dtype=np.uint32) for name in ("seed", "rounds"))
    z, log_density = (np.stack([case.walkers[i] for case in padded]) for i in (0, 1))
    answer = programs.ensembles(seeds, rounds, z, log_density, stack([case.data for case in padded]))
    path, log_density = (np.asarray(part) for part in answer)
    return [_further(case, path[i], log_density[i]) for i, case in enumerate(begun)]


def _further(case: Case, path: np.ndarray, log_density: np.ndarray) -> Case:
    """A round further; of the path no more is kept than its second half can be asked for."""
    rounds, whole = case.rounds + 1, np.concatenate([case.path, path]) if case.rounds else path
    late = whole[-(rounds + 1) // 2 * len(path) :]
    return replace(case, rounds=rounds, walkers=(path[-1], log_density), path=late)


def _on_the_way(sampler: SamplerSettings, case: Case) -> Case:
    """Walkers at different ones of the weighted draws; of few effective draws the weights are made more even."""
    wanted = sampler.n_ensembles * sampler.n_walkers
    generator = np.random.default_rng([case.seed, 2])
    log_weights = np.where(np.isfinite(case.log_density), case.log_weights, -np.inf)
    power = 1.0
    while effective_draws(power * log_weights) < _SPREAD * wanted:
        power *= 0.9
    # The largest of weights times exponential numbers are a sample without replacement.
    chosen = np.argsort(power * log_weights + generator.gumbel(size=len(log_weights)))[-wanted:]
    chosen = generator.permutation(chosen)
    shape = sampler.n_ensembles, sampler.n_walkers
    walkers = case.z[chosen].reshape(*shape, -1), case.log_density[chosen].reshape(shape)
    return replace(case, walkers=walkers)


def look(programs: BatchPrograms, cases: list[Case]) -> list[Case]:
    """What the draws of the second half of the walkers' paths say."""
    return [replace(case, fit=_by_ensembles(programs, case)) for case in cases]


def _by_ensembles(programs: BatchPrograms, case: Case) -> BatchFit:
    sampler, stored = programs.settings.sampler, case.rounds * STORED
    second = case.path[-(stored // 2) :]
    kept = np.unique(np.linspace(0, len(second) - 1, _KEPT_PER_WALKER).round().astype(int))
    z = second[kept].transpose(1, 2, 0, 3).reshape(-1, len(kept), len(programs.names))
    draws = {name: z[..., i] for i, name in enumerate(programs.names)}
    diagnostics = diagnose_few_draws(draws, sampler.n_ensembles)
    reasons = (*shortfalls(diagnostics, sampler.target_r_hat, sampler.target_ess), *stuck_walkers(z))
    steps = case.rounds * STEPS
    return BatchFit(z.reshape(-1, z.shape[-1]), "ensembles", case.fit.pareto_k, diagnostics, reasons, steps)


def by_nuts(programs: BatchPrograms, case: Case) -> BatchFit:
    """What NUTS makes of it, started from the weighted draws."""
    from bowdenfit.inference.nuts import sample

    weights = np.exp(case.log_weights)
    center = weights @ case.z
    start = MaximumPosterior(center, np.cov(case.z.T, aweights=weights).reshape(len(center), -1))
    posterior = replace(programs.posterior, given=case.data)
    asked = Sampling(posterior, start, programs.settings.sampler, case.seed, diagnose=diagnose_few_draws)
    chain = sample(asked, programs.nuts)
    z = chain.z.reshape(-1, chain.z.shape[-1])
    return BatchFit(z, "nuts", case.fit.pareto_k, chain.diagnostics, chain.reasons, chain.steps)
