"""The minimum of least squares without priors: parameters at an end of their range, weights of tables, kinks and rival minima.

Where the regime of a reading changes, as where a side of a loop goes slack, residuals have kinks. There the solver may stop
although the tangent plane says that the sum of squares would still fall, and a kink may keep it from a lower minimum.

A standard error is the curvature at the minimum. Where the sum of squares has a flat floor instead (preload of a loop whose
return side is always slack, stiffness of a rope read at one load), curvature does not say how far the floor reaches. So each
parameter in question is pinned at values that its prior considers possible, and the others are fitted again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bowdenfit.inference.interval import NORMAL_90
from bowdenfit.inference.linearized import Linearized, estimate_scatter, linearize
from bowdenfit.inference.objective import LOWER_END, Problem, Solution, has_lower_end, sum_of_squares, total_squares
from bowdenfit.inference.profiles import Basin, ProfileIntervals, compute_profile_intervals, is_stuck
from bowdenfit.inference.scalar_priors import clipped_z
from bowdenfit.parameters.priors import HalfCauchy, Uniform
from bowdenfit.parameters.space import Parameter

_NEAR_END = -2.0  # below this z an estimate may be on its way to the lower end, above its negative to the upper
_FAR = 50.0  # standard error in units of the prior's sd beyond which data say nothing of a parameter
_MOST_FOLLOWED = 3  # times that a profile is followed to a lower minimum
_RESTARTS = 12  # from which the solver starts again where it is stuck
_FARTHEST_RESTART = 1.0  # of each from there [z]
PINS = (-2.5, 2.5)  # z at which a parameter is pinned
_AS_WELL = 0.97725  # probability up to which a deviation counts as chance: two standard errors of a normal reading
_EXACT = 1e-6  # scatter of readings that fit without any
_APART = 4.0  # standard errors beyond which it is another answer; were the errors normal, 2 could not be passed


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
    linearized: Linearized
    active: np.ndarray
    scale: np.ndarray
    residual_sd: dict[str, float]
    error: np.ndarray
    determined: np.ndarray

    @property
    def is_stuck(self) -> bool:
        """Whether another start is worth its time: the table that scatters least would limit a parameter by not much more."""
        return is_stuck(self.basin.solution["fall"], (NORMAL_90 * float(np.min(self.scale, initial=1.0))) ** 2)


def find_lowest_minimum(problem: Problem, start: np.ndarray, intervals: bool) -> tuple[LocalMinimum, ProfileIntervals]:
    """The minimum and its limits, if `intervals`; where a profile leads to a lower one it is followed there."""
    minimum = _find_minimum(problem, start)
    if not intervals:
        return minimum, ProfileIntervals()
    profiled = compute_profile_intervals(minimum.basin, minimum.scale, minimum.determined)
    for _ in range(_MOST_FOLLOWED):
        if profiled.lower is None:
            break
        minimum = _find_minimum(minimum.basin.problem, profiled.lower["z"])
        profiled = compute_profile_intervals(minimum.basin, minimum.scale, minimum.determined)
    return minimum, profiled


def _find_minimum(problem: Problem, start: np.ndarray) -> LocalMinimum:
    """The minimum; where the solver is stuck, the lowest that it finds from where other scatter would have led it."""
    minimum = _describe_minimum(_reweigh(_solve_to_minimum(problem, start)))
    if not minimum.is_stuck:
        return minimum
    draw, first, active, moves = (
        np.random.default_rng(0),
        minimum.basin.solution["z"],
        minimum.active,
        minimum.linearized.moves(minimum.scale),
    )
    lowest = minimum.basin.solution
    for _ in range(_RESTARTS):
        trial_start = first.copy()
        trial_start[active] += np.clip(
            moves @ draw.standard_normal(moves.shape[1]), -_FARTHEST_RESTART, _FARTHEST_RESTART
        )
        lowest = min(lowest, minimum.basin.problem.solve(trial_start, minimum.basin.at_end, first), key=total_squares)
    return _describe_minimum(replace(minimum.basin, solution=lowest))


def _describe_minimum(basin: Basin) -> LocalMinimum:
    solution = basin.solution
    active = np.flatnonzero(~basin.problem.noise & ~basin.at_end)
    linearized = linearize(solution["jacobian"][:, active])
    scale, residual_sd = estimate_scatter(
        basin.problem.posterior.model.terms, solution["residuals"], linearized.leverage
    )
    error, determined = np.full(len(solution["z"]), np.nan), basin.at_end.copy()
    error[active] = np.linalg.norm(linearized.moves(scale), axis=1)
    determined[active] = (
        linearized.determined & (np.abs(solution["z"][active]) <= _FAR) & (linearized.unit_error <= _FAR)
    )
    return LocalMinimum(basin, linearized, active, scale, residual_sd, error, determined)


def _solve_to_minimum(problem: Problem, start: np.ndarray) -> Basin:
    """The minimum without priors, and which parameters have run to an end of their range there."""
    parameters, n = problem.posterior.model.space.free, len(start)
    pin, at_end, solution = np.zeros(n), np.zeros(n, dtype=bool), problem.solve(start)
    for i in np.flatnonzero(_may_be_at_end(parameters, solution["z"]) & ~problem.noise):
        mask, end = np.arange(n) == i, np.copysign(LOWER_END, solution["z"][i])
        # A step can leap over the minimum into the flat tail of the map from z; only what ends there from the middle too
        # has its minimum there.
        again = problem.solve(np.where(mask, 0.0, solution["z"]), at_end, pin)
        solution = min(solution, again, key=sum_of_squares)
        if not _may_be_at_end(parameters, solution["z"])[i]:
            continue
        trial_pin = np.where(mask, end, pin)
        trial = problem.solve(solution["z"], at_end | mask, trial_pin)
        if sum_of_squares(trial) <= sum_of_squares(solution) * (1 + 1e-7) + 1e-14:
            at_end, pin, solution = at_end | mask, trial_pin, trial
    return Basin(problem, solution, at_end)


def _reweigh(basin: Basin) -> Basin:
    """The minimum with the noise scales that single readings of a run each tell; the same where there are no such runs.

    Their prior medians say how much more readings scatter at low loads than at high ones, which nothing else corrects.
    """
    problem, space = basin.problem, basin.problem.posterior.model.space
    values = dict(zip((p.name for p in space.free), basin.solution["values"], strict=True))
    values |= {p.name: np.asarray(p.fixed) for p in space.fixed}
    scatter: dict[str, float] = {}
    for term in problem.posterior.model.terms:
        if hasattr(term, "scatter_of_single_readings"):
            scatter |= term.scatter_of_single_readings(values)
    names = [
        name for name in scatter if name in space.index and isinstance(space.free[space.index[name]].prior, HalfCauchy)
    ]
    if not names or len(names) < len(scatter):
        return basin
    noise_z = np.zeros(space.size)
    for name in names:
        at = space.index[name]
        noise_z[at] = clipped_z(space.free[at].prior, float(scatter[name]))
    return _solve_to_minimum(replace(problem, noise_z=noise_z), basin.solution["z"])


def _may_be_at_end(parameters: tuple[Parameter, ...], z: np.ndarray) -> np.ndarray:
    """Which parameters may be on their way to an end of their range."""
    limited = np.array([isinstance(p.prior, Uniform) for p in parameters], dtype=bool)
    return (has_lower_end(parameters) & (z < _NEAR_END)) | (limited & (z > -_NEAR_END))


def find_rivals(solution: Solution, trials: Sequence[Solution], scale: np.ndarray, n_informed: int) -> list[Solution]:
    """Those of the trials that fit about as well as what was found.

    Args:
        found: The minimum; its residuals by table.
        trials: Solutions with a parameter pinned elsewhere.
        scale: Scatter of each standardized residual about the minimum [1].
        n_informed: Number of directions that the residuals determine; scatter about few spare readings is known badly.
    """
    from scipy.special import stdtrit

    # Readings without any scatter fit nothing else, whatever their weight.
    exact = np.concatenate([np.full(len(r), not np.any(r)) for r in solution["residuals"].values()])
    scale = np.where(exact, _EXACT, scale)
    spare = max(sum(np.count_nonzero(r) for r in solution["residuals"].values()) - n_informed, 1)
    limit = _scaled_squares(solution, scale) + float(stdtrit(spare, _AS_WELL)) ** 2
    return [trial for trial in trials if _scaled_squares(trial, scale) <= limit]


def range_of_minima(value: float, error: float, rivals: Sequence[float]) -> tuple[float, float] | None:
    """Lowest and highest value that fit about as well, where one lies further off than the error allows; else None."""
    if all(abs(rival - value) <= _APART * error for rival in rivals):
        return None
    return min(value, *rivals), max(value, *rivals)


def _scaled_squares(solution: Solution, scale: np.ndarray) -> float:
    total = float(np.sum((np.concatenate(list(solution["residuals"].values())) / scale) ** 2))
    return total if np.isfinite(total) else float("inf")
