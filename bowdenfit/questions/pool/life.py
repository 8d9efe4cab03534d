r"""How long cables last: cycles until efficiency, which falls as friction grows, is below what is asked for.

.. math:: \eta(c) = \exp\Bigl(-e^{b c / c_{ref}} \sum_k e^{a_k} \theta_k\Bigr), \qquad
          c^* = \frac{c_{ref}}{b} \log \frac{-\log \eta_{min}}{\sum_k e^{a_k} \theta_k}

infinite where friction does not grow (b at most 0), and 0 where a new cable is below it already.
"""

import numpy as np

from bowdenfit.questions.pool.answer import Life, ServiceLimit


def cycles_to_failure(limit: ServiceLimit, logs: np.ndarray, wear: np.ndarray, reference: float) -> np.ndarray:
    """Cycles at which each draw falls below the efficiency that is asked for.

    Args:
        asked: The efficiency and the wrap angles.
        logs: Log coefficients when new, (..., coefficient), in the order of the wrap angles.
        wear: Growth of log coefficients in the reference cycles, (...,).
        reference: The reference cycles.
    """
    log_margin = friction_log_margin(limit, logs)
    growing = np.where(wear > 0, wear, 1.0)
    return np.where(log_margin <= 0, 0.0, np.where(wear > 0, reference * log_margin / growing, np.inf))


def friction_log_margin(limit: ServiceLimit, logs: np.ndarray) -> np.ndarray:
    """By how much log coefficients may grow until then, (...,)."""
    angles = np.array(list(limit.wrap_angles.values()))
    return np.log(-np.log(limit.efficiency)) - np.log(np.exp(logs) @ angles)


def summarize_life(limit: ServiceLimit, cycles: np.ndarray, longest: float) -> Life:
    """A life of draws of its cycles.

    Args:
        asked: What it is until.
        cycles: Draws.
        longest: Cycles that were inspected.
    """
    early, median = (float(np.quantile(cycles, q, method="inverted_cdf")) for q in (0.05, 0.5))
    fails = None if limit.cycles is None else float(np.mean(cycles < limit.cycles))
    beyond = median > longest or (limit.cycles is not None and limit.cycles > longest)
    return Life(median, early, fails, float(np.mean(np.isinf(cycles))), bool(beyond))
