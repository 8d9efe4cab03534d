"""Which curve to propose for wrap angles along a route: a bell, or a smooth curve where another predicts angles better.

Every family is fitted by least squares, with its priors as readings, and each angle is predicted from the others by its
leverage (Cook and Weisberg, Residuals and Influence in Regression, 1982, equation 2.2.23). Angles too small to detect count
only where a curve lies above the lowest detected one.
"""

from collections.abc import Mapping

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


def _errors(curve: Curve, lengths: Vector, angles: Vector) -> Vector:
    """Error of each detected angle's prediction from the others [rad]."""
    defaults, is_detected = PriorDefaults(), np.isfinite(angles)
    detected, noise = angles[is_detected], np.deg2rad(defaults.angle_noise_degrees)
    lowest = np.min(detected)
    parameters = curve.parameters(detected, defaults)

    def residuals(z: Vector) -> Vector:
        values = {p.name: jnp.asarray(p.prior.constrain(jnp.asarray(at))) for p, at in zip(parameters, z, strict=True)}
        angle = np.asarray(curve.wrap_angle(values, jnp.asarray(lengths)))
        above = np.maximum(angle[~is_detected] - lowest, 0.0)
        return np.concatenate([(angle[is_detected] - detected) / noise, above / noise, z])

    best = least_squares(residuals, np.zeros(len(parameters)))
    left, _ = np.linalg.qr(best.jac)
    leverage = np.sum(left**2, axis=1)[: len(detected)]
    return noise * best.fun[: len(detected)] / np.maximum(1 - leverage, 1e-6)
