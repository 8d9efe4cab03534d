"""Importance sampling of densities that take milliseconds, from mixtures that are learnt from weighted draws.

Friction that builds up while the rope creeps is followed through thousands of time steps for every density, and ensembles of
walkers need hundreds of thousands of densities before they agree. Here a mixture of Student t distributions is fitted to
weighted draws of the posterior, round by round, starting about its maximum; draws of the last mixture are weighted and kept.
Some ten thousand densities are enough. Independent batches of draws show by R-hat whether they agree, and Pareto k whether the
weights can be trusted.

Walkers with independent proposals from the same mixtures gave a third as many effective draws from as many densities.

References:
    Vehtari, Simpson, Gelman, Yao and Gabry 2024, "Pareto smoothed importance sampling" (JMLR 25).
    Cappé, Douc, Guillin, Marin and Robert 2008, "Adaptive importance sampling in general mixture classes" (Statistics and
    Computing 18), for learning from weighted draws of all rounds.
"""

import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.cable.sensors import RUN_SCATTER
from bowdenfit.inference.batch.weights import diagnose_weighted, effective_sample_size, even_weights, resample
from bowdenfit.inference.chain import Chain, Progress, SamplingRequest, worst_diagnostics
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.diagnostics import describe_convergence_shortfalls
from bowdenfit.inference.psis import describe_uneven_weights, smooth_weights
from bowdenfit.inference.resources import available_cores, linear_algebra_in_one_thread
from bowdenfit.inference.student_mixture import StudentMixture, start_mixture

_AT_ONCE = 64  # densities that one call computes
_DRAWS = 512  # draws of a round of learning, and of each batch between two checks
_ENOUGH = 500.0  # effective draws of all rounds from which the mixture is learnt well
_MOST_ROUNDS = 20  # of learning; ropes with five and nine parameters took 7 and 12
_LEAST_EFFICIENCY = 0.1  # effective draws per draw below which more of them would not help
_USUAL = 12_000  # densities that sampling usually takes in all, for the progress bar
_LEAST_PER_PARAMETER = 10  # effective draws per parameter to which weights are evened out, so that a mixture can be fitted
_PARTS, _WIDE, _WIDE_SHARE = 4, 2.0, 0.1  # components of the mixture, and the factor and weight of a wide one
# Degrees of freedom: those of the mean of four mountings. With five, effective draws of mu fell the more were drawn.
_FREEDOM = 3
_STREAM = 4


@dataclass(frozen=True)
class Densities:
    """Log densities of many points, computed on all cores.

    Args:
        program: Compiled function of `_AT_ONCE` points (rows) and of the data.
        data: The data.
    """

    program: Callable[..., Any]
    data: Any

    def __call__(self, z: np.ndarray) -> np.ndarray:
        """Return the log density of every row; minus infinity where it cannot be computed."""
        padded = np.concatenate([z, np.zeros((-len(z) % _AT_ONCE, z.shape[1]))])
        with ThreadPoolExecutor(available_cores()) as threads:
            values = list(threads.map(self._compute, padded.reshape(-1, _AT_ONCE, z.shape[1])))
        return np.concatenate(values)[: len(z)]

    def _compute(self, z: np.ndarray) -> np.ndarray:
        with jax.enable_x64(True):  # the setting is each thread's own
            return np.asarray(self.program(z, self.data))


def compile_densities(log_density: Callable[[Array, Any], Array], data: Any, size: int) -> Densities:
    """Compile a log density of one z and of data.

    Args:
        log_density: The log density.
        data: Its data.
        size: Number of parameters.
    """
    shape = jax.ShapeDtypeStruct((_AT_ONCE, size), jnp.float64)
    return Densities(compile_program(jax.vmap(log_density, (0, None)), shape, data, run_often=True), data)


def learn_proposal(densities: Densities, request: SamplingRequest) -> StudentMixture:
    """Return a mixture near the posterior, learnt from weighted draws of mixtures before it.

    With few mountings everything spreads wider the more mountings scatter, so components begin at different scatters.

    Args:
        densities: The log density.
        request: Start and seed.
    """
    start, generator = request.start, np.random.default_rng([request.seed, _STREAM])
    names = [parameter.name for parameter in request.posterior.model.space.free]
    scatter = names.index(RUN_SCATTER) if RUN_SCATTER in names else 0
    least = _LEAST_PER_PARAMETER * len(start.z)
    mixtures = [StudentMixture(start.z[None], np.linalg.cholesky(start.covariance)[None], np.ones(1), _FREEDOM)]
    z, value = np.empty((0, len(start.z))), np.empty(0)
    begin = time.monotonic()
    for _ in range(_MOST_ROUNDS):
        proposed = mixtures[-1].draw(generator, _DRAWS)
        z, value = np.concatenate([z, proposed]), np.concatenate([value, densities(proposed)])
        missing = (_USUAL - len(z)) * (time.monotonic() - begin) / len(z)
        request.report(Progress(len(z), request.settings.max_steps, None, None, "importance", missing))
        log_weights = value - np.logaddexp.reduce([mixture.log_density(z) for mixture in mixtures])
        if not np.isfinite(log_weights).any():
            mixtures.append(mixtures[-1])
            continue
        rows = z[resample(np.exp(even_weights(log_weights, least)), 4 * _DRAWS, 0.5)]
        rows = rows[np.argsort(rows[:, scatter])]
        mixture = start_mixture(rows, _PARTS, _FREEDOM).refine(rows)
        mixtures.append(mixture.with_wide_component(rows, _WIDE, _WIDE_SHARE))
        if effective_sample_size(log_weights) >= _ENOUGH:
            break
    return mixtures[-1]


