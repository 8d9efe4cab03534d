"""Settings of a batch, and the programs that are compiled once for all data sets of one shape.

One program moves the ensembles of walkers of any of the posteriors. What the walkers of a posterior do depends on its own seed,
data and starts alone; which move is made at which step, and in which coordinates, is drawn once for all of them.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from threading import Lock
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.description import SamplerSettings
from bowdenfit.description.defaults import THIN, WALKERS_PER_PARAMETER
from bowdenfit.inference.batch.laplace import count_climb_points
from bowdenfit.inference.batch.weights import BLOCK, ProposedPoints
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.coordinates import Conditional, CoordinateMaps, coordinate_maps, identity
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.moves import Moves, weighted_moves
from bowdenfit.inference.nuts import compile_nuts
from bowdenfit.inference.objective import noise_scales
from bowdenfit.inference.walkers import SweepChoices, count_walker_numbers, make_walker_sweep, to_uniform

STATES_PER_ROUND = 20  # states stored of a round, `THIN` steps apart
STEPS_PER_ROUND = STATES_PER_ROUND * THIN
_STREAM = 1  # stream of random numbers of the walkers
CHUNK = 16  # data sets that climb together, always the same number so that rounding is the same
# Threads that share one interpreter: 96 fits of the on-body cable took 27 s with 4 threads on 16 cores, and 41 s with 17.
MOST_AT_ONCE = 4


def compile_round(posterior: LogDensity, n_ensembles: int, n_walkers: int) -> Callable[..., Any]:
    """Compile a round of walkers: a function of seed, number of the round, z by ensemble and walker, and data.

    Args:
        posterior: The posterior.
        n_ensembles: Number of independent ensembles.
        n_walkers: Walkers of each ensemble; a power of two.
    """
    run_round = walker_round(posterior.log_density, weighted_moves(), coordinate_maps(posterior))
    seed = number = jax.ShapeDtypeStruct((), jnp.uint32)
    z = jax.ShapeDtypeStruct((n_ensembles, n_walkers, posterior.model.space.size), jnp.float64)
    return compile_program(run_round, seed, number, z, posterior.data, run_often=True)


def walker_round(
    log_density: Callable[[Array, Any], Array], moves: Moves, frames: CoordinateMaps
) -> Callable[..., Any]:
    """Return a function of seed, round number, z and data that gives the stored z of a round of one cable.

    Args:
        log_density: Log density of one z and data.
        moves: Moves of the walkers with their shares.
        frames: Coordinates they move in, with their shares.
    """
    sweep = make_walker_sweep(log_density, moves, frames)
    ends = [jnp.asarray(np.cumsum([share for _, share in weighted])[:-1]) for weighted in (moves, frames)]

    def step_ensemble(bits: Array, order: Array, kinds: Array, frame: Array, z: Array, data: Any) -> Array:
        return z.at[order].set(sweep(SweepChoices(frame, kinds, bits), z[order], data)[0])

    step_ensembles = jax.vmap(step_ensemble, (0, 0, None, None, 0, None))

    def run_round(seed: Array, number: Array, z: Array, data: Any) -> Array:
        n_ensembles, n_walkers, size = z.shape

        def store(z: Array, choices: Any) -> tuple[Array, Array]:
            keys, kinds, frame = choices
            order = _shuffle_walkers(_random_bits(keys[0], (2, n_ensembles, 1)), n_walkers)
            bits = _random_bits(keys[1], (n_ensembles, THIN, 2, n_walkers // 2, count_walker_numbers(size)))
            z = step_ensembles(bits, order, kinds, frame, z, data)
            return z, z

        own_key, shared_key = (
            jax.random.fold_in(jax.random.fold_in(jax.random.key(s), _STREAM), number) for s in (seed, 0)
        )
        uniform = to_uniform(_random_bits(shared_key, (STATES_PER_ROUND, THIN + 1)))
        chosen = zip(ends, (uniform[:, 1:], uniform[:, 0]), strict=True)
        kinds, frame = (jnp.searchsorted(end, number, side="right") for end, number in chosen)
        return jax.lax.scan(store, z, (jax.random.split(own_key, (STATES_PER_ROUND, 2)), kinds, frame))[1]

    return run_round


def _random_bits(key: Array, shape: tuple[int, ...]) -> Array:
    """Return random bits, generated along one axis, because XLA takes ten seconds to compile them along five."""
    return jax.random.bits(key, (int(np.prod(shape)),), jnp.uint32).reshape(shape)


def _shuffle_walkers(bits: Array, n_walkers: int) -> Array:
    """Return a random order of the walkers of every ensemble; its halves move in turns."""
    order = ((2 * bits[0] + 1) * jnp.arange(n_walkers, dtype=jnp.uint32) + bits[1]) % n_walkers
    return order.astype(jnp.int32)


@dataclass(frozen=True)
class BatchSettings:
    """Sampler settings and targets of a batch.

    Args:
        sampler: Ensembles, their least number of walkers (a power of two), maximum steps, and targets; also those of NUTS where
            it is needed.
        target_sd_error: Largest Monte Carlo error of a standard deviation, relative to it; a tenth is hardly ever exceeded.
            Long tails need many more draws for it than for a mean or a rank.
        n_kept: Number of equally weighted draws that weighted ones are resampled to.
        nuts: Whether NUTS samples what the ensembles leave.
        chunk: Data sets that climb together.
        threads: Data sets sampled at a time; if omitted one more than there are cores, because threads wait for each other, but
            `MOST_AT_ONCE` at most.
    """

    sampler: SamplerSettings = field(
        default_factory=lambda: SamplerSettings(
            n_ensembles=2, n_walkers=64, max_steps=20_000, target_ess=400, target_r_hat=1.03
        )
    )
    target_sd_error: float = 0.033
    n_kept: int = 2048
    nuts: bool = True
    chunk: int = CHUNK
    threads: int = 0

    def __post_init__(self) -> None:
        walkers = self.sampler.walkers(0)
        if walkers & (walkers - 1):
            raise ValueError(f"an ensemble of a batch needs a power of two of walkers, such as 128, and not {walkers}.")


@dataclass(frozen=True)
class BatchPrograms:
    """Programs compiled for data of one shape; they may serve several batches.

    Args:
        posterior: Posterior whose model is shared by all data sets.
        settings: Sampler settings and targets.
        compiling: Lock held by the thread that compiles a shared program.
    """

    posterior: LogDensity
    settings: BatchSettings
    compiling: Lock = field(default_factory=Lock, repr=False, compare=False)

    @cached_property
    def gradients(self) -> Callable[..., Any]:
        """Log density and gradient, for climbing to maxima."""
        size, gradient = self.posterior.model.space.size, jax.value_and_grad(self.posterior.log_density)
        chunk = self.settings.chunk
        shape = jax.ShapeDtypeStruct((chunk, count_climb_points(size), size), np.dtype(float))
        return compile_program(jax.vmap(jax.vmap(gradient, (0, None))), shape, stack_data([self.posterior.data], chunk))

    @cached_property
    def evaluate_points(self) -> Callable[..., Any]:
        """Function that gives `ProposedPoints` of a block of points, each of them a z or a w, of one data set."""
        conditional, posterior = Conditional(self.posterior), self.posterior
        coordinate_map = conditional.map_point if conditional.has_coefficients else identity

        def evaluate(point: Array, is_z: Array, data: Any) -> ProposedPoints:
            w, z, log_volume = coordinate_map(point, is_z, data)
            log_density, has_z = posterior.log_density(z, data), jnp.isfinite(z).all()
            has_w, finite = jnp.isfinite(w).all() & jnp.isfinite(log_volume), has_z & jnp.isfinite(log_density)
            z, w = jnp.where(has_z, z, 0.0), jnp.where(has_w, w, 0.0)
            return ProposedPoints(w, z, jnp.where(has_w, log_volume, jnp.inf), jnp.where(finite, log_density, -jnp.inf))

        rows = jax.ShapeDtypeStruct((BLOCK, posterior.model.space.size), np.dtype(float))
        is_z = jax.ShapeDtypeStruct((BLOCK,), np.dtype(bool))
        return compile_program(jax.vmap(evaluate, (0, 0, None)), rows, is_z, posterior.data)

    @cached_property
    def ensembles(self) -> Callable[..., Any]:
        """Compiled round of all walkers."""
        return compile_round(self.posterior, self.settings.sampler.n_ensembles, self.n_walkers)

    @property
    def threads(self) -> int:
        """Data sets sampled at a time."""
        return self.settings.threads or min(len(os.sched_getaffinity(0)) + 1, MOST_AT_ONCE)

    @property
    def n_walkers(self) -> int:
        """Walkers of each ensemble, doubled until a covariance can be fitted to half of them."""
        walkers = self.settings.sampler.walkers(0)
        while walkers < WALKERS_PER_PARAMETER * self.posterior.model.space.size:
            walkers *= 2
        return walkers

    @cached_property
    def nuts(self) -> Callable[..., Any]:
        """Compiled NUTS of one data set."""
        return compile_nuts(self.posterior, self.settings.sampler)

    @cached_property
    def noise(self) -> np.ndarray:
        """Which parameters are noise scales."""
        return noise_scales(self.posterior)

    @cached_property
    def friction(self) -> np.ndarray:
        """Which parameters are friction coefficients."""
        return np.array([p.role == "friction" for p in self.posterior.model.space.free], dtype=bool)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of z."""
        return tuple(p.name for p in self.posterior.model.space.free)


def stack_data(trees: Sequence[Any], count: int) -> Any:
    """Stack data of several data sets along a new first axis, repeating the last up to a count."""
    padded = [*trees, *[trees[-1]] * (count - len(trees))]
    return jax.tree.map(lambda *leaves: np.stack(leaves), *padded)
