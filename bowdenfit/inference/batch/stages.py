"""The stages of a batch: weighted draws, a round of walkers and what their paths say, NUTS; each for a chunk of data sets."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bowdenfit.inference.batch.diagnostics import diagnose_few_draws, remembered, sd_errors, uncertain_sds
from bowdenfit.inference.batch.ensembles import STEPS, STORED
from bowdenfit.inference.batch.laplace import mixtures
from bowdenfit.inference.batch.programs import CHUNK, WALKING, BatchPrograms, stack
from bowdenfit.inference.batch.weights import BLOCK, Weighted, evened, resample, weighted_draws
from bowdenfit.inference.chain import Sampling, stuck_walkers
from bowdenfit.inference.diagnostics import Diagnostics, shortfalls
from bowdenfit.inference.least_squares import MaximumPosterior

_KEPT_PER_WALKER, _KEPT_PER_WALKER_FOR_SDS = 20, 100
FORGETS = 3  # effective draws that each walker makes by itself, so that where it started is forgotten
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
        weighted: Its weighted draws; None where nothing can be computed.
        fit: What is known so far.
        rounds: How many its walkers have gone.
        walkers: Where they are, (ensemble, walker, parameter).
        path: Their stored states of late, (state, ensemble, walker, parameter).
    """

    number: int
    data: Any
    seed: int
    weighted: Weighted | None
    fit: BatchFit
    rounds: int = 0
    walkers: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0)))
    path: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0, 0)))


def weigh(programs: BatchPrograms, parts: list[tuple[int, Any, int]]) -> list[Case]:
    """Weighted draws of a chunk of data sets."""
    seeds, data = np.array([seed for *_, seed in parts]), stack([data for _, data, _ in parts], CHUNK)
    padded = np.concatenate([seeds, np.repeat(seeds[-1:], CHUNK - len(seeds))])
    begun = mixtures(lambda z: programs.gradients(z, data), programs.noise, programs.friction, padded)
    drawing = {
        i: weighted_draws(
            mixture, np.random.default_rng([int(seed), 1]), lambda w: not _by_weights(programs, w).reasons
        )
        for i, (mixture, seed) in enumerate(zip(begun, seeds, strict=False))
        if mixture is not None
    }
    z, weighted = np.zeros((CHUNK, BLOCK, len(programs.names))), dict[int, Weighted]()
    wanted = {i: next(one) for i, one in drawing.items()}
    while wanted:
        for i, rows in wanted.items():
            z[i] = rows
        log_density, asked, wanted = np.asarray(programs.densities(z, data)), list(wanted), {}
        for i in asked:
            try:
                wanted[i] = drawing[i].send(log_density[i])
            except StopIteration as end:
                weighted[i] = end.value
    return [Case(*part, weighted.get(i), _by_weights(programs, weighted.get(i))) for i, part in enumerate(parts)]


def _by_weights(programs: BatchPrograms, weighted: Weighted | None) -> BatchFit:
    """What weighted draws say, as draws of equal weight."""
    settings = programs.settings
    least = _SPREAD * programs.n_walkers * settings.sampler.n_ensembles
    if weighted is None or np.isfinite(weighted.log_density).sum() < least:
        return BatchFit(np.zeros((0, len(programs.names))), "laplace", float("inf"), {}, (_UNKNOWN,))
    diagnostics = weighted.diagnose(programs.names)
    reasons = weighted.shortfalls(diagnostics, settings.sampler.target_ess)
    reasons += uncertain_sds(weighted.sd_errors(programs.names), settings.target_sd_error)
    kept = resample(np.exp(weighted.log_weights), settings.n_kept, 0.5)
    return BatchFit(weighted.z[kept], "laplace", weighted.pareto_k, diagnostics, reasons)


def walk(programs: BatchPrograms, cases: list[Case]) -> list[Case]:
    """A round of the walkers of a chunk of data sets, which have gone as many."""
    begun = [case if case.rounds else _on_the_way(programs, case) for case in cases]
    padded = [*begun, *[begun[-1]] * (WALKING - len(begun))]
    seeds, number = np.array([case.seed for case in padded], dtype=np.uint32), np.uint32(begun[0].rounds)
    z, data = np.stack([case.walkers for case in padded]), stack([case.data for case in padded], WALKING)
    paths = np.asarray(programs.ensembles(seeds, number, z, data))
    return [_further(case, path) for case, path in zip(begun, paths, strict=False)]


