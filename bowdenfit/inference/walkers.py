"""Compiled programs that move ensembles of walkers: one sweep over an ensemble, and all that one posterior needs.

Random numbers come from outside. This module does not import emcee, which takes long to load.
"""

from collections.abc import Callable
from concurrent.futures import Executor
from functools import cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.description import SamplerSettings
from bowdenfit.description.defaults import THIN
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.coordinates import (
    Conditional,
    CoordinateMap,
    CoordinateMaps,
    coordinate_maps,
    maps_without_ridge,
    z_map,
)
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.moves import Moves, RandomNumbers, count_move_numbers, default_moves, random_numbers


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


def make_walker_sweep(
    log_density: Callable[[Array, Any], Array], moves: Moves, frames: CoordinateMaps
) -> Callable[..., Any]:
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


class MoveShares(NamedTuple):
    """How often what is done.

    Args:
        moves: Share of each.
        frames: Share of each of the coordinates.
    """

    moves: tuple[float, ...]
    frames: tuple[float, ...]

    def choose(self, random: np.random.RandomState, shape: tuple[int, int]) -> SweepChoices:
        """What is drawn at random for a sweep of walkers, (walker, parameter)."""
        walkers, size = shape
        return SweepChoices(
            np.asarray(random.choice(len(self.frames), p=self.frames), dtype=np.int32),
            random.choice(len(self.moves), size=THIN, p=self.moves).astype(np.int32),
            random.randint(2**32, size=(THIN, 2, walkers // 2, count_walker_numbers(size)), dtype=np.uint32),
        )


class WalkerPrograms(NamedTuple):
    """What walkers of an ensemble run.

    Args:
        sweep: `walker_sweep` of `THIN` steps.
        shares: Of its moves and coordinates.
        later: What walkers run that have not settled in the usual time, compiled then; None where that is the same.
    """

    sweep: Callable[..., Any]
    shares: MoveShares
    later: "Callable[[], WalkerPrograms] | None" = None


def compile_walkers(
    posterior: LogDensity, settings: SamplerSettings, moves: Moves | None = None, beside: Executor | None = None
) -> WalkerPrograms:
    """The programs of one posterior.

    Where its ridge is wide, walkers do without it at first, because it takes half of the time to compile and to run: loops,
    benches and recordings settle in as many steps. What has not settled in the usual time has it, whatever the reason.

    Args:
        posterior: The posterior; what is compiled serves others with data of the same shapes.
        settings: How many walkers.
        moves: What they do, in z alone; `default_moves`, in all coordinates, if omitted.
        beside: See `compile_program`.
    """
    space = posterior.model.space
    of_what = posterior.log_density, posterior.data, space.size, settings
    if moves is not None:
        return compile_density_walkers(*of_what, ((z_map, 1.0),), moves, beside)
    if Conditional(posterior).is_narrow:
        return compile_density_walkers(*of_what, coordinate_maps(posterior), beside=beside)
    plain = maps_without_ridge(space)
    first = compile_density_walkers(*of_what, plain, beside=beside)

    @cache
    def later() -> WalkerPrograms:
        frames = coordinate_maps(posterior)
        return compile_density_walkers(*of_what, frames) if len(frames) > len(plain) else first

    return first._replace(later=later)


def compile_density_walkers(
    log_density: Callable[[Array, Any], Array],
    data: Any,
    size: int,
    settings: SamplerSettings,
    frames: CoordinateMaps,
    moves: Moves | None = None,
    beside: Executor | None = None,
) -> WalkerPrograms:
    """The programs of any density.

    Args:
        log_density: Of one z and data.
        data: Data of the shapes that it is compiled for.
        size: Number of parameters.
        settings: How many walkers.
        frames: The coordinates.
        moves: `default_moves` if omitted.
        beside: See `compile_program`.
    """
    shape = settings.walkers(size), size
    moves = moves or default_moves(size, shape[0])
    shares = MoveShares(*(tuple(share for _, share in weighted) for weighted in (moves, frames)))
    choices = shares.choose(np.random.RandomState(0), shape)  # any, for its shapes
    sweep, z = make_walker_sweep(log_density, moves, frames), jax.ShapeDtypeStruct(shape, jnp.float64)
    return WalkerPrograms(compile_program(sweep, choices, z, data, beside=beside), shares)
