"""Ensembles of walkers of many posteriors in one program: the moves of `ensemble`, some steps at a time.

What a posterior's walkers do depends on its own seed, data and starts alone.

References:
    Goodman and Weare 2010, "Ensemble samplers with affine invariance" (Communications in Applied Mathematics and
    Computational Science 5); ter Braak 2006, "A Markov chain Monte Carlo version of the genetic algorithm differential
    evolution" (Statistics and Computing 16); Nelson, Ford and Payne 2014 (Astrophysical Journal Supplement 210), for both.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.log_density import LogDensity

STORED, THIN = 20, 10  # states of a round that are stored, and steps from one to the next
STEPS = STORED * THIN
_STRETCH, _JUMP = 0.3, 0.1  # shares of the moves; the rest is differential evolution
_SCALE = 2.0  # of the stretch move
_JITTER = 1e-5  # of the length of a difference
_STREAM = 1


def make_round(posterior: LogDensity, n_ensembles: int, n_walkers: int, data: Any) -> Callable[..., Any]:
    """Compiled: a round of every cable, from seeds, the number of the round, z and log densities by ensemble and walker.

    Args:
        posterior: The posterior.
        n_ensembles: Independent ensembles of each cable.
        n_walkers: Of each ensemble; a power of two.
        data: Data of as many cables as a round takes, along a new first axis.
    """
    size, cables = posterior.model.space.size, len(jax.tree.leaves(data)[0])
    half, first_gamma = n_walkers // 2, 2.38 / np.sqrt(2 * size)

    def of_cable(seed: Array, number: Array, z: Array, log_density: Array, data: Any) -> Any:
        density = jax.vmap(jax.vmap(lambda one: posterior.log_density(one, data)))

        def move_half(carried: Any, turn: Any) -> Any:
            (z, values), (which, bits, kind) = carried, turn
            moving, resting = z[which], z[1 - which]
            gamma = jnp.where(kind < _STRETCH + _JUMP, 1.0, first_gamma)
            proposed, log_factor = _propose(moving, resting, bits, kind < _STRETCH, gamma)
            new = density(proposed)
            better = log_factor + new - values[which] > jnp.log(_uniform(bits[..., 2]))
            z = z.at[which].set(jnp.where(better[..., None], proposed, moving))
            return (z, values.at[which].set(jnp.where(better, new, values[which]))), None

        def step(carried: Any, key: Array) -> Any:
            of_order, of_walkers = jax.random.split(key)
            order, kind = _halves(of_order, n_ensembles, n_walkers)
            z, values, walker = (_shuffle(part, order) for part in carried)
            bits = jax.random.bits(of_walkers, (2, n_ensembles, half, 3), jnp.uint32)
            turns = jnp.arange(2), bits, jnp.stack([kind, kind])
            (z, values), _ = jax.lax.scan(move_half, (_by_half(z, half), _by_half(values, half)), turns)
            return (_whole(z), _whole(values), walker), None

        def stored(carried: Any, keys: Array) -> Any:
            (z, values, walker), _ = jax.lax.scan(step, carried, keys)
            own = jnp.argsort(walker, axis=1)  # every walker in its own row again
            z, values = _shuffle(z, own), _shuffle(values, own)
            return (z, values, jnp.sort(walker, axis=1)), z

        key = jax.random.fold_in(jax.random.fold_in(jax.random.key(seed), _STREAM), number)
        keys = jax.random.split(key, (STORED, THIN))
        walkers = jnp.tile(jnp.arange(n_walkers), (n_ensembles, 1))
        (_, values, _), path = jax.lax.scan(stored, (z, log_density, walkers), keys)
        return path, values

    whole = jax.ShapeDtypeStruct((cables,), jnp.uint32)
    shapes = [jax.ShapeDtypeStruct((cables, n_ensembles, n_walkers, *more), jnp.float64) for more in ((size,), ())]
    return compile_program(jax.vmap(of_cable), whole, whole, *shapes, data)


def _propose(moving: Array, resting: Array, bits: Array, stretches: Array, gamma: Array) -> tuple[Array, Array]:
    """Proposals by stretching toward one resting walker, or along the difference of two; log factors of acceptance."""
    half, size = moving.shape[-2:]
    one = bits[..., 0] % half
    other = (one + 1 + (bits[..., 0] >> 8) % (half - 1)) % half
    near, far = (jnp.take_along_axis(resting, i.astype(jnp.int32)[..., None], axis=-2) for i in (one, other))
    uniform = _uniform(bits[..., 1])
    factor = ((_SCALE - 1) * uniform + 1) ** 2 / _SCALE
    stretched = near + factor[..., None] * (moving - near)
    evolved = moving + (gamma * (1 + _JITTER * (2 * uniform - 1)))[..., None] * (near - far)
    return jnp.where(stretches, stretched, evolved), jnp.where(stretches, (size - 1) * jnp.log(factor), 0.0)


def _uniform(bits: Array) -> Array:
    """Between 0 and 1, neither of them."""
    return (bits + 0.5) / 2.0**32


def _halves(key: Array, n_ensembles: int, n_walkers: int) -> tuple[Array, Array]:
    """An order of the walkers of every ensemble at random, whose halves move one after the other, and what move."""
    bits = jax.random.bits(key, (2, n_ensembles + 1), jnp.uint32)
    odd, shift = 2 * bits[0, :-1, None] + 1, bits[1, :-1, None]
    return (odd * jnp.arange(n_walkers, dtype=jnp.uint32) + shift) % n_walkers, _uniform(bits[0, -1])


def _shuffle(part: Array, order: Array) -> Array:
    return jax.vmap(lambda walkers, of: walkers[of])(part, order.astype(jnp.int32))


def _by_half(part: Array, half: int) -> Array:
    """(half, ensemble, walker, ...) of (ensemble, walker, ...)."""
    return jnp.stack([part[:, :half], part[:, half:]])


def _whole(part: Array) -> Array:
    return jnp.concatenate([part[0], part[1]], axis=1)