@linear_algebra_in_one_thread()
def sample(request: SamplingRequest, densities: Densities) -> Chain:
    """Draw from a learnt mixture until the weighted draws suffice, or until more would not help.

    Draws take less than a minute, so they are not stored in the checkpoint: a sampling that was interrupted starts again.

    Args:
        request: Posterior, start, settings and seed. Each batch of draws counts as a chain, of `max_steps` draws at most.
        densities: The log density.
    """
    proposal, n_batches, size = learn_proposal(densities, request), request.settings.n_ensembles, len(request.start.z)
    names, generator = [p.name for p in request.posterior.model.space.free], np.random.default_rng([request.seed, 0])
    log_ratio, z = np.empty((n_batches, 0)), np.empty((n_batches, 0, size))
    derived = dict[str, np.ndarray]()
    while True:
        proposed = generator.permutation(proposal.draw(generator, n_batches * _DRAWS))
        ratios = (densities(proposed) - proposal.log_density(proposed)).reshape(n_batches, _DRAWS)
        more = {name: np.reshape(values, ratios.shape) for name, values in request.quantities(proposed).items()}
        log_ratio = np.concatenate([log_ratio, ratios], axis=1)
        z = np.concatenate([z, proposed.reshape(n_batches, _DRAWS, size)], axis=1)
        derived = {name: np.concatenate([derived.get(name, values[:, :0]), values], axis=1) for name, values in more.items()}
        chain = _make_chain(request, z, {name: z[..., i] for i, name in enumerate(names)}, derived, log_ratio)
        request.report(Progress(log_ratio.size, request.settings.max_steps, *worst_diagnostics(chain), "importance"))
        hopeless = chain.acceptance < _LEAST_EFFICIENCY or chain.pareto_k == float("inf")
        if not chain.reasons or hopeless or chain.steps + _DRAWS > request.settings.max_steps:
            return chain


def _make_chain(
    request: SamplingRequest,
    z: np.ndarray,
    parameters: Mapping[str, np.ndarray],
    derived: Mapping[str, np.ndarray],
    log_ratio: np.ndarray,
) -> Chain:
    """Return draws of equal weight, with diagnostics of the weighted ones.

    Args:
        request: Settings and seed.
        z: All draws, (batch, draw, parameter).
        parameters, derived: The same by name, and derived quantities, (batch, draw).
        log_ratio: Log density less that of the proposal, (batch, draw).
    """
    settings, (n_batches, n_draws) = request.settings, log_ratio.shape
    smoothed, pareto_k = smooth_weights(log_ratio.ravel())
    weights = np.exp(smoothed).reshape(log_ratio.shape)
    per_batch, shuffled = 2 * settings.target_ess // n_batches, np.random.default_rng([request.seed, 1])
    chosen = np.stack([shuffled.permutation(resample(row / row.sum(), per_batch, 0.5)) for row in weights])
    every = {**parameters, **derived}
    equal = {name: np.take_along_axis(values, chosen, axis=1) for name, values in every.items()}
    of_batches = request.diagnose(equal, n_batches)
    of_weights = diagnose_weighted(
        np.stack([values.ravel() for values in every.values()], axis=1), weights.ravel(), tuple(every)
    )
    diagnostics = {name: replace(d, r_hat=of_batches[name].r_hat, drift=0.0) for name, d in of_weights.items()}
    reasons = (
        *describe_uneven_weights(pareto_k, log_ratio.size),
        *describe_convergence_shortfalls(diagnostics, settings.target_r_hat, settings.target_ess),
    )
    return Chain(
        np.take_along_axis(z, chosen[..., None], axis=1),
        {name: equal[name] for name in derived},
        diagnostics,
        n_batches,
        steps=n_draws,
        acceptance=effective_sample_size(smoothed) / log_ratio.size,
        reasons=reasons,
        sampler="importance",
        pareto_k=pareto_k,
    )
