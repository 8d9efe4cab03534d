"""The least-squares objective: residuals of a posterior with some parameters pinned, with or without priors."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.solver import PRECISE, Precision, compile_solver, minimize
from bowdenfit.parameters.priors import HalfCauchy, HalfNormal, LogNormal, TruncatedNormal, Uniform
from bowdenfit.parameters.space import Parameter

Solution = dict[str, Any]
Objective = Callable[..., Solution]

_TIE = 1e-6  # weight of z that keeps undetermined parameters from drifting, without moving any other
_CACHE_SIZE = 4  # evaluations cached; the last is usually where a solve ends
LOWER_END = -38.0  # z at which a quantile reaches the lower end of its support in double precision


def make_objective(posterior: LogDensity) -> Objective:
    """Compile one objective for every solve: pinned parameters and whether priors count are arguments.

    The objective takes the z to start from, which parameters are pinned and where, the weight of each z as a residual of its
    own (1 with the priors, 0 without), the data, and the precision. It returns a dictionary: z, values and their slope by z,
    residuals and expected readings by term, all residuals stacked with those of the priors, the Jacobian of the residuals (zero
    for pinned parameters; `sensitivity` has theirs too), whether the solver succeeded, and the decrease of the sum of squares
    that the tangent plane still predicts (`fall`).
    """
    space = posterior.model.space
    vector = jax.ShapeDtypeStruct((space.size,), jnp.float64)
    rows = sum(count for term in posterior.model.terms for count, _ in term.residual_blocks)
    with ThreadPoolExecutor(1) as thread:
        thread.submit(compile_solver, rows + space.size, space.size)
        slow, shapes = posterior.model.is_slow, (vector, vector, posterior.data)
        program = compile_program(_evaluation_program(posterior), *shapes, run_once=not slow, run_often=slow)

    def objective(
        start: np.ndarray, pinned: np.ndarray, pin: np.ndarray, weight: np.ndarray, data: Any, precision: Precision
    ) -> Solution:
        @lru_cache(_CACHE_SIZE)
        def evaluate_cached(z: bytes) -> Solution:
            return program(np.frombuffer(z), weight, data)

        def evaluate_all(z: np.ndarray) -> Solution:
            return evaluate_cached(np.where(pinned, pin, z).tobytes())

        def evaluate(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            solution = evaluate_all(z)
            return np.asarray(solution["stacked"]), np.where(pinned, 0.0, solution["jacobian"])

        minimum = minimize(evaluate, np.where(pinned, pin, start), precision)
        solution = jax.tree.map(np.asarray, evaluate_all(minimum.x))
        sensitivity = solution["jacobian"][: -space.size]
        jacobian = np.where(pinned, 0.0, sensitivity)
        status = {"succeeded": minimum.succeeded, "fall": minimum.fall}
        return solution | {"jacobian": jacobian, "sensitivity": sensitivity} | status

    return objective


def _evaluation_program(posterior: LogDensity) -> Callable[..., Solution]:
    """Return a function of z that gives values, residuals, Jacobian and expected readings."""
    space = posterior.model.space

    def evaluate(z: Array, weight: Array, data: Any) -> Solution:
        # A value depends on its own z alone. So priors are differentiated once, and not again along every z.
        values, slope = jax.jvp(space.vector, (z,), (jnp.ones_like(z),))

        def residuals(values: Array) -> tuple[Array, dict[str, Array]]:
            by_term = posterior.residuals_at(space.named(values), data)
            return jnp.concatenate(list(by_term.values())), by_term

        def differentiate(direction: Array) -> tuple[Array, Array, dict[str, Array]]:
            return jax.jvp(residuals, (values,), (direction,), has_aux=True)

        read, columns, by_term = jax.vmap(differentiate, out_axes=(None, 1, None))(jnp.diag(slope))
        jacobian = jnp.concatenate([columns, jnp.diag(weight)])
        named, terms = space.named(values), zip(posterior.model.terms, data, strict=True)
        readings = {term.name: term.expected(named, d) for term, d in terms}
        outputs = {"z": z, "values": values, "slope": slope, "readings": readings, "jacobian": jacobian}
        return outputs | {"stacked": jnp.concatenate([read, weight * z]), "residuals": by_term}

    return evaluate


@dataclass(frozen=True)
class Problem:
    """A least-squares problem of one posterior, with noise scales held at their prior medians.

    Args:
        posterior: The posterior.
        objective: The objective that `make_objective` compiled for data of its shape.
        with_priors: Whether the priors count as measurements of the parameters.
        noise_z: z of the noise scales, where they are not at their prior medians.
    """

    posterior: LogDensity
    objective: Objective
    with_priors: bool = False
    noise_z: np.ndarray | float = 0.0

    @cached_property
    def noise(self) -> np.ndarray:
        """Which free parameters are noise scales."""
        return noise_scales(self.posterior)

    @cached_property
    def penalty(self) -> np.ndarray:
        """Weight of each prior that counts with or without the others: 1 for weights of departures, 0 elsewhere.

        Without theirs, smooth departures would follow the noise of the angles.
        """
        return np.array([p.role == "departure" for p in self.posterior.model.space.free], dtype=float)

    @cached_property
    def weight(self) -> np.ndarray:
        """Weight of each z as a residual of its own."""
        return np.where(self.noise, 0.0, 1.0 if self.with_priors else np.maximum(self.penalty, _TIE))

    @cached_property
    def data(self) -> Any:
        """The posterior's data on the device; moving them there costs as much as some evaluations."""
        return jax.device_put(self.posterior.data)

    def solve(
        self,
        start: np.ndarray,
        pinned: np.ndarray | bool = False,
        pin: np.ndarray | None = None,
        precision: Precision = PRECISE,
    ) -> Solution:
        """Return the minimum with further parameters pinned; without priors z has so little weight that it only breaks ties."""
        pin = np.zeros(len(start)) if pin is None else pin
        at = np.where(self.noise & (pin == 0), self.noise_z, pin)
        return self.objective(start, self.noise | pinned, at, self.weight, self.data, precision)


def sum_of_squares(solution: Solution) -> float:
    """Return the sum of squares of the standardized residuals, without those of the priors."""
    return float(sum(np.sum(r**2) for r in solution["residuals"].values()))


def total_squares(solution: Solution) -> float:
    """Return the sum of squares of all residuals, including those of the priors where these count."""
    return float(solution["stacked"] @ solution["stacked"])


def noise_scales(posterior: LogDensity) -> np.ndarray:
    """Return which free parameters are noise scales."""
    return np.array([p.role == "noise" for p in posterior.model.space.free], dtype=bool)


def has_lower_end(parameters: tuple[Parameter, ...]) -> np.ndarray:
    """Return which parameters have a lower end that an estimate can run to."""
    bounded = LogNormal | HalfNormal | HalfCauchy | TruncatedNormal | Uniform
    return np.array([isinstance(p.prior, bounded) for p in parameters], dtype=bool)
