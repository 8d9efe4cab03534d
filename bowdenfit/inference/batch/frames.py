"""The coordinates w of `coordinates`, for walkers of a batch: in JAX, and with the volume in z of a unit of w."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.conditional import Conditional
from bowdenfit.inference.coordinates import shares_of_coordinates
from bowdenfit.inference.value_chart import NODES, Chart

_WIDTH = float(NODES[1] - NODES[0])


class Frame(NamedTuple):
    """Coordinates.

    Args:
        to_w: W of z and data, (walker, parameter).
        from_w: Z of w and data, and log of the volume of a unit of w there; NaN where there is no z.
    """

    to_w: Callable[[Array, Any], Array]
    from_w: Callable[[Array, Any], tuple[Array, Array]]


Frames = Sequence[tuple[Frame, float]]  # each with its share of all steps

IN_Z = Frame(lambda z, _: z, lambda w, _: (w, jnp.zeros(len(w))))


def batch_frames(chart: Chart, conditional: Conditional) -> Frames:
    """In what walkers of a batch move, and how often."""
    values = in_values(chart) if len(chart.which) else None
    return shares_of_coordinates(IN_Z, values, in_ridge(conditional) if conditional.is_told else None)


def in_values(chart: Chart) -> Frame:
    """Values of the parameters, as `Chart` has them."""
    return Frame(partial(_to_values, chart), partial(_from_values, chart))


def in_ridge(conditional: Conditional) -> Frame:
    """Coefficients given everything else, in units of their ridge."""
    return Frame(jax.vmap(conditional.to_w, (0, None)), jax.vmap(conditional.from_w, (0, None)))


def _to_values(chart: Chart, z: Array, _: Any) -> Array:
    """`Chart.from_z`."""
    along = (z[:, chart.which] - NODES[0]) / _WIDTH
    node = jnp.clip(along, 0, len(NODES) - 2).astype(int)
    return z.at[:, chart.which].set(_taken(chart.values, node) + (along - node) * _taken(chart.rises, node))


def _from_values(chart: Chart, w: Array, _: Any) -> tuple[Array, Array]:
    """`Chart.to_z`."""
    at, inner = w[:, chart.which], jnp.asarray(chart.values[1:-1])
    search = jax.vmap(partial(jnp.searchsorted, side="right"), in_axes=1, out_axes=1)
    node = search(inner, at)
    along = node + (at - _taken(chart.values, node)) / _taken(chart.rises, node)
    z = w.at[:, chart.which].set(NODES[0] + _WIDTH * along)
    return z, -_taken(chart.log_slopes, node).sum(axis=1)


def _taken(table: np.ndarray, node: Array) -> Array:
    """Of each column of a table the rows of its nodes."""
    return jnp.take(jnp.asarray(table), node * table.shape[1] + jnp.arange(table.shape[1]), mode="clip")
