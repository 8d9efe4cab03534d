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
from bowdenfit.inference.prior_grid import Chart, chart_values
from bowdenfit.parameters.space import ParameterSpace

# W and z of walkers (rows), and log of the volume in z of a unit of w there: of either of them, of which it is said whether it
# is z, and of data. NaN where w has no z.
Frame = Callable[[Array, Array, Any], tuple[Array, Array, Array]]
Frames = Sequence[tuple[Frame, float]]  # each with its share of all steps


def z_alone(given: Array, is_z: Array, data: Any) -> tuple[Array, Array, Array]:
    """Of one point: z itself."""
    del is_z, data
    return given, given, jnp.zeros(())


in_z: Frame = jax.vmap(z_alone, (0, None, None))


def in_values(chart: Chart) -> Frame:
    """Values of the parameters, as `Chart` has them."""
    return lambda given, is_z, _: chart.at(given, is_z)


def in_ridge(conditional: Conditional) -> Frame:
    """Coefficients given everything else, in units of their ridge."""
    return jax.vmap(conditional.at, (0, None, None))


def frames_of(posterior: LogDensity) -> Frames:
    """In what walkers move, and how often, whatever the posterior is like.

    By measurement on simulated on-body data, whose scatter between mountings mixes five times as fast for the ridge. Half of
    all is done in values where there is no friction coefficient that readings tell of. Without z walkers that start far out
    stay there: with values and the ridge alone three of 24 on-body fits took 6000 to 11,000 steps instead of 600 to 1400.
    `walker_programs` says where the ridge is not needed.

    Args:
        posterior: The posterior.
    """
    conditional, without = Conditional(posterior), frames_without_ridge(posterior.model.space)
    if not conditional.has_coefficients:
        return without
    return *((frame, share / 2) for frame, share in without), (in_ridge(conditional), 0.5)


def frames_without_ridge(space: ParameterSpace) -> Frames:
    """Z and values alone; also for densities that are no model's."""
    chart = chart_values(space)
    return (in_z, 0.5), (in_values(chart) if len(chart.which) else in_z, 0.5)
