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
    """Random choices for some steps.

    Args:
        frame: Number of the coordinates in which walkers move.
        kinds: Number of the move of each step.
        bits: Random bits, (step, half, walker, `count_walker_numbers`), as unsigned integers.
    """

    frame: Array | np.ndarray
    kinds: Array | np.ndarray
    bits: Array | np.ndarray


class Walkers(NamedTuple):
    """State of walkers during a sweep.

    Args:
        w, z: Positions in the coordinates of the sweep, and in z, (walker, parameter).
        value_in_w, value: Log densities in w and in z.
        accepted: Number of accepted proposals.
    """

    w: Array
    z: Array
    value_in_w: Array
    value: Array
    accepted: Array


def count_walker_numbers(size: int) -> int:
    """Return how many uniform numbers a step of a walker of `size` parameters needs."""
    return 1 + count_move_numbers(size)


def make_walker_sweep(
    log_density: Callable[[Array, Any], Array], moves: Moves, frames: CoordinateMaps
) -> Callable[..., Any]:
    """Return a function of `SweepChoices`, z (walker, parameter) and data that moves all walkers of an ensemble.

    It returns z, log densities, and the number of accepted proposals of every walker. The halves of the ensemble move in turns,
    so walkers should be shuffled from one sweep to the next.

    Args:
        log_density: Log density of one z and data.
        moves: Moves of the walkers, with their shares.
        frames: Coordinates, with their shares.
    """
    proposals = [move for move, _ in moves]

    def sweep(choices: SweepChoices, z: Array, data: Any) -> tuple[Array, Array, Array]:
        def evaluate(points: Array, is_z: Array) -> Walkers:
            ways = [partial(_apply_map, frame, is_z) for frame, _ in frames]
            w, z, volume = jax.lax.switch(choices.frame, ways, points, data)
            value = jax.vmap(lambda one: log_density(one, data))(z)
            value, finite = jnp.where(jnp.isnan(value), -jnp.inf, value), jnp.isfinite(volume)
            # Where coordinates do not reach: nothing is proposed there, and a walker that is there already stays.
            beyond = jnp.where(is_z & (value > -jnp.inf), jnp.inf, -jnp.inf)
            value_in_w = jnp.where(finite, value + jnp.where(finite, volume, 0.0), beyond)
            return Walkers(w, z, value_in_w, value, jnp.zeros_like(value))

        def half_step(halves: tuple[Walkers, Walkers], turn: tuple[Array, Array, Array, RandomNumbers]) -> Any:
            (moving, resting), (begins, kind, chance, numbers) = halves, turn
            w, factors = jax.lax.switch(kind, proposals, numbers, moving.w, resting.w)
            proposed = evaluate(jnp.where(begins, moving.z, w), begins)._replace(accepted=moving.accepted + ~begins)
            better = factors + proposed.value_in_w - moving.value_in_w > jnp.log(chance)
            moved = jax.tree.map(lambda new, old: jax.vmap(jnp.where)(begins | better, new, old), proposed, moving)
            return (resting, moved), None

        # In two turns before the first step each half is evaluated where it is, so that only one evaluation is compiled.
        half = len(z) // 2
        halves = _unknown_walkers(z[:half]), _unknown_walkers(z[half:])
        bits = choices.bits.reshape(-1, *choices.bits.shape[2:])
        uniform = to_uniform(jnp.concatenate([jnp.zeros_like(bits[:2]), bits]))
        kinds = jnp.concatenate([jnp.zeros(2, choices.kinds.dtype), jnp.repeat(choices.kinds, 2)])
        begins = jnp.arange(len(kinds)) < 2
        turns = begins, kinds, uniform[..., 0], random_numbers(uniform[..., 1:])
        ended = jax.tree.map(lambda *rows: jnp.concatenate(rows), *jax.lax.scan(half_step, halves, turns)[0])
        return ended.z, ended.value, ended.accepted

    return sweep


def _unknown_walkers(z: Array) -> Walkers:
    """Return walkers at z whose densities are not known yet."""
    return Walkers(z, z, *jnp.zeros((3, len(z))))


