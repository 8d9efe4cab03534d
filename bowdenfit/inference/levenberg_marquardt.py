"""Levenberg-Marquardt composed of optimistix's parts: a descent that scales parameters, and a search by MINPACK's rules.

Optimistix's own method damps all parameters alike, and stops when a step changes little, as every heavily damped step does.
Here a step is damped in units of each parameter's column and limited by a trust radius, which adapts to the success of the last
step; the solve ends when little is left of the residuals along the tangent plane.

The model is not part of the compiled program: the caller evaluates it, and a linear function with the same residuals and
Jacobian takes its place, which is all that a step needs. So one small program of the shapes alone serves every model.

References:
    Moré, The Levenberg-Marquardt algorithm: implementation and theory, Lecture Notes in Mathematics 630 (1978), 105.
    Rader, Lyons and Kidger, Optimistix: modular optimisation in JAX and Equinox (2024), arXiv:2402.09983.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax import Array

from bowdenfit.inference.compilation import compile_program
from bowdenfit.kinds.term import round_up_count

_SINGULAR = 1e-13  # relative size of scaled singular values below which a direction takes no step
_UNCOMPUTABLE = 1e100  # replaces a residual that cannot be computed, so that no step goes there
_BISECTIONS = 40  # of the damping, on a logarithmic scale
_LONGER = 1.1  # factor by which an undamped step may exceed the radius
_ACCEPTED = 1e-4  # part of the predicted decrease of the sum of squares that a step must reach
_MOST_SHAPES = 8  # numbers of rows and columns whose programs are kept: one fit needs two or three; a judgement
_SUCCESS: Any = optx.RESULTS.successful


class _Tangent(eqx.Module):
    """The tangent plane: column norms, singular values of the scaled Jacobian, directions, and residuals along them."""

    size: Array
    singular: Array
    directions: Array
    along: Array


class ScaledDescent(optx.AbstractDescent):
    """Damped steps of limited length, in which each parameter is scaled by the largest norm that its column has had."""

    def init(self, y: Array, f_info_struct: Any) -> _Tangent:
        """Return an empty state."""
        rank = min(len(f_info_struct.residual), len(y))
        return _Tangent(jnp.zeros_like(y), jnp.zeros(rank), jnp.zeros((rank, len(y))), jnp.zeros(rank))

    def query(self, y: Array, f_info: Any, state: _Tangent) -> _Tangent:  # noqa: ARG002
        """Compute singular values at an accepted point; a step of any radius is then a division."""
        jacobian = f_info.jac.as_matrix()
        size = _largest_norms(jacobian, state.size)
        left, singular, directions = jnp.linalg.svd(_divide_by_norms(jacobian, size), full_matrices=False)
        informed = singular > _SINGULAR * singular[0]
        return _Tangent(
            size, jnp.where(informed, singular, 1.0), directions, jnp.where(informed, left.T @ f_info.residual, 0.0)
        )

    def step(self, step_size: Array, state: _Tangent) -> tuple[Array, Any]:
        """Return the undamped step, or where it is too long the step that is damped to the radius."""
        slope = state.singular * state.along

        def damp(by: Array | float) -> Array:
            return slope / (state.singular**2 + by)

        def bisect(_: int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
            middle = jnp.sqrt(ends[0] * ends[1])
            longer = _norm(damp(middle)) > step_size
            return jnp.where(longer, middle, ends[0]), jnp.where(longer, ends[1], middle)

        largest_damping = _norm(slope) / step_size
        _, damping = jax.lax.fori_loop(0, _BISECTIONS, bisect, (1e-12 * largest_damping, largest_damping))
        step = damp(jnp.where(_norm(damp(0.0)) <= _LONGER * step_size, 0.0, damping))
        return -_divide_by_norms(state.directions.T @ step, state.size), _SUCCESS


class _Radius(eqx.Module):
    """Trust radius of the next step, and the predicted and actual relative decrease of the last."""

    radius: Array
    size: Array
    predicted: Array
    actual: Array


class RadiusSearch(optx.AbstractSearch):
    """MINPACK's rules for the trust radius, with both decreases computed without cancellation.

    Args:
        first: Radius of the first step, relative to the norm of the scaled parameters.
    """

    first: Any

    def init(self, y: Array, f_info_struct: Any) -> _Radius:  # noqa: ARG002
        """Return an empty state."""
        return _Radius(jnp.ones(()), jnp.zeros_like(y), jnp.ones(()), jnp.ones(()))

    def step(
        self, first_step: Array, y: Array, y_eval: Array, f_info: Any, f_eval_info: Any, state: _Radius
    ) -> tuple[Array, Array, Any, _Radius]:
        """Return the next radius, and whether the step is accepted."""
        before, after, moved = f_info.residual, f_eval_info.residual, y_eval - y
        linear, total = f_info.jac.mv(moved), jnp.maximum(before @ before, 1e-300)
        slope = linear @ before / total
        predicted = -2 * linear @ (before + linear / 2) / total
        actual = (before - after) @ (before + after) / total
        ratio = jnp.where(predicted > 0, actual / jnp.where(predicted > 0, predicted, 1.0), 0.0)
        accepted = first_step | (ratio >= _ACCEPTED)
        length = _norm(state.size * moved)
        shrinks = jnp.clip(jnp.where(actual >= 0, 0.5, slope / (2 * slope + actual)), 0.1, 0.5)
        grows = (ratio >= 0.75) | (length < 0.9 * state.radius)
        radius = jnp.where(grows, 2 * length, state.radius)
        radius = jnp.where(ratio > 0.25, radius, shrinks * jnp.minimum(state.radius, 10 * length))
        size = jnp.where(accepted, _largest_norms(f_eval_info.jac.as_matrix(), state.size), state.size)
        extent = _norm(size * y_eval)
        radius = jnp.where(first_step, self.first * jnp.where(extent > 0, extent, 1.0), radius)
        predicted, actual = (jnp.where(first_step, 1.0, change) for change in (predicted, actual))
        return radius, accepted, _SUCCESS, _Radius(radius, size, predicted, actual)


class LevenbergMarquardt(optx.AbstractGaussNewton):
    """The solver: ends by the gradient, or when neither parameters nor the sum of squares change any more.

    Args:
        change: Relative change of parameters and of the sum of squares that counts as none.
        gradient: Share of the residuals along the tangent plane that counts as none.
        radius: Radius of the first step, relative to the norm of the scaled parameters.
    """

    rtol: Any
    atol: Any
    norm: Callable[[Any], Array]
    descent: ScaledDescent
    search: RadiusSearch
    verbose: Callable[..., None]

    def __init__(self, change: Array, gradient: Array, radius: Array) -> None:
        self.rtol, self.atol, self.norm, self.verbose = change, gradient, optx.two_norm, _print_nothing
        self.descent, self.search = ScaledDescent(), RadiusSearch(radius)

    def terminate(self, fn: Any, y: Array, args: Any, options: Any, state: Any, tags: Any) -> tuple[Array, Any]:  # noqa: ARG002
        """Return whether the solve has ended."""
        last = state.search_state
        smooth = _norm(state.descent_state.along) <= self.atol * _norm(state.f_info.residual)
        flat = (jnp.abs(last.actual) <= self.rtol) & (last.predicted <= self.rtol) & (last.actual <= 2 * last.predicted)
        still = last.radius <= self.rtol * _norm(last.size * y)
        return ~state.first_step & (smooth | flat | still), state.result


@lru_cache(_MOST_SHAPES)
def compile_stepper(rows: int, columns: int) -> tuple[Callable[..., Any], list[np.ndarray]]:
    """Compile the step of a solve; return it and the initial state.

    A step takes the solver's settings, whether it is the first, the accepted parameters, the state, and residuals and Jacobian
    at the point that the last step returned. It returns the accepted parameters, the state, the next point to evaluate, and
    whether the solve has ended. Padding with rows of zeros, which change nothing, lets one program serve many tables.
    """
    (program, state), more = _compile_step(round_up_count(rows), columns), round_up_count(rows) - rows
    none, flat = np.zeros(more), np.zeros((more, columns))

    def step(settings: Any, first: Any, y: Any, state: Any, residuals: np.ndarray, jacobian: np.ndarray) -> Any:
        return program(settings, first, y, state, np.concatenate([residuals, none]), np.concatenate([jacobian, flat]))

    return step, state


@lru_cache(_MOST_SHAPES)
def _compile_step(rows: int, columns: int) -> tuple[Callable[..., Any], list[np.ndarray]]:
    """Compile the step for a padded number of rows."""
    number, *arrays = (jax.ShapeDtypeStruct(shape, jnp.float64) for shape in ((), (columns,), (rows,), (rows, columns)))
    flag, settings = jax.ShapeDtypeStruct((), jnp.bool_), (number, number, number)
    state = jax.eval_shape(lambda *arguments: _array_leaves(_initialize(*arguments)[2]), settings, *arrays)
    program = compile_program(_step, settings, flag, arrays[0], state, *arrays[1:], run_once=True)
    return program, [np.zeros(leaf.shape, leaf.dtype) for leaf in state]


def _step(
    settings: tuple[Array, ...], first: Array, y: Array, leaves: list[Array], residuals: Array, jacobian: Array
) -> tuple[Array, list[Array], Array, Array]:
    """Take one step of the solver."""
    solver, linear, state = _initialize(settings, y, residuals, jacobian)
    tree, static = jax.tree.structure(eqx.filter(state, eqx.is_array)), eqx.filter(state, eqx.is_array, inverse=True)
    state_leaves = [jnp.where(first, *pair) for pair in zip(_array_leaves(state), leaves, strict=True)]
    state = eqx.combine(jax.tree.unflatten(tree, state_leaves), static)
    y, state, _ = solver.step(linear, y, state.y_eval, {}, state, frozenset())
    done, _ = solver.terminate(linear, y, y, {}, state, frozenset())
    return y, _array_leaves(state), state.y_eval, done


def _initialize(settings: tuple[Array, ...], y: Array, residuals: Array, jacobian: Array) -> tuple[Any, Any, Any]:
    """Return the solver, the linear function in the model's place, and the initial state."""
    values = jnp.where(jnp.isfinite(residuals), residuals, _UNCOMPUTABLE)
    slopes = jnp.where(jnp.isfinite(jacobian), jacobian, 0.0)

    def linear(x: Array, at: Array) -> tuple[Array, None]:
        return values + slopes @ (x - at), None

    solver, shape = LevenbergMarquardt(*settings), jax.eval_shape(lambda: values)
    return solver, linear, solver.init(linear, y, y, {}, shape, None, frozenset())


def _array_leaves(state: Any) -> list[Array]:
    """Return the arrays of a state."""
    return jax.tree.leaves(eqx.filter(state, eqx.is_array))


def _largest_norms(jacobian: Array, before: Array) -> Array:
    """Return the largest norm that each column has had."""
    return jnp.maximum(before, jnp.sqrt(jnp.sum(jacobian**2, axis=0)))


def _divide_by_norms(x: Array, size: Array) -> Array:
    """Divide by the norms of columns; zero where a column has always been zero."""
    return x / jnp.where(size > 0, size, jnp.inf)


def _norm(x: Array) -> Array:
    return jnp.sqrt(jnp.sum(x**2))


def _print_nothing(**_: Any) -> None:
    """Print nothing."""
