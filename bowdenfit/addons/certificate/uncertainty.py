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

from bowdenfit.types import Vector


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


def symmetric_interval(draws: Vector, probability: float) -> tuple[float, float]:
    """Return the ends of the probabilistically symmetric coverage interval (JCGM 101, 7.7)."""
    low, high = (float(end) for end in np.quantile(draws, ((1 - probability) / 2, (1 + probability) / 2)))
    return low, high
