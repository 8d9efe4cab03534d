"""The values of the parameters as coordinates to move in, instead of z.

Readings are nearly linear in friction coefficients and in the coefficients of curves, so that ridges of the posterior that
are bent in z are straight in values, and a step along one stays on it. Noise scales stay in z, where a funnel is less narrow.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.compilation import compile_program
from bowdenfit.parameters.space import ParameterSpace

NODES = np.linspace(-6.0, 6.0, 241)
_WIDTH = float(NODES[1] - NODES[0])
_LEAST_CURVATURE = 1e-6  # relative change of slope below which a value is linear in z, and charting it does nothing


@dataclass(frozen=True)
class PriorGrid:
    """A one-to-one map from z to other coordinates: parameter by parameter, linear between nodes and beyond the last.

    Any such map leaves the sampler's target what it is, because its slopes are known exactly; this one follows the priors.

    Args:
        size: Number of parameters.
        which: Positions of those that are mapped; the others stay as they are.
        values: Coordinate at `NODES` of each of those, (node, parameter), rising.
    """

    size: int
    indices: np.ndarray
    values: np.ndarray

    @cached_property
    def rises(self) -> np.ndarray:
        """From one node to the next."""
        return np.diff(self.values, axis=0)

    @cached_property
    def log_slopes(self) -> np.ndarray:
        """Log of the coordinate per z between nodes."""
        return np.log(self.rises / _WIDTH)

    def _look_up(self, node: Array) -> Array:
        """Coordinate at nodes, its rise to the next, and the log of the slope, of each parameter; one look for all three."""
        table = np.stack([self.values[:-1], self.rises, self.log_slopes], axis=-1).reshape(-1, 3)
        columns = len(self.indices)
        entries = jnp.take(jnp.asarray(table), node * columns + jnp.arange(columns), axis=0, mode="clip")
        return jnp.moveaxis(entries, -1, 0)

    def map_points(self, points: Array, is_z: Array) -> tuple[Array, Array, Array]:
        """Coordinates and z, and log of the volume in z of a unit of the coordinates there, of one of the two.

        Args:
            given: Z or coordinates, (walker, parameter).
            is_z: Whether it is z.
        """
        own = points[:, self.indices]
        search = jax.vmap(partial(jnp.searchsorted, side="right", method="scan"), in_axes=1, out_axes=1)
        along = (own - NODES[0]) / _WIDTH
        node = jnp.where(is_z, jnp.clip(along, 0, len(NODES) - 2).astype(int), search(jnp.asarray(self.values[1:-1]), own))
        value, rise, log_slope = self._look_up(node)
        w = jnp.where(is_z, value + (along - node) * rise, own)
        z = jnp.where(is_z, own, NODES[0] + _WIDTH * (node + (own - value) / rise))
        return points.at[:, self.indices].set(w), points.at[:, self.indices].set(z), -log_slope.sum(axis=1)


@lru_cache(maxsize=8)
def make_prior_grid(space: ParameterSpace) -> PriorGrid:
    """The chart of the values of free parameters, noise scales and values that are linear in z excepted."""
    grid = np.repeat(NODES[:, None], space.size, axis=1)
    shape = jax.ShapeDtypeStruct(grid.shape, jnp.float64)
    values = np.asarray(compile_program(jax.vmap(space.vector), shape, run_once=True)(grid))
    slopes = np.diff(values, axis=0)
    rising = np.all(np.isfinite(values), axis=0) & np.all(slopes > 0, axis=0)
    bent = np.ptp(slopes, axis=0) > _LEAST_CURVATURE * np.max(np.abs(slopes), axis=0)
    which = np.flatnonzero(rising & bent & np.array([p.role != "noise" for p in space.free], dtype=bool))
    return PriorGrid(space.size, which, values[:, which])
