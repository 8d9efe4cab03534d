"""Coordinates w in which walkers move: z, values of the parameters, and friction coefficients given everything else.

Any one-to-one map leaves what is sampled as it is, because the volume in z of a unit of w is counted.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from bowdenfit.inference.conditional import Conditional
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.value_chart import Chart, chart_values
from bowdenfit.parameters.space import ParameterSpace


class Frame(NamedTuple):
    """Coordinates.

    Args:
        to_w: W of z and data, (walker, parameter), and log of the volume in z of a unit of w there.
        from_w: Z of w and data, and the same; NaN where there is no z.
    """

    to_w: Callable[[Array, Any], tuple[Array, Array]]
    from_w: Callable[[Array, Any], tuple[Array, Array]]


Frames = Sequence[tuple[Frame, float]]  # each with its share of all steps

IN_Z = Frame(*[lambda z, _: (z, jnp.zeros(len(z)))] * 2)


def in_values(chart: Chart) -> Frame:
    """Values of the parameters, as `Chart` has them."""
    return Frame(lambda z, _: chart.from_z(z), lambda w, _: chart.to_z(w))


def in_ridge(conditional: Conditional) -> Frame:
    """Coefficients given everything else, in units of their ridge."""
    return Frame(jax.vmap(conditional.to_w, (0, None)), jax.vmap(conditional.from_w, (0, None)))


def frames_of(posterior: LogDensity) -> Frames:
    """In what walkers move, and how often.

    By measurement on simulated on-body data, whose scatter between mountings mixes five times as fast for the ridge. Half of
    all is done in values where there is no friction coefficient that readings tell of.

    Args:
        posterior: The posterior.
    """
    conditional, without = Conditional(posterior), frames_without_ridge(posterior.model.space)
    if not conditional.is_told:
        return without
    return *((frame, share / 2) for frame, share in without), (in_ridge(conditional), 0.5)


def frames_without_ridge(space: ParameterSpace) -> Frames:
    """Z and values, for densities that are no model's alone."""
    chart = chart_values(space)
    return (IN_Z, 0.5), (in_values(chart) if len(chart.which) else IN_Z, 0.5)
