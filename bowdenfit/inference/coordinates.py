"""Coordinates w in which walkers move: z, values of the parameters, and friction coefficients given everything else.

Any one-to-one map leaves what is sampled as it is, because the volume in z of a unit of w is counted.
"""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from bowdenfit.inference.conditional import Conditional
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.prior_grid import PriorGrid, make_prior_grid
from bowdenfit.parameters.space import ParameterSpace

# W and z of walkers (rows), and log of the volume in z of a unit of w there: of either of them, of which it is said whether it
# is z, and of data. NaN where w has no z.
CoordinateMap = Callable[[Array, Array, Any], tuple[Array, Array, Array]]
CoordinateMaps = Sequence[tuple[CoordinateMap, float]]  # each with its share of all steps


def identity(point: Array, is_z: Array, data: Any) -> tuple[Array, Array, Array]:
    """Of one point: z itself."""
    del is_z, data
    return point, point, jnp.zeros(())


z_map: CoordinateMap = jax.vmap(identity, (0, None, None))


def value_map(grid: PriorGrid) -> CoordinateMap:
    """Values of the parameters, as `PriorGrid` has them."""
    return lambda points, is_z, _: grid.map_points(points, is_z)


def ridge_map(conditional: Conditional) -> CoordinateMap:
    """Coefficients given everything else, in units of their ridge."""
    return jax.vmap(conditional.map_point, (0, None, None))


def coordinate_maps(posterior: LogDensity) -> CoordinateMaps:
    """In what walkers move, and how often, whatever the posterior is like.

    By measurement on simulated on-body data, whose scatter between mountings mixes five times as fast for the ridge. Half of
    all is done in values where there is no friction coefficient that readings tell of. Without z walkers that start far out
    stay there: with values and the ridge alone three of 24 on-body fits took 6000 to 11,000 steps instead of 600 to 1400.
    `walker_programs` says where the ridge is not needed.

    Args:
        posterior: The posterior.
    """
    conditional, plain = Conditional(posterior), maps_without_ridge(posterior.model.space)
    if not conditional.has_coefficients:
        return plain
    return *((frame, share / 2) for frame, share in plain), (ridge_map(conditional), 0.5)


def maps_without_ridge(space: ParameterSpace) -> CoordinateMaps:
    """Z and values alone; also for densities that are no model's."""
    grid = make_prior_grid(space)
    return (z_map, 0.5), (value_map(grid) if len(grid.indices) else z_map, 0.5)
