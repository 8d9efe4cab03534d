r"""Profiles of the sum of squares: one parameter pinned, the others fitted again, and how far the sum of squares rises.

The 90 % interval of a parameter holds the values :math:`\theta` at which

.. math:: \frac{C}{V}\,[S(\theta) - S(\hat\theta)] \le t^2_{\nu,\,0.95}

with C the variance that readings of unit scatter would give the parameter and V the one that their scatter about the fit
gives it, table by table. Where all readings scatter alike, V/C is their variance and this is the F interval of the
textbooks; of a model that is linear in all its parameters it is the estimate plus and minus t standard errors. The degrees
of freedom are Satterthwaite's: those of the tables in proportion to what they contribute to V. Limits at the end of a
parameter's range belong to the interval: it is cut off there, not moved. Where the errors of a row's own angles enter by the
effective variance, the sum of squares has each value's own weights, so that the interval leans toward the solution with the
true angles as unknowns; it holds nine in ten truths there, when the standard error's no longer does.

References:
    Bates and Watts, Nonlinear Regression Analysis and Its Applications (1988), section 6.1.
    Chandler and Bate, Inference for clustered data using the independence loglikelihood, Biometrika 94 (2007), 167.
    Satterthwaite, An approximate distribution of estimates of variance components, Biometrics Bulletin 2 (1946), 110.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from bowdenfit.display import Part
from bowdenfit.inference.linearized import blocks, linearize
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import LOWER_END, Objective, Problem, Solution, may_end
from bowdenfit.inference.solver import QUICK, gauss_newton
from bowdenfit.parameters.priors import Uniform
from bowdenfit.parameters.space import Parameter

PROBABILITY = 0.9
FARTHEST = -LOWER_END
_ALWAYS = ("friction", "friction_model")  # roles whose intervals are worth their time in large problems
_SMALL = 20_000  # entries of the Jacobian up to which every parameter's interval is
_INSIDE = 2.0  # size of z a little inside the range of a parameter that is at an end of it
_PRECISION = 3e-4  # of a limit, in the steps that lead to it
_FAR = 1.0  # step of another parameter that is not foretold [z]
_BEYOND = 1.5  # how far the second step goes, in parts of the way that is left by the first
_MOST_STEPS = 50
_LEAST_STEP, _MOST_STEP, _LONGEST_STEP = 1e-6, 1.0, 8.0  # first step from the minimum, and all others [z]


@dataclass(frozen=True, repr=False)
class Profile(Part):
    """How the sum of squares rises on both sides of the minimum.

    Args:
        name: Name of the parameter.
        values: Its values, in its shown unit, rising.
        rise: By how much the sum of squares of the standardized residuals is larger there than at the minimum, the other
            parameters fitted again; noise scales at their prior median.
    """

    name: str
    values: np.ndarray
    rise: np.ndarray


@dataclass(frozen=True)
class Basin:
    """A minimum, from which one of its parameters is moved.

    Args:
        problem: What it is the minimum of.
        found: The minimum.
        at_end: Parameters at an end of their range, which may leave it when another is moved.
    """

    problem: Problem
    found: Solution
    at_end: np.ndarray

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The free parameters."""
        return self.problem.posterior.model.space.free

    def moved(self, index: int, z: float, near: Solution) -> Solution:
        """The minimum with one parameter pinned at z; others leave the end of their range where that is better.

        Args:
            index: Of the parameter.
            z: Where it is pinned.
            near: The minimum with it pinned elsewhere, or free.
        """
        this = np.arange(len(near["z"])) == index
        ended = self.at_end & ~this
        pin = np.where(this, z, self.found["z"])
        found = self._solved(self._toward(near, this, z), this | ended, pin)
        side = np.sign(self.found["z"])
        inside = np.where(ended, side * _INSIDE, found["z"])
        if not ended.any() or not np.any(ended & (side * self._gradient(inside) > 0)):
            return found
        return min(found, self._solved(inside, this, pin), key=_total)

    def _toward(self, near: Solution, this: np.ndarray, z: float) -> np.ndarray:
        """Where the others follow it to in a straight line; where they are, if that is far, since few lines stay straight."""
        others = ~(self.problem.noise | self.at_end | this)
        jacobian = np.concatenate([near["sensitivity"], np.diag(self.problem.weight)])
        residuals = near["stacked"] + jacobian @ np.where(this, z - near["z"], 0.0)
        if not (np.all(np.isfinite(jacobian)) and np.all(np.isfinite(residuals))):
            return near["z"]
        step = np.zeros(len(this))
        step[others] = gauss_newton(jacobian[:, others], residuals)
        return near["z"] + step if np.all(np.abs(step) <= _FAR) else near["z"]

    def _solved(self, start: np.ndarray, pinned: np.ndarray | bool, pin: np.ndarray) -> Solution:
        return self.problem.solve(start, pinned, pin, QUICK)

    def _gradient(self, z: np.ndarray) -> np.ndarray:
        """Of half the sum of squares."""
        there = self._solved(z, True, z)
        return there["stacked"][: -len(z)] @ there["sensitivity"]

    def rise(self, index: int) -> Callable[[float], float]:
        """By how much the sum of squares is larger where z of a parameter is pinned; not a number where it has none.

        Each solve starts from the nearest one on the way from the minimum: one from beyond may lie in another valley.
        """
        known, lowest = [self.found], _total(self.found)
        center = float(self.found["z"][index])

        @cache
        def at(z: float) -> float:
            if z == center:
                return 0.0
            way = [other for other in known if abs(other["z"][index] - center) <= abs(z - center)]
            found = self.moved(index, z, min(way, key=lambda other: abs(other["z"][index] - z)))
            if not np.isfinite(_total(found)):
                return float("nan")
            known.append(found)
            return _total(found) - lowest

        return at

    def value(self, index: int, z: float) -> float:
        """Value of a parameter at z, in its shown unit; infinite where its range has no end."""
        parameter = self.parameters[index]
        if z > 0 and not (isinstance(parameter.prior, Uniform) or np.isfinite(z)):
            return float("inf")
        if z < 0 and not (may_end((parameter,))[0] or np.isfinite(z)):
            return float("-inf")
        at = np.clip(np.full(len(self.parameters), z), -FARTHEST, FARTHEST)
        values = self._solved(at, True, at)["values"]
        return float(values[index]) * parameter.shown_scale


