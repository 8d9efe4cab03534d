"""Where a profile of the sum of squares rises above its level: a search in few solves.

References:
    Chandrupatla, A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function without using
    derivatives, Advances in Engineering Software 28 (1997), 145.
"""

from collections.abc import Callable

import numpy as np

from bowdenfit.inference.objective import LOWER_END

PROBABILITY = 0.9
FARTHEST = -LOWER_END
_PRECISION = 3e-4  # of a limit, in the steps that lead to it
_BEYOND = 1.5  # how far the second step goes, in parts of the way that is left by the first
_MOST_STEPS = 50
_LEAST_STEP, _MOST_STEP, _LONGEST_STEP = 1e-6, 1.0, 8.0  # first step from the minimum, and all others [z]


def find_interval_ends(
    rise: Callable[[float], float], center: float, error: float, ratio: float, freedom: float
) -> tuple[float, float]:
    """Limits of the 90 % interval, as z; infinite where the sum of squares never rises enough.

    Args:
        rise: By how much the sum of squares is larger at a z.
        center: z of the minimum.
        error: Standard error of z there; the first step is taken from it.
        ratio: V/C, variance of the parameter over what readings of unit scatter would give it.
        freedom: Degrees of freedom.
    """
    far = student_quantile(freedom)

    def above(z: float) -> float:
        risen = rise(z)
        return np.sqrt(max(risen, 0.0) / ratio) - far if np.isfinite(risen) else float("nan")

    step = float(np.clip(far * error, _LEAST_STEP, _MOST_STEP))
    return _find_limit(above, center, -step), _find_limit(above, center, step)


def _find_limit(above: Callable[[float], float], center: float, step: float) -> float:
    """Where a function that is negative at the center first becomes positive, going by growing steps.

    About a good minimum it is nearly straight. So the second step goes a little farther than a straight line would have to,
    and no farther than the usual one. Where it is not a number short of there, the interval is the wider one.
    """

    def known(z: float) -> float:
        return float(np.nan_to_num(above(z), nan=-1.0))

    inside, ahead, end = center, step, np.copysign(FARTHEST, step)
    least = above(center)
    close = _PRECISION * abs(least)
    for _ in range(_MOST_STEPS):
        outside = float(np.clip(inside + ahead, -FARTHEST, FARTHEST))
        reached = above(outside)
        if abs(reached) <= close:
            return outside
        if reached > 0:
            return find_crossing(known, inside, outside, _PRECISION * abs(ahead), close)
        if np.isnan(reached):
            step = ahead = ahead / 4
        else:
            straight = (
                abs(_BEYOND * ahead * reached / (reached - least)) if inside == center and reached > least else np.inf
            )
            step = float(np.clip(2 * step, -_LONGEST_STEP, _LONGEST_STEP)) if ahead == step else step
            inside, ahead = outside, float(np.copysign(min(abs(step), straight), step))
        if inside == end or abs(step) < _LEAST_STEP:
            break
    return float(np.copysign(np.inf, step))


def find_crossing(
    above: Callable[[float], float], inside: float, outside: float, tolerance: float, close: float = 0.0
) -> float:
    """Where a function goes through zero between two points at which it has either sign.

    By inverse interpolation through the last three points where that is safe, else halfway (Chandrupatla), but for the first
    point, which is on the straight line; SciPy has it too, but takes a quarter of a second to load.

    Args:
        above: The function.
        inside, outside: The points.
        tolerance: How near a point has to be.
        close: Size of the function that is as good as zero.
    """
    (last, last_value), (other, other_value) = (outside, above(outside)), (inside, above(inside))
    part, least = last_value / (last_value - other_value), min(tolerance / 2 / abs(inside - outside), 0.5)
    part = min(max(part, least), 1 - least)
    while True:
        at = last + part * (other - last)
        value = above(at)
        older, older_value = last, last_value
        if (value > 0) != (last_value > 0):
            older, older_value, other, other_value = other, other_value, last, last_value
        last, last_value = at, value
        least = tolerance / 2 / abs(other - last)
        if abs(last_value) <= close or least > 0.5:
            return last if abs(last_value) < abs(other_value) else other
        x_ratio, y_ratio = (last - other) / (older - other), (last_value - other_value) / (older_value - other_value)
        part = 0.5
        if y_ratio * y_ratio < x_ratio and (1 - y_ratio) * (1 - y_ratio) < 1 - x_ratio:
            part = last_value / (other_value - last_value) * older_value / (other_value - older_value)
            part += (
                (older - last)
                / (other - last)
                * last_value
                / (older_value - last_value)
                * other_value
                / (older_value - other_value)
            )
        part = min(max(part, least), 1 - least)


def student_quantile(freedom: float) -> float:
    """Student's t that the interval reaches to."""
    from scipy.special import stdtrit

    return float(stdtrit(freedom, (1 + PROBABILITY) / 2))
