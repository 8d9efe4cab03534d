"""The answer of a calibration: which intervals contain the truth as often as they claim, and which way others are wrong."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from bowdenfit.display import Display, Rows
from bowdenfit.words import percent

LEVEL = 0.01  # at which a quantity is rejected, Holm-corrected: 1 calibration in 100 of a right tool fails by chance
INTERVALS = (0.5, 0.9)
MAX_UNCONVERGED = 0.1  # share of all replications, beyond which the others say little; a judgement
MIN_REPLICATIONS = 20  # to judge by; a judgement, see `Power` for what so few can see
_BIAS_ERRORS = 3.0  # standard errors beyond which a bias is named: 1 unbiased quantity in 370


@dataclass(frozen=True)
class QuantityLabel:
    """A quantity that may be ranked.

    Args:
        symbol: Its symbol in figures.
        is_answer: Whether it is what a fit is made for, a coefficient or the optimum, and no noise scale or the like.
        meaning: Meaning in words.
    """

    symbol: str
    is_answer: bool = True
    meaning: str = ""


@dataclass(frozen=True)
class Coverage:
    """Share of intervals that held the truth.

    Args:
        probability: Claimed probability of the intervals.
        rate: How often they did.
        low, high: Rates between which chance keeps all quantities of a calibrated tool with probability 99 %.
    """

    probability: float
    rate: float
    low: float
    high: float

    @property
    def within(self) -> bool:
        """Whether the rate is what chance gives."""
        return self.low <= self.rate <= self.high


@dataclass(frozen=True)
class CheckedQuantity:
    """One quantity over all replications.

    Args:
        name: Its name.
        symbol: Its symbol in figures.
        ranks: Share of each posterior below the truth.
        p_value: p-value of uniform ranks.
        corrected: The same, corrected for the number of quantities.
        coverage: Coverage of the central intervals.
        bias: Mean of (posterior mean less truth) in posterior standard deviations.
        bias_error: Its standard error.
        shrinkage: 1 less the mean posterior variance over the prior variance: 0 where the data say nothing; NaN where truths
            are not of the prior.
        judged_by: "ranks and coverage", or "coverage" where truths are not of the prior; empty where the verdict does not
            look at it.
        meaning: Meaning in words.
    """

    name: str
    symbol: str
    ranks: tuple[float, ...]
    p_value: float
    corrected: float
    coverage: tuple[Coverage, ...]
    bias: float
    bias_error: float
    shrinkage: float
    judged_by: str = "ranks and coverage"
    meaning: str = ""

    JSON: ClassVar = (..., "is_calibrated", "fault")

    @property
    def is_calibrated(self) -> bool:
        """Whether its ranks are uniform and its intervals contain the truth as often as they claim, as far as it is judged."""
        if not self.judged_by:
            return True
        return (self.corrected >= LEVEL or self.judged_by == "coverage") and all(e.within for e in self.coverage)

    @property
    def fault(self) -> str:
        """Which way it is wrong, in words; empty if it is not."""
        if self.is_calibrated:
            return ""
        widest = self.coverage[-1]
        faults = []
        if not np.isnan(self.bias) and abs(self.bias) > _BIAS_ERRORS * self.bias_error:
            faults.append(f"estimated too {'high' if self.bias > 0 else 'low'}")
        if any(interval.rate < interval.low for interval in self.coverage):
            faults.append(
                f"intervals too narrow ({percent(widest.rate, 0)} of the {percent(widest.probability, 0)} intervals contain "
                "the true value)"
            )
        elif any(interval.rate > interval.high for interval in self.coverage):
            faults.append(
                f"intervals too wide ({percent(widest.rate, 0)} of the {percent(widest.probability, 0)} intervals contain the "
                "true value)"
            )
        return " and ".join(faults) or "ranks are not uniform"


@dataclass(frozen=True)
class Power:
    """Probability that a calibration rejects one quantity whose intervals are too narrow, all others being right.

    Args:
        too_small: Share by which its posterior standard deviation is too small.
        caught: Probability, to 0.02 or so.
    """

    too_small: float
    caught: float


@dataclass(frozen=True, repr=False)
class Calibration(Display):
    """Result of a calibration.

    Args:
        name: Name of the cable.
        assumed: What was assumed of it in the fits against what was stated; empty of a calibration proper.
        seed: Seed.
        replications: How many were made.
        quantities: Quantities that were ranked.
        unconverged: Replications whose draws could not be trusted, with why; they are not ranked.
        redrawn: Why tables were drawn again, with how many were.
        seconds: Median time of a replication.
        truths: True values that did not come from the priors, in words.
        engines: Number of replications fitted by each engine.
        power: Power of so many replications for one quantity.
        faults_with_all: What would be wrong with which quantity if replications whose draws could not be trusted were ranked
            too, by the draws there are.
    """

    name: str
    assumed: tuple[str, ...]
    seed: int
    replications: int
    quantities: tuple[CheckedQuantity, ...]
    unconverged: dict[int, str]
    redrawn: dict[str, int]
    seconds: float
    truths: tuple[str, ...] = ()
    engines: dict[str, int] = field(default_factory=dict)
    power: tuple[Power, ...] = ()
    faults_with_all: dict[str, str] = field(default_factory=dict)

    level: ClassVar = LEVEL
    JSON: ClassVar = (..., "is_calibrated", "ranked", "level")

    def _table(self) -> Rows:
        rows = [
            {"quantity": q.name} | {f"held_{100 * c.probability:.0f}": c.rate for c in q.coverage}
            | {"bias": q.bias, "bias_error": q.bias_error, "p_value": q.p_value, "corrected": q.corrected}
            | {"shrinkage": q.shrinkage, "fault": q.fault}
            for q in self.quantities
        ]  # fmt: skip
        return rows, {name: "1" for row in rows for name, value in row.items() if isinstance(value, float)}

    @property
    def ranked(self) -> int:
        """How many replications were ranked."""
        return self.replications - len(self.unconverged)

    @property
    def faults(self) -> dict[str, str]:
        """What is wrong with which quantity."""
        return {q.name: q.fault for q in self.quantities if not q.is_calibrated}

    @property
    def is_conclusive(self) -> bool:
        """Whether enough replications converged to say anything."""
        return self.ranked >= MIN_REPLICATIONS and len(self.unconverged) <= MAX_UNCONVERGED * self.replications

    @property
    def is_calibrated(self) -> bool:
        """Whether every quantity is."""
        return self.is_conclusive and not self.faults
