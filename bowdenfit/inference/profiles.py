r"""Profiles of the sum of squares: one parameter pinned, the others fitted again, and how far the sum of squares rises.

The 90 % interval of a parameter holds the values :math:`\theta` at which

.. math:: \frac{C}{V}\,[S(\theta) - S(\hat\theta)] \le t^2_{\nu,\,0.95}

with C the variance that readings of unit scatter would give the parameter and V the one that their scatter about the fit
gives it, table by table. Where all readings scatter alike, V/C is their variance and this is the F interval of the
textbooks; of a model that is linear in all its parameters it is the estimate plus and minus t standard errors. The degrees
of freedom are Satterthwaite's: those of the tables in proportion to what they contribute to V. Limits at the end of a
parameter's range belong to the interval: it is cut off there, not moved. Where the errors of a row's own angles enter by the
effective variance, the weights change along the profile, so that the interval approximates the solution with the true angles as
parameters; it covers nine in ten true values there, when the interval by the standard error no longer does.

References:
    Bates and Watts, Nonlinear Regression Analysis and Its Applications (1988), section 6.1.
    Chandler and Bate, Inference for clustered data using the independence loglikelihood, Biometrika 94 (2007), 167.
    Satterthwaite, An approximate distribution of estimates of variance components, Biometrics Bulletin 2 (1946), 110.
    Chandrupatla, A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function without using
    derivatives, Advances in Engineering Software 28 (1997), 145, for the ends of the intervals.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import stdtrit

from bowdenfit.inference.linearized import iterate_blocks, linearize
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import LOWER_END, Objective, Problem, Solution, has_lower_end, total_squares
from bowdenfit.inference.solver import QUICK, gauss_newton_step
from bowdenfit.parameters.priors import Uniform
from bowdenfit.parameters.space import Parameter

UNKNOWN_LIMITS = (float("nan"), float("nan"))
_STUCK = 0.05  # predicted decrease at which the solver counts as stuck, relative to the level that limits a parameter
_ROUNDING = 1e-12  # decrease of a sum of squares that is rounding, for readings without scatter
_ALWAYS = ("friction", "friction_model")  # roles whose intervals are computed in large problems too
_NEVER = ("noise", "departure")  # roles without intervals: noise scales are held, and nobody reads the weights of a departure
_SMALL = 20_000  # entries of the Jacobian up to which all intervals are computed
_AT_END = 6.0  # z so near to the end of a range that other parameters, fitted at the end, need not be fitted again
_INSIDE = 2.0  # z a little inside the range, for a parameter that is at an end of it
_FAR = 1.0  # largest extrapolated step of another parameter [z]
_LOWER = 0.01  # relative decrease, on the same level, from which another minimum is a lower one
PROBABILITY = 0.9  # of every interval that is shown
FARTHEST = -LOWER_END
_PRECISION = 3e-4  # precision of a limit, relative to the step that leads to it
_BEYOND = 1.5  # length of the second step, relative to the linear extrapolation
_MOST_STEPS = 50  # outward; a guard
# limits of the first step from the minimum, and the longest of the others [z]
_LEAST_STEP, _MOST_STEP, _LONGEST_STEP = 1e-6, 1.0, 8.0


@dataclass(frozen=True)
class Profile:
    """Profile of the sum of squares on both sides of the minimum.

    Args:
        name: Name of the parameter.
        values: Values at which it is pinned, in its shown unit, increasing.
        rise: Increase of the sum of squares of the standardized residuals over the minimum, the other parameters fitted again;
            noise scales at their prior medians.
    """

    name: str
    values: np.ndarray
    rise: np.ndarray


@dataclass(frozen=True)
class Basin:
    """A minimum from which profiles are computed.

    Args:
        problem: The least-squares problem.
        solution: The minimum.
        at_end: Parameters at an end of their range, which may leave it when another parameter is pinned.
    """

    problem: Problem
    solution: Solution
    at_end: np.ndarray

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The free parameters."""
        return self.problem.posterior.model.space.free

    def solve_pinned(self, index: int, z: float, near: Solution) -> Solution:
        """Return the minimum with one parameter pinned at z; others leave the end of their range where that is better.

        Args:
            index: Position of the parameter.
            z: Value at which it is pinned.
            near: The minimum with it pinned elsewhere, or free.
        """
        mask = np.arange(len(near["z"])) == index
        ended = self.at_end & ~mask
        pin = np.where(mask, z, self.solution["z"])
        solution = self._solve(self._extrapolate(near, mask, z), mask | ended, pin)
        side = np.sign(self.solution["z"])
        if not ended.any() or not np.any(
            ended & (side * self._gradient(np.where(ended, side * _AT_END, solution["z"])) > 0)
        ):
            return solution
        return min(solution, self._solve(np.where(ended, side * _INSIDE, solution["z"]), mask, pin), key=total_squares)

    def _extrapolate(self, near: Solution, mask: np.ndarray, z: float) -> np.ndarray:
        """Return where the other parameters follow linearly; unchanged where that is far."""
        remaining = ~(self.problem.noise | self.at_end | mask)
        jacobian = np.concatenate([near["sensitivity"], np.diag(self.problem.weight)])
        residuals = near["stacked"] + jacobian @ np.where(mask, z - near["z"], 0.0)
        if not (np.all(np.isfinite(jacobian)) and np.all(np.isfinite(residuals))):
            return near["z"]
        step = np.zeros(len(mask))
        step[remaining] = gauss_newton_step(jacobian[:, remaining], residuals)
        return near["z"] + step if np.all(np.abs(step) <= _FAR) else near["z"]

    def _solve(self, start: np.ndarray, pinned: np.ndarray | bool, pin: np.ndarray) -> Solution:
        return self.problem.solve(start, pinned, pin, QUICK)

    def _gradient(self, z: np.ndarray) -> np.ndarray:
        """Return the gradient of half the sum of squares."""
        there = self._solve(z, True, z)
        return there["stacked"][: -len(z)] @ there["sensitivity"]

    def value(self, index: int, z: float) -> float:
        """Return the value of a parameter at z, in its shown unit; infinite where its range has no end."""
        parameter = self.parameters[index]
        if z > 0 and not (isinstance(parameter.prior, Uniform) or np.isfinite(z)):
            return float("inf")
        if z < 0 and not (has_lower_end((parameter,))[0] or np.isfinite(z)):
            return float("-inf")
        at = np.clip(np.full(len(self.parameters), z), -FARTHEST, FARTHEST)
        values = self._solve(at, True, at)["values"]
        return float(values[index]) * parameter.shown_scale


