"""What the draws imply along the route: curves, the optimal length of each draw, and efficiencies at chosen lengths."""

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.sensors import RUN_SCATTER, noise_law
from bowdenfit.description import Description, Route
from bowdenfit.display import Display, Rows
from bowdenfit.inference.draws import DrawFunction, curves_at, for_each_draw
from bowdenfit.inference.interval import Interval
from bowdenfit.models import Model
from bowdenfit.results.optimal_length import OptimalLength, find_best_window, is_at_edge, rank_choices

GRID_POINTS = 201  # an odd number, so that the middle is one; a judgement: curves of wrap angles are wider than many steps
_GOLDEN = (np.sqrt(5.0) - 1) / 2  # golden ratio: the part of a bracket that each section keeps
_REFINEMENTS = 32  # golden sections of a bracket of two grid steps: to 4e-7 of a step


def route_grid(model: Model, points: int = GRID_POINTS) -> np.ndarray:
    """Return equally spaced route values over the range of the curves."""
    route = model.description.route
    assert route is not None  # callers ask only where there is a route
    return np.linspace(*route.range, points)


def make_optimizer(model: Model) -> Callable[[Float[Array, " free"]], tuple[Array, Array]]:
    """Return a function of z that gives the optimal route value and the efficiency there."""
    optimum = make_optimizer_of_values(model)
    return lambda z: optimum(model.space.constrain(z))


def make_optimizer_of_values(model: Model) -> Callable[[Mapping[str, Array]], tuple[Array, Array]]:
    """Return a function of named values [internal units] that gives the optimal route value and the efficiency there.

    Grid search, then golden section between the neighbors of the best grid point; at a jump of a published geometry the
    grid point itself is kept where it is better.
    """
    grid = route_grid(model)
    step = float(grid[1] - grid[0])

    def optimum(values: Mapping[str, Array]) -> tuple[Array, Array]:
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


class Efficiencies(Display, list[Interval]):
    """Efficiencies [1] with intervals at values of the route variable: a list that displays itself as `predict` does.

    Args:
        intervals: One a length.
        route: The route; None without one.
        lengths: Route values.
        outside: That each lies outside the curves, in words; empty inside.
    """

    def __init__(
        self, intervals: Iterable[Interval], route: Route | None, lengths: Iterable[float], outside: Iterable[str]
    ) -> None:
        super().__init__(intervals)
        at = [float(length) for length in lengths]
        self._at = [{} if route is None else {f"{route.variable}_{route.unit}": length} for length in at]
        self._outside = list(outside)

    @property
    def rows(self) -> list[dict[str, Any]]:
        """Rows as `predict` gives them."""
        return [
            at
            | {"efficiency": interval.median}
            | {k: v for k, v in vars(interval).items() if k != "median"}
            | ({"in_range": not outside} if at else {})
            | {"note": outside}
            for at, interval, outside in zip(self._at, self, self._outside, strict=True)
        ]

    def _table(self) -> Rows:
        rows = self.rows
        numbers = [name for row in rows[:1] for name, value in row.items() if isinstance(value, float)]
        return rows, {name: name.rpartition("_")[2] if name in self._at[0] else "1" for name in numbers}


@dataclass(frozen=True, repr=False)
class RouteDraws(Display):
    """What every draw implies along the route; rows are draws.

    Args:
        grid: Route values of the curves.
        curves: The efficiency [1] and wrap angles [deg] on the grid, by name.
        choices: Efficiency at the choices.
        mean, mounted: Output force [N] there at the reference force, without a mounting's effect and in a new one.
    """

    grid: np.ndarray
    curves: dict[str, np.ndarray]
    choices: np.ndarray
    mean: np.ndarray
    mounted: np.ndarray

    def sentences(self) -> list[str]:
        """Return the number of draws and grid points."""
        return [f"{', '.join(self.curves)} of {len(self.choices)} draws at {len(self.grid)} values of the route."]

    def _table(self) -> Rows:
        """Return medians and 90 % intervals on the grid."""
        quantiles = {name: np.quantile(draws, (0.5, 0.05, 0.95), axis=0) for name, draws in self.curves.items()}
        endings = ("", "_q05", "_q95")
        columns = {name + ending: q for name, levels in quantiles.items() for ending, q in zip(endings, levels, strict=True)}
        return {"route": self.grid} | columns, {name: "1" if name.startswith("efficiency") else "deg" for name in columns}


def compile_along_route(model: Model, beside: Executor | None = None) -> DrawFunction:
    """Compile the function from draws (z, and the effect of a new mounting on the exponent) to curves and forces.

    Args:
        model: The model.
        beside: See `compile_program`.
    """
    route, grid = model.description.route, route_grid(model)
    assert route is not None  # callers ask only where there is a route
    at, force = np.asarray(route.choices, dtype=float), model.cable.friction.conditions.reference_force

    def pulled(values: dict[str, Array], effect: Array) -> Array:
        return model.cable.output_force_at(values, jnp.asarray(at), jnp.asarray(float(force)), jnp.ones(()), effect)

    def implied(z_and_mounting: Float[Array, " free_and_one"]) -> dict[str, Any]:
        values = model.space.constrain(z_and_mounting[:-1])
        effects = {"mean": jnp.zeros(()), "mounted": z_and_mounting[-1]}
        of_choices = {name: pulled(values, effect) for name, effect in effects.items()} if len(at) else {}
        if len(at):
            of_choices["choices"] = model.cable.efficiency_at(values, jnp.asarray(at))
        return {"curves": curves_at(model, values, grid), **of_choices}

    with jax.enable_x64(True):
        return for_each_draw(implied, model.space.size + 1, run_once=True, beside=beside)


def compute_along_route(model: Model, program: DrawFunction, z: np.ndarray, mounting: np.ndarray) -> RouteDraws:
    """Return what draws imply along the route.

    Args:
        model: The model.
        program: Program made by `compile_along_route`.
        z: Draws, one a row.
        mounting: Effect of a new mounting on the friction exponent of each.
    """
    with jax.enable_x64(True):
        outputs = program(np.column_stack([z, mounting]))
    none = np.zeros((len(z), 0))
    return RouteDraws(
        route_grid(model),
        outputs["curves"],
        outputs.get("choices", none),
        outputs.get("mean", none),
        outputs.get("mounted", none),
    )


def draw_new_mounting(description: Description, values: dict[str, np.ndarray], n: int, seed: int) -> np.ndarray:
    """Draw the effect of one new mounting on the friction exponent [1], for every draw.

    Args:
        description: How readings scatter.
        values: Draws by parameter.
        n: Their number.
        seed: Seed of the fit.
    """
    scatter = values.get(RUN_SCATTER, np.zeros(1)).ravel()
    return scatter * noise_law(description).draw_with(np.random.default_rng([seed, 3]), n)


def summarize_optimum(
    route: Route, lengths: np.ndarray, efficiencies: np.ndarray, along: RouteDraws, force: float | None
) -> OptimalLength:
    """Return the best length with its uncertainty.

    Args:
        route: Range of the route and the choices on it.
        lengths: Optimum of every draw.
        efficiencies: Efficiency there.
        along: The same draws along the route.
        force: Input force at which efficiencies hold [N]; None where they are the same at any.
    """
    return OptimalLength(
        route.variable,
        route.unit,
        Interval.of(lengths),
        Interval.of(efficiencies),
        float(is_at_edge(lengths, route.range).mean()),
        find_best_window(along.grid, along.curves["efficiency"], efficiencies),
        rank_choices(np.asarray(route.choices), along.choices) if route.choices else (),
        force,
    )
