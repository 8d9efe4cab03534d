"""The design answer: the route value of highest efficiency, and what choosing another one costs."""

from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.models.build import Model
from bowdenfit.physics.friction import transmission_efficiency

GRID_POINTS = 201
_GOLDEN = (np.sqrt(5.0) - 1) / 2
_REFINEMENTS = 32  # golden sections of a bracket of two grid steps: to 1e-7 of a step
EDGE_FRACTION = 0.001  # an optimum this close to an end of the range, as a fraction of the range, counts as at the edge


@dataclass(frozen=True)
class Choice:
    """One length that can be bought.

    Args:
        length: Route value.
        probability_best: Probability that no other choice is more efficient.
        expected_regret: Expected loss of efficiency against the best choice [1].
    """

    length: float
    probability_best: float
    expected_regret: float


@dataclass(frozen=True)
class Window:
    """Shortest stretch of route values that is within a fraction of the best efficiency with a probability.

    Args:
        within: Allowed relative loss of efficiency.
        probability: Probability that the whole window is within it.
        start: Lower end; NaN where no length is good enough that surely.
        stop: Upper end.
    """

    within: float
    probability: float
    start: float
    stop: float


def route_grid(model: Model, points: int = GRID_POINTS) -> np.ndarray:
    """Equally spaced route values over the range of the curves."""
    route = model.description.route
    assert route is not None  # callers ask only where there is a route
    return np.linspace(*route.range, points)


def optimum_of(model: Model) -> Callable[[Float[Array, " free"]], tuple[Array, Array]]:
    """Function of z: the optimal route value and the efficiency there.

    Grid search, then golden section between the neighbors of the best grid point; at a jump of a published geometry the
    grid point itself is kept where it is better.
    """
    grid = route_grid(model)
    step = float(grid[1] - grid[0])

    def optimum(z: Float[Array, " free"]) -> tuple[Array, Array]:
        values = model.space.constrain(z)

        def exponent(route: Array) -> Array:
            return model.cable.exponent_at(values, route[None])[0]

        on_grid = model.cable.exponent_at(values, jnp.asarray(grid))
        best = jnp.argmin(on_grid)
        at = jnp.asarray(grid)[best]

        def shrink(_: int, bracket: tuple[Array, Array]) -> tuple[Array, Array]:
            low, high = bracket
            left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
            better_left = exponent(left) < exponent(right)
            return jnp.where(better_left, low, left), jnp.where(better_left, right, high)

        ends = jnp.maximum(at - step, grid[0]), jnp.minimum(at + step, grid[-1])
        low, high = jax.lax.fori_loop(0, _REFINEMENTS, shrink, ends)
        refined = (low + high) / 2
        better = exponent(refined) < on_grid[best]
        return jnp.where(better, refined, at), transmission_efficiency(jnp.minimum(exponent(refined), on_grid[best]))

    return optimum


def at_edge(lengths: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """Which optima lie at an end of the range, where the true optimum may be outside."""
    tolerance = EDGE_FRACTION * (limits[1] - limits[0])
    return (lengths <= limits[0] + tolerance) | (lengths >= limits[1] - tolerance)


def rank_choices(lengths: np.ndarray, efficiency: np.ndarray) -> tuple[Choice, ...]:
    """Probability of being best and expected regret of each length that can be bought.

    Args:
        lengths: The choices.
        efficiency: Efficiency of each draw (rows) at each choice (columns).
    """
    best = efficiency.max(axis=1, keepdims=True)
    wins = (efficiency == best) / (efficiency == best).sum(axis=1, keepdims=True)
    regret = (best - efficiency).mean(axis=0)
    rows = zip(lengths, wins.mean(axis=0), regret, strict=True)
    return tuple(Choice(float(a), float(b), float(c)) for a, b, c in rows)


def best_window(
    grid: np.ndarray, efficiency: np.ndarray, best: np.ndarray, within: float = 0.01, probability: float = 0.95
) -> Window:
    """The longest window whose every length is within a fraction of the draw's best efficiency with a probability.

    'Within 1 % of the best with 95 % probability' holds at each length of the window; it is the connected stretch
    around the length where that probability is highest.

    Args:
        grid: Route values.
        efficiency: Efficiency of each draw (rows) on the grid (columns).
        best: Highest efficiency of each draw.
        within: Allowed relative loss.
        probability: Required probability.
    """
    good = (efficiency >= (1 - within) * best[:, None]).mean(axis=0)
    center = int(np.argmax(good))
    if good[center] < probability:
        return Window(within, probability, float("nan"), float("nan"))
    low = high = center
    while low > 0 and good[low - 1] >= probability:
        low -= 1
    while high < len(grid) - 1 and good[high + 1] >= probability:
        high += 1
    return Window(within, probability, float(grid[low]), float(grid[high]))
