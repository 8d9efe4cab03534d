"""What cables of a fleet do over cycles: friction, or efficiency where life is asked for, and how many have failed."""

import numpy as np

from bowdenfit.inference.population.sampling import PopulationDraws
from bowdenfit.questions.pool.answer import Asked, Curves
from bowdenfit.questions.pool.inspected import Given
from bowdenfit.questions.pool.life import cycles_until

_POINTS, _BEYOND = 61, 1.25  # of a curve, and how far it goes beyond what was inspected or asked for
_FURTHEST = 8.0  # times the longest inspected


def curves_of(known: Given, drawn: PopulationDraws, asked: Asked | None, new: np.ndarray) -> Curves:
    """What is drawn over cycles.

    Args:
        known: What is pooled.
        drawn: Of the population and its cables.
        asked: What life is until.
        new: Draws of new cables, (draw, number).
    """
    reference, furthest = known.reference_cycles, known.reference_cycles
    every = (drawn.cables[:, i] for i in range(len(known.cables)))
    if asked is None:
        at = np.linspace(0.0, _BEYOND * furthest, _POINTS)
        medians = [_friction(values, at, reference)[1] for values in every]
        return Curves(at, _friction(new, at, reference), np.array(medians), None, None)
    life = cycles_until(asked, new[:, :-1], new[:, -1], reference)
    median = float(np.quantile(life, 0.5, method="inverted_cdf"))
    furthest = max(furthest, asked.cycles or 0.0, min(median, _FURTHEST * reference))
    at = np.linspace(0.0, _BEYOND * furthest, _POINTS)
    medians, fails = [], []
    for values in every:
        medians.append(_efficiency(asked, values, at, reference)[1])
        fails.append(_failed(cycles_until(asked, values[:, :-1], values[:, -1], reference), at))
    return Curves(at, _efficiency(asked, new, at, reference), np.array(medians), _failed(life, at), np.array(fails))


def _friction(values: np.ndarray, at: np.ndarray, reference: float) -> np.ndarray:
    """Friction over that when new: 5 %, 50 % and 95 %."""
    found: np.ndarray = np.exp(np.quantile(values[:, -1], (0.05, 0.5, 0.95))[:, None] * at / reference)
    return found


def _efficiency(asked: Asked, values: np.ndarray, at: np.ndarray, reference: float) -> np.ndarray:
    """Efficiency: 5 %, 50 % and 95 %."""
    total = np.exp(values[:, :-1]) @ np.array(list(asked.wrap_angles.values()))
    return np.quantile(np.exp(-total[:, None] * np.exp(values[:, -1:] * at / reference)), (0.05, 0.5, 0.95), axis=0)


def _failed(life: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Share of lives that have ended."""
    found: np.ndarray = np.searchsorted(np.sort(life), at, side="right") / len(life)
    return found
