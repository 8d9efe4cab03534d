r"""Paired comparisons of a few persons: Student's t, from each person's numbers or from what was printed of them.

References:
    Brockway 1987, "Derivation of formulae used to calculate energy expenditure in man" (Human Nutrition: Clinical Nutrition
    41C, 463-471); Student 1908, "The probable error of a mean" (Biometrika 6).
"""

import math

import numpy as np
from scipy import stats
from scipy.optimize import brentq

_OXYGEN, _CARBON_DIOXIDE, _NITROGEN = 16.58, 4.51, 5.90  # kJ/l, kJ/l and kJ/g
LEVEL, POWER = 0.05, 0.8
_MAX_PERSONS = 100_000


def brockway(oxygen: np.ndarray | float, carbon_dioxide: np.ndarray | float, nitrogen: float = 0.0) -> np.ndarray | float:
    r"""Metabolic rate [W], :math:`16.58 V_{O_2} + 4.51 V_{CO_2} - 5.90 N` in kJ (Brockway 1987).

    Args:
        oxygen: Taken up [ml/min].
        carbon_dioxide: Given off [ml/min].
        nitrogen: In urine [g/min]; hardly anybody who walks measures it.
    """
    return (_OXYGEN * oxygen + _CARBON_DIOXIDE * carbon_dioxide - 1000 * _NITROGEN * nitrogen) / 60


def mean_and_error(differences: np.ndarray) -> tuple[float, float]:
    """Mean difference and its standard error.

    Args:
        differences: A number for each person.
    """
    return float(np.mean(differences)), float(stats.sem(differences))


def two_sided_p(t: float, persons: int) -> float:
    """Probability of a t as far from 0 by chance.

    Args:
        t: Mean difference over its standard error.
        persons: How many.
    """
    return float(2 * stats.t.sf(abs(t), persons - 1))


def t_from_p(p: float, persons: float) -> float:
    """The t, without its sign, that has a two-sided probability."""
    return float(stats.t.isf(p / 2, persons - 1))


def half_width(error: float, persons: int, level: float = 1 - LEVEL) -> float:
    """Half the width of the interval that holds the true difference in so many studies of all.

    Args:
        error: Standard error.
        persons: How many.
        level: The share of studies.
    """
    return float(stats.t.ppf((1 + level) / 2, persons - 1)) * error


def probability_below(mean: float, error: float, persons: int, prior_sd: float = math.inf) -> float:
    """Probability that the true difference is negative.

    Args:
        mean, error: Of the difference, and its standard error.
        persons: How many.
        prior_sd: Standard deviation of what differences were expected before, about 0; infinite where nothing was.
    """
    if math.isinf(prior_sd):
        return float(stats.t.cdf(-mean / error, persons - 1))
    grid = np.linspace(-12, 12, 200_001) * prior_sd
    weight = np.exp(-((grid / prior_sd) ** 2) / 2) * (1 + ((grid - mean) / error) ** 2 / (persons - 1)) ** (-persons / 2)
    return float((weight[grid < 0].sum() + weight[grid == 0].sum() / 2) / weight.sum())


def power(effect: float, persons: float, level: float = LEVEL) -> float:
    """Probability that a true difference is found.

    Args:
        effect: The difference over the standard deviation of persons' differences.
        persons: How many.
        level: Of the two-sided test.
    """
    limit, shift = t_from_p(level, persons), abs(effect) * math.sqrt(persons)
    other_way = float(stats.nct.cdf(-limit, persons - 1, shift))  # NaN where it is too small to be computed
    return float(stats.nct.sf(limit, persons - 1, shift)) + (0.0 if math.isnan(other_way) else other_way)


def persons_needed(effect: float, share: float = POWER) -> int | None:
    """Persons with whom a true difference is found in so many studies of all; None where they are too many.

    Args:
        effect: See `power`.
        share: The share.
    """
    largest = min(20 / max(effect**2, 1e-9) + 40, _MAX_PERSONS)  # with 20 over the square 99 % of all studies find it
    if power(effect, largest) < share:
        return None
    return 2 if power(effect, 2) >= share else math.ceil(brentq(lambda n: power(effect, n) - share, 2, largest))


def smallest_detectable(persons: int, share: float = POWER) -> float:
    """Difference, over the standard deviation of persons' differences, that is found in so many studies of all."""
    enough = 4 * t_from_p(LEVEL, persons) / math.sqrt(persons)
    return float(brentq(lambda effect: power(effect, persons) - share, 0.0, enough))
