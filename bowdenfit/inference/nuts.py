"""Sampling with the No-U-Turn sampler (blackjax): several chains side by side, tuned together, run until they agree.

One compiled program takes every chain some steps further. While tuning, each chain adapts its step size, and between
windows the mass matrix becomes the covariance of all chains' draws; the first is that of the maximum of the posterior.

Posteriors of few readings are funnels: where the scatter is small, so are the ranges of the coefficients, and a step size that
suits other regions is too long to enter and leave this one. So every tenth trajectory takes steps sixteen times finer; a region
is out of reach only if these trajectories diverge too.

References:
    Hoffman and Gelman 2014, "The No-U-Turn sampler" (Journal of Machine Learning Research 15); Betancourt 2017, "A
    conceptual introduction to Hamiltonian Monte Carlo" (arXiv:1701.02434).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import accumulate
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from blackjax.adaptation.step_size import DualAveragingAdaptationState, dual_averaging_adaptation
from blackjax.mcmc import nuts
from jax import Array

from bowdenfit.description import SamplerSettings
from bowdenfit.description.defaults import KEPT_OF_CHAINS
from bowdenfit.inference.chain import Chain, Progress, SamplingRequest, describe_stuck_walkers, worst_diagnostics
from bowdenfit.inference.checkpoint import append_record, read_records
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.diagnostics import Trajectories, compute_energy_mixing, describe_trajectory_shortfalls
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import noise_scales

BLOCK = 50  # steps between two progress reports
WINDOWS = (1, 1, 2, 4, 2)  # blocks of warm-up with one mass matrix each, doubling as in Stan; the last tunes the step size only
WARM_UP = sum(WINDOWS)
MOST_DOUBLINGS = 10  # largest tree depth of a trajectory, blackjax's and Stan's default
# One trajectory in FINE_EVERY takes steps FINE_FACTOR times finer; FINE_EVERY divides BLOCK.
FINE_EVERY, FINE_FACTOR = 10, 16
_FIRST_CHECK = 5  # blocks of draws before convergence is first checked
_FIRST_STEP, _STREAM = 0.1, 3
_STATISTICS = ("diverging", "energy", "acceptance_rate", "tree_depth", "n_steps")

Block: TypeAlias = dict[str, np.ndarray]  # positions and statistics of the steps, and the tuning at the end


def compile_nuts(posterior: LogDensity, settings: SamplerSettings) -> Callable[..., Any]:
    """Compile `BLOCK` steps of every chain; the result depends on the seed and the number of the block alone.

    Args:
        posterior: The posterior.
        settings: Number of chains, and target acceptance of their step sizes.
    """
    size = posterior.model.space.size
    return compile_block(posterior.log_density, (size, size), posterior.data, settings)


def compile_block(
    log_density: Callable[[Array, Any], Array],
    mass: tuple[int, ...],
    data: Any,
    settings: SamplerSettings,
    fine: bool = True,
) -> Callable[..., Any]:
    """Compile `BLOCK` steps of every chain for any density.

    Args:
        log_density: Log density of z and data.
        mass: Shape of the inverse mass matrix; of one dimension where it is diagonal.
        data: Data, or their shapes.
        settings: Number of chains, and target acceptance of their step sizes.
        fine: Whether every tenth trajectory takes finer steps.
    """
    chains, finer = settings.n_chains, _is_fine(BLOCK) & fine
    kernel, (_, adapted, _) = nuts.build_kernel(), dual_averaging_adaptation(settings.target_acceptance)

    def block(
        seed: Array, number: Array, z: Array, tuning: Array, adapting: Array, inverse_mass: Array, data: Any
    ) -> dict[str, Array]:
        def density(z: Array) -> Array:
            return log_density(z, data)

        def move(key: Array, state: Any, step_size: Array) -> Any:
            return kernel(key, state, density, step_size, inverse_mass, MOST_DOUBLINGS)

        def step(carried: Any, turn: Any) -> Any:
            (states, tuning), (key, fine) = carried, turn
            step_sizes = jnp.exp(jnp.where(adapting, tuning.log_step_size, tuning.log_step_size_avg))
            step_sizes = jnp.where(fine, step_sizes / FINE_FACTOR, step_sizes)
            states, info = jax.vmap(move)(jax.random.split(key, chains), states, step_sizes)
            acceptance = jnp.nan_to_num(info.acceptance_rate)
            changed = jax.vmap(adapted)(tuning, acceptance)
            tuning = jax.tree.map(lambda new, old: jnp.where(adapting & ~fine, new, old), changed, tuning)
            lengths = info.num_trajectory_expansions, info.num_integration_steps
            return (states, tuning), (states.position, info.is_divergent, info.energy, acceptance, *lengths)

        keys = jax.random.split(jax.random.fold_in(jax.random.key(seed), number), BLOCK)
        states = jax.vmap(lambda one: nuts.init(one, density))(z)
        carried = states, DualAveragingAdaptationState(*tuning)
        (_, tuned), steps = jax.lax.scan(step, carried, (keys, finer))
        result = dict(zip(("z", *_STATISTICS), steps, strict=True))
        return result | {"tuning": jnp.stack(tuned), "inverse_mass": inverse_mass}

    integer, flag = jax.ShapeDtypeStruct((), jnp.uint32), jax.ShapeDtypeStruct((), jnp.bool_)
    shapes = [jax.ShapeDtypeStruct(shape, jnp.float64) for shape in ((chains, mass[0]), (5, chains), mass)]
    return compile_program(block, integer, integer, shapes[0], shapes[1], flag, shapes[2], data)


def _is_fine(steps: int) -> np.ndarray:
    """Return which of the steps are fine."""
    return np.arange(steps) % FINE_EVERY == FINE_EVERY - 1


def draw_starting_points(
    posterior: LogDensity, start: MaximumPosterior, settings: SamplerSettings, generator: np.random.Generator
) -> np.ndarray:
    """Draw over-dispersed starts, (chain, parameter).

    Noise scales start above their prior median: with hardly any noise the density is so narrow that the first trajectories
    would have to be very short.
    """
    spread = np.sqrt(2) * generator.standard_normal((settings.n_chains, len(start.z)))
    z = start.z + spread @ np.linalg.cholesky(start.covariance).T
    return np.where(noise_scales(posterior), np.abs(z), z)


def sample(request: SamplingRequest, program: Callable[..., Any]) -> Chain:
    """Sample with several chains of NUTS.

    Args:
        request: Posterior, start, settings and seed.
        program: The program of `compile_nuts`.
    """
    posterior, settings, seed = request.posterior, request.settings, request.seed
    points = draw_starting_points(posterior, request.start, settings, np.random.default_rng([seed, _STREAM]))
    blocks = (
        read_records(request.checkpoint, _record_shapes(*points.shape))
        if request.checkpoint is not None and request.resume
        else []
    )
    limit = WARM_UP + max(settings.max_steps // BLOCK, 1)
    target = WARM_UP + _FIRST_CHECK
    while target < len(blocks):  # the looks of a sampling that nothing interrupted
        target = _next_check(target)
    target = min(target, limit)
    worst: tuple[float | None, float | None] = (None, None)
    while True:
        while len(blocks) < target:
            z, tuning, mass = next_block_state(blocks, points, request.start.covariance)
            numbers = np.uint32(seed), np.uint32(len(blocks))
            done = program(*numbers, z, tuning, np.bool_(len(blocks) < WARM_UP), mass, posterior.data)
            blocks.append(jax.tree.map(np.asarray, done))
            if request.checkpoint is not None:
                append_record(request.checkpoint, blocks[-1])
            request.report(Progress(len(blocks) * BLOCK, limit * BLOCK, *worst, "nuts"))
        chain, could_improve = _summarize(request, blocks)
        worst = worst_diagnostics(chain)
        request.report(Progress(len(blocks) * BLOCK, limit * BLOCK, *worst, "nuts"))
        if not could_improve or target >= limit:
            return chain
        target = min(_next_check(target), limit)


def _record_shapes(chains: int, size: int) -> dict[str, tuple[int, ...]]:
    """Return shapes of the arrays of a stored block."""
    steps = dict.fromkeys(_STATISTICS, (BLOCK, chains))
    return {"z": (BLOCK, chains, size), "tuning": (5, chains), "inverse_mass": (size, size), **steps}


def _next_check(blocks: int) -> int:
    """Return the number of blocks at the convergence check after one at `blocks`."""
    return blocks + (blocks - WARM_UP + 2) // 3


def next_block_state(
    blocks: Sequence[Block], points: np.ndarray, covariance: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return positions, tuning and inverse mass matrix at the start of the next block.

    Args:
        blocks: All blocks before it.
        points: Starts of the chains.
        covariance: The first inverse mass matrix; one-dimensional if it is diagonal.
    """
    if not blocks:
        return points, _initial_tuning(_FIRST_STEP, len(points)), covariance
    z, tuning, mass = blocks[-1]["z"][-1], blocks[-1]["tuning"], blocks[-1]["inverse_mass"]
    ends = list(accumulate(WINDOWS))
    if len(blocks) not in ends:
        return z, tuning, mass
    average = float(np.median(tuning[1]))
    if len(blocks) == WARM_UP:
        return z, np.concatenate([tuning[:1], np.full((1, len(z)), average), tuning[2:]]), mass
    window = np.concatenate([block["z"] for block in blocks[-WINDOWS[ends.index(len(blocks))] :]])
    new_mass = (
        _shrink_covariance(window.reshape(-1, z.shape[1]))
        if mass.ndim > 1
        else _shrink_variances(window.reshape(-1, len(mass)))
    )
    return z, _initial_tuning(float(np.exp(average)), len(z)), new_mass


