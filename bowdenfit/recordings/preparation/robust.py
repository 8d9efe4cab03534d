"""The least robust sum of squares of a model with a few parameters, by Newton's method with the slopes of the model."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from bowdenfit.recordings.preparation.shapes import OtherVector
from bowdenfit.types import Vector

_MOST_STEPS = 200
_LEAST_CHANGE = 1e-14  # of the cost
_DAMPING = 1e-3
_MOST_DAMPING = 1e12

Deviations: TypeAlias = tuple[Float[np.ndarray, " residuals"], Float[np.ndarray, "residuals parameters"]]
"""Residuals [standard deviations], and their slopes: a column for each parameter."""

Model: TypeAlias = Callable[[np.ndarray], Deviations]
"""Deviations at parameters."""


def robust_cost(residuals: Vector) -> float:
    """Sum of sqrt(1 + r^2) - 1: half the square of a small residual, the size of a large one."""
    return float(np.sum(np.sqrt(1 + residuals**2) - 1))


def robust_minimum(model: Model, start: OtherVector, least: OtherVector, most: OtherVector) -> tuple[np.ndarray, float]:
    """Parameters of the least robust cost near a start, and that cost.

    Newton's steps, damped as Levenberg and Marquardt do until the cost falls; a parameter that wants beyond its limits stays
    there. The curvature is that of the cost with the model as a plane, which the play operator is between kinks.

    Args:
        model: Residuals and slopes.
        start: Where to begin, inside the limits.
        least, most: Limits of each parameter.
    """
    point, damping = start, _DAMPING
    residuals, slopes = model(point)
    cost = robust_cost(residuals)
    for _ in range(_MOST_STEPS):
        root = np.sqrt(1 + residuals**2)
        gradient, curvature = slopes.T @ (residuals / root), (slopes.T / root**3) @ slopes
        free = ((point > least) | (gradient < 0)) & ((point < most) | (gradient > 0))
        own = np.where(free, curvature.diagonal(), 0.0)
        curvature = np.where(free[:, None] & free, curvature, 0.0)
        own = np.maximum(own, 1e-12 * own.max())
        while damping < _MOST_DAMPING and own.any():
            step = np.linalg.solve(curvature + np.diag(damping * own + ~free), np.where(free, -gradient, 0.0))
            tried = np.clip(point + step, least, most)
            residuals, slopes = model(tried)
            lower = robust_cost(residuals)
            if lower < cost:
                break
            damping *= 8
        else:
            break
        change, point, cost, damping = cost - lower, tried, lower, max(damping / 8, 1e-9)
        if change < _LEAST_CHANGE * cost:
            break
    return point, cost
