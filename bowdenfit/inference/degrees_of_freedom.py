"""Degrees of freedom of a quantity by the shape of its draws, and the coverage factor of a t distribution.

References:
    JCGM 100:2008, Guide to the expression of uncertainty in measurement (GUM).
    JCGM 101:2008, Supplement 1 to the GUM: propagation of distributions using a Monte Carlo method.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri, stdtrit

from bowdenfit.types import Vector

# Degrees of freedom from which on the shape of some thousand draws does not differ from a normal one by more than it scatters
# (the ratio of widths below by 2 %). A judgement.
LARGEST_DEGREES = 50.0
_DEGREES = np.geomspace(1.0, LARGEST_DEGREES, 500)  # between which degrees are interpolated, to a part in thousands


def coverage_factor(degrees: float, probability: float) -> float:
    """Return the coverage factor of a t distribution (GUM G.3.2 and G.6.4).

    Args:
        degrees: Effective degrees of freedom, at least 1; between whole numbers, t is interpolated (G.4.1).
        probability: Coverage probability of the interval.
    """
    end = (1 + probability) / 2
    return float(ndtri(end) if math.isinf(degrees) else stdtrit(degrees, end))


def effective_degrees_of_freedom(standard: Sequence[float], degrees: Sequence[float]) -> float:
    """Return the effective degrees of freedom by the Welch-Satterthwaite formula (GUM G.4.1, equation G.2b).

    Args:
        standard: Contributions to the standard uncertainty, independent of each other [unit of the result].
        degrees: Degrees of freedom of each; infinite for limits that are taken as known (GUM G.4.3).
    """
    spread = sum(u**4 / freedom for u, freedom in zip(standard, degrees, strict=True))
    return sum(u**2 for u in standard) ** 2 / spread if spread > 0 else math.inf


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
    ratio = (high - low) / (third - first) if third > first else 0.0
    width_ratios = stdtrit(_DEGREES, 0.975) / stdtrit(_DEGREES, 0.75)  # of a central 95 % interval to a 50 % one: they fall
    degrees = float(np.interp(-ratio, -width_ratios, _DEGREES, right=math.inf))
    return float(high - low) / 2 / coverage_factor(degrees, 0.95), degrees
