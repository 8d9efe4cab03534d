"""Some steps of an ensemble of walkers in one program: moves, densities, what is accepted. Random numbers come from outside."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.coordinates import CoordinateMap, CoordinateMaps
from bowdenfit.inference.moves import Moves, RandomNumbers, count_move_numbers, random_numbers


class SweepChoices(NamedTuple):
    """What is drawn at random for some steps.

    Args:
        frame: Number of the coordinates that walkers move in.
        kinds: Number of the move of each step.
        bits: (step, half, walker, `count_walker_numbers`), as unsigned integers.
    """

    frame: Array | np.ndarray
    kinds: Array | np.ndarray
    bits: Array | np.ndarray


class Walkers(NamedTuple):
    """Walkers on their way.

    Args:
        w, z: Where they are in the coordinates that they move in, and in z, (walker, parameter).
        value_in_w, value: Log densities there, in either.
        accepted: How many of their proposals were accepted.
    """

    w: Array
    z: Array
    value_in_w: Array
    value: Array
    accepted: Array


def count_walker_numbers(size: int) -> int:
    """How many uniform numbers a step of a walker of so many parameters needs."""
    return 1 + count_move_numbers(size)


def make_walker_sweep(log_density: Callable[[Array, Any], Array], moves: Moves, frames: CoordinateMaps) -> Callable[..., Any]:
    """Steps of all walkers of an ensemble, of what is `SweepChoices`, z (walker, parameter), and data.

    They give z and log densities after them, and how many proposals of every walker were accepted. The halves of the ensemble
    move in turns, so that walkers should be put in another order from one sweep to the next.

    Args:
        log_density: Of one z and data.
        moves: What the walkers do.
        frames: In which coordinates.
    """
    proposals = [move for move, _ in moves]

    def sweep(choices: SweepChoices, z: Array, data: Any) -> tuple[Array, Array, Array]:
        def evaluate(points: Array, is_z: bool) -> Walkers:
            ways = [partial(_apply_map, frame, is_z) for frame, _ in frames]
            w, z, volume = jax.lax.switch(choices.frame, ways, points, data)
            value = jax.vmap(lambda one: log_density(one, data))(z)
            value, known = jnp.where(jnp.isnan(value), -jnp.inf, value), jnp.isfinite(volume)
            # Where coordinates do not reach: nothing is proposed there, and a walker that is there already stays.
            beyond = jnp.where(is_z & (value > -jnp.inf), jnp.inf, -jnp.inf)
            value_in_w = jnp.where(known, value + jnp.where(known, volume, 0.0), beyond)
            return Walkers(w, z, value_in_w, value, jnp.zeros_like(value))

        def half_step(halves: tuple[Walkers, Walkers], turn: tuple[Array, Array, RandomNumbers]) -> Any:
            (moving, resting), (kind, chance, numbers) = halves, turn
            w, factors = jax.lax.switch(kind, proposals, numbers, moving.w, resting.w)
            proposed = evaluate(w, is_z=False)._replace(accepted=moving.accepted + 1)
            better = factors + proposed.value_in_w - moving.value_in_w > jnp.log(chance)
            moved = jax.tree.map(lambda new, old: jax.vmap(jnp.where)(better, new, old), proposed, moving)
            return (resting, moved), None

        begin, half = evaluate(z, is_z=True), len(z) // 2
        halves = jax.tree.map(lambda rows: rows[:half], begin), jax.tree.map(lambda rows: rows[half:], begin)
        uniform = to_uniform(choices.bits).reshape(-1, *choices.bits.shape[2:])
        turns = jnp.repeat(choices.kinds, 2), uniform[..., 0], random_numbers(uniform[..., 1:])
        ended = jax.tree.map(lambda *rows: jnp.concatenate(rows), *jax.lax.scan(half_step, halves, turns)[0])
        return ended.z, ended.value, ended.accepted

    return sweep


def _apply_map(frame: CoordinateMap, is_z: bool, points: Array, data: Any) -> tuple[Array, Array, Array]:
    """W, z and log volume of walkers, of either of the first two."""
    return frame(points, jnp.asarray(is_z), data)


def to_uniform(bits: Array | np.ndarray) -> Array:
    """Numbers between 0 and 1, neither of them, of unsigned integers."""
    return (jnp.asarray(bits) + 0.5) / 2.0**32
