"""Fit many data sets of one shape with the same programs, each by the cheapest engine whose own checks it passes.

First importance sampling from a mixture about the maxima of the posterior: the Pareto k of the weights and the effective sample
size decide whether it is accepted, and it is given up early where the first draws are worth little. Then ensembles of walkers,
started from draws of a mixture learnt from those, in rounds until they agree. Then NUTS. The result of a data set depends on
its own data and seed alone, not on the other data sets.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from operator import attrgetter
from threading import Event
from typing import Any, NamedTuple, TypeVar

import jax
import numpy as np

from bowdenfit.inference import nuts
from bowdenfit.inference.batch.laplace import fit_mixtures
from bowdenfit.inference.batch.programs import (
    STATES_PER_ROUND,
    STEPS_PER_ROUND,
    BatchPrograms,
    BatchSettings,
    stack_data,
)
from bowdenfit.inference.batch.weights import (
    ImportanceSampler,
    MaximaProposal,
    ProposedPoints,
    WeightedDraws,
    even_weights,
    resample,
)
from bowdenfit.inference.chain import SamplingRequest, describe_stuck_walkers
from bowdenfit.inference.diagnostics import (
    MAXIMUM_DRIFT,
    Diagnostics,
    array_stats,
    describe_convergence_shortfalls,
    describe_low_ess,
    diagnose_all,
)
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.resources import linear_algebra_in_one_thread
from bowdenfit.inference.student_mixture import StudentMixture
from bowdenfit.words import percent

_FIRST_CHECK = 3  # rounds of walkers before convergence is first checked
_KEPT_PER_WALKER, _KEPT_PER_WALKER_FOR_SDS = 20, 100  # draws kept; standard deviations in long tails need more
ESS_PER_WALKER = 2  # effective draws per walker, so that the start of each is forgotten
_ESS_PER_START = 2  # least effective draws per walker among the weighted draws that ensembles start from
_NOT_COMPUTABLE = (
    "the model cannot be computed at the prior medians or anywhere near; the usual cause is a prior or a fixed value that is "
    "orders of magnitude off"
)
_ENOUGH = 1000.0  # effective draws beyond which drift is no longer judged more strictly
Argument, Result = TypeVar("Argument"), TypeVar("Result")


@dataclass(frozen=True)
class BatchFit:
    """The fit of one data set.

    Args:
        z: Draws of the posterior, equally weighted, (draw, parameter); none where nothing could be computed.
        engine: "laplace" (weighted draws), "ensembles" or "nuts".
        pareto_k: Pareto k of the importance weights; infinite where there are none.
        diagnostics: Diagnostics by parameter; weighted draws have no R-hat and no drift.
        reasons: Why the draws should not be trusted; empty if they can be.
        steps: Steps of each walker or chain; 0 for weighted draws.
    """

    z: np.ndarray
    engine: str
    pareto_k: float
    diagnostics: dict[str, Diagnostics]
    reasons: tuple[str, ...]
    steps: int = 0


class DatasetStart(NamedTuple):
    """A data set that is ready to be sampled.

    Args:
        data: Its data.
        seed: Its seed.
        first: Mixture that the first draws are proposed from; None where the density cannot be computed.
    """

    data: Any
    seed: int
    first: StudentMixture | None


class DatasetOutcome(NamedTuple):
    """A data set after weighted draws and walkers.

    Args:
        dataset: The data set.
        fit: Its fit so far.
        start: Where NUTS can start; None where the draws are good, or nothing can be computed.
    """

    dataset: DatasetStart
    fit: BatchFit
    start: MaximumPosterior | None


def start_chunk(programs: BatchPrograms, parts: list[tuple[Any, int]]) -> list[DatasetStart]:
    """Fit the first proposals of a chunk of data sets with their seeds."""
    chunk = programs.settings.chunk
    seeds, data = np.array([seed for _, seed in parts]), stack_data([data for data, _ in parts], chunk)
    padded = np.concatenate([seeds, np.repeat(seeds[-1:], chunk - len(seeds))])
    mixtures = fit_mixtures(lambda z: programs.gradients(z, data), programs.noise, programs.friction, padded)
    return [DatasetStart(*part, first) for part, first in zip(parts, mixtures, strict=False)]


def sample_dataset(programs: BatchPrograms, dataset: DatasetStart, stopped: Callable[[], bool]) -> DatasetOutcome:
    """Draw from a data set's posterior by importance sampling or, where that is not good enough, by walkers.

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
    """Return where NUTS can start."""
    weights = np.exp(_even_log_weights(programs, near))
    return MaximumPosterior(weights @ near.z, np.cov(near.z.T, aweights=weights).reshape(near.z.shape[1], -1))


def _fit_by_weights(programs: BatchPrograms, weighted: WeightedDraws | None) -> BatchFit:
    """Resample weighted draws to equal weights, with their diagnostics."""
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
    """Return the second half of the walkers' paths, checked for convergence until they pass or have reached the step limit."""
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
    """Choose different weighted draws as starts, (ensemble, walker, parameter)."""
    n_ensembles, generator = programs.settings.sampler.n_ensembles, np.random.default_rng([seed, 2])
    log_weights = _even_log_weights(programs, near)
    # The largest of weights times exponential numbers are a sample without replacement.
    chosen = np.argsort(log_weights + generator.gumbel(size=len(log_weights)))[-n_ensembles * programs.n_walkers :]
    return near.z[generator.permutation(chosen)].reshape(n_ensembles, programs.n_walkers, -1)


def _even_log_weights(programs: BatchPrograms, weighted: WeightedDraws) -> np.ndarray:
    """Return log weights, made more even where too few effective draws are left to start walkers from."""
    return even_weights(
        weighted.log_weights, _ESS_PER_START * programs.settings.sampler.n_ensembles * programs.n_walkers
    )


