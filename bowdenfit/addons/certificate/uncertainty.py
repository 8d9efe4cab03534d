"""What a certificate states about a quantity's uncertainty: by Monte Carlo, with the GUM's own formulas next to it.

References:
    JCGM 100:2008, Guide to the expression of uncertainty in measurement (GUM).
    JCGM 101:2008, Supplement 1 to the GUM: propagation of distributions using a Monte Carlo method.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import brentq
from scipy.stats import t as student

from bowdenfit.types import Vector

# Degrees of freedom from which on the shape of some thousand draws does not differ from a normal one by more than it scatters
# (the ratio of widths below by 2 %). A judgement.
LARGEST_DEGREES = 50.0


@dataclass(frozen=True)
class UncertaintyComponent:
    """One line of an uncertainty budget.

    Args:
        name: Source of the uncertainty.
        evaluation: "A" by statistical analysis of the readings, "B" by other means (GUM 2.3.2, 2.3.3).
        standard: Contribution to the standard uncertainty of the result, in its unit.
        degrees: Degrees of freedom; infinite for limits that are taken as known (GUM G.4.3).
    """

    name: str
    evaluation: Literal["A", "B"]
    standard: float
    degrees: float


def combined_standard_uncertainty(components: Sequence[UncertaintyComponent]) -> float:
    """Return the combined standard uncertainty of independent components (GUM 5.1.2)."""
    return math.sqrt(sum(component.standard**2 for component in components))


def effective_degrees_of_freedom(components: Sequence[UncertaintyComponent]) -> float:
    """Return the effective degrees of freedom by the Welch-Satterthwaite formula (GUM G.4.1, equation G.2b)."""
    spread = sum(component.standard**4 / component.degrees for component in components)
    return combined_standard_uncertainty(components) ** 4 / spread if spread > 0 else math.inf


def coverage_factor(degrees: float, probability: float) -> float:
    """Return the coverage factor of a t distribution (GUM G.3.2 and G.6.4).

    Args:
        degrees: Effective degrees of freedom, at least 1; between whole numbers, t is interpolated (G.4.1).
        probability: Coverage probability of the interval.
    """
    return float(student.ppf((1 + probability) / 2, degrees))


def fit_t_distribution(draws: Vector) -> tuple[float, float]:
    """Return scale and degrees of freedom of the t distribution whose central 50 % and 95 % intervals are those of draws.

    A mean of few readings has a scaled and shifted t distribution (JCGM 101, 6.4.9), and its scale is the standard uncertainty
    of type A of the GUM (G.3.2). The intervals' ratio grows as the degrees of freedom become fewer, whatever the scale is.

    Args:
        draws: Draws of the quantity.

    Returns:
        Scale; degrees, at least 1, and infinite beyond `LARGEST_DEGREES` or where tails are no wider than normal ones.
    """
    low, first, third, high = np.quantile(draws, (0.025, 0.25, 0.75, 0.975))
    ratio = (high - low) / (third - first)
    if ratio <= _width_ratio(LARGEST_DEGREES):
        degrees = math.inf
    elif ratio >= _width_ratio(1.0):
        degrees = 1.0
    else:
        degrees = float(brentq(lambda degrees: _width_ratio(degrees) - ratio, 1.0, LARGEST_DEGREES))
    return float(high - low) / 2 / coverage_factor(degrees, 0.95), degrees


def _width_ratio(degrees: float) -> float:
    """Return the width of the central 95 % interval of a t distribution over that of its central 50 % interval."""
    return float(student.ppf(0.975, degrees) / student.ppf(0.75, degrees))


def symmetric_interval(draws: Vector, probability: float) -> tuple[float, float]:
    """Return the ends of the probabilistically symmetric coverage interval (JCGM 101, 7.7)."""
    low, high = (float(end) for end in np.quantile(draws, ((1 - probability) / 2, (1 + probability) / 2)))
    return low, high
