"""Which curve to propose for wrap angles along a route: a bell, or a smooth curve where another predicts angles better.

Every family is fitted by least squares, with its priors as readings, and each angle is predicted from the others by its
leverage (Cook and Weisberg, Residuals and Influence in Regression, 1982, equation 2.2.23). Angles too small to detect count
only where a curve lies above the lowest detected one.
"""

from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from bowdenfit.cable.curves import Curve
from bowdenfit.cable.registry import CURVES, load_class
from bowdenfit.description import PriorDefaults, Route
from bowdenfit.types import Vector

BELL, NO_FAMILY = "gaussian", "smooth"


def propose_curve(route: Route, lengths: Vector, angles: Vector) -> str:
    """Return the curve to propose: a bell if of all curves it predicts angles left out best, else a smooth curve.

    Args:
        route: Route variable and its range; readings outside are left out.
        lengths: Values of the route variable.
        angles: Detected angles [rad]; NaN where undetected, which is below the lowest detected one.
    """
    inside = (lengths >= route.range[0]) & (lengths <= route.range[1])
    if np.isfinite(angles[inside]).sum() <= CURVES[BELL].coefficients:
        return BELL
    errors = leave_one_out_errors(route, lengths[inside], angles[inside])
    squares = {family: float(np.sum(error**2)) for family, error in errors.items()}
    return BELL if squares[BELL] == min(squares.values()) else NO_FAMILY


def leave_one_out_errors(route: Route, lengths: Vector, angles: Vector) -> Mapping[str, Vector]:
    """Return by family the error [rad] of each detected angle's prediction from the others; see `propose_curve`."""
    with jax.enable_x64(True):
        return {
            family: _errors(load_class(entry.place)("angle", route), lengths, angles)
            for family, entry in CURVES.items()
        }


def fit_curve(route: Route, family: str, lengths: Vector, angles: Vector, at: Vector) -> Vector:
    """Wrap angle [rad] of the least-squares curve of a family at some lengths; readings outside the range are left out.

    Args:
        route: Route variable and its range.
        family: Name of the family.
        lengths, angles: See `propose_curve`; some angles are detected.
        at: Lengths to draw the curve at.
    """
    inside = (lengths >= route.range[0]) & (lengths <= route.range[1])
    with jax.enable_x64(True):
        curve: Curve = load_class(CURVES[family].place)("angle", route)
        best, values_at = _fit(curve, lengths[inside], angles[inside])
        return np.asarray(curve.wrap_angle(values_at(best.x), jnp.asarray(at)))


def _fit(curve: Curve, lengths: Vector, angles: Vector) -> tuple[Any, Callable[[Vector], dict[str, jax.Array]]]:
    """Least-squares solution of a curve in its coordinates z, detected angles first, and its values by name at z."""
    defaults, is_detected = PriorDefaults(), np.isfinite(angles)
    detected, noise = angles[is_detected], np.deg2rad(defaults.angle_noise_degrees)
    lowest = np.min(detected)
    parameters = curve.parameters(detected, defaults)

    def values_at(z: Vector) -> dict[str, jax.Array]:
        return {p.name: jnp.asarray(p.prior.constrain(jnp.asarray(at))) for p, at in zip(parameters, z, strict=True)}

    def residuals(z: Vector) -> Vector:
        angle = np.asarray(curve.wrap_angle(values_at(z), jnp.asarray(lengths)))
        above = np.maximum(angle[~is_detected] - lowest, 0.0)
        return np.concatenate([(angle[is_detected] - detected) / noise, above / noise, z])

    return least_squares(residuals, np.zeros(len(parameters))), values_at


def _errors(curve: Curve, lengths: Vector, angles: Vector) -> Vector:
    """Error of each detected angle's prediction from the others [rad]."""
    detected, noise = angles[np.isfinite(angles)], np.deg2rad(PriorDefaults().angle_noise_degrees)
    best, _ = _fit(curve, lengths, angles)
    left, _ = np.linalg.qr(best.jac)
    leverage = np.sum(left**2, axis=1)[: len(detected)]
    return noise * best.fun[: len(detected)] / np.maximum(1 - leverage, 1e-6)
