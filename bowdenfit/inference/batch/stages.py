"""The stages of one data set of a batch: weighted draws, and walkers whose paths are looked at from time to time; then NUTS."""

from collections.abc import Callable
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from bowdenfit.inference.batch.diagnostics import diagnose_few_draws, sd_errors, starts_not_forgotten, uncertain_sds
from bowdenfit.inference.batch.ensembles import STEPS, STORED
from bowdenfit.inference.batch.laplace import about_maxima
from bowdenfit.inference.batch.mixture import StudentMixture
from bowdenfit.inference.batch.programs import CHUNK, BatchPrograms, stack_data
from bowdenfit.inference.batch.proposals import MaximaProposal, ProposedPoints
from bowdenfit.inference.batch.weights import Target, WeightedDraws, even_weights, resample
from bowdenfit.inference.chain import SamplingRequest, stuck_walkers
from bowdenfit.inference.diagnostics import Diagnostics, convergence_shortfalls
from bowdenfit.inference.least_squares import MaximumPosterior

_FIRST_LOOK = 3  # rounds of walkers before the first look
_KEPT_PER_WALKER, _KEPT_PER_WALKER_FOR_SDS = 20, 100
FORGETS = 2  # effective draws that each walker makes by itself, so that where it started is forgotten
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


class DatasetStart(NamedTuple):
    """A data set.

    Args:
        data: Its data.
        seed: Its seed.
        first: What is drawn from first; None where nothing can be computed.
    """

    data: Any
    seed: int
    first: StudentMixture | None


class DatasetOutcome(NamedTuple):
    """What weighted draws and walkers made of a data set.

    Args:
        begun: The data set.
        fit: What came of it.
        start: Where NUTS may start; None where draws are good, or nothing can be computed.
    """

    begun: DatasetStart
    fit: BatchFit
    start: MaximumPosterior | None


def start_chunk(programs: BatchPrograms, parts: list[tuple[Any, int]]) -> list[DatasetStart]:
    """What draws of a chunk of data sets with their seeds are proposed from first."""
    seeds, data = np.array([seed for _, seed in parts]), stack_data([data for data, _ in parts], CHUNK)
    padded = np.concatenate([seeds, np.repeat(seeds[-1:], CHUNK - len(seeds))])
    found = about_maxima(lambda z: programs.gradients(z, data), programs.noise, programs.friction, padded)
    return [DatasetStart(*part, first) for part, first in zip(parts, found, strict=False)]


def sample_dataset(programs: BatchPrograms, begun: DatasetStart, stopped: Callable[[], bool]) -> DatasetOutcome:
    """Weighted draws of a data set or, where these are not enough, those of walkers.

    Raises:
        CancelledError: It is stopped.
    """
    data, seed, first = begun
    if first is None:
        return DatasetOutcome(begun, _by_weights(programs, None), None)
    target = Target(
        lambda given, is_z: ProposedPoints(*map(np.asarray, programs.places(given, is_z, data))),
        programs.friction,
        lambda found: found.is_reliable and not _by_weights(programs, found).reasons,
    )
    proposal, generator = MaximaProposal(first), np.random.default_rng([seed, 1])
    weighted = target.weighted(proposal, generator)
    fit = _by_weights(programs, weighted)
    if not (fit.reasons and len(fit.z)):
        return DatasetOutcome(begun, fit, None)
    near = target.nearer(weighted, proposal, generator)
    fit = replace(_walked(programs, begun, near, stopped), pareto_k=fit.pareto_k)
    return DatasetOutcome(begun, fit, _start_of(programs, near) if fit.reasons else None)


def _start_of(programs: BatchPrograms, near: WeightedDraws) -> MaximumPosterior:
    """Where NUTS may start."""
    weights = np.exp(_evened(programs, near))
    return MaximumPosterior(weights @ near.z, np.cov(near.z.T, aweights=weights).reshape(near.z.shape[1], -1))


def _by_weights(programs: BatchPrograms, weighted: WeightedDraws | None) -> BatchFit:
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


