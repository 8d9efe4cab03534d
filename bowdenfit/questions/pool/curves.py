"""What cables of a fleet do over cycles: friction, or efficiency where life is asked for, and how many have failed."""

import numpy as np

from bowdenfit.inference.population.sampling import PopulationDraws
from bowdenfit.questions.pool.answer import Curves, ServiceLimit
from bowdenfit.questions.pool.inspected import PoolingData
from bowdenfit.questions.pool.life import cycles_to_failure

_POINTS, _BEYOND = 61, 1.25  # of a curve, and how far it goes beyond what was inspected or asked for
_FURTHEST = 8.0  # times the longest inspected


def compute_curves(data: PoolingData, draws: PopulationDraws, limit: ServiceLimit | None, new: np.ndarray) -> Curves:
    """What is drawn over cycles.

    Args:
        known: What is pooled.
        drawn: Of the population and its cables.
        asked: What life is until.
        new: Draws of new cables, (draw, number).
    """
    reference, furthest = data.reference_cycles, data.reference_cycles
    cables = (draws.cables[:, i] for i in range(len(data.cables)))
    if limit is None:
        cycles = np.linspace(0.0, _BEYOND * furthest, _POINTS)
        medians = [_friction_quantiles(values, cycles, reference)[1] for values in cables]
        return Curves(cycles, _friction_quantiles(new, cycles, reference), np.array(medians), None, None)
    life = cycles_to_failure(limit, new[:, :-1], new[:, -1], reference)
    median = float(np.quantile(life, 0.5, method="inverted_cdf"))
    furthest = max(furthest, limit.cycles or 0.0, min(median, _FURTHEST * reference))
    cycles = np.linspace(0.0, _BEYOND * furthest, _POINTS)
    medians, fails = [], []
    for values in cables:
        medians.append(_efficiency_quantiles(limit, values, cycles, reference)[1])
        fails.append(_share_failed(cycles_to_failure(limit, values[:, :-1], values[:, -1], reference), cycles))
    return Curves(
        cycles,
        _efficiency_quantiles(limit, new, cycles, reference),
        np.array(medians),
        _share_failed(life, cycles),
        np.array(fails),
    )


def _friction_quantiles(values: np.ndarray, cycles: np.ndarray, reference: float) -> np.ndarray:
    """Friction over that when new: 5 %, 50 % and 95 %."""
    growth: np.ndarray = np.exp(np.quantile(values[:, -1], (0.05, 0.5, 0.95))[:, None] * cycles / reference)
    return growth


def _efficiency_quantiles(limit: ServiceLimit, values: np.ndarray, cycles: np.ndarray, reference: float) -> np.ndarray:
    """Efficiency: 5 %, 50 % and 95 %."""
    total = np.exp(values[:, :-1]) @ np.array(list(limit.wrap_angles.values()))
    return np.quantile(np.exp(-total[:, None] * np.exp(values[:, -1:] * cycles / reference)), (0.05, 0.5, 0.95), axis=0)


def _share_failed(life: np.ndarray, cycles: np.ndarray) -> np.ndarray:
    """Share of lives that have ended."""
    share: np.ndarray = np.searchsorted(np.sort(life), cycles, side="right") / len(life)
    return share
