"""Tests of the ranks of truths: whether they are uniform, how often intervals hold the truth, and the power of both.

References:
    Saeilynoja, Buerkner & Vehtari 2022, "Graphical test for discrete uniformity and its applications in goodness-of-fit
    evaluation and multiple sample comparison" (Statistics and Computing 32).
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import special, stats

from bowdenfit.multiple_testing import adjust_p_values
from bowdenfit.questions.calibrate.answer import (
    INTERVALS,
    LEVEL,
    Calibration,
    CheckedQuantity,
    Coverage,
    Power,
    QuantityLabel,
)
from bowdenfit.questions.calibrate.replications import Replication

TOO_SMALL = (0.1, 0.2, 0.3)  # shares by which a posterior standard deviation is too small, as examples
_POWER_CALIBRATIONS = 500  # simulated; the standard error of a probability is then 0.022 at most
_POWER_SEED = 20_220_729
N_INTERVALS = 50  # between the places where the distribution function is looked at; a judgement
_NULL_SAMPLES = 20_000  # simulated; a p-value of 0.0001 is then two of them
_NULL_SEED = 20_220_728


def summarize_replications(
    replications: Sequence[Replication],
    quantities: Mapping[str, QuantityLabel],
    *,
    name: str = "",
    assumed: tuple[str, ...] = (),
    truths: tuple[str, ...] = (),
    seed: int = 0,
) -> Calibration:
    """Return what replications say of every quantity.

    Args:
        replications: Any number, in any order.
        quantities: Label of each quantity; others are shown by name.
        name: Name of the cable.
        assumed: Assumptions of the fits.
        truths: True values that did not come from the priors, in words.
        seed: Seed of the replications.
    """
    replications = sorted(replications, key=lambda r: r.number)
    converged = [r for r in replications if not r.reasons]
    descriptions = {q: quantities.get(q, QuantityLabel(q)) for q in (converged[0].ranked if converged else ())}
    criterion = "coverage" if truths else "ranks and coverage"
    judged_by = {q: criterion if label.is_answer or not truths else "" for q, label in descriptions.items()}
    n_judged = sum(map(bool, judged_by.values()))
    checked = _check_all(descriptions, judged_by, converged)
    sampled = [r for r in replications if r.ranked]
    checked_with_all = checked if len(sampled) == len(converged) else _check_all(descriptions, judged_by, sampled)
    redrawn: Counter[str] = Counter()
    for replication in replications:
        redrawn.update(replication.redrawn)
    unconverged = {r.number: r.reasons[0] for r in replications if r.reasons}
    seconds = float(np.median([r.seconds for r in replications])) if replications else float("nan")
    engines = Counter(r.engine for r in converged if r.engine)
    bands = {claimed: _chance_band(len(converged), claimed, n_judged) for claimed in INTERVALS} if checked else {}
    power = estimate_power(len(converged), LEVEL / n_judged, bands, not truths) if checked else ()
    summary = len(replications), checked, unconverged, dict(redrawn), seconds
    wrong_with_all = {q.name: q.fault for q in checked_with_all if not q.is_calibrated}
    return Calibration(name, assumed, seed, *summary, truths, dict(engines.most_common()), power, wrong_with_all)


def _check_all(
    descriptions: Mapping[str, QuantityLabel], judged_by: Mapping[str, str], replications: Sequence[Replication]
) -> tuple[CheckedQuantity, ...]:
    """Test every quantity over the same replications."""
    n_judged = sum(map(bool, judged_by.values()))
    ranks = [np.array([r.ranked[q].rank for r in replications]) for q in descriptions]
    p_values = [UniformRanks(len(replications)).p_value(r) for r in ranks]
    return tuple(
        replace(
            _check_quantity(q, descriptions[q].symbol, r, (p, c), n_judged, judged_by[q], replications),
            meaning=descriptions[q].meaning,
        )
        for q, r, p, c in zip(descriptions, ranks, p_values, adjust_p_values(p_values).tolist(), strict=True)
    )


def _check_quantity(
    name: str,
    symbol: str,
    ranks: np.ndarray,
    p: tuple[float, float],
    n_judged: int,
    judged_by: str,
    replications: Sequence[Replication],
) -> CheckedQuantity:
    ranked_truths = [r.ranked[name] for r in replications]
    truth, mean, sd = (
        np.array([getattr(ranked_truth, moment) for ranked_truth in ranked_truths]) for moment in ("truth", "mean", "sd")
    )
    usable = (sd > 0) & np.isfinite(truth)  # an optimum at the same end in every draw has no spread
    deviation = (mean - truth)[usable] / sd[usable]
    n = max(len(deviation), 1)
    bias, error = (float(deviation.mean()), float(deviation.std() / np.sqrt(n))) if usable.any() else (np.nan, np.nan)
    # The prior of z is the standard normal; that of the optimum is what was drawn.
    prior = float(np.var(truth)) if name.startswith("optimal_") else 1.0
    has_prior_variance = prior > 0 and judged_by == CheckedQuantity.judged_by
    shrinkage = 1 - float(np.mean(sd**2)) / prior if has_prior_variance else float("nan")
    coverage = tuple(_measure_coverage(ranks, probability, n_judged) for probability in INTERVALS)
    return CheckedQuantity(name, symbol, tuple(ranks.tolist()), *p, coverage, bias, error, shrinkage, judged_by)


def _measure_coverage(ranks: np.ndarray, probability: float, n_judged: int) -> Coverage:
    contains_truth = np.abs(ranks - 0.5) < probability / 2
    return Coverage(probability, float(contains_truth.mean()), *_chance_band(len(ranks), probability, n_judged))


def _chance_band(n: int, probability: float, n_judged: int) -> tuple[float, float]:
    """Return rates between which chance keeps the intervals of all quantities that are judged."""
    tail = LEVEL / (2 * len(INTERVALS) * n_judged)
    low, high = (float(stats.binom.ppf(t, n, probability)) / n for t in (tail, 1 - tail))
    return low, high


def estimate_power(n: int, level: float, bands: dict[float, tuple[float, float]], by_ranks: bool) -> tuple[Power, ...]:
    """Return the power of a calibration, by simulation of normal posteriors.

    Args:
        n: Replications.
        level: P value of the ranks of one quantity below which it is rejected.
        bands: Rates of intervals that are allowed, by what these claim.
        by_ranks: Whether ranks are judged too.
    """
    errors = np.random.default_rng(_POWER_SEED).standard_normal((_POWER_CALIBRATIONS, n))
    uniform, powers = UniformRanks(n), []
    for too_small in TOO_SMALL:
        ranks = special.ndtr(errors / (1 - too_small))
        rates = {claimed: np.mean(np.abs(ranks - 0.5) < claimed / 2, axis=1) for claimed in bands}
        caught = np.any(
            [(rates[claimed] < low) | (rates[claimed] > high) for claimed, (low, high) in bands.items()], axis=0
        )
        if by_ranks:
            caught |= np.array([uniform.p_value(row) < level for row in ranks])
        powers.append(Power(too_small, float(caught.mean())))
    return tuple(powers)


@dataclass(frozen=True)
class UniformRanks:
    """Distribution of the distribution function of n uniform ranks.

    The statistic of a sample is the smallest two-sided binomial probability of its distribution function over all places;
    how small that gets by chance is simulated, and gives bands and p values that agree with each other.

    Args:
        n: Number of ranks.
    """

    n: int

    @property
    def positions(self) -> np.ndarray:
        """Ranks at which the distribution function is looked at."""
        return np.arange(1, N_INTERVALS) / N_INTERVALS

    @cached_property
    def _two_sided_probability(self) -> np.ndarray:
        """Two-sided binomial probability by number of ranks below a place, and place."""
        counts = np.arange(self.n + 1)[:, None]
        below, above = (f(counts, self.n, self.positions) for f in (stats.binom.cdf, stats.binom.sf))
        return np.minimum(1.0, 2 * np.minimum(below, above + stats.binom.pmf(counts, self.n, self.positions)))

    @cached_property
    def _null_statistics(self) -> np.ndarray:
        """The statistic of uniform samples, in growing order."""
        generator = np.random.default_rng(_NULL_SEED)
        samples = generator.multinomial(self.n, np.full(N_INTERVALS, 1 / N_INTERVALS), size=_NULL_SAMPLES)
        counts = samples[:, :-1].cumsum(axis=1)
        return np.sort(self._two_sided_probability[counts, np.arange(N_INTERVALS - 1)].min(axis=1))

    def p_value(self, ranks: np.ndarray) -> float:
        """Return the probability that uniform ranks are as far from uniform as these."""
        counts = self.count_below(ranks)
        statistic = self._two_sided_probability[counts, np.arange(N_INTERVALS - 1)].min()
        return float((1 + np.searchsorted(self._null_statistics, statistic, side="right")) / (1 + _NULL_SAMPLES))

    def count_below(self, ranks: np.ndarray) -> np.ndarray:
        """Count the ranks at or below each place."""
        return np.searchsorted(np.sort(ranks), self.positions, side="right")

    def band(self, probability: float) -> tuple[np.ndarray, np.ndarray]:
        """Return a lower and an upper distribution function that hold that of uniform ranks with a probability."""
        gamma = float(np.quantile(self._null_statistics, 1 - probability))
        ends = (stats.binom.ppf(tail, self.n, self.positions) / self.n for tail in (gamma / 2, 1 - gamma / 2))
        low, high = ends
        return low, high
