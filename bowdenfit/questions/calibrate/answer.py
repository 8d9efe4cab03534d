"""What many replications say: which intervals hold the truth as often as they claim, and which way others are wrong."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.questions.calibrate.replication import Replication
from bowdenfit.questions.calibrate.uniformity import UniformRanks, holm

LEVEL = 0.01  # at which a quantity is rejected, corrected for the number of quantities
INTERVALS = (0.5, 0.9)
MOST_UNCONVERGED = 0.1  # of all replications, beyond which the rest says little
FEWEST = 20  # replications to judge by
_CLEARLY = 3.0  # standard errors beyond which a bias is named


@dataclass(frozen=True)
class Coverage:
    """How often intervals held the truth.

    Args:
        probability: What they claim.
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
class Checked:
    """One quantity over all replications.

    Args:
        name: Its name.
        symbol: Its symbol in figures.
        ranks: Share of each posterior below the truth.
        p_value: Of uniform ranks.
        corrected: The same, corrected for the number of quantities.
        coverage: Of the central intervals.
        bias: Mean of (posterior mean less truth) in posterior standard deviations.
        bias_error: Its standard error.
        shrinkage: 1 less the mean posterior variance over the prior variance: 0 where the data say nothing.
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

    JSON: ClassVar = (..., "is_calibrated", "fault")

    @property
    def is_calibrated(self) -> bool:
        """Whether its ranks are uniform and its intervals hold the truth as often as they claim."""
        return self.corrected >= LEVEL and all(each.within for each in self.coverage)

    @property
    def fault(self) -> str:
        """Which way it is wrong, in words; empty if it is not."""
        if self.is_calibrated:
            return ""
        widest = self.coverage[-1]
        faults = []
        if not np.isnan(self.bias) and abs(self.bias) > _CLEARLY * self.bias_error:
            faults.append(f"estimated too {'high' if self.bias > 0 else 'low'}")
        if any(each.rate < each.low for each in self.coverage):
            faults.append(
                f"intervals too narrow ({widest.rate:.0%} of the {widest.probability:.0%} intervals hold the truth)"
            )
        elif any(each.rate > each.high for each in self.coverage):
            faults.append(
                f"intervals too wide ({widest.rate:.0%} of the {widest.probability:.0%} intervals hold the truth)"
            )
        return " and ".join(faults) or "ranks are not uniform"


@dataclass(frozen=True)
class Calibration:
    """What a calibration found.

    Args:
        name: Name of the cable.
        assumed: What was assumed of it in the fits against what was stated; empty of a calibration proper.
        seed: Seed.
        replications: How many were made.
        quantities: What was ranked.
        unconverged: Replications whose draws could not be trusted, with why; they are not ranked.
        redrawn: Why tables were drawn again, with how many were.
        seconds: Median time of a replication.
    """

    name: str
    assumed: tuple[str, ...]
    seed: int
    replications: int
    quantities: tuple[Checked, ...]
    unconverged: dict[int, str]
    redrawn: dict[str, int]
    seconds: float

    level: ClassVar = LEVEL
    JSON: ClassVar = (..., "is_calibrated", "ranked", "level")

    @property
    def ranked(self) -> int:
        """How many replications were ranked."""
        return self.replications - len(self.unconverged)

    @property
    def faults(self) -> dict[str, str]:
        """What is wrong with which quantity."""
        return {q.name: q.fault for q in self.quantities if not q.is_calibrated}

    @property
    def is_judged(self) -> bool:
        """Whether enough replications converged to say anything."""
        return self.ranked >= FEWEST and len(self.unconverged) <= MOST_UNCONVERGED * self.replications

    @property
    def is_calibrated(self) -> bool:
        """Whether every quantity is."""
        return self.is_judged and not self.faults


def findings(
    replications: Sequence[Replication],
    symbols: Mapping[str, str],
    *,
    name: str = "",
    assumed: tuple[str, ...] = (),
    seed: int = 0,
) -> Calibration:
    """What replications say.

    Args:
        replications: Any number, in any order.
        symbols: Symbol of each quantity; those without one are shown by name.
        name: Name of the cable.
        assumed: What was assumed in the fits.
        seed: Seed of the replications.
    """
    replications = sorted(replications, key=lambda r: r.number)
    good = [r for r in replications if not r.reasons]
    names = list(good[0].ranked) if good else []
    by_chance = UniformRanks(len(good))
    ranks = [np.array([r.ranked[q].rank for r in good]) for q in names]
    p_values = [by_chance.p_value(r) for r in ranks]
    quantities = tuple(
        _check_quantity(q, symbols.get(q, q), r, (p, c), len(names), good)
        for q, r, p, c in zip(names, ranks, p_values, holm(p_values), strict=True)
    )
    redrawn: Counter[str] = Counter()
    for each in replications:
        redrawn.update(each.redrawn)
    unconverged = {r.number: r.reasons[0] for r in replications if r.reasons}
    seconds = float(np.median([r.seconds for r in replications])) if replications else float("nan")
    return Calibration(name, assumed, seed, len(replications), quantities, unconverged, dict(redrawn), seconds)


def _check_quantity(
    name: str, symbol: str, ranks: np.ndarray, p: tuple[float, float], n_quantities: int, good: Sequence[Replication]
) -> Checked:
    found = [r.ranked[name] for r in good]
    truth, mean, sd = (np.array([getattr(each, what) for each in found]) for what in ("truth", "mean", "sd"))
    known = sd > 0  # an optimum at the same end in every draw has no spread
    deviation = (mean - truth)[known] / sd[known]
    n = max(len(deviation), 1)
    bias, error = (float(deviation.mean()), float(deviation.std() / np.sqrt(n))) if known.any() else (np.nan, np.nan)
    # The prior of z is the standard normal; that of the optimum is what was drawn.
    prior = float(np.var(truth)) if name.startswith("optimal_") else 1.0
    shrinkage = 1 - float(np.mean(sd**2)) / prior if prior > 0 else float("nan")
    coverage = tuple(_coverage(ranks, probability, n_quantities) for probability in INTERVALS)
    return Checked(name, symbol, tuple(ranks.tolist()), *p, coverage, bias, error, shrinkage)


def _coverage(ranks: np.ndarray, probability: float, n_quantities: int) -> Coverage:
    from scipy import stats

    n, tail = len(ranks), LEVEL / (2 * len(INTERVALS) * n_quantities)
    held = np.abs(ranks - 0.5) < probability / 2
    low, high = (float(stats.binom.ppf(t, n, probability)) / n for t in (tail, 1 - tail))
    return Coverage(probability, float(held.mean()), low, high)