def _walked(programs: BatchPrograms, begun: DatasetStart, near: WeightedDraws, stopped: Callable[[], bool]) -> BatchFit:
    """What the second half of the walkers' paths says, looked at until it is enough or they have gone as far as they may."""
    limit = max(programs.settings.sampler.max_steps // STEPS, _FIRST_LOOK)
    with programs.compiling:  # by the first that needs it
        walk = programs.ensembles
    walkers, path, diagnostics = _starts(programs, near, begun.seed), list[np.ndarray](), dict[str, Diagnostics]()
    rounds, target = 0, _FIRST_LOOK
    while True:
        for number in range(rounds, target):
            if stopped():
                raise CancelledError
            path.append(np.asarray(walk(np.uint32(begun.seed), np.uint32(number), walkers, begun.data)))
            walkers = path[-1][-1]
        rounds, path = target, path[-(target + 1) // 2 :]  # no more than the second half can be asked for
        late = np.concatenate(path)[-(rounds * STORED // 2) :]
        fit = _by_ensembles(programs, late, [*diagnostics][-1:], last=rounds == limit)
        fit, diagnostics = replace(fit, steps=rounds * STEPS), fit.diagnostics
        if not fit.reasons or rounds == limit:
            return fit
        target = min(rounds + max(rounds // 3, 1), limit)


def _starts(programs: BatchPrograms, near: WeightedDraws, seed: int) -> np.ndarray:
    """Different ones of weighted draws, (ensemble, walker, parameter)."""
    n_ensembles, generator = programs.settings.sampler.n_ensembles, np.random.default_rng([seed, 2])
    log_weights = _evened(programs, near)
    # The largest of weights times exponential numbers are a sample without replacement.
    chosen = np.argsort(log_weights + generator.gumbel(size=len(log_weights)))[-n_ensembles * programs.n_walkers :]
    return near.z[generator.permutation(chosen)].reshape(n_ensembles, programs.n_walkers, -1)


def _evened(programs: BatchPrograms, weighted: WeightedDraws) -> np.ndarray:
    """Log weights, more even where draws are worth too few to start walkers from."""
    return even_weights(weighted.log_weights, _SPREAD * programs.settings.sampler.n_ensembles * programs.n_walkers)


def _by_ensembles(programs: BatchPrograms, late: np.ndarray, asked_before: list[str], last: bool) -> BatchFit:
    """What states of walkers say, (state, ensemble, walker, parameter).

    Args:
        programs: What is compiled.
        late: The states.
        asked_before: What asked for more at the last look.
        last: Whether no walkers go on; else diagnostics end with the first parameter that asks for more.
    """
    sampler = programs.settings.sampler
    strict = bool(np.isfinite(programs.settings.target_sd_error))
    per_walker = _KEPT_PER_WALKER_FOR_SDS if strict else _KEPT_PER_WALKER
    kept = np.unique(np.linspace(0, len(late) - 1, per_walker).round().astype(int))
    z = late[kept].transpose(1, 2, 0, 3).reshape(-1, len(kept), len(programs.names))
    draws = {name: z[..., i] for i, name in enumerate(programs.names)}
    diagnostics, reasons = dict[str, Diagnostics](), stuck_walkers(z)
    for name in dict.fromkeys((*asked_before, *programs.names)):
        if reasons and not last:
            break
        found = diagnose_few_draws({name: draws[name]}, sampler.n_ensembles)
        short = convergence_shortfalls(found, sampler.target_r_hat, sampler.target_ess)
        reasons, diagnostics = (*reasons, *short, *starts_not_forgotten(found, FORGETS * len(z))), diagnostics | found
    if strict and not reasons:
        reasons = uncertain_sds(sd_errors(draws), programs.settings.target_sd_error)
    return BatchFit(z.reshape(-1, z.shape[-1]), "ensembles", float("inf"), diagnostics, reasons)


def sample_by_nuts(programs: BatchPrograms, ended: DatasetOutcome, start: MaximumPosterior) -> BatchFit:
    """What NUTS makes of it."""
    from bowdenfit.inference.nuts import sample

    posterior = replace(programs.posterior, given=ended.begun.data)
    asked = SamplingRequest(posterior, start, programs.settings.sampler, ended.begun.seed, diagnose=diagnose_few_draws)
    chain = sample(asked, programs.nuts)
    draws = {name: chain.z[..., i] for i, name in enumerate(programs.names)}
    reasons = chain.reasons or uncertain_sds(sd_errors(draws), programs.settings.target_sd_error)
    z = chain.z.reshape(-1, chain.z.shape[-1])
    return BatchFit(z, "nuts", ended.fit.pareto_k, chain.diagnostics, reasons, chain.steps)