class Rise:
    """Increase of the sum of squares with one parameter pinned, as a function of z; NaN where it cannot be computed.

    Each solve starts from the nearest solution between the minimum and z: one beyond z may lie in another valley.

    Args:
        basin: The minimum.
        index: Position of the parameter.
    """

    def __init__(self, basin: Basin, index: int) -> None:
        self._basin, self._index = basin, index
        self._known = {float(basin.solution["z"][index]): basin.solution}
        self._center, self._least = float(basin.solution["z"][index]), total_squares(basin.solution)

    def __call__(self, z: float) -> float:
        """Return the increase at z."""
        if z not in self._known:
            visited = [at for at in self._known if abs(at - self._center) <= abs(z - self._center) and self._is_known(at)]
            self._known[z] = self._basin.solve_pinned(self._index, z, self._known[min(visited, key=lambda at: abs(at - z))])
        return total_squares(self._known[z]) - self._least if self._is_known(z) else float("nan")

    def _is_known(self, z: float) -> bool:
        return bool(np.isfinite(total_squares(self._known[z])))

    @property
    def lowest(self) -> Solution:
        """The solution with the smallest sum of squares so far."""
        return min((solution for at, solution in self._known.items() if self._is_known(at)), key=total_squares)

    @property
    def most_fall(self) -> float:
        """Largest decrease that the tangent plane still predicted where the solver ended.

        It is large where the solver ended at a kink of the residuals.
        """
        return max(solution["fall"] for at, solution in self._known.items() if self._is_known(at))


