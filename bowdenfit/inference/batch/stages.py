"""The stages of one data set of a batch: weighted draws, and walkers whose paths are looked at from time to time; then NUTS."""

from collections.abc import Callable
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from bowdenfit.inference.batch.diagnostics import (
    describe_remembered_starts,
    describe_uncertain_sds,
    diagnose_few_draws,
    estimate_sd_errors,
)
from bowdenfit.inference.batch.ensembles import STATES_PER_ROUND, STEPS_PER_ROUND
from bowdenfit.inference.batch.laplace import fit_mixtures
from bowdenfit.inference.batch.mixture import StudentMixture
from bowdenfit.inference.batch.programs import CHUNK, BatchPrograms, stack_data
from bowdenfit.inference.batch.proposals import MaximaProposal, ProposedPoints
from bowdenfit.inference.batch.weights import ImportanceSampler, WeightedDraws, even_weights, resample
from bowdenfit.inference.chain import SamplingRequest, describe_stuck_walkers
from bowdenfit.inference.diagnostics import Diagnostics, describe_convergence_shortfalls
from bowdenfit.inference.least_squares import MaximumPosterior

_FIRST_CHECK = 3  # rounds of walkers before the first look
_KEPT_PER_WALKER, _KEPT_PER_WALKER_FOR_SDS = 20, 100
ESS_PER_WALKER = 2  # effective draws that each walker makes by itself, so that where it started is forgotten
_ESS_PER_START = 2  # effective draws for every walker that the starts of ensembles are drawn from, at the least
_NOT_COMPUTABLE = (
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

    dataset: DatasetStart
    fit: BatchFit
    start: MaximumPosterior | None


def start_chunk(programs: BatchPrograms, parts: list[tuple[Any, int]]) -> list[DatasetStart]:
    """What draws of a chunk of data sets with their seeds are proposed from first."""
    seeds, data = np.array([seed for _, seed in parts]), stack_data([data for data, _ in parts], CHUNK)
    padded = np.concatenate([seeds, np.repeat(seeds[-1:], CHUNK - len(seeds))])
    mixtures = fit_mixtures(lambda z: programs.gradients(z, data), programs.noise, programs.friction, padded)
    return [DatasetStart(*part, first) for part, first in zip(parts, mixtures, strict=False)]


def sample_dataset(programs: BatchPrograms, dataset: DatasetStart, stopped: Callable[[], bool]) -> DatasetOutcome:
    """Weighted draws of a data set or, where these are not enough, those of walkers.

    Raises:
        CancelledError: It is stopped.
    """
    data, seed, first = dataset
    if first is None:
        return DatasetOutcome(dataset, _fit_by_weights(programs, None), None)
    target = ImportanceSampler(
        lambda points, is_z: ProposedPoints(*map(np.asarray, programs.evaluate_points(points, is_z, data))),
        programs.friction,
        lambda draws: draws.is_reliable and not _fit_by_weights(programs, draws).reasons,
    )
    proposal, generator = MaximaProposal(first), np.random.default_rng([seed, 1])
    weighted = target.draw_enough(proposal, generator)
    fit = _fit_by_weights(programs, weighted)
    if not (fit.reasons and len(fit.z)):
        return DatasetOutcome(dataset, fit, None)
    near = target.draw_nearer(weighted, proposal, generator)
    fit = replace(_fit_by_walkers(programs, dataset, near, stopped), pareto_k=fit.pareto_k)
    return DatasetOutcome(dataset, fit, _nuts_start(programs, near) if fit.reasons else None)


def _nuts_start(programs: BatchPrograms, near: WeightedDraws) -> MaximumPosterior:
    """Where NUTS may start."""
    weights = np.exp(_even_log_weights(programs, near))
    return MaximumPosterior(weights @ near.z, np.cov(near.z.T, aweights=weights).reshape(near.z.shape[1], -1))


def _fit_by_weights(programs: BatchPrograms, weighted: WeightedDraws | None) -> BatchFit:
    """What weighted draws say, as draws of equal weight."""
    settings = programs.settings
    least = _ESS_PER_START * programs.n_walkers * settings.sampler.n_ensembles
    if weighted is None or np.isfinite(weighted.log_density).sum() < least:
        return BatchFit(np.zeros((0, len(programs.names))), "laplace", float("inf"), {}, (_NOT_COMPUTABLE,))
    diagnostics = weighted.diagnose(programs.names)
    reasons = weighted.describe_shortfalls(diagnostics, settings.sampler.target_ess)
    reasons += describe_uncertain_sds(weighted.estimate_sd_errors(programs.names), settings.target_sd_error)
    kept = resample(np.exp(weighted.log_weights), settings.n_kept, 0.5)
    return BatchFit(weighted.z[kept], "laplace", weighted.pareto_k, diagnostics, reasons)


def _fit_by_walkers(
    programs: BatchPrograms, dataset: DatasetStart, near: WeightedDraws, stopped: Callable[[], bool]
) -> BatchFit:
    """What the second half of the walkers' paths says, looked at until it is enough or they have gone as far as they may."""
    limit = max(programs.settings.sampler.max_steps // STEPS_PER_ROUND, _FIRST_CHECK)
    with programs.compiling:  # by the first that needs it
        walk = programs.ensembles
    walkers, path, diagnostics = (
        _choose_starts(programs, near, dataset.seed),
        list[np.ndarray](),
        dict[str, Diagnostics](),
    )
    rounds, target = 0, _FIRST_CHECK
    while True:
        for number in range(rounds, target):
            if stopped():
                raise CancelledError
            path.append(np.asarray(walk(np.uint32(dataset.seed), np.uint32(number), walkers, dataset.data)))
            walkers = path[-1][-1]
        rounds, path = target, path[-(target + 1) // 2 :]  # no more than the second half can be asked for
        late = np.concatenate(path)[-(rounds * STATES_PER_ROUND // 2) :]
        fit = _summarize_walkers(programs, late, [*diagnostics][-1:], last=rounds == limit)
        fit, diagnostics = replace(fit, steps=rounds * STEPS_PER_ROUND), fit.diagnostics
        if not fit.reasons or rounds == limit:
            return fit
        target = min(rounds + max(rounds // 3, 1), limit)


def _choose_starts(programs: BatchPrograms, near: WeightedDraws, seed: int) -> np.ndarray:
    """Different ones of weighted draws, (ensemble, walker, parameter)."""
    n_ensembles, generator = programs.settings.sampler.n_ensembles, np.random.default_rng([seed, 2])
    log_weights = _even_log_weights(programs, near)
    # The largest of weights times exponential numbers are a sample without replacement.
    chosen = np.argsort(log_weights + generator.gumbel(size=len(log_weights)))[-n_ensembles * programs.n_walkers :]
    return near.z[generator.permutation(chosen)].reshape(n_ensembles, programs.n_walkers, -1)


def _even_log_weights(programs: BatchPrograms, weighted: WeightedDraws) -> np.ndarray:
    """Log weights, more even where draws are worth too few to start walkers from."""
    return even_weights(
        weighted.log_weights, _ESS_PER_START * programs.settings.sampler.n_ensembles * programs.n_walkers
    )


def _summarize_walkers(programs: BatchPrograms, late: np.ndarray, short_before: list[str], last: bool) -> BatchFit:
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
    diagnostics, reasons = dict[str, Diagnostics](), describe_stuck_walkers(z)
    for name in dict.fromkeys((*short_before, *programs.names)):
        if reasons and not last:
            break
        found_diagnostics = diagnose_few_draws({name: draws[name]}, sampler.n_ensembles)
        short = describe_convergence_shortfalls(found_diagnostics, sampler.target_r_hat, sampler.target_ess)
        reasons, diagnostics = (
            (*reasons, *short, *describe_remembered_starts(found_diagnostics, ESS_PER_WALKER * len(z))),
            diagnostics | found_diagnostics,
        )
    if strict and not reasons:
        reasons = describe_uncertain_sds(estimate_sd_errors(draws), programs.settings.target_sd_error)
    return BatchFit(z.reshape(-1, z.shape[-1]), "ensembles", float("inf"), diagnostics, reasons)


def sample_by_nuts(programs: BatchPrograms, outcome: DatasetOutcome, start: MaximumPosterior) -> BatchFit:
    """What NUTS makes of it."""
    from bowdenfit.inference.nuts import sample

    posterior = replace(programs.posterior, data_override=outcome.dataset.data)
    request = SamplingRequest(
        posterior, start, programs.settings.sampler, outcome.dataset.seed, diagnose=diagnose_few_draws
    )
    chain = sample(request, programs.nuts)
    draws = {name: chain.z[..., i] for i, name in enumerate(programs.names)}
    reasons = chain.reasons or describe_uncertain_sds(estimate_sd_errors(draws), programs.settings.target_sd_error)
    z = chain.z.reshape(-1, chain.z.shape[-1])
    return BatchFit(z, "nuts", outcome.fit.pareto_k, chain.diagnostics, reasons, chain.steps)
