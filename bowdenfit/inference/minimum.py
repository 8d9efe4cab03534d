"""The minimum of least squares without priors: what has run to an end of its range, how tables weigh, and where kinks lie.

Where the regime of a reading changes, as where a side of a loop goes slack, residuals have kinks. There the solver may end
where the tangent plane says that the sum of squares would yet fall, and a kink may keep it from a lower minimum.
"""

from dataclasses import dataclass, replace

import numpy as np

from bowdenfit.inference.interval import NORMAL_90
from bowdenfit.inference.linearized import Linearized, linearize, scatter_about
from bowdenfit.inference.objective import LOWER_END, Problem, has_lower_end, sum_of_squares, total_squares
from bowdenfit.inference.profiles import Basin, ProfileIntervals, is_stuck, profile_intervals
from bowdenfit.inference.scalar_priors import clipped_z
from bowdenfit.parameters.priors import HalfCauchy, Uniform
from bowdenfit.parameters.space import Parameter

_SUSPECT = -2.0  # below this z an estimate may be on its way to the lower end, above its negative to the upper
_FAR = 50.0  # standard error in units of the prior's sd beyond which data say nothing of a parameter
_FOLLOWED = 3  # times that a profile is followed to a lower minimum
_PLACES = 12  # from which the solver starts again where it is stuck
_FARTHEST_PLACE = 1.0  # of each from there [z]


@dataclass(frozen=True)
class LocalMinimum:
    """A minimum, and what residuals and Jacobian say there.

    Args:
        basin: The minimum.
        about: Its Jacobian by what is free and at no end.
        active: Which parameters these are.
        scale: Scatter of each standardized residual.
        residual_sd: The same by table.
        error: Standard errors of z; not numbers at an end.
        determined: Whether readings determine a parameter.
    """

    basin: Basin
    about: Linearized
    active: np.ndarray
    scale: np.ndarray
    residual_sd: dict[str, float]
    error: np.ndarray
    determined: np.ndarray

    @property
    def is_stuck(self) -> bool:
        """Whether another start is worth its time: the table that scatters least would limit a parameter by not much more."""
        return is_stuck(self.basin.found["fall"], (NORMAL_90 * float(np.min(self.scale, initial=1.0))) ** 2)


def lowest_minimum(problem: Problem, start: np.ndarray, intervals: bool) -> tuple[LocalMinimum, ProfileIntervals]:
    """The minimum and its limits, if `intervals`; where a profile leads to a lower one it is followed there."""
    at = _found(problem, start)
    if not intervals:
        return at, ProfileIntervals()
    profiled = profile_intervals(at.basin, at.scale, at.determined)
    for _ in range(_FOLLOWED):
        if profiled.lower is None:
            break
        at = _found(at.basin.problem, profiled.lower["z"])
        profiled = profile_intervals(at.basin, at.scale, at.determined)
    return at, profiled


def _found(problem: Problem, start: np.ndarray) -> LocalMinimum:
    """The minimum; where the solver is stuck, the lowest that it finds from where other scatter would have led it."""
    at = _described(_weighed(_minimum(problem, start)))
    if not at.is_stuck:
        return at
    draw, first, active, moves = np.random.default_rng(0), at.basin.found["z"], at.active, at.about.moves(at.scale)
    lowest = at.basin.found
    for _ in range(_PLACES):
        place = first.copy()
        place[active] += np.clip(moves @ draw.standard_normal(moves.shape[1]), -_FARTHEST_PLACE, _FARTHEST_PLACE)
        lowest = min(lowest, at.basin.problem.solve(place, at.basin.at_end, first), key=total_squares)
    return _described(replace(at.basin, found=lowest))


def _described(basin: Basin) -> LocalMinimum:
    found = basin.found
    active = np.flatnonzero(~basin.problem.noise & ~basin.at_end)
    about = linearize(found["jacobian"][:, active])
    scale, residual_sd = scatter_about(basin.problem.posterior.model.terms, found["residuals"], about.leverage)
    error, determined = np.full(len(found["z"]), np.nan), basin.at_end.copy()
    error[active] = np.linalg.norm(about.moves(scale), axis=1)
    determined[active] = about.determined & (np.abs(found["z"][active]) <= _FAR) & (about.unit_error <= _FAR)
    return LocalMinimum(basin, about, active, scale, residual_sd, error, determined)


def _minimum(problem: Problem, start: np.ndarray) -> Basin:
    """The minimum without priors, and which parameters have run to an end of their range there."""
    parameters, n = problem.posterior.model.space.free, len(start)
    pin, at_end, found = np.zeros(n), np.zeros(n, dtype=bool), problem.solve(start)
    for i in np.flatnonzero(_suspect(parameters, found["z"]) & ~problem.noise):
        this, end = np.arange(n) == i, np.copysign(LOWER_END, found["z"][i])
        # A step can leap over the minimum into the flat tail of the map from z; only what ends there from the middle too
        # has its minimum there.
        again = problem.solve(np.where(this, 0.0, found["z"]), at_end, pin)
        found = min(found, again, key=sum_of_squares)
        if not _suspect(parameters, found["z"])[i]:
            continue
        trial_pin = np.where(this, end, pin)
        trial = problem.solve(found["z"], at_end | this, trial_pin)
        if sum_of_squares(trial) <= sum_of_squares(found) * (1 + 1e-7) + 1e-14:
            at_end, pin, found = at_end | this, trial_pin, trial
    return Basin(problem, found, at_end)


def _weighed(basin: Basin) -> Basin:
    """The minimum with the noise scales that single readings of a run each tell; the same where there are no such runs.

    Their prior medians say how much more readings scatter at low loads than at high ones, which nothing else corrects.
    """
    problem, space = basin.problem, basin.problem.posterior.model.space
    values = dict(zip((p.name for p in space.free), basin.found["values"], strict=True))
    values |= {p.name: np.asarray(p.fixed) for p in space.fixed}
    told: dict[str, float] = {}
    for term in problem.posterior.model.terms:
        if hasattr(term, "scatter_of_single_readings"):
            told |= term.scatter_of_single_readings(values)
    weighed = [name for name in told if name in space.index and isinstance(space.free[space.index[name]].prior, HalfCauchy)]
    if not weighed or len(weighed) < len(told):
        return basin
    noise_z = np.zeros(space.size)
    for name in weighed:
        at = space.index[name]
        noise_z[at] = clipped_z(space.free[at].prior, float(told[name]))
    return _minimum(replace(problem, noise_z=noise_z), basin.found["z"])


def _suspect(parameters: tuple[Parameter, ...], z: np.ndarray) -> np.ndarray:
    """Which parameters may be on their way to an end of their range."""
    limited = np.array([isinstance(p.prior, Uniform) for p in parameters], dtype=bool)
    return (has_lower_end(parameters) & (z < _SUSPECT)) | (limited & (z > -_SUSPECT))
