"""What is compiled for the walkers of one posterior; apart from what emcee makes of it, which takes long to load."""

from collections.abc import Callable
from concurrent.futures import Executor
from functools import cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.description import SamplerSettings
from bowdenfit.description.defaults import THIN
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.conditional import Conditional
from bowdenfit.inference.coordinates import CoordinateMaps, coordinate_maps, maps_without_ridge, z_map
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.moves import Moves, default_moves
from bowdenfit.inference.sweep import SweepChoices, count_walker_numbers, make_walker_sweep


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
