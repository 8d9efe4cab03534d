"""Coordinates w in which walkers move: z, values of the parameters, and friction coefficients given everything else.

Any one-to-one map leaves the sampled density unchanged, because the volume in z of a unit of w is accounted for.

`PriorGrid` moves in parameter values: readings are nearly linear in friction coefficients and in the coefficients of curves, so
ridges of the posterior that are bent in z are straight in values. Noise scales stay in z, where their funnel is less narrow.

`Conditional` moves friction coefficients relative to their conditional posterior. With few readings of little scatter, the
coefficients that are compatible with a given wrap angle and scatter lie in a narrow ridge; walkers hardly ever find the way
from the wide end of the posterior into the narrow one, and small scatters are sampled too seldom. In units of the ridge, about
its center, the conditional posterior is standard normal and there is no funnel.

References:
    Neal 2003, "Slice sampling" (Annals of Statistics 31), section 8, for such a funnel.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.linalg import cho_solve, solve_triangular

from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.parameters.space import ParameterSpace

NODES = np.linspace(-6.0, 6.0, 241)
_WIDTH = float(NODES[1] - NODES[0])
_LEAST_CURVATURE = 1e-6  # relative change of slope below which a value is linear in z and need not be mapped
# readings beyond the number of coefficients from which the ridge is no longer needed; see `Conditional.is_narrow`
_SPARE_READINGS = 4
# Function of walkers (rows), of whether they are z (otherwise w), and of data, that gives their w and z and the log of the
# volume in z of a unit of w; NaN where w has no z.
CoordinateMap = Callable[[Array, Array, Any], tuple[Array, Array, Array]]
CoordinateMaps = Sequence[tuple[CoordinateMap, float]]  # each with its share of all steps


@dataclass(frozen=True)
class PriorGrid:
    """A one-to-one map from z to parameter values: parameter by parameter, piecewise linear between nodes and beyond the last.

    The map need not be exact, since its slopes are known exactly: the sampled density remains the same.

    Args:
        size: Number of parameters.
        indices: Positions of the parameters that are mapped; the others stay as they are.
        values: Parameter value at each of `NODES`, (node, parameter), increasing.
    """

    size: int
    indices: np.ndarray
    values: np.ndarray

    @cached_property
    def rises(self) -> np.ndarray:
        """Increase of the value from one node to the next."""
        return np.diff(self.values, axis=0)

    @cached_property
    def log_slopes(self) -> np.ndarray:
        """Log of the slope of the value between nodes."""
        return np.log(self.rises / _WIDTH)

    def _look_up(self, node: Array) -> Array:
        """Return the value at nodes, its rise to the next node, and the log of the slope, of each parameter, by one lookup."""
        table = np.stack([self.values[:-1], self.rises, self.log_slopes], axis=-1).reshape(-1, 3)
        columns = len(self.indices)
        entries = jnp.take(jnp.asarray(table), node * columns + jnp.arange(columns), axis=0, mode="clip")
        return jnp.moveaxis(entries, -1, 0)

    def map_points(self, points: Array, is_z: Array) -> tuple[Array, Array, Array]:
        """Return w, z and the log of the volume in z of a unit of w, given either w or z.

        Args:
            points: Values of z or of w, (walker, parameter).
            is_z: Whether the points are z.
        """
        own = points[:, self.indices]
        search = jax.vmap(partial(jnp.searchsorted, side="right", method="scan"), in_axes=1, out_axes=1)
        along = (own - NODES[0]) / _WIDTH
        node = jnp.where(
            is_z, jnp.clip(along, 0, len(NODES) - 2).astype(int), search(jnp.asarray(self.values[1:-1]), own)
        )
        value, rise, log_slope = self._look_up(node)
        w = jnp.where(is_z, value + (along - node) * rise, own)
        z = jnp.where(is_z, own, NODES[0] + _WIDTH * (node + (own - value) / rise))
        return points.at[:, self.indices].set(w), points.at[:, self.indices].set(z), -log_slope.sum(axis=1)


@lru_cache(maxsize=8)
def make_prior_grid(space: ParameterSpace) -> PriorGrid:
    """Return the grid of all free parameters except noise scales and parameters whose values are linear in z."""
    grid = np.repeat(NODES[:, None], space.size, axis=1)
    shape = jax.ShapeDtypeStruct(grid.shape, jnp.float64)
    values = np.asarray(compile_program(jax.vmap(space.vector), shape, run_once=True)(grid))
    slopes = np.diff(values, axis=0)
    rising = np.all(np.isfinite(values), axis=0) & np.all(slopes > 0, axis=0)
    bent = np.ptp(slopes, axis=0) > _LEAST_CURVATURE * np.max(np.abs(slopes), axis=0)
    which = np.flatnonzero(rising & bent & np.array([p.role != "noise" for p in space.free], dtype=bool))
    return PriorGrid(space.size, which, values[:, which])


@dataclass(frozen=True)
class Conditional:
    """Coordinates of the friction coefficients of one model, given all other parameters.

    Args:
        posterior: The posterior.
    """

    posterior: LogDensity

    @cached_property
    def indices(self) -> np.ndarray:
        """Positions of the coefficients in z."""
        return np.flatnonzero([p.role == "friction" for p in self.posterior.model.space.free])

    @cached_property
    def _coefficients(self) -> ParameterSpace:
        return ParameterSpace(tuple(self.posterior.model.space.free[i] for i in self.indices))

    @property
    def has_coefficients(self) -> bool:
        """Whether any friction coefficient is free."""
        return len(self.indices) > 0

    @property
    def is_narrow(self) -> bool:
        """Whether the ridge may be so narrow that walkers hardly find into it without these coordinates.

        That is so where few readings determine a scatter, and where an angle is known only by a guess. In simulated funnels
        whose scatter has a known density, walkers without these coordinates put 0.5 to 1 of 100 draws below its 1 %
        quantile with two readings more than coefficients, 0.85 to 1.1 with three, and 0.9 to 1.1 with four and more,
        which is sampling error. Identical readings count once: they carry no information about a scatter.
        """
        model = self.posterior.model
        varying = [varying for term in model.terms for _, varying in term.residual_blocks if varying]
        distinct = [len(np.unique(term.observed())) for term in model.terms]
        informative = min(varying + distinct, default=0)
        return any(p.role == "angle" for p in model.space.free) or informative < len(self.indices) + _SPARE_READINGS

    def map_point(self, point: Array, is_z: Array, data: Any) -> tuple[Array, Array, Array]:
        """Return w, z and the log of the volume in z of a unit of w, given either w or z; NaN where w has no z.

        Args:
            point: One z or one w.
            is_z: Whether the point is a z.
            data: Data of the posterior.
        """
        ridge, own = self._ridge(point, data), point[self.indices]
        z = jnp.where(is_z, own, self._to_z(own, ridge))
        w = jnp.where(is_z, self._to_w(own, ridge), own)
        return point.at[self.indices].set(w), point.at[self.indices].set(z), -self._log_volume(z, ridge)

    def _to_w(self, z: Array, ridge: "_Ridge") -> Array:
        return ridge.root.T @ (self._coefficients.vector(z) - ridge.center)

    def _to_z(self, w: Array, ridge: "_Ridge") -> Array:
        return self._coefficients.z_of(ridge.center + solve_triangular(ridge.root, w, trans="T", lower=True))

    def _log_volume(self, z: Array, ridge: "_Ridge") -> Array:
        """Return the log of the volume in w of a unit of the coefficients' z."""
        _, slopes = jax.jvp(self._coefficients.vector, (z,), (jnp.ones_like(z),))
        return jnp.sum(jnp.log(slopes)) + jnp.sum(jnp.log(jnp.diagonal(ridge.root)))

    def _ridge(self, z: Array, data: Any) -> "_Ridge":
        """Return the ridge at given values of all other parameters; the ridge of the priors where it cannot be computed."""
        own = self._coefficients
        low, middle, high = jax.vmap(own.vector)(jnp.tile(jnp.array([[-1.0], [0.0], [1.0]]), own.size))
        width = 2 / (high - low)
        others = self.posterior.values(z.at[self.indices].set(0.0), data)

        def residuals(coefficients: Array) -> Array:
            values = others | {p.name: coefficients[i] for i, p in enumerate(own.free)}
            return jnp.concatenate(list(self.posterior.residuals_at(values, data).values()))

        differentiate = partial(jax.jvp, residuals, (middle,))
        residual, slopes = jax.vmap(lambda way: differentiate((way,)), out_axes=(None, 1))(jnp.eye(own.size))
        root = jnp.linalg.cholesky(slopes.T @ slopes + jnp.diag(width**2))
        center = middle - cho_solve((root, True), slopes.T @ residual)
        finite = jnp.all(jnp.isfinite(root)) & jnp.all(jnp.isfinite(center))
        return _Ridge(jnp.where(finite, center, middle), jnp.where(finite, root, jnp.diag(width)))


