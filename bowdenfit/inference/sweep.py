"""Some steps of ensembles of walkers in one program: moves, densities, what is accepted. Random numbers come from outside."""

from collections.abc import Callable
from functools import partial
from operator import itemgetter
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.coordinates import Frames
from bowdenfit.inference.moves import Moves, numbers_of_move


class Chosen(NamedTuple):
    """What is drawn at random for some steps.

    Args:
        frame: Number of the coordinates that walkers move in.
        kinds: Number of the move of each step.
        order: Of the walkers of every ensemble at each step, (step, ensemble, walker); its halves move one after the other.
        bits: (step, half, ensemble, walker, `numbers_of_walker`), as unsigned integers.
    """

    frame: Array | np.ndarray
    kinds: Array | np.ndarray
    order: Array | np.ndarray
    bits: Array | np.ndarray


class Places(NamedTuple):
    """Of walkers.

    Args:
        w: In the coordinates that they move in.
        z: In z.
        value: Log density in z.
        volume: Log of the volume in z of a unit of w.
    """

    w: Array
    z: Array
    value: Array
    volume: Array


def numbers_of_walker(size: int) -> int:
    """How many uniform numbers a step of a walker of so many parameters needs."""
    return 1 + numbers_of_move(size)


def walker_sweep(log_density: Callable[[Array, Any], Array], moves: Moves, frames: Frames) -> Callable[..., Any]:
    """Steps of all walkers, of what is `Chosen`, z and log densities by ensemble and walker, and data.

    They give z and log densities after them, and how many proposals of every walker were accepted.

    Args:
        log_density: Of one z and data.
        moves: What the walkers do.
        frames: In which coordinates.
    """
    proposals = [jax.vmap(move) for move, _ in moves]
    to_w, from_w = ([frame[way] for frame, _ in frames] for way in (0, 1))

    def sweep(chosen: Chosen, z: Array, values: Array, data: Any) -> tuple[Array, Array, Array]:
        def places_of(w: Array) -> Places:
            z, volume = jax.lax.switch(chosen.frame, from_w, w.reshape(-1, w.shape[-1]), data)
            values = jax.vmap(lambda one: log_density(one, data))(z)
            known = jnp.isfinite(volume) & ~jnp.isnan(values)  # out of reach of the coordinates both may be infinite
            values, volume = jnp.where(known, values, -jnp.inf), jnp.where(known, volume, 0.0)
            return Places(w, *(part.reshape(*w.shape[:-1], *part.shape[1:]) for part in (z, values, volume)))

        def move_half(carried: Any, turn: Any) -> Any:
            (places, accepted), (which, kind, uniform) = carried, turn
            moving, resting = (jax.tree.map(itemgetter(i), places) for i in (which, 1 - which))
            proposed, factors = jax.lax.switch(kind, proposals, uniform[..., 1:], moving.w, resting.w)
            new = places_of(proposed)
            gain = factors + new.value + new.volume - moving.value - moving.volume
            better = gain > jnp.log(uniform[..., 0])
            moved = jax.tree.map(lambda new, old: jnp.where(_like(better, new), new, old), new, moving)
            places = jax.tree.map(lambda part, half: part.at[which].set(half), places, moved)
            return (places, accepted.at[which].add(better)), None

        def step(carried: Any, chosen: Any) -> Any:
            kind, order, uniform = chosen
            carried, walker = jax.tree.map(partial(_shuffle, order=order), carried)
            turns = jnp.arange(2), jnp.stack([kind, kind]), uniform
            carried, _ = jax.lax.scan(move_half, jax.tree.map(_by_half, carried), turns)
            return (jax.tree.map(_whole, carried), walker), None

        n_ensembles, n_walkers, size = z.shape
        w, volume = jax.lax.switch(chosen.frame, to_w, z.reshape(-1, size), data)
        begin = Places(w.reshape(z.shape), z, values, volume.reshape(values.shape)), jnp.zeros(values.shape, int)
        walkers = jnp.tile(jnp.arange(n_walkers), (n_ensembles, 1))
        ended, _ = jax.lax.scan(step, (begin, walkers), (chosen.kinds, chosen.order, to_uniform(chosen.bits)))
        (places, accepted), walker = ended
        own = jnp.argsort(walker, axis=1)  # every walker in its own row again
        return _shuffle(places.z, own), _shuffle(places.value, own), _shuffle(accepted, own)

    return sweep


def to_uniform(bits: Array | np.ndarray) -> Array:
    """Numbers between 0 and 1, neither of them, of unsigned integers."""
    return (jnp.asarray(bits) + 0.5) / 2.0**32


def _shuffle(part: Array, order: Array) -> Array:
    return jax.vmap(lambda walkers, of: walkers[of])(part, order.astype(jnp.int32))


def _like(chosen: Array, part: Array) -> Array:
    """With as many axes."""
    return chosen.reshape(*chosen.shape, *[1] * (part.ndim - chosen.ndim))


def _by_half(part: Array) -> Array:
    """(half, ensemble, walker, ...) of (ensemble, walker, ...)."""
    half = part.shape[1] // 2
    return jnp.stack([part[:, :half], part[:, half:]])


def _whole(part: Array) -> Array:
    return jnp.concatenate([part[0], part[1]], axis=1)