def compute_profile(
    posterior: LogDensity,
    objective: Objective,
    name: str,
    start: np.ndarray,
    z: Sequence[float] | np.ndarray,
    with_priors: bool = False,
) -> Profile:
    """Compute the profile of one free parameter, for figures and for identifiability.

    Args:
        posterior: The posterior.
        objective: Its compiled objective.
        name: Name of the parameter.
        start: z to start from, such as that of the maximum of the posterior.
        z: Values of z at which the parameter is pinned.
        with_priors: Whether the priors count as measurements of the parameters.
    """
    problem, index = Problem(posterior, objective, with_priors), posterior.model.space.index[name]
    solution = problem.solve(start)
    basin = Basin(problem, solution, np.zeros_like(problem.noise))
    rise = Rise(basin, index)
    pins = [float(pin) for pin in np.sort(z)]
    rises = {pin: rise(pin) for pin in sorted(pins, key=lambda pin: abs(pin - solution["z"][index]))}  # outward
    return Profile(name, np.array([basin.value(index, pin) for pin in pins]), np.array([rises[pin] for pin in pins]))


@dataclass(frozen=True)
class ProfileIntervals:
    """90 % profile intervals about a minimum.

    Args:
        limits: Limits by name, in shown units; NaN where the solver was stuck on the way.
        stuck: Whether it was stuck at the minimum.
        lower: The solution with the smallest sum of squares, if it is lower than the minimum.
    """

    limits: dict[str, tuple[float, float]] = field(default_factory=dict)
    stuck: bool = False
    lower: Solution | None = None


def compute_profile_intervals(basin: Basin, scale: np.ndarray, determined: np.ndarray) -> ProfileIntervals:
    """Compute 90 % intervals of determined parameters that are answers, given the scatter of each residual."""
    limits, lowest, least_level = {}, basin.solution, np.inf
    cheap = basin.solution["jacobian"].size <= _SMALL
    for i, p in enumerate(basin.parameters):
        if determined[i] and p.role not in _NEVER and (cheap or p.role in _ALWAYS):
            error, ratio, freedom = _estimate_spread(basin, scale, i)
            if ratio > 0:
                rise, level = Rise(basin, i), ratio * student_quantile(freedom) ** 2
                ends = find_interval_ends(rise, float(basin.solution["z"][i]), error, ratio, freedom)
                of_this = basin.value(i, ends[0]), basin.value(i, ends[1])
                limits[p.name] = UNKNOWN_LIMITS if is_stuck(rise.most_fall, level) else of_this
                lowest, least_level = min(lowest, rise.lowest, key=total_squares), min(level, least_level)
    lower = total_squares(lowest) < total_squares(basin.solution) - max(_LOWER * least_level, _ROUNDING)
    return ProfileIntervals(limits, is_stuck(basin.solution["fall"], least_level), lowest if lower else None)


def is_stuck(fall: float, level: float) -> bool:
    """Return whether the predicted decrease is too large for a rise by `level` to be meaningful."""
    return bool(fall > max(_STUCK * level, _ROUNDING))