def _apply_map(frame: CoordinateMap, is_z: Array, points: Array, data: Any) -> tuple[Array, Array, Array]:
    """Return w, z and the log volume of walkers, given either of the first two."""
    return frame(points, is_z, data)


def to_uniform(bits: Array | np.ndarray) -> Array:
    """Return numbers strictly between 0 and 1 from unsigned integers."""
    return (jnp.asarray(bits) + 0.5) / 2.0**32


class MoveShares(NamedTuple):
    """Shares of the moves and of the coordinate systems.

    Args:
        moves: Share of each.
        frames: Share of each coordinate system.
    """

    moves: tuple[float, ...]
    frames: tuple[float, ...]

    def choose(self, random: np.random.RandomState, shape: tuple[int, int]) -> SweepChoices:
        """Draw the random choices for a sweep of walkers of a shape, (walker, parameter)."""
        walkers, size = shape
        return SweepChoices(
            np.asarray(random.choice(len(self.frames), p=self.frames), dtype=np.int32),
            random.choice(len(self.moves), size=THIN, p=self.moves).astype(np.int32),
            random.randint(2**32, size=(THIN, 2, walkers // 2, count_walker_numbers(size)), dtype=np.uint32),
        )


class WalkerPrograms(NamedTuple):
    """Compiled programs of an ensemble's walkers.

    Args:
        sweep: Function of `make_walker_sweep` for `THIN` steps.
        shares: Shares of its moves and coordinates.
        later: Compiles the programs of walkers that have not converged in the usual time; None if they are the same.
    """

    sweep: Callable[..., Any]
    shares: MoveShares
    later: "Callable[[], WalkerPrograms] | None" = None


def compile_walkers(
    posterior: LogDensity, settings: SamplerSettings, moves: Moves | None = None, beside: Executor | None = None
) -> WalkerPrograms:
    """Compile the walkers of one posterior.

    Where the ridge of friction coefficients is wide, walkers first move without its coordinates, which take half of the time to
    compile and to run: loops, benches and recordings converge in as many steps. Walkers that have not converged in the usual
    time then use them.

    Args:
        posterior: The posterior; the programs serve other data of the same shapes.
        settings: Sampler settings, for the number of walkers.
        moves: Moves, in z alone; `default_moves`, in all coordinates, if omitted.
        beside: See `compile_program`.
    """
    space = posterior.model.space
    arguments = posterior.log_density, posterior.data, space.size, settings
    options: Any = {"beside": beside, "run_often": posterior.model.is_slow}
    if moves is not None:
        return compile_density_walkers(*arguments, ((z_map, 1.0),), moves, **options)
    if Conditional(posterior).is_narrow:
        return compile_density_walkers(*arguments, coordinate_maps(posterior), **options)
    plain = maps_without_ridge(space)
    first = compile_density_walkers(*arguments, plain, **options)

    @cache
    def later() -> WalkerPrograms:
        frames = coordinate_maps(posterior)
        return compile_density_walkers(*arguments, frames) if len(frames) > len(plain) else first

    return first._replace(later=later)


def compile_density_walkers(
    log_density: Callable[[Array, Any], Array],
    data: Any,
    size: int,
    settings: SamplerSettings,
    frames: CoordinateMaps,
    moves: Moves | None = None,
    beside: Executor | None = None,
    run_often: bool = False,
) -> WalkerPrograms:
    """Compile the walkers of any density.

    Args:
        log_density: Log density of one z and data.
        data: Data of the shapes for which the programs are compiled.
        size: Number of parameters.
        settings: Sampler settings, for the number of walkers.
        frames: The coordinates.
        moves: `default_moves` if omitted.
        beside, run_often: See `compile_program`.
    """
    shape = settings.walkers(size), size
    moves = moves or default_moves(size, shape[0])
    shares = MoveShares(*(tuple(share for _, share in weighted) for weighted in (moves, frames)))
    choices = shares.choose(np.random.RandomState(0), shape)  # any, for its shapes
    sweep, z = make_walker_sweep(log_density, moves, frames), jax.ShapeDtypeStruct(shape, jnp.float64)
    return WalkerPrograms(compile_program(sweep, choices, z, data, beside=beside, run_often=run_often), shares)
