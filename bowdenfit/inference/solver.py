"""The least-squares solver: MINPACK's Levenberg-Marquardt, SciPy's trust region where that fails, and a last polish.

Both see the residuals and their Jacobian by automatic differentiation, and scale each parameter by its own column. The
polish takes undamped Gauss-Newton steps while what is left of the gradient shrinks. It buys the last digits; and where the
weights of readings follow the parameters without being differentiated, it finds the point at which the weighted gradient is
zero, which a method that only compares sums of squares can miss.

References:
    Moré, The Levenberg-Marquardt algorithm: implementation and theory, Lecture Notes in Mathematics 630 (1978), 105.
    Bates and Watts, A relative offset orthogonality convergence criterion for nonlinear least squares, Technometrics 23
    (1981), 179.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

Evaluate = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]

# Relative change of parameters and of the sum of squares at which a method stops, and part of the residuals along the
# tangent plane at which the polish does: as far as rounding allows, or enough for the sum of squares.
_PRECISE, _QUICK = (1e-14, 1e-13), (1e-9, 1e-5)
_MOST_EVALUATIONS = 1000
_MOST_POLISHING = 30
_STRAIGHT = (
    0.3  # part of a step's effect by which residuals may depart from their tangent plane; at a kink they do by more
)
_SMOOTH = 1e-3  # part of the residuals along the tangent plane above which a point is no smooth minimum
_SHRINKS = 0.8  # factor by which each step of the polish must shorten what is left of the gradient
_SINGULAR = 1e-13  # of scaled singular values; a direction below it takes no step
_LOST = 1e100  # stands for a residual that cannot be computed, so that no step goes there


@dataclass(frozen=True)
class Minimum:
    """Where the solver stopped.

    Args:
        x: Parameters.
        residuals: There.
        jacobian: Their derivatives.
        succeeded: Whether it is a minimum.
    """

    x: np.ndarray
    residuals: np.ndarray
    jacobian: np.ndarray
    succeeded: bool

    @property
    def sum_of_squares(self) -> float:
        """Sum of squares of the residuals."""
        return float(self.residuals @ self.residuals)


def minimize(evaluate: Evaluate, start: np.ndarray, quick: bool = False) -> Minimum:
    """Least squares from a start.

    Args:
        evaluate: Residuals, at least as many as parameters, and their Jacobian.
        start: Parameters to start from.
        quick: Whether eight digits of the sum of squares are enough, instead of all that rounding leaves.
    """
    tolerance, exact = _QUICK if quick else _PRECISE
    first = evaluate(start)
    if not len(start) or not np.all(np.isfinite(first[0])):
        return Minimum(start, *first, not len(start))
    found = _polished(evaluate, _by(evaluate, start, "lm", tolerance), exact)
    if found.succeeded and _gauss_newton(found)[1] <= _SMOOTH * np.linalg.norm(found.residuals):
        return found
    # It has stopped short: at a kink of the residuals, or in a long bend.
    others = [_polished(evaluate, _by(evaluate, x, "trf", tolerance), exact) for x in (start, found.x)]
    return min([found, *others], key=lambda m: (not m.succeeded, m.sum_of_squares))


def orthogonal(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Q and the inverse of R of a Jacobian's QR decomposition: errors of readings e move the parameters by R^-1 Q^T e.

    The normal equations, whose condition number is the square, are never formed.

    Args:
        jacobian: Derivatives of the residuals; its columns must be independent.
    """
    size = np.linalg.norm(jacobian, axis=0)
    q, r = np.linalg.qr(jacobian / size)
    return q, np.linalg.inv(r) / size[:, None]


def _by(evaluate: Evaluate, start: np.ndarray, method: Literal["lm", "trf"], tolerance: float) -> Minimum:
    """What one of SciPy's methods finds."""
    from scipy.optimize import least_squares

    last: list[tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]] = []

    def at(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if not last or not np.array_equal(last[0][0], x):
            last[:] = [(x.copy(), evaluate(x))]
        return last[0][1]

    with np.errstate(over="ignore", invalid="ignore"):
        found = least_squares(
            lambda x: np.where(np.isfinite(at(x)[0]), at(x)[0], _LOST),
            start,
            lambda x: np.where(np.isfinite(at(x)[1]), at(x)[1], 0.0),
            method=method,
            x_scale="jac",
            ftol=tolerance,
            xtol=tolerance,
            gtol=tolerance,
            max_nfev=_MOST_EVALUATIONS,
        )
    return Minimum(found.x, *at(found.x), found.status > 0 and bool(np.all(np.isfinite(at(found.x)[0]))))


def _polished(evaluate: Evaluate, found: Minimum, exact: float) -> Minimum:
    """Gauss-Newton steps from where a method stopped, as long as each shortens what is left of the gradient."""
    step, left = _gauss_newton(found)
    for _ in range(_MOST_POLISHING):
        if left <= exact * np.linalg.norm(found.residuals) or np.any(np.abs(step) > np.maximum(np.abs(found.x), 1.0)):
            break
        x = found.x + step
        trial = Minimum(x, *evaluate(x), found.succeeded)
        if not np.all(np.isfinite(trial.residuals)) or not np.all(np.isfinite(trial.jacobian)):
            break
        next_step, next_left = _gauss_newton(trial)
        bent = np.linalg.norm(trial.residuals - found.residuals - found.jacobian @ step)
        if next_left > _SHRINKS * left or bent > _STRAIGHT * left:
            break
        found, step, left = trial, next_step, next_left
    return found


def _gauss_newton(found: Minimum) -> tuple[np.ndarray, float]:
    """The undamped step, and the length of the residuals along the tangent plane, which it would take off."""
    jacobian = np.where(np.isfinite(found.jacobian), found.jacobian, 0.0)
    size = np.linalg.norm(jacobian, axis=0)
    size = np.where(size > 0, size, 1.0)
    u, s, vt = np.linalg.svd(jacobian / size, full_matrices=False)
    along = np.where(s > _SINGULAR * s[0], u.T @ found.residuals, 0.0)
    return -(vt.T @ (along / np.maximum(s, 1e-300))) / size, float(np.linalg.norm(along))
