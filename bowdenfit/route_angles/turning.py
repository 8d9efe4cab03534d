"""Total angle that a route of points turns through, the sum of all its bends without sign, and its standard deviation.

Errors of the points bend a route that is straight, so the angle of the points as they are is too large (a sum of lengths of
noisy vectors). How much is found by adding errors once more, and taken off.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.interpolate import BSpline, make_lsq_spline

_DEGREE = 3
_FINE = 801  # tangents along a spline; a judgement: 0.01 deg on ten turns
_REPETITIONS = 200  # of the errors; the standard deviation is then known to 5 %
_MOST_PIECES = 40  # of a spline; a judgement: ten full turns
_SHAPE = 0.04  # of the angle of a spline: what is left on circles, helices and an S of two arcs; a judgement
_SEED = 1  # of the errors, so that a file always gives the same angle
Points = Float[np.ndarray, "points dimensions"]


@dataclass(frozen=True)
class Turning:
    """Angle that a route turns through.

    Args:
        angle: Without what errors of the points add [rad].
        sd: Its standard deviation [rad].
        added: What these errors added, and was taken off [rad].
    """

    angle: float
    sd: float
    added: float


def measure_polyline(points: Points, error: float) -> Turning:
    """Return the sum of the angles at the corners of a polyline.

    Args:
        points: Points in the order along the route; no two neighbors are the same [mm].
        error: Standard deviation of each coordinate [mm].
    """
    angle = _sum_of_turns(np.diff(points, axis=0))
    again = [_sum_of_turns(np.diff(noisy, axis=0)) for noisy in _repeat(points, error)]
    return _without_added(angle, angle, again, 0.0)


def measure_spline(points: Points, error: float) -> Turning:
    r"""Return the integral of the curvature of a smooth curve, :math:`\int \kappa\,ds`.

    Cubic splines of 1, 2, 3, ... pieces are fitted by least squares and weighted by Akaike's criterion; how far they differ is
    part of the error.

    Args:
        points: Four points or more, in the order along the route [mm].
        error: Standard deviation of each coordinate, above 0 [mm].
    """
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    along, (n, dimensions) = lengths / lengths[-1], points.shape
    pieces = range(1, max(2, min(_MOST_PIECES, (n - _DEGREE) // 2) + 1))
    splines = [_fit_spline(along, points, count) for count in pieces]
    misfits = np.array([np.sum((spline(along) - points) ** 2) for spline in splines]) / error**2
    criterion = misfits + 2 * dimensions * (np.array(pieces) + _DEGREE)
    weights = np.exp(-(criterion - criterion.min()) / 2)
    weights /= weights.sum()
    angles = np.array([_turn_of_spline(spline) for spline in splines])
    angle, best = float(weights @ angles), int(criterion.argmin())
    between = float(weights @ (angles - angle) ** 2) ** 0.5
    again = [_turn_of_spline(_fit_spline(along, noisy, pieces[best])) for noisy in _repeat(splines[best](along), error)]
    return _without_added(angle, angles[best], again, float(np.hypot(between, _SHAPE * angle)))


def _without_added(angle: float, start: float, again: list[float], more: float) -> Turning:
    """Return an angle without what errors add, of which half is taken to be uncertain.

    Args:
        angle: Of the points as they are [rad].
        start: To which errors were added [rad].
        again: Of each repetition [rad].
        more: Another standard deviation [rad].
    """
    added = float(np.mean(again)) - start if again else 0.0
    scatter = float(np.std(again, ddof=1)) if again else 0.0
    return Turning(max(angle - added, 0.0), float(np.hypot(np.hypot(scatter, added / 2), more)), added)


def _repeat(points: Points, error: float) -> list[Points]:
    """Return the points with errors added, again and again; none where there is no error."""
    generator = np.random.default_rng(_SEED)
    return [points + generator.normal(0.0, error, points.shape) for _ in range(_REPETITIONS if error > 0 else 0)]


def _sum_of_turns(steps: Float[np.ndarray, "steps dimensions"]) -> float:
    """Return the sum of the angles between successive directions [rad], exact for small ones too."""
    directions = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    before, after = directions[:-1], directions[1:]
    return float(2 * np.sum(np.arctan2(np.linalg.norm(after - before, axis=1), np.linalg.norm(after + before, axis=1))))


def _fit_spline(along: Float[np.ndarray, " points"], points: Points, pieces: int) -> BSpline:
    """Return the cubic spline of equal pieces through points by least squares."""
    knots = np.concatenate([np.zeros(_DEGREE), np.linspace(0, 1, pieces + 1), np.ones(_DEGREE)])
    return make_lsq_spline(along, points, knots, _DEGREE)


def _turn_of_spline(spline: BSpline) -> float:
    """Return the angle that a spline turns through [rad]."""
    return _sum_of_turns(spline.derivative()(np.linspace(0, 1, _FINE)))
