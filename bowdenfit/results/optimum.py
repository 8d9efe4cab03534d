"""The route value of highest efficiency, for one draw."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.model import Model

GRID_POINTS = 201
_GOLDEN = (np.sqrt(5.0) - 1) / 2
_REFINEMENTS = 32  # golden sections of a bracket of two grid steps: to 1e-7 of a step


def route_grid(model: Model, points: int = GRID_POINTS) -> np.ndarray:
    """Equally spaced route values over the range of the curves."""
    route = model.description.route
    assert route is not None  # callers ask only where there is a route
    return np.linspace(*route.range, points)


def make_optimizer(model: Model) -> Callable[[Float[Array, " free"]], tuple[Array, Array]]:
    """Function of z: the optimal route value and the efficiency there.

    Grid search, then golden section between the neighbors of the best grid point; at a jump of a published geometry the
    grid point itself is kept where it is better.
    """
    grid = route_grid(model)
    step = float(grid[1] - grid[0])

    def optimum(z: Float[Array, " free"]) -> tuple[Array, Array]:
        values = model.space.constrain(z)

        def loss(route: Array) -> Array:
            return model.cable.loss_at(values, route[None])[0]

        def efficiency(at_loss: Array) -> Array:
            return -at_loss if model.cable.is_loop else model.cable.friction.efficiency(values, at_loss)

        on_grid = model.cable.loss_at(values, jnp.asarray(grid))
        best = jnp.argmin(on_grid)
        at = jnp.asarray(grid)[best]

        def shrink(_: int, bracket: tuple[Array, Array]) -> tuple[Array, Array]:
            low, high = bracket
            left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
            better_left = loss(left) < loss(right)
            return jnp.where(better_left, low, left), jnp.where(better_left, right, high)

        ends = jnp.maximum(at - step, grid[0]), jnp.minimum(at + step, grid[-1])
        low, high = jax.lax.fori_loop(0, _REFINEMENTS, shrink, ends)
        refined = (low + high) / 2
        better = loss(refined) < on_grid[best]
        return jnp.where(better, refined, at), efficiency(jnp.minimum(loss(refined), on_grid[best]))

    return optimum
