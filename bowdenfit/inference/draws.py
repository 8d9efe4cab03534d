"""Functions of posterior draws: named values, curves, forces and replicated readings, compiled for many draws at a time."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.resources import available_cores
from bowdenfit.models import Model

PRIOR_DRAWS = 4096  # of which 205 lie beyond either end of a 90 % interval; a judgement
BATCH = 1024  # draws that a compiled program takes at a time
_SMALL = 10_000  # numbers in the data below which compiling takes longer than running
PREDICTED_GROUPS = ("log_likelihood", "expected", "replicated")  # of `compile_replicator`, a number for each reading
Function = Callable[..., Any]
DrawFunction: TypeAlias = Callable[[np.ndarray], Any]


def for_each_draw(
    function: Function,
    size: int,
    *data: Any,
    run_once: bool = False,
    run_often: bool = False,
    beside: Executor | None = None,
) -> DrawFunction:
    """Compile `function` of one z (and of data that are the same for all) to be applied to any number of z (rows)."""
    over_rows, rows = jax.vmap(function, in_axes=(0, *(None for _ in data))), jax.ShapeDtypeStruct((BATCH, size), float)
    program = compile_program(over_rows, rows, *data, run_once=run_once, run_often=run_often, beside=beside)
    return lambda z: run_in_batches(lambda part: program(part, *data), BATCH, z)


def for_each_value(function: Function, values: Mapping[str, np.ndarray], *data: Any) -> Any:
    """Apply `function` of named values (and of data that are the same for all) to many draws.

    The compiled program does not contain the map from z to values, which often is most of it.

    Args:
        function: Function of named values [internal units].
        values: Values of all draws, by name.
        data: Further arguments.
    """
    over_rows = jax.vmap(function, in_axes=(0, *(None for _ in data)))
    rows = {name: jax.ShapeDtypeStruct((BATCH,), float) for name in values}
    program = compile_program(over_rows, rows, *data, run_once=True)
    return run_in_batches(lambda part: program(part, *data), BATCH, dict(values))


def run_in_batches(program: Function, batch: int, rows: Any) -> Any:
    """Run a program that is compiled for `batch` rows, of one array or of several, on any number of rows, on all cores."""
    count = len(jax.tree.leaves(rows)[0])

    def run_batch(start: int) -> Any:
        padded = np.minimum(np.arange(start, start + batch), count - 1)
        with jax.enable_x64(True):  # the setting is each thread's own
            return jax.tree.map(np.asarray, program(jax.tree.map(lambda array: array[padded], rows)))

    with ThreadPoolExecutor(available_cores()) as threads:
        parts = list(threads.map(run_batch, range(0, count, batch)))
    whole = jax.tree.map(lambda *x: np.concatenate(x), *parts)
    return jax.tree.map(lambda x: x[:count], whole)


def value_function(model: Model) -> Callable[[Float[Array, " free"]], dict[str, Array]]:
    """Return a function of z that gives free parameters and derived curve coefficients by name, in their shown units."""
    return lambda z: shown_values(model, model.space.constrain(z))


def shown_values(model: Model, values: Mapping[str, Array]) -> dict[str, Array]:
    """Return free parameters and derived curve coefficients by name, in shown units, from values in internal units."""
    shown = {p.name: values[p.name] * p.shown_scale for p in model.space.free}
    for curve in model.cable.curves.values():
        shown |= curve.derived(values) | curve.departure_rms(values)
    return shown


def derived_units(model: Model) -> dict[str, tuple[str, str]]:
    """Return unit and symbol of every derived curve coefficient, by name."""
    every = (curve.derived_units() | curve.departure_units() for curve in model.cable.curves.values())
    return {name: unit for units in every for name, unit in units.items()}


def compile_replicator(posterior: LogDensity, seed: int, beside: Executor | None = None) -> DrawFunction:
    """Compile the posterior predictive distribution of draws (rows).

    The function returns, by group ("values", "log_likelihood", "expected", "replicated") and name, arrays over draws and
    readings: named values, log likelihood of every reading, expected readings, and replicated readings.
    """
    model = posterior.model
    key = jax.random.key(seed)  # an argument, so that the program is the same for every seed

    def predict(z_and_number: Float[Array, " free_and_one"], data: Any, key: Array) -> dict[str, Mapping[str, Array]]:
        number = z_and_number[-1].astype(jnp.uint32)
        keys = jax.random.split(jax.random.fold_in(key, number), max(len(model.terms), 1))
        values = model.space.constrain(z_and_number[:-1])
        terms = list(zip(model.terms, data, keys, strict=False))
        return {
            "values": shown_values(model, values),
            "log_likelihood": {t.name: t.log_likelihood(values, d) for t, d, _ in terms},
            "expected": {t.name: t.expected(values, d) for t, d, _ in terms},
            "replicated": {t.name: t.simulate(values, d, key) for t, d, key in terms},
        }

    slow, small = model.is_slow, sum(np.size(array) for array in jax.tree.leaves(posterior.data)) < _SMALL
    options: Any = {"run_once": small and not slow, "run_often": slow, "beside": beside}
    program = for_each_draw(predict, model.space.size + 1, posterior.data, key, **options)
    return lambda z: program(np.column_stack([z, np.arange(len(z), dtype=float)]))


def imply_groups(model: Model, z: np.ndarray, implied: DrawFunction, seed: int) -> dict[str, Any]:
    """Return what draws imply by group (see `compile_replicator`), and draws of the parameters from the prior ("prior").

    Args:
        model: The model.
        z: Draws, (chain, draw, parameter).
        implied: Program made by `compile_replicator`.
        seed: Seed of the draws from the prior.
    """
    chains, draws, size = z.shape
    prior_z = np.random.default_rng([seed, 2]).standard_normal((PRIOR_DRAWS, size))
    of_all = implied(np.concatenate([z.reshape(-1, size), prior_z]))
    groups = jax.tree.map(lambda v: v[: chains * draws].reshape(chains, draws, *v.shape[1:]), of_all)
    return groups | {"prior": {p.name: of_all["values"][p.name][chains * draws :][None] for p in model.space.free}}


def curve_function(model: Model, route: np.ndarray) -> Callable[[Float[Array, " free"]], dict[str, Array]]:
    """Return a function of z that gives wrap angles of curved contacts [deg] and the efficiency [1] at route values."""
    return lambda z: curves_at(model, model.space.constrain(z), route)


def curves_at(model: Model, values: Mapping[str, Array], route: np.ndarray) -> dict[str, Array]:
    """Return wrap angles of curved contacts [deg] and the efficiency [1] at route values, by named values [internal units]."""
    at = jnp.asarray(route, dtype=float)
    angles = {name: jnp.rad2deg(curve.wrap_angle(values, at)) for name, curve in model.cable.curves.items()}
    return angles | {"efficiency": model.cable.efficiency_at(values, at)}


def output_force_at(
    model: Model,
    z: np.ndarray,
    route: np.ndarray,
    force: float,
    stroke: int,
    mountings: Sequence[np.ndarray],
    *,
    inverse: bool = False,
) -> list[np.ndarray]:
    """Return the output force [N] of draws (rows) at route values (columns), at the reference speed, for some mountings.

    Args:
        model: The model.
        z: Draws, one a row.
        route: Route values; any one number where the cable has no route.
        force: Force at the motor side [N].
        stroke: +1 pulling, -1 return.
        mountings: Effect of each mounting on the friction exponent of each draw [1].
        inverse: Return the input force instead, given the force at the load side.
    """
    at = jnp.asarray(np.atleast_1d(route), dtype=float)
    function: Function = model.cable.input_force_at if inverse else model.cable.output_force_at

    def other_end(z_and_mounting: Float[Array, " free_and_one"]) -> Float[Array, " route"]:
        values = model.space.constrain(z_and_mounting[:-1])
        return function(values, at, jnp.asarray(float(force)), jnp.asarray(float(stroke)), z_and_mounting[-1])

    program = for_each_draw(other_end, model.space.size + 1)
    return [program(np.column_stack([z, mounting])) for mounting in mountings]


def efficiency_at(model: Model, z: np.ndarray, route: np.ndarray) -> np.ndarray:
    """Return the efficiency of every draw (rows) at route values (columns); any one number where the cable has no route."""
    curves = curve_function(model, np.atleast_1d(np.asarray(route, dtype=float)))
    return for_each_draw(lambda one: curves(one)["efficiency"], model.space.size)(z)
