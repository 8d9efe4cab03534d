"""Ensembles of walkers of any of many posteriors in one program, some steps at a time.

What a posterior's walkers do depends on its own seed, data and starts alone. Which move is made at which step, and in which
coordinates, is drawn once for all of them, so that no other need be computed.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.description.defaults import THIN
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.coordinates import CoordinateMaps, coordinate_maps
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.moves import Moves, weighted_moves
from bowdenfit.inference.sweep import SweepChoices, count_walker_numbers, make_walker_sweep, to_uniform

STATES_PER_ROUND = 20  # states of a round that are stored, `THIN` steps from one to the next, all in the same coordinates
STEPS_PER_ROUND = STATES_PER_ROUND * THIN
_STREAM = 1


def compile_round(posterior: LogDensity, n_ensembles: int, n_walkers: int) -> Callable[..., Any]:
    """Compiled: a round, from a seed, the number of the round, z by ensemble and walker, and data.

    Args:
        posterior: The posterior.
        n_ensembles: Independent ensembles.
        n_walkers: Of each ensemble; a power of two.
    """
    run_round = walker_round(posterior.log_density, weighted_moves(), coordinate_maps(posterior))
    seed = number = jax.ShapeDtypeStruct((), jnp.uint32)
    z = jax.ShapeDtypeStruct((n_ensembles, n_walkers, posterior.model.space.size), jnp.float64)
    return compile_program(run_round, seed, number, z, posterior.data, run_often=True)


def walker_round(log_density: Callable[[Array, Any], Array], moves: Moves, frames: CoordinateMaps) -> Callable[..., Any]:
    """Stored z of a round of one cable, of seed, number of the round, z and data.

    Args:
        log_density: Of one z and data.
        moves: What the walkers do.
        frames: In which coordinates.
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

        own_key, shared_key = (jax.random.fold_in(jax.random.fold_in(jax.random.key(s), _STREAM), number) for s in (seed, 0))
        uniform = to_uniform(_random_bits(shared_key, (STATES_PER_ROUND, THIN + 1)))
        chosen = zip(ends, (uniform[:, 1:], uniform[:, 0]), strict=True)
        kinds, frame = (jnp.searchsorted(end, number, side="right") for end, number in chosen)
        return jax.lax.scan(store, z, (jax.random.split(own_key, (STATES_PER_ROUND, 2)), kinds, frame))[1]

    return run_round


def _random_bits(key: Array, shape: tuple[int, ...]) -> Array:
    """Random; along one axis first, because XLA takes ten seconds to compile them along five."""
    return jax.random.bits(key, (int(np.prod(shape)),), jnp.uint32).reshape(shape)


def _shuffle_walkers(bits: Array, n_walkers: int) -> Array:
    """An order of the walkers of every ensemble at random; their halves move one after the other."""
    order = ((2 * bits[0] + 1) * jnp.arange(n_walkers, dtype=jnp.uint32) + bits[1]) % n_walkers
    return order.astype(jnp.int32)