def _further(case: Case, path: np.ndarray) -> Case:
    """A round further; of the path no more is kept than its second half can be asked for."""
    rounds, whole = case.rounds + 1, np.concatenate([case.path, path]) if case.rounds else path
    late = whole[-(rounds + 1) // 2 * len(path) :]
    return replace(case, rounds=rounds, walkers=path[-1], path=late)


def _on_the_way(programs: BatchPrograms, case: Case) -> Case:
    """Walkers at different ones of the weighted draws."""
    assert case.weighted is not None  # nothing walks where nothing can be computed
    shape, generator = (
        (programs.settings.sampler.n_ensembles, programs.n_walkers),
        np.random.default_rng([case.seed, 2]),
    )
    log_weights = _evened(programs, case.weighted)
    # The largest of weights times exponential numbers are a sample without replacement.
    chosen = np.argsort(log_weights + generator.gumbel(size=len(log_weights)))[-shape[0] * shape[1] :]
    chosen = generator.permutation(chosen)
    return replace(case, walkers=case.weighted.z[chosen].reshape(*shape, -1))


def _evened(programs: BatchPrograms, weighted: Weighted) -> np.ndarray:
    """Log weights, more even where draws are worth too few to start walkers from."""
    return evened(weighted.log_weights, _SPREAD * programs.settings.sampler.n_ensembles * programs.n_walkers)


def look(programs: BatchPrograms, cases: list[Case], last: bool) -> list[Case]:
    """What the draws of the second half of the walkers' paths say.

    Args:
        programs: What is compiled.
        cases: Of a chunk.
        last: Whether no walkers go on; else diagnostics end with the first parameter that asks for more.
    """
    return [replace(case, fit=_by_ensembles(programs, case, last)) for case in cases]


def _by_ensembles(programs: BatchPrograms, case: Case, last: bool) -> BatchFit:
    sampler, stored = programs.settings.sampler, case.rounds * STORED
    second = case.path[-(stored // 2) :]
    strict = bool(np.isfinite(programs.settings.target_sd_error))
    per_walker = _KEPT_PER_WALKER_FOR_SDS if strict else _KEPT_PER_WALKER
    kept = np.unique(np.linspace(0, len(second) - 1, per_walker).round().astype(int))
    z = second[kept].transpose(1, 2, 0, 3).reshape(-1, len(kept), len(programs.names))
    draws = {name: z[..., i] for i, name in enumerate(programs.names)}
    diagnostics, reasons = dict[str, Diagnostics](), stuck_walkers(z)
    asked_before = [*case.fit.diagnostics][-1:]  # for more
    for name in dict.fromkeys((*asked_before, *programs.names)):
        if reasons and not last:
            break
        found = diagnose_few_draws({name: draws[name]}, sampler.n_ensembles)
        short = shortfalls(found, sampler.target_r_hat, sampler.target_ess)
        reasons, diagnostics = (*reasons, *short, *remembered(found, FORGETS * len(z))), diagnostics | found
    if strict and not reasons:
        reasons = uncertain_sds(sd_errors(draws), programs.settings.target_sd_error)
    steps = case.rounds * STEPS
    return BatchFit(z.reshape(-1, z.shape[-1]), "ensembles", case.fit.pareto_k, diagnostics, reasons, steps)


def by_nuts(programs: BatchPrograms, case: Case) -> BatchFit:
    """What NUTS makes of it, started from the weighted draws."""
    from bowdenfit.inference.nuts import sample

    assert case.weighted is not None  # nor is there anything to start from
    weights, rows = np.exp(_evened(programs, case.weighted)), case.weighted.z
    start = MaximumPosterior(weights @ rows, np.cov(rows.T, aweights=weights).reshape(rows.shape[1], -1))
    posterior = replace(programs.posterior, given=case.data)
    asked = Sampling(posterior, start, programs.settings.sampler, case.seed, diagnose=diagnose_few_draws)
    chain = sample(asked, programs.nuts)
    draws = {name: chain.z[..., i] for i, name in enumerate(programs.names)}
    reasons = chain.reasons or uncertain_sds(sd_errors(draws), programs.settings.target_sd_error)
    z = chain.z.reshape(-1, chain.z.shape[-1])
    return BatchFit(z, "nuts", case.fit.pareto_k, chain.diagnostics, reasons, chain.steps)