def _initial_tuning(step_size: float, chains: int) -> np.ndarray:
    """Return the tuning of every chain (columns) at the start of a window: the fields of blackjax's state, in their order."""
    init, _, _ = dual_averaging_adaptation(0.8)
    return np.repeat(np.asarray([float(x) for x in init(step_size)])[:, None], chains, axis=1)


def _shrink_covariance(draws: np.ndarray) -> np.ndarray:
    """Return the covariance of draws (rows), shrunk toward a small multiple of the identity as Stan does."""
    n, size = draws.shape
    return n / (n + 5) * np.cov(draws.T).reshape(size, size) + 1e-3 * 5 / (n + 5) * np.eye(size)


def _shrink_variances(draws: np.ndarray) -> np.ndarray:
    """Return variances of draws (rows), shrunk toward 1, for coordinates that are about standard normal."""
    n = len(draws)
    return n / (n + 5) * draws.var(axis=0, ddof=1) + 5 / (n + 5)


def _summarize(request: SamplingRequest, blocks: Sequence[Block]) -> tuple[Chain, bool]:
    """Return the draws after warm-up with their diagnostics, and whether more draws could improve these."""
    samples = {name: np.concatenate([b[name] for b in blocks[WARM_UP:]]) for name in ("z", *_STATISTICS)}
    steps, chains = samples["energy"].shape
    fine = _is_fine(steps)
    n_kept = max(KEPT_OF_CHAINS, 2 * request.settings.target_ess) // chains
    retained = np.unique(np.linspace(0, steps - 1, min(steps, n_kept)).round().astype(int))
    z = np.ascontiguousarray(samples["z"][retained].transpose(1, 0, 2))
    trajectories = Trajectories(
        WARM_UP * BLOCK,
        steps * chains,
        int(samples["diverging"].sum()),
        int(fine.sum()) * chains,
        int(samples["diverging"][fine].sum()),
        int((samples["tree_depth"][~fine] >= MOST_DOUBLINGS).sum()),
        compute_energy_mixing(samples["energy"].T),
        float(np.exp(blocks[-1]["tuning"][1, 0])),
        int(sum(b["n_steps"].sum() for b in blocks)),
        {name: np.ascontiguousarray(samples[name][retained].T) for name in _STATISTICS},
    )
    details = {"acceptance": float(samples["acceptance_rate"].mean()), "sampler": "nuts", "trajectories": trajectories}
    chain = request.make_chain(z, chains, steps=steps, **details)
    reasons = (*chain.reasons, *describe_stuck_walkers(z[:, z.shape[1] // 2 :]))
    return replace(chain, reasons=(*reasons, *describe_trajectory_shortfalls(trajectories))), bool(reasons)
