"""Other solutions that fit about as well: what a standard error at the minimum cannot see.

A standard error is the curvature at the minimum. Where the sum of squares has a floor instead (preload of a loop whose return
side is always slack, stiffness of a rope read at one load), curvature says nothing of how far that floor reaches. So each
parameter in question is pinned at values that its prior holds possible, and the others are fitted again.
"""

from collections.abc import Sequence

import numpy as np

from bowdenfit.inference.objective import Solution

PINS = (-2.5, 2.5)  # z at which a parameter is pinned
_AS_WELL = 0.97725  # probability up to which a deviation counts as chance: two standard errors of a normal reading
_EXACT = 1e-6  # scatter of readings that fit without any
_APART = 4.0  # standard errors beyond which it is another answer; were the errors normal, 2 could not be passed


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
