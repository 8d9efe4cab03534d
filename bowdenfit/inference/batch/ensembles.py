"""Ensembles of walkers of many posteriors in one program, some steps at a time.

What a posterior's walkers do depends on its own seed, data and starts alone. Which move is made at which step, and in which
coordinates, is drawn once for all of them, so that no other need be computed.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.batch.frames import Frames
from bowdenfit.inference.batch.moves import MOVES, Moves, numbers_of_move
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.log_density import LogDensity

STORED, THIN = 20, 10  # states of a round that are stored, and steps from one to the next, all in the same coordinates
STEPS = STORED * THIN
_STREAM = 1


def make_round(
    posterior: LogDensity, frames: Frames, n_ensembles: int, n_walkers: int, data: Any
) -> Callable[..., Any]:
    """Compiled: a round of every cable, from seeds, the number of the round, z and log densities by ensemble and walker.

    Args:
        posterior: The posterior.
        frames: Coordinates that walkers move in.
        n_ensembles: Independent ensembles of each cable.
        n_walkers: Of each ensemble; a power of two.
        data: Data of as many cables as a round takes, along a new first axis.
    """
    cables, size = len(jax.tree.leaves(data)[0]), posterior.model.space.size
    of_cable = walker_round(posterior.log_density, MOVES, frames)
    seeds, number = jax.ShapeDtypeStruct((cables,), jnp.uint32), jax.ShapeDtypeStruct((), jnp.uint32)
    shapes = [jax.ShapeDtypeStruct((cables, n_ensembles, n_walkers, *more), jnp.float64) for more in ((size,), ())]
    return compile_program(jax.vmap(of_cable, (0, None, 0, 0, 0)), seeds, number, *shapes, data)


def walker_round(log_density: Callable[[Array, Any], Array], moves: Moves, frames: Frames) -> Callable[..., Any]:
    """A round of one cable, of seed, number of the round, z, log densities there and data: stored z, last log densities.

    Args:
        log_density: Of one z and data.
        moves: What the walkers do.
        frames: In which coordinates.
    """
    proposals = [jax.vmap(move) for move, _ in moves]
    to_w, from_w = ([frame[way] for frame, _ in frames] for way in (0, 1))
    ends = [jnp.asarray(np.cumsum([share for _, share in each])[:-1]) for each in (moves, frames)]

    def of_cable(seed: Array, number: Array, z: Array, values: Array, data: Any) -> Any:
        n_ensembles, n_walkers = values.shape

        def back(frame: Array, w: Array) -> tuple[Array, Array]:
            z, volume = jax.lax.switch(frame, from_w, w.reshape(-1, w.shape[-1]), data)
            return z.reshape(w.shape), volume.reshape(w.shape[:-1])

        def density(frame: Array, w: Array) -> Array:
            z, volume = back(frame, w)
            found = jax.vmap(jax.vmap(lambda one: log_density(one, data)))(z) + volume
            return jnp.where(jnp.isnan(found), -jnp.inf, found)

        def move_half(frame: Array, carried: Any, turn: Any) -> Any:
            (w, values), (which, kind, uniform) = carried, turn
            moving, resting = w[which], w[1 - which]
            proposed, factors = jax.lax.switch(kind, proposals, uniform[..., 1:], moving, resting)
            new = density(frame, proposed)
            better = factors + new - values[which] > jnp.log(uniform[..., 0])
            w = w.at[which].set(jnp.where(better[..., None], proposed, moving))
            return (w, values.at[which].set(jnp.where(better, new, values[which]))), None

        def step(frame: Array, carried: Any, chosen: Any) -> Any:
            kind, bits, uniform = chosen
            order = _order(bits, n_walkers)
            w, values, walker = (_shuffle(part, order) for part in carried)
            turns = jnp.arange(2), jnp.stack([kind, kind]), uniform
            (w, values), _ = jax.lax.scan(partial(move_half, frame), (_by_half(w), _by_half(values)), turns)
            return (_whole(w), _whole(values), walker), None

        def stored(carried: Any, chosen: Any) -> Any:
            (z, values), (keys, kinds, frame) = carried, chosen
            bits = _bits(keys[0], (THIN, 2, n_ensembles, 1))
            uniform = _uniform(_bits(keys[1], (THIN, 2, n_ensembles, n_walkers // 2, 1 + numbers_of_move(z.shape[2]))))
            w = jax.lax.switch(frame, to_w, z.reshape(-1, z.shape[-1]), data).reshape(z.shape)
            begin = w, values + back(frame, w)[1], jnp.tile(jnp.arange(n_walkers), (n_ensembles, 1))
            (w, values, walker), _ = jax.lax.scan(partial(step, frame), begin, (kinds, bits, uniform))
            own, (z, volume) = jnp.argsort(walker, axis=1), back(frame, w)  # every walker in its own row again
            z, values = (_shuffle(part, own) for part in (z, values - volume))
            return (z, values), z

        own, of_all = (jax.random.fold_in(jax.random.fold_in(jax.random.key(s), _STREAM), number) for s in (seed, 0))
        drawn = _uniform(_bits(of_all, (STORED, THIN + 1)))
        chosen = zip(ends, (drawn[:, 1:], drawn[:, 0]), strict=True)
        kinds, frame = (jnp.searchsorted(end, number, side="right") for end, number in chosen)
        (_, values), path = jax.lax.scan(stored, (z, values), (jax.random.split(own, (STORED, 2)), kinds, frame))
        return path, values

    return of_cable


def _bits(key: Array, shape: tuple[int, ...]) -> Array:
    """Random; along one axis first, because XLA takes ten seconds to compile them along five."""
    return jax.random.bits(key, (int(np.prod(shape)),), jnp.uint32).reshape(shape)


def _uniform(bits: Array) -> Array:
    """Between 0 and 1, neither of them."""
    return (bits + 0.5) / 2.0**32


def _order(bits: Array, n_walkers: int) -> Array:
    """An order of the walkers of every ensemble at random, whose halves move one after the other."""
    return ((2 * bits[0] + 1) * jnp.arange(n_walkers, dtype=jnp.uint32) + bits[1]) % n_walkers


def _shuffle(part: Array, order: Array) -> Array:
    return jax.vmap(lambda walkers, of: walkers[of])(part, order.astype(jnp.int32))


def _by_half(part: Array) -> Array:
    """(half, ensemble, walker, ...) of (ensemble, walker, ...)."""
    half = part.shape[1] // 2
    return jnp.stack([part[:, :half], part[:, half:]])


def _whole(part: Array) -> Array:
    return jnp.concatenate([part[0], part[1]], axis=1)