def _summarize_walkers(programs: BatchPrograms, late: np.ndarray, short_before: list[str], last: bool) -> BatchFit:
    """Return draws and diagnostics of walker states, (state, ensemble, walker, parameter).

    Args:
        programs: The compiled programs.
        late: The states.
        short_before: Parameters that had not converged at the last check; they are checked first.
        last: Whether the walkers stop here; otherwise the check ends with the first parameter that has not converged.
    """
    sampler = programs.settings.sampler
    strict = bool(np.isfinite(programs.settings.target_sd_error))
    per_walker = _KEPT_PER_WALKER_FOR_SDS if strict else _KEPT_PER_WALKER
    retained = np.unique(np.linspace(0, len(late) - 1, per_walker).round().astype(int))
    z = late[retained].transpose(1, 2, 0, 3).reshape(-1, len(retained), len(programs.names))
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
    """Sample a data set by NUTS."""
    posterior = replace(programs.posterior, data_override=outcome.dataset.data)
    request = SamplingRequest(
        posterior, start, programs.settings.sampler, outcome.dataset.seed, diagnose=diagnose_few_draws
    )
    chain = nuts.sample(request, programs.nuts)
    draws = {name: chain.z[..., i] for i, name in enumerate(programs.names)}
    reasons = chain.reasons or describe_uncertain_sds(estimate_sd_errors(draws), programs.settings.target_sd_error)
    z = chain.z.reshape(-1, chain.z.shape[-1])
    return BatchFit(z, "nuts", outcome.fit.pareto_k, chain.diagnostics, reasons, chain.steps)


def diagnose_few_draws(draws: Mapping[str, np.ndarray], n_ensembles: int) -> dict[str, Diagnostics]:
    """Return diagnostics of a few hundred effective draws.

    Two halves of n effective draws differ by 2 / sqrt(n) of their spread by chance alone. `MAXIMUM_DRIFT` is 2.5 / sqrt(n) at a
    thousand. Here twice that is allowed, computed with at most a thousand effective draws, so that fits that had to continue
    for another reason are not judged more strictly.
    """
    diagnostics = diagnose_all(draws, n_ensembles)
    allowed = {
        name: 2.5 / np.sqrt(np.clip(min(d.ess_bulk, d.ess_tail), 1.0, _ENOUGH)) for name, d in diagnostics.items()
    }
    return {
        name: replace(d, drift=float(d.drift / allowed[name]) / 2 * MAXIMUM_DRIFT) for name, d in diagnostics.items()
    }


def describe_remembered_starts(diagnostics: Mapping[str, Diagnostics], least: int) -> tuple[str, ...]:
    """Describe parameters with too few effective draws for walkers to have forgotten their starts."""
    return tuple(
        describe_low_ess(f"the middle of {name}", d.ess_bulk, least)
        for name, d in diagnostics.items()
        if not d.ess_bulk >= least
    )


def estimate_sd_errors(draws: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Return the Monte Carlo error of each standard deviation, relative to it, from draws (walker, draw)."""
    return {
        name: float(array_stats().mcse(values, method="sd", chain_axis=0, draw_axis=1) / np.std(values))
        for name, values in draws.items()
        if np.ptp(values) > 0
    }


def describe_uncertain_sds(errors: Mapping[str, float], most: float) -> tuple[str, ...]:
    """Describe standard deviations that are not known well enough; empty if all are."""
    return tuple(
        f"the standard deviation of {name} is known to {percent(error)} and should be known to {percent(most)}"
        for name, error in errors.items()
        if not error <= most
    )


@linear_algebra_in_one_thread()
def fit_batch(
    posterior: LogDensity,
    data: Sequence[Any],
    seeds: Sequence[int],
    settings: BatchSettings | None = None,
    programs: BatchPrograms | None = None,
) -> list[BatchFit]:
    """Fit data sets of one shape; return one fit for each, in order.

    Args:
        posterior: The posterior, whose model is shared by all data sets.
        data: `posterior.data` of every data set; all arrays of the same shapes.
        seeds: One seed for every data set, which with its data determines its draws.
        settings: Sampler settings and targets.
        programs: Programs compiled for another batch of the same shape and model; their settings are used.
    """
    programs = programs or BatchPrograms(posterior, settings or BatchSettings())
    parts, pool, stop = list(zip(data, seeds, strict=True)), ThreadPoolExecutor(programs.threads), Event()
    try:
        needed = ("gradients", "evaluate_points", "noise", "friction", "names")  # by all, so before any
        for future in [pool.submit(_in_64_bits, attrgetter(name), programs) for name in needed]:
            future.result()
        start = partial(_in_64_bits, partial(start_chunk, programs))
        chunks = [pool.submit(start, chunk) for chunk in _split(parts, programs.settings.chunk)]
        drawing = partial(_in_64_bits, partial(sample_dataset, programs, stopped=stop.is_set))
        futures = [pool.submit(drawing, dataset) for chunk in chunks for dataset in chunk.result()]
        outcomes = [future.result() for future in futures]
    finally:  # an interrupt, or an error of one data set, waits for none of the others
        stop.set()
        pool.shutdown(wait=False, cancel_futures=True)
    use_nuts = programs.settings.nuts
    return [
        sample_by_nuts(programs, future, future.start) if use_nuts and future.start is not None else future.fit
        for future in outcomes
    ]


def _in_64_bits(function: Callable[[Argument], Result], argument: Argument) -> Result:
    """Call a function with 64-bit floats enabled, a JAX setting of each thread."""
    with jax.enable_x64(True):
        return function(argument)


def _split(parts: Sequence[Any], count: int) -> list[list[Any]]:
    return [list(parts[i : i + count]) for i in range(0, len(parts), count)]