class _Ridge(NamedTuple):
    """Center of the coefficients, and the lower Cholesky factor of their precision."""

    center: Array
    root: Array


def identity(point: Array, is_z: Array, data: Any) -> tuple[Array, Array, Array]:
    """Identity map of one point: walkers move in z."""
    del is_z, data
    return point, point, jnp.zeros(())


z_map: CoordinateMap = jax.vmap(identity, (0, None, None))


def value_map(grid: PriorGrid) -> CoordinateMap:
    """Return the map to parameter values of a `PriorGrid`."""
    return lambda points, is_z, _: grid.map_points(points, is_z)


def ridge_map(conditional: Conditional) -> CoordinateMap:
    """Return the map to friction coefficients in units of their ridge."""
    return jax.vmap(conditional.map_point, (0, None, None))


def coordinate_maps(posterior: LogDensity) -> CoordinateMaps:
    """Return the coordinates in which walkers move, and how often each is used.

    Chosen on simulated on-body data, where the scatter between mountings mixes five times as fast with the ridge. Without
    friction coefficients half of the steps are made in values. Walkers that start far out stay there unless some steps are made
    in z: with values and the ridge alone three of 24 on-body fits took 6000 to 11,000 steps instead of 600 to 1400.
    `compile_walkers` decides where the ridge is not needed.

    Args:
        posterior: The posterior.
    """
    conditional, plain = Conditional(posterior), maps_without_ridge(posterior.model.space)
    if not conditional.has_coefficients:
        return plain
    return *((frame, share / 2) for frame, share in plain), (ridge_map(conditional), 0.5)


def maps_without_ridge(space: ParameterSpace) -> CoordinateMaps:
    """Return z and parameter values as coordinates; also for densities that belong to no model."""
    grid = make_prior_grid(space)
    return (z_map, 0.5), (value_map(grid) if len(grid.indices) else z_map, 0.5)
