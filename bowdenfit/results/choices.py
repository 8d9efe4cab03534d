"""From draws to a decision: what can be bought, what it costs not to have the best, and what is good enough."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

EDGE_FRACTION = 0.001  # an optimum this close to an end of the range, as a fraction of the range, counts as at the edge


@dataclass(frozen=True)
class Choice:
    """One length that can be bought.

    Args:
        length: Route value.
        probability_best: Probability that no other choice is more efficient.
        expected_regret: Expected loss of efficiency against the best choice [1].
    """

    length: float
    probability_best: float
    expected_regret: float


@dataclass(frozen=True)
class Window:
    """Shortest stretch of route values that is within a fraction of the best efficiency with a probability.

    Args:
        within: Allowed relative loss of efficiency.
        probability: Probability that the whole window is within it.
        start: Lower end; NaN where no length is good enough that surely.
        stop: Upper end.
    """

    within: float
    probability: float
    start: float
    stop: float

    JSON: ClassVar = ("within", "probability", ("from", "start"), ("to", "stop"))


def is_at_edge(lengths: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """Which optima lie at an end of the range, where the true optimum may be outside."""
    tolerance = EDGE_FRACTION * (limits[1] - limits[0])
    return (lengths <= limits[0] + tolerance) | (lengths >= limits[1] - tolerance)


def rank_choices(lengths: np.ndarray, efficiency: np.ndarray) -> tuple[Choice, ...]:
    """Probability of being best and expected regret of each length that can be bought.

    Args:
        lengths: The choices.
        efficiency: Efficiency of each draw (rows) at each choice (columns).
    """
    best = efficiency.max(axis=1, keepdims=True)
    wins = (efficiency == best) / (efficiency == best).sum(axis=1, keepdims=True)
    regret = (best - efficiency).mean(axis=0)
    rows = zip(lengths, wins.mean(axis=0), regret, strict=True)
    return tuple(Choice(float(a), float(b), float(c)) for a, b, c in rows)


def find_best_window(
    grid: np.ndarray, efficiency: np.ndarray, best: np.ndarray, within: float = 0.01, probability: float = 0.95
) -> Window:
    """The longest window whose every length is within a fraction of the draw's best efficiency with a probability.

    'Within 1 % of the best with 95 % probability' holds at each length of the window; it is the connected stretch
    around the length where that probability is highest.

    Args:
        grid: Route values.
        efficiency: Efficiency of each draw (rows) on the grid (columns).
        best: Highest efficiency of each draw.
        within: Allowed relative loss.
        probability: Required probability.
    """
    good = (efficiency >= (1 - within) * best[:, None]).mean(axis=0)
    center = int(np.argmax(good))
    if good[center] < probability:
        return Window(within, probability, float("nan"), float("nan"))
    low = high = center
    while low > 0 and good[low - 1] >= probability:
        low -= 1
    while high < len(grid) - 1 and good[high + 1] >= probability:
        high += 1
    return Window(within, probability, float(grid[low]), float(grid[high]))
