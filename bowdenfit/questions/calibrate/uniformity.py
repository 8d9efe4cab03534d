"""Are ranks uniform? Simultaneous bands of their distribution function, and p values that go with them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

N_INTERVALS = 50  # where the distribution function is looked at
_SIMULATED = 20_000
_SEED = 20_220_728


@dataclass(frozen=True)
class UniformRanks:
    """What the distribution function of n uniform ranks looks like.

    The statistic of a sample is the smallest two-sided binomial probability of its distribution function over all places;
    how small that gets by chance is simulated, and gives bands and p values that agree with each other.

    Args:
        n: Number of ranks.

    References:
        Saeilynoja, Buerkner & Vehtari 2022, "Graphical test for discrete uniformity and its applications in goodness-of-fit
        evaluation and multiple sample comparison" (Statistics and Computing 32).
    """

    n: int

    @property
    def positions(self) -> np.ndarray:
        """Ranks at which the distribution function is looked at."""
        return np.arange(1, N_INTERVALS) / N_INTERVALS

    @cached_property
    def _two_sided_probability(self) -> np.ndarray:
        """Two-sided binomial probability by number of ranks below a place, and place."""
        from scipy import stats

        counts = np.arange(self.n + 1)[:, None]
        below, above = (f(counts, self.n, self.positions) for f in (stats.binom.cdf, stats.binom.sf))
        return np.minimum(1.0, 2 * np.minimum(below, above + stats.binom.pmf(counts, self.n, self.positions)))

    @cached_property
    def _null_statistics(self) -> np.ndarray:
        """The statistic of uniform samples, in growing order."""
        generator = np.random.default_rng(_SEED)
        counts = generator.multinomial(self.n, np.full(N_INTERVALS, 1 / N_INTERVALS), size=_SIMULATED)[:, :-1].cumsum(axis=1)
        return np.sort(self._two_sided_probability[counts, np.arange(N_INTERVALS - 1)].min(axis=1))

    def p_value(self, ranks: np.ndarray) -> float:
        """Probability that uniform ranks are as far from uniform as these."""
        counts = self.count_below(ranks)
        statistic = self._two_sided_probability[counts, np.arange(N_INTERVALS - 1)].min()
        return float((1 + np.searchsorted(self._null_statistics, statistic, side="right")) / (1 + _SIMULATED))

    def count_below(self, ranks: np.ndarray) -> np.ndarray:
        """How many ranks are at or below each place."""
        return np.searchsorted(np.sort(ranks), self.positions, side="right")

    def band(self, probability: float) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest distribution function at each place, which hold that of uniform ranks with a probability."""
        from scipy import stats

        gamma = float(np.quantile(self._null_statistics, 1 - probability))
        ends = (stats.binom.ppf(tail, self.n, self.positions) / self.n for tail in (gamma / 2, 1 - gamma / 2))
        low, high = ends
        return low, high
