"""The least-squares solver: Levenberg-Marquardt by optimistix, with a bolder first step where that fails, and a final polish.

Jacobians come from automatic differentiation. The polish takes undamped Gauss-Newton steps while the remaining gradient
shrinks. It yields the last digits; and where the weights of readings follow the parameters without being differentiated, it
finds the point at which the weighted gradient is zero, which a method that only compares sums of squares can miss.

References:
    Bates and Watts, A relative offset orthogonality convergence criterion for nonlinear least squares, Technometrics 23
    (1981), 179.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import jax
import numpy as np

from bowdenfit.inference.levenberg_marquardt import compile_stepper

Evaluate = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]

_MOST_POLISHING = 30  # steps; a guard
# Deviation of residuals from their tangent plane, relative to a step's effect, up to which it is polished; larger at a kink.
_STRAIGHT = 0.3
_SMOOTH = 1e-3  # share of the residuals along the tangent plane above which a point is not a smooth minimum
_SHRINKS = 0.8  # factor by which each step of the polish must reduce the remaining step
_SINGULAR = 1e-13  # relative singular value below which a direction takes no step
_RADIUS, _BOLD_RADIUS = 0.3, 100.0  # of the first step, relative to the norm of the scaled parameters


class Precision(NamedTuple):
    """Stopping criteria of the solver.

    Args:
        change: Relative change of parameters and of the sum of squares that counts as none.
        gradient: Share of the residuals along the tangent plane that counts as none; its square bounds the relative decrease
            that is left.
        evaluations: Evaluations after which it gives up.
    """

    change: float
    gradient: float
    evaluations: int


PRECISE = Precision(1e-14, 1e-13, 1000)
"""As far as rounding allows."""
QUICK = Precision(1e-9, 1e-4, 150)
"""Eight digits of the sum of squares."""
ROUGH = Precision(1e-5, 1e-3, 150)
"""Five digits."""


@dataclass(frozen=True)
class Minimum:
    """Where the solver stopped: parameters, residuals, their Jacobian, and whether it is a minimum."""

    x: np.ndarray
    residuals: np.ndarray
    jacobian: np.ndarray
    succeeded: bool

    @property
    def sum_of_squares(self) -> float:
        """Sum of squares of the residuals."""
        return float(self.residuals @ self.residuals)

    @cached_property
    def fall(self) -> float:
        """Decrease of the sum of squares that the tangent plane still predicts: 0 at a minimum, positive at kinks."""
        return _remaining_step(self)[1] ** 2 if np.all(np.isfinite(self.residuals)) else float("inf")


def minimize(evaluate: Evaluate, start: np.ndarray, precision: Precision = PRECISE) -> Minimum:
    """Minimize a sum of squares from a start.

    Args:
        evaluate: Function that returns residuals, at least as many as parameters, and their Jacobian.
        start: Parameters to start from.
        precision: Stopping criteria.
    """
    first = Minimum(start, *evaluate(start), not len(start))
    if not len(start) or not np.all(np.isfinite(first.residuals)):
        return first
    if not np.any(first.jacobian):  # nothing moves the residuals
        return replace(first, succeeded=True)
    minimum = _polish(evaluate, _descend(evaluate, first, precision, _RADIUS), precision)
    if minimum.succeeded and minimum.fall <= _SMOOTH**2 * minimum.sum_of_squares:
        return minimum
    # It has stopped short: at a kink of the residuals, or in a long bend. One that ran out of evaluations goes on.
    again = (minimum,) if precision != PRECISE and not minimum.succeeded else (first, minimum)
    remaining = [_polish(evaluate, _descend(evaluate, at, precision, _BOLD_RADIUS), precision) for at in again]
    return min([minimum, *remaining], key=lambda m: (not m.succeeded, m.sum_of_squares))


def compile_solver(rows: int, columns: int) -> None:
    """Compile the solver for a shape ahead of its first use, in another thread."""
    with jax.enable_x64(True):  # the setting is each thread's own
        compile_stepper(rows, columns)


def orthogonalize(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return Q and the inverse of R of a Jacobian's QR decomposition: errors e of readings move parameters by R^-1 Q^T e.

    The normal equations, whose condition number is the square, are never formed.

    Args:
        jacobian: Derivatives of the residuals; its columns must be independent.
    """
    size = np.linalg.norm(jacobian, axis=0)
    q, r = np.linalg.qr(jacobian / size)
    return q, np.linalg.inv(r) / size[:, None]


def gauss_newton_step(jacobian: np.ndarray, residuals: np.ndarray) -> np.ndarray:
    """Return the undamped step to the minimum of the linearized problem; 0 in undetermined directions."""
    size = np.linalg.norm(jacobian, axis=0)
    size = np.where(size > 0, size, np.inf)
    return -np.linalg.lstsq(jacobian / size, residuals, _SINGULAR)[0] / size


def _descend(evaluate: Evaluate, at: Minimum, precision: Precision, radius: float) -> Minimum:
    """Run Levenberg-Marquardt from a point; return where it ends."""
    settings = precision.change, precision.gradient, radius
    advance, state = compile_stepper(*at.jacobian.shape)
    best, x = replace(at, succeeded=False), at.x
    with np.errstate(over="ignore", invalid="ignore"):  # a step may go where nothing can be computed, and is taken back
        for count in range(precision.evaluations):
            x, state, trial, done = advance(settings, count == 0, x, state, at.residuals, at.jacobian)
            best = at if np.array_equal(x, at.x) else best
            if done:
                return replace(best, succeeded=bool(np.all(np.isfinite(best.residuals))))
            at = Minimum(np.asarray(trial), *evaluate(np.asarray(trial)), False)
    return best


def _polish(evaluate: Evaluate, minimum: Minimum, precision: Precision) -> Minimum:
    """Take Gauss-Newton steps as long as each shortens the remaining step."""
    step, left = _remaining_step(minimum)
    for _ in range(_MOST_POLISHING):
        flat = left <= precision.gradient * np.linalg.norm(minimum.residuals)
        if flat or np.any(np.abs(step) > np.maximum(np.abs(minimum.x), 1.0)):
            break
        x = minimum.x + step
        trial = Minimum(x, *evaluate(x), minimum.succeeded)
        if not np.all(np.isfinite(trial.residuals)) or not np.all(np.isfinite(trial.jacobian)):
            break
        next_step, next_left = _remaining_step(trial)
        bent = np.linalg.norm(trial.residuals - minimum.residuals - minimum.jacobian @ step)
        if next_left > _SHRINKS * left or bent > _STRAIGHT * left:
            break
        minimum, step, left = trial, next_step, next_left
    return minimum


def _remaining_step(minimum: Minimum) -> tuple[np.ndarray, float]:
    """Return the undamped step, and the length of the residuals along the tangent plane."""
    jacobian = np.where(np.isfinite(minimum.jacobian), minimum.jacobian, 0.0)
    step = gauss_newton_step(jacobian, minimum.residuals)
    return step, float(np.linalg.norm(jacobian @ step))