def _estimate_spread(basin: Basin, scale: np.ndarray, index: int) -> tuple[float, float, float]:
    """Return the standard error of z of a parameter, its variance over that by unit scatter, and degrees of freedom.

    NaN where the readings carry no information about it, not even a little inside its range.
    """
    solution, terms = basin.solution, basin.problem.posterior.model.terms
    if basin.at_end[index]:  # where z has no influence; a little inside its range
        solution = basin.solve_pinned(index, float(np.copysign(_INSIDE, basin.solution["z"][index])), basin.solution)
    columns = np.flatnonzero(~basin.problem.noise & ~basin.at_end | (np.arange(len(basin.at_end)) == index))
    linearized = linearize(solution["sensitivity"][:, columns], basin.problem.penalty[columns])
    column = int(np.searchsorted(columns, index))
    if not linearized.determined[column] or not linearized.unit_error[column] > 0:
        return float("nan"), float("nan"), 1.0
    moves = linearized.moves(scale)[column] ** 2
    parts = [
        (np.sum(moves[rows]), freedom)
        for _, rows, _, freedom in iterate_blocks(terms, basin.solution["residuals"], linearized.leverage)
    ]
    parts.append((np.sum(moves[linearized.n_readings :]), np.inf))  # priors
    variance = float(np.sum(moves))
    return (
        float(np.sqrt(variance)),
        variance / float(linearized.unit_error[column]) ** 2,
        satterthwaite_freedom(*np.array(parts).T),
    )


def satterthwaite_freedom(parts: np.ndarray, freedom: np.ndarray) -> float:
    """Return Satterthwaite's degrees of freedom of a variance; at least 1.

    Args:
        parts: Contribution of each block of residuals to the variance.
        freedom: Degrees of freedom of each block's scatter; infinite where it is known.
    """
    share = parts / max(float(np.sum(parts)), 1e-300)
    return float(np.clip(1 / max(float(np.sum(share**2 / freedom)), 1e-9), 1.0, 1e9))


def find_interval_ends(
    rise: Callable[[float], float], center: float, error: float, ratio: float, freedom: float
) -> tuple[float, float]:
    """Return the limits of the 90 % interval, as z; infinite where the sum of squares never rises enough.

    Args:
        rise: Function of z: increase of the sum of squares.
        center: z of the minimum.
        error: Standard error of z there; the first step is taken from it.
        ratio: V/C, variance of the parameter over what readings of unit scatter would give it.
        freedom: Degrees of freedom.
    """
    far = student_quantile(freedom)

    def excess(z: float) -> float:
        risen = rise(z)
        return np.sqrt(max(risen, 0.0) / ratio) - far if np.isfinite(risen) else float("nan")

    step = float(np.clip(far * error, _LEAST_STEP, _MOST_STEP))
    return _find_limit(excess, center, -step), _find_limit(excess, center, step)


def _find_limit(excess: Callable[[float], float], center: float, step: float) -> float:
    """Return where a function that is negative at the center first becomes positive, stepping outward by growing steps.

    About a regular minimum it is nearly linear, so the second step goes a little beyond the linear extrapolation, but no
    farther than a usual step. Where it is NaN before the limit, the interval is the wider one.
    """

    def excess_or_below(z: float) -> float:
        return float(np.nan_to_num(excess(z), nan=-1.0))

    inside, ahead, end = center, step, np.copysign(FARTHEST, step)
    least = excess(center)
    close = _PRECISION * abs(least)
    for _ in range(_MOST_STEPS):
        outside = float(np.clip(inside + ahead, -FARTHEST, FARTHEST))
        reached = excess(outside)
        if abs(reached) <= close:
            return outside
        if reached > 0:
            return find_crossing(excess_or_below, inside, outside, _PRECISION * abs(ahead), close)
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
    """Find the zero of a function between two points at which it has opposite signs.

    By inverse quadratic interpolation through the last three points where that is safe, else by bisection (Chandrupatla); the
    first point is the linear interpolation. SciPy's version takes a quarter of a second to load.

    Args:
        above: The function.
        inside, outside: The points.
        tolerance: Precision of the zero.
        close: Size of the function that counts as zero.
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
    """Return the quantile of Student's t to which the interval reaches."""
    return float(stdtrit(freedom, (1 + PROBABILITY) / 2))