def profile(
    posterior: LogDensity,
    objective: Objective,
    name: str,
    start: np.ndarray,
    z: Sequence[float] | np.ndarray,
    with_priors: bool = False,
) -> Profile:
    """The profile of one free parameter, for figures and for questions of identifiability.

    Args:
        posterior: The posterior.
        objective: Its compiled solve.
        name: Name of the parameter.
        start: z to start from, such as that of the maximum of the posterior.
        z: Where the parameter is pinned, as z.
        with_priors: Whether the priors count as measurements of the parameters.
    """
    problem, index = Problem(posterior, objective, with_priors), posterior.model.space.index[name]
    found = problem.solve(start)
    basin = Basin(problem, found, np.zeros_like(problem.noise))
    rise = basin.rise(index)
    pins = [float(pin) for pin in np.sort(z)]
    rises = {pin: rise(pin) for pin in sorted(pins, key=lambda pin: abs(pin - found["z"][index]))}  # outward
    return Profile(name, np.array([basin.value(index, pin) for pin in pins]), np.array([rises[pin] for pin in pins]))


def limits(basin: Basin, scale: np.ndarray, determined: np.ndarray) -> dict[str, tuple[float, float]]:
    """90 % intervals of determined parameters, in shown units, by the scatter of each residual about the minimum."""
    found, cheap = {}, basin.found["jacobian"].size <= _SMALL
    for i, p in enumerate(basin.parameters):
        if determined[i] and not basin.problem.noise[i] and (cheap or p.role in _ALWAYS):
            error, ratio, freedom = _spread(basin, scale, i)
            if ratio > 0:
                ends = interval(basin.rise(i), float(basin.found["z"][i]), error, ratio, freedom)
                found[p.name] = basin.value(i, ends[0]), basin.value(i, ends[1])
    return found


