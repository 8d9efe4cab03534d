"""Ensembles of walkers of many posteriors in one program, some steps at a time.

What a posterior's walkers do depends on its own seed, data and starts alone. Which move is made at which step is drawn once for
all of them, so that no other need be computed.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.batch.moves import Moves, batch_moves, numbers_of_move
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.value_chart import chart_values

STORED, THIN = 20, 10  # states of a round that are stored, and steps from one to the next
STEPS = STORED * THIN
_STREAM = 1


def make_round(posterior: LogDensity, n_ensembles: int, n_walkers: int, data: Any) -> Callable[..., Any]:
    """Compiled: a round of every cable, from seeds, the number of the round, z and log densities by ensemble and walker.

    Args:
        posterior: The posterior.
        n_ensembles: Independent ensembles of each cable.
        n_walkers: Of each ensemble; a power of two.
        data: Data of as many cables as a round takes, along a new first axis.
    """
    space, cables = posterior.model.space, len(jax.tree.leaves(data)[0])
    of_cable = walker_round(posterior.log_density, batch_moves(chart_values(space)))
    seeds, number = jax.ShapeDtypeStruct((cables,), jnp.uint32), jax.ShapeDtypeStruct((), jnp.uint32)
    shapes = [jax.ShapeDtypeStruct((cables, n_ensembles, n_walkers, *more), jnp.float64) for more in ((space.size,), ())]
    return compile_program(jax.vmap(of_cable, (0, None, 0, 0, 0)), seeds, number, *shapes, data)


def walker_round(log_density: Callable[[Array, Any], Array], moves: Moves) -> Callable[..., Any]:
    """A round of one cable, of seed, number of the round, z, log densities there and data: stored z, last log densities.

    Args:
        log_density: Of one z and data.
        moves: What the walkers do.
    """
    proposals = [jax.vmap(move) for move, _ in moves]
    ends = jnp.asarray(np.cumsum([share for _, share in moves])[:-1])

    def of_cable(seed: Array, number: Array, z: Array, values: Array, data: Any) -> Any:
        n_ensembles, n_walkers = values.shape
        density = jax.vmap(jax.vmap(lambda one: log_density(one, data)))

        def move_half(carried: Any, turn: Any) -> Any:
            (z, values), (which, kind, uniform) = carried, turn
            moving, resting = z[which], z[1 - which]
            proposed, factors = jax.lax.switch(kind, proposals, uniform[..., 1:], moving, resting)
            new = density(proposed)
            better = factors + new - values[which] > jnp.log(uniform[..., 0])
            z = z.at[which].set(jnp.where(better[..., None], proposed, moving))
            return (z, values.at[which].set(jnp.where(better, new, values[which]))), None

        def step(carried: Any, chosen: Any) -> Any:
            kind, bits, uniform = chosen
            order = _order(bits, n_walkers)
            z, values, walker = (_shuffle(part, order) for part in carried)
            turns = jnp.arange(2), jnp.stack([kind, kind]), uniform
            (z, values), _ = jax.lax.scan(move_half, (_by_half(z), _by_half(values)), turns)
            return (_whole(z), _whole(values), walker), None

        def stored(carried: Any, chosen: Any) -> Any:
            keys, kinds = chosen
            bits = _bits(keys[0], (THIN, 2, n_ensembles, 1))
            count = 1 + numbers_of_move(z.shape[2])
            uniform = _uniform(_bits(keys[1], (THIN, 2, n_ensembles, n_walkers // 2, count)))
            (*places, walker), _ = jax.lax.scan(step, carried, (kinds, bits, uniform))
            own = jnp.argsort(walker, axis=1)  # every walker in its own row again
            found, values = (_shuffle(part, own) for part in places)
            return (found, values, jnp.sort(walker, axis=1)), found

        own, of_all = (jax.random.fold_in(jax.random.fold_in(jax.random.key(s), _STREAM), number) for s in (seed, 0))
        kinds = jnp.searchsorted(ends, _uniform(_bits(of_all, (STORED, THIN))), side="right")
        walkers = jnp.tile(jnp.arange(n_walkers), (n_ensembles, 1))
        (_, values, _), path = jax.lax.scan(stored, (z, values, walkers), (jax.random.split(own, (STORED, 2)), kinds))
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
