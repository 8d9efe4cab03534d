"""Some steps of an ensemble of walkers in one program: moves, densities, what is accepted. Random numbers come from outside."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.coordinates import Frames
from bowdenfit.inference.moves import Moves, Numbers, numbers_at, numbers_of_move


class Chosen(NamedTuple):
    """What is drawn at random for some steps.

    Args:
        frame: Number of the coordinates that walkers move in.
        kinds: Number of the move of each step.
        bits: (step, half, walker, `numbers_of_walker`), as unsigned integers.
    """

    frame: Array | np.ndarray
    kinds: Array | np.ndarray
    bits: Array | np.ndarray


def numbers_of_walker(size: int) -> int:
    """How many uniform numbers a step of a walker of so many parameters needs."""
    return 1 + numbers_of_move(size)


def walker_sweep(log_density: Callable[[Array, Any], Array], moves: Moves, frames: Frames) -> Callable[..., Any]:
    """Steps of all walkers of an ensemble, of what is `Chosen`, z (walker, parameter), and data.

    They give z and log densities after them, and how many proposals of every walker were accepted. The halves of the ensemble
    move in turns, so that walkers should be put in another order from one sweep to the next.

    Args:
        log_density: Of one z and data.
        moves: What the walkers do.
        frames: In which coordinates.
    """
    proposals, coordinates = [move for move, _ in moves], [frame for frame, _ in frames]

    def sweep(chosen: Chosen, z: Array, data: Any) -> tuple[Array, Array, Array]:
        n_walkers, size = z.shape
        # Of a walker: where it is in the coordinates that it moves in, and in z; its log density in those, and in z; and how
        # often it moved. In one array, since each operation takes its time to compile.
        where_w, where_z, rest = slice(size), slice(size, 2 * size), slice(2 * size, None)

        def walkers_at(given: Array, is_z: Array) -> Array:
            w, z, volume = jax.lax.switch(chosen.frame, coordinates, given, is_z, data)
            values = jax.vmap(lambda one: log_density(one, data))(z)
            values, known = jnp.where(jnp.isnan(values), -jnp.inf, values), jnp.isfinite(volume)
            # Out of reach of the coordinates is nothing to go to, and who is there already stays.
            out_of_reach = jnp.where(is_z & (values > -jnp.inf), jnp.inf, -jnp.inf)
            value_in_w = jnp.where(known, values + jnp.where(known, volume, 0.0), out_of_reach)
            numbers = jnp.stack([value_in_w, values, jnp.zeros_like(values)], axis=1)
            return jnp.concatenate([w, z, numbers], axis=1)

        def half_step(carried: tuple[Array, Array], turn: tuple[Array, Array, Array, Numbers]) -> Any:
            (moving, resting), (is_begin, kind, chance, numbers) = carried, turn
            w, factors = jax.lax.switch(kind, proposals, numbers, moving[:, where_w], resting[:, where_w])
            there = walkers_at(jnp.where(is_begin, moving[:, where_z], w), is_begin)
            better = factors + there[:, -3] - moving[:, -3] > jnp.log(chance)
            moved = jnp.where(better[:, None], there.at[:, -1].set(moving[:, -1] + 1), moving)
            return (resting, jnp.where(is_begin, there, moved)), None

        # In its first two turns each half finds its own places, with nothing known of them but z.
        begin = jnp.concatenate([z, z, jnp.zeros((n_walkers, 3))], axis=1)
        halves = begin[: n_walkers // 2], begin[n_walkers // 2 :]
        uniform = to_uniform(chosen.bits).reshape(-1, *chosen.bits.shape[2:])
        is_begin, uniform = jnp.arange(2 + len(uniform)) < 2, jnp.concatenate([uniform[:2], uniform])
        kinds = jnp.repeat(jnp.pad(chosen.kinds, (1, 0)), 2)
        turns = is_begin, kinds, uniform[..., 0], numbers_at(uniform[..., 1:])
        ended = jnp.concatenate(jax.lax.scan(half_step, halves, turns)[0])
        _, values, accepted = ended[:, rest].T
        return ended[:, where_z], values, accepted

    return sweep


def to_uniform(bits: Array | np.ndarray) -> Array:
    """Numbers between 0 and 1, neither of them, of unsigned integers."""
    return (jnp.asarray(bits) + 0.5) / 2.0**32
