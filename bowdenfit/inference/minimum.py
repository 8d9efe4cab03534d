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
from scipy.special import stdtrit

from bowdenfit.inference.interval import NORMAL_90
from bowdenfit.inference.linearized import Linearized, estimate_scatter, linearize
from bowdenfit.inference.objective import LOWER_END, Problem, Solution, has_lower_end, sum_of_squares, total_squares
from bowdenfit.inference.profiles import Basin, ProfileIntervals, compute_profile_intervals, is_stuck
from bowdenfit.inference.scalar_priors import clipped_z
from bowdenfit.parameters.priors import HalfCauchy, Uniform
from bowdenfit.parameters.space import Parameter

_NEAR_END = -2.0  # z below which an estimate may run to the lower end of its range, and above its negative to the upper
# standard error, relative to the prior's standard deviation, beyond which data carry no information about a parameter
_FAR = 50.0
_MOST_FOLLOWED = 3  # times that a profile is followed to a lower minimum
_RESTARTS = 12  # further starts where the solver is stuck
_FARTHEST_RESTART = 1.0  # largest change of each z at such a start
PINS = (-2.5, 2.5)  # z at which a parameter is pinned
_AS_WELL = 0.97725  # probability below two standard errors of a normal: a rival within it fits about as well
_EXACT = 1e-6  # scatter assigned to readings that are fitted exactly
_APART = 4.0  # standard errors beyond which a rival is another solution; normal errors would not exceed 2


@dataclass(frozen=True)
class LocalMinimum:
    """A minimum with its linearization.

    Args:
        basin: The minimum.
        linearized: Linearization by parameters that are free and not at an end of their range.
        active: Positions of these parameters.
        scale: Scatter of each standardized residual.
        residual_sd: Scatter by table.
        error: Standard errors of z; NaN at an end of the range.
        determined: Whether readings determine each parameter.
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
        """Whether a further start is worthwhile, judged by the table that scatters least."""
        return is_stuck(self.basin.solution["fall"], (NORMAL_90 * float(np.min(self.scale, initial=1.0))) ** 2)


def find_lowest_minimum(problem: Problem, start: np.ndarray, intervals: bool) -> tuple[LocalMinimum, ProfileIntervals]:
    """Find the minimum and, if `intervals`, its profile intervals; where a profile leads to a lower minimum, follow it."""
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
    """Solve from a start; where the solver is stuck, solve from further starts and return the lowest minimum."""
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
    """Linearize about a minimum; return it with scatter and standard errors."""
    solution = basin.solution
    active = np.flatnonzero(~basin.problem.noise & ~basin.at_end)
    linearized = linearize(solution["jacobian"][:, active], basin.problem.penalty[active])
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
    """Solve without priors; return the minimum and which parameters have run to an end of their range."""
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
    """Solve again with noise scales estimated from single readings of runs; unchanged where there are no such runs.

    Otherwise their prior medians would decide how much more readings scatter at low loads than at high ones.
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
    """Return which parameters may run to an end of their range."""
    limited = np.array([isinstance(p.prior, Uniform) for p in parameters], dtype=bool)
    return (has_lower_end(parameters) & (z < _NEAR_END)) | (limited & (z > -_NEAR_END))


def find_rivals(solution: Solution, trials: Sequence[Solution], scale: np.ndarray, n_informed: int) -> list[Solution]:
    """Return the trial solutions that fit about as well as the minimum.

    Args:
        solution: The minimum; its residuals by table.
        trials: Solutions with a parameter pinned elsewhere.
        scale: Scatter of each standardized residual about the minimum [1].
        n_informed: Number of directions that the residuals determine; with few spare readings the scatter is uncertain.
    """
    # Readings without any scatter fit nothing else, whatever their weight.
    exact = np.concatenate([np.full(len(r), not np.any(r)) for r in solution["residuals"].values()])
    scale = np.where(exact, _EXACT, scale)
    spare = max(sum(np.count_nonzero(r) for r in solution["residuals"].values()) - n_informed, 1)
    limit = _scaled_squares(solution, scale) + float(stdtrit(spare, _AS_WELL)) ** 2
    return [trial for trial in trials if _scaled_squares(trial, scale) <= limit]


def range_of_minima(value: float, error: float, rivals: Sequence[float]) -> tuple[float, float] | None:
    """Return the lowest and highest value that fit about as well, if one lies farther off than the error allows; else None."""
    if all(abs(rival - value) <= _APART * error for rival in rivals):
        return None
    return min(value, *rivals), max(value, *rivals)


def _scaled_squares(solution: Solution, scale: np.ndarray) -> float:
    total = float(np.sum((np.concatenate(list(solution["residuals"].values())) / scale) ** 2))
    return total if np.isfinite(total) else float("inf")
