"""The least-squares solver: Levenberg-Marquardt by optimistix, with a bolder first step where that fails, and a last polish.

It sees the residuals and their Jacobian by automatic differentiation. The polish takes undamped Gauss-Newton steps while what
is left of the gradient shrinks. It buys the last digits; and where the weights of readings follow the parameters without being
differentiated, it finds the point at which the weighted gradient is zero, which a method that only compares sums of squares
can miss.

References:
    Bates and Watts, A relative offset orthogonality convergence criterion for nonlinear least squares, Technometrics 23
    (1981), 179.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

Evaluate = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]

# Relative change of parameters and of the sum of squares at which a method stops, and part of the residuals along the
# tangent plane at which the polish does: as far as rounding allows, or enough for the sum of squares.
_PRECISE, _QUICK = (1e-14, 1e-13), (1e-9, 1e-5)
_MOST_EVALUATIONS, _MOST_QUICK = 1000, 150
_MOST_POLISHING = 30
_STRAIGHT = (
    0.3  # part of a step's effect by which residuals may depart from their tangent plane; at a kink they do by more
)
_SMOOTH = 1e-3  # part of the residuals along the tangent plane above which a point is no smooth minimum
_SHRINKS = 0.8  # factor by which each step of the polish must shorten what is left of the gradient
_SINGULAR = 1e-13  # of scaled singular values; a direction below it takes no step
_RADIUS, _BOLD_RADIUS = 0.3, 100.0  # of the first step, as part of the length of the scaled parameters


@dataclass(frozen=True)
class Minimum:
    """Where the solver stopped: parameters, residuals, their derivatives, and whether it is a minimum."""

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
    first = Minimum(start, *evaluate(start), not len(start))
    if not len(start) or not np.all(np.isfinite(first.residuals)):
        return first
    found = _polish(evaluate, _descend(evaluate, first, quick, _RADIUS), quick)
    if found.succeeded and _gauss_newton(found)[1] <= _SMOOTH * np.linalg.norm(found.residuals):
        return found
    # It has stopped short: at a kink of the residuals, or in a long bend. One that ran out of evaluations goes on.
    again = (found,) if quick and not found.succeeded else (first, found)
    others = [_polish(evaluate, _descend(evaluate, at, quick, _BOLD_RADIUS), quick) for at in again]
    return min([found, *others], key=lambda m: (not m.succeeded, m.sum_of_squares))


def prepare(rows: int, columns: int) -> None:
    """Compile what solves of a shape need, in a thread beside something else; the first of them does it otherwise."""
    import jax

    from bowdenfit.inference.levenberg_marquardt import stepper

    with jax.enable_x64(True):  # the setting is each thread's own
        stepper(rows, columns)


def orthogonal(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Q and the inverse of R of a Jacobian's QR decomposition: errors of readings e move the parameters by R^-1 Q^T e.

    The normal equations, whose condition number is the square, are never formed.

    Args:
        jacobian: Derivatives of the residuals; its columns must be independent.
    """
    size = np.linalg.norm(jacobian, axis=0)
    q, r = np.linalg.qr(jacobian / size)
    return q, np.linalg.inv(r) / size[:, None]


def _descend(evaluate: Evaluate, at: Minimum, quick: bool, radius: float) -> Minimum:
    """Where Levenberg-Marquardt from a point ends."""
    from bowdenfit.inference.levenberg_marquardt import stepper

    settings = (*(_QUICK if quick else _PRECISE), radius)
    advance, state = stepper(*at.jacobian.shape)
    best, x = replace(at, succeeded=False), at.x
    with np.errstate(over="ignore", invalid="ignore"):  # a step may go where nothing can be computed, and is taken back
        for count in range(_MOST_QUICK if quick else _MOST_EVALUATIONS):
            x, state, trial, done = advance(settings, count == 0, x, state, at.residuals, at.jacobian)
            best = at if np.array_equal(x, at.x) else best
            if done:
                return replace(best, succeeded=bool(np.all(np.isfinite(best.residuals))))
            at = Minimum(np.asarray(trial), *evaluate(np.asarray(trial)), False)
    return best


def _polish(evaluate: Evaluate, found: Minimum, quick: bool) -> Minimum:
    """Gauss-Newton steps from where a method stopped, as long as each shortens what is left of the gradient."""
    exact, (step, left) = (_QUICK if quick else _PRECISE)[1], _gauss_newton(found)
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
    size = np.where(size > 0, size, np.inf)
    step = -np.linalg.lstsq(jacobian / size, found.residuals, _SINGULAR)[0] / size
    return step, float(np.linalg.norm(jacobian @ step))
