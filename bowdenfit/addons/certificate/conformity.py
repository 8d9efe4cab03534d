"""Conformity of a measured quantity with a stated limit, and the risks of the decision.

References:
    JCGM 106:2012, The role of measurement uncertainty in conformity assessment.
    ILAC-G8:09/2019, Guidelines on decision rules and statements of conformity, 4.2.3.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from scipy.special import ndtr
from scipy.stats import norm

from bowdenfit.errors import DescriptionError
from bowdenfit.types import Vector

Decision: TypeAlias = Literal["pass", "conditional pass", "conditional fail", "fail"]
DECISION_WORDS: dict[Decision, str] = {
    "pass": "conforms",
    "conditional pass": "conforms, but lies inside the guard band",
    "conditional fail": "does not conform, but lies inside the guard band",
    "fail": "does not conform",
}
_FAR = 10.0  # standard deviations beyond which a normal distribution has nothing left
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)


@dataclass(frozen=True)
class ToleranceInterval:
    """Permissible values of a quantity (JCGM 106, 3.3.5), or measured values that are accepted (3.3.9).

    Args:
        lower: Lower limit; minus infinity where there is none.
        upper: Upper limit; infinity where there is none.
    """

    lower: float = -math.inf
    upper: float = math.inf

    def __contains__(self, value: float) -> bool:
        return self.lower <= value <= self.upper

    def narrowed(self, by: float) -> "ToleranceInterval":
        """Return the interval without a guard band at each limit; with a negative one, it is wider."""
        return ToleranceInterval(self.lower + by, self.upper - by)


@dataclass(frozen=True)
class ConformityStatement:
    """Whether a quantity conforms with its limits, by which rule, and how likely that is wrong.

    Args:
        quantity: Name of the quantity.
        tolerance: The limits.
        acceptance: Where the decision rule accepts.
        guard_band: Width of the guard band, in the unit of the quantity.
        decision: The decision.
        probability: Probability that the quantity conforms (JCGM 106, 3.3.7), given everything that was measured.
        consumer_risk: Specific risk of the consumer: that the quantity does not conform, if it is accepted (3.3.13).
        producer_risk: Specific risk of the producer: that the quantity conforms, if it is rejected (3.3.14).
        global_risks: Risks of consumer and producer over a production (3.3.15, 3.3.16); None where none is stated.
        source: Where the limits come from.
    """

    quantity: str
    tolerance: ToleranceInterval
    acceptance: ToleranceInterval
    guard_band: float
    decision: Decision
    probability: float
    consumer_risk: float
    producer_risk: float
    global_risks: tuple[float, float] | None
    source: str


def conformance_probability(draws: Vector, tolerance: ToleranceInterval) -> float:
    """Return the probability that a quantity lies within its limits, from its draws (JCGM 106, 7)."""
    return float(np.mean((draws >= tolerance.lower) & (draws <= tolerance.upper)))


def decide(value: float, tolerance: ToleranceInterval, guard_band: float) -> Decision:
    """Return the decision on a measured value: guarded acceptance and guarded rejection (JCGM 106, 8.3).

    Args:
        value: Measured value.
        tolerance: Permissible values.
        guard_band: Width of the guard band; 0 is simple acceptance.
    """
    if value in tolerance:
        return "pass" if value in tolerance.narrowed(guard_band) else "conditional pass"
    return "conditional fail" if value in tolerance.narrowed(-guard_band) and guard_band else "fail"


def refuse_empty_acceptance(quantity: str, tolerance: ToleranceInterval, guard_band: float) -> ToleranceInterval:
    """Return where a decision rule accepts.

    Raises:
        DescriptionError: The guard bands leave nothing between the limits.
    """
    acceptance = tolerance.narrowed(guard_band)
    if acceptance.lower > acceptance.upper:
        raise DescriptionError(
            f"the limits of {quantity} are {tolerance.upper - tolerance.lower:.3g} apart, less than twice the guard band of "
            f"{guard_band:.3g}, so that no value could be accepted; measure more accurately, or agree on a smaller guard_band "
            "with the customer (0 for simple acceptance)."
        )
    return acceptance


def global_risks(
    density: Callable[[Vector], Vector],
    support: tuple[float, float],
    tolerance: ToleranceInterval,
    acceptance: ToleranceInterval,
    standard_uncertainty: float,
) -> tuple[float, float]:
    """Return the global risks of consumer and producer (JCGM 106, 9.5).

    Args:
        density: Probability density of the quantity over a production.
        support: Where it is not 0.
        tolerance: Permissible values.
        acceptance: Measured values that are accepted.
        standard_uncertainty: Of a measurement, which is normal about the value of the item.

    Returns:
        Probability that an item does not conform and is accepted, and that it conforms and is rejected.
    """
    reach = 8 * standard_uncertainty
    edges = [
        tolerance.lower,
        tolerance.upper,
        *(end + side for end in vars(acceptance).values() for side in (-reach, 0, reach)),
    ]
    ends = np.unique(np.clip([*support, *edges], *support))
    half, middle = np.diff(ends)[:, None] / 2, (ends[1:] + ends[:-1])[:, None] / 2
    values, weights = middle + half * _NODES, half * _WEIGHTS
    upper, lower = (ndtr((end - values) / standard_uncertainty) for end in (acceptance.upper, acceptance.lower))
    accepted, mass = upper - lower, weights * density(values)
    conforms = (values >= tolerance.lower) & (values <= tolerance.upper)
    return float(np.sum(mass * accepted * ~conforms)), float(np.sum(mass * (1 - accepted) * conforms))


def normal_production(mean: float, sd: float) -> tuple[Callable[[Vector], Vector], tuple[float, float]]:
    """Return density and support of a quantity that is normal over a production."""
    return norm(mean, sd).pdf, (mean - _FAR * sd, mean + _FAR * sd)