def _spread(basin: Basin, scale: np.ndarray, index: int) -> tuple[float, float, float]:
    """Standard error of z of a parameter, its variance over that by readings of unit scatter, and degrees of freedom.

    Not numbers where the readings say nothing of it, not even a little inside its range.
    """
    found, terms = basin.found, basin.problem.posterior.model.terms
    if basin.at_end[index]:  # where z has no influence; a little inside its range
        found = basin.moved(index, float(np.copysign(_INSIDE, basin.found["z"][index])), basin.found)
    columns = np.flatnonzero(~basin.problem.noise & ~basin.at_end | (np.arange(len(basin.at_end)) == index))
    about = linearize(found["sensitivity"][:, columns])
    place = int(np.searchsorted(columns, index))
    if not about.determined[place] or not about.unit_error[place] > 0:
        return float("nan"), float("nan"), 1.0
    moves = about.moves(scale)[place] ** 2
    parts = [
        (np.sum(moves[rows]), freedom)
        for _, rows, _, freedom in blocks(terms, basin.found["residuals"], about.leverage)
    ]
    variance = float(np.sum(moves))
    return float(np.sqrt(variance)), variance / float(about.unit_error[place]) ** 2, freedom_of(*np.array(parts).T)


def interval(
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
    from scipy.special import stdtrit

    quantile = float(stdtrit(freedom, (1 + PROBABILITY) / 2))

    def above(z: float) -> float:
        risen = rise(z)
        return np.sqrt(max(risen, 0.0) / ratio) - quantile if np.isfinite(risen) else float("nan")

    step = float(np.clip(quantile * error, _LEAST_STEP, _MOST_STEP))
    return _limit(above, center, -step), _limit(above, center, step)


def _limit(above: Callable[[float], float], center: float, step: float) -> float:
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
            return _crossing(known, inside, outside, _PRECISION * abs(ahead), close)
        if np.isnan(reached):
            step = ahead = ahead / 4
        else:
            straight = abs(_BEYOND * ahead * reached / (reached - least)) if inside == center and reached > least else np.inf
            step = float(np.clip(2 * step, -_LONGEST_STEP, _LONGEST_STEP)) if ahead == step else step
            inside, ahead = outside, float(np.copysign(min(abs(step), straight), step))
        if inside == end or abs(step) < _LEAST_STEP:
            break
    return float(np.copysign(np.inf, step))


def _crossing(
    above: Callable[[float], float], inside: float, outside: float, tolerance: float, close: float = 0.0
) -> float:
    """Where a function goes through zero between two points at which it has either sign.

    By inverse interpolation through the last three points where that is safe, else halfway (Chandrupatla, Advances in
    Engineering Software 28 (1997), 145), but for the first point, which is on the straight line; SciPy has it too, but takes a
    quarter of a second to load.

    Args:
        above: The function.
        inside, outside: The points.
        tolerance: How near a point has to be.
        close: Size of the function that is as good as zero.
    """
    (last, found), (other, opposite) = (outside, above(outside)), (inside, above(inside))
    part, least = found / (found - opposite), min(tolerance / 2 / abs(inside - outside), 0.5)
    part = min(max(part, least), 1 - least)
    while True:
        at = last + part * (other - last)
        value = above(at)
        before, was = last, found
        if (value > 0) != (found > 0):
            before, was, other, opposite = other, opposite, last, found
        last, found = at, value
        least = tolerance / 2 / abs(other - last)
        if abs(found) <= close or least > 0.5:
            return last if abs(found) < abs(opposite) else other
        place, height = (last - other) / (before - other), (found - opposite) / (was - opposite)
        part = 0.5
        if height * height < place and (1 - height) * (1 - height) < 1 - place:
            part = found / (opposite - found) * was / (opposite - was)
            part += (before - last) / (other - last) * found / (was - found) * opposite / (was - opposite)
        part = min(max(part, least), 1 - least)


def freedom_of(parts: np.ndarray, freedom: np.ndarray) -> float:
    """Satterthwaite's degrees of freedom of a variance; at least 1.

    Args:
        parts: What each block of residuals contributes to the variance.
        freedom: Degrees of freedom of each block's scatter; infinite where it is known.
    """
    share = parts / max(float(np.sum(parts)), 1e-300)
    return float(np.clip(1 / max(float(np.sum(share**2 / freedom)), 1e-9), 1.0, 1e9))


def _total(found: Solution) -> float:
    """Sum of squares of everything that counts, priors too where they do."""
    return float(found["stacked"] @ found["stacked"])
