"""Readings of one table, each beside what everything else says of it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.display import Part
from bowdenfit.inference.predictive_checks import LooPredictive, Uniformity
from bowdenfit.inference.psis import RELIABLE_K
from bowdenfit.kinds.places import Places

_LEAST_FREEDOM = 5  # of the tails of a prediction by few readings, where priors tell something of the scatter too
FALSE_ALARM = 0.01  # chance that a healthy fit is said to have an outlier; the same for the other kinds of alarm


@dataclass(frozen=True, repr=False)
class CheckedReading(Part):
    """One reading beside its prediction from all the others.

    Args:
        table, label, unit: What it is.
        reading: The reading; the bound of one that is only known to be at most so.
        is_bound: Whether it is such a bound.
        expected, sd, q05, q95: Median, standard deviation and interval of the prediction.
        z: Deviation from it in standard deviations; NaN of a bound.
        probability: Where the reading lies in it, uniform between 0 and 1 if all is right.
        chance: Probability of a deviation as large.
        pareto_k: How far the fit leans on the reading.
        inside: Whether it was taken inside the range in which the curves hold.
        outlier: Whether it is so far out that chance does as much in one healthy fit of a hundred.
        decisive: Whether the fit would be a markedly different one without it.
    """

    table: str
    label: str
    unit: str
    reading: float
    is_bound: bool
    expected: float
    sd: float
    q05: float
    q95: float
    z: float
    probability: float
    chance: float
    pareto_k: float
    inside: bool
    outlier: bool
    decisive: bool

    JSON: ClassVar = (
        "table", "label", "unit", "at_most?", "measured?", "expected", "sd", "q05", "q95", "z", "probability", "chance",
        "pareto_k", "inside", "outlier", "decisive",
    )  # fmt: skip

    @property
    def at_most(self) -> float | None:
        """The bound, of a bound."""
        return self.reading if self.is_bound else None

    @property
    def measured(self) -> float | None:
        """The reading, of any other."""
        return None if self.is_bound else self.reading


@dataclass(frozen=True, repr=False)
class TableChecks(Part):
    """All readings of one table.

    Args:
        table: Name of the readings in results.
        unit: Their unit.
        labels: Each in words.
        reading: The readings; the bound of those that are only known to be at most so.
        at_most: Whether a reading is such a bound.
        predicted: Each reading's prediction without itself.
        places: Where each was taken.
        probability: Where each lies in its prediction, uniform between 0 and 1 if all is right.
        uniformity: Whether these are uniform; None of few readings.
        refitted: Which readings a fit without them predicts.
    """

    table: str
    unit: str
    labels: tuple[str, ...]
    reading: np.ndarray
    at_most: np.ndarray
    predicted: LooPredictive
    places: Places
    probability: np.ndarray
    uniformity: Uniformity | None
    refitted: np.ndarray

    JSON: ClassVar = ("table", ("readings", "measured"), "in_interval", "bounds", "uniform", "fault")

    @property
    def z_score(self) -> np.ndarray:
        """Deviations from the predictions in their standard deviations; NaN of a bound, 0 where there is none."""
        deviation = np.asarray(self.reading - self.predicted.mean, dtype=float)
        with np.errstate(divide="ignore"):
            z = np.divide(deviation, self.predicted.sd, out=np.zeros_like(deviation), where=deviation != 0)
        return np.where(self.at_most, np.nan, z)

    @property
    def decisive(self) -> np.ndarray:
        """Whether the fit leans on a reading so much that weights cannot leave it out."""
        return ~(self.predicted.pareto_k <= RELIABLE_K)

    @property
    def chance(self) -> np.ndarray:
        """Probability of a deviation as large, of each reading; where the weights fail, as if predictions were Student-t.

        Weights that lean on few draws leave much of the reading's own effect in its prediction, which is then too wide. The
        degrees of freedom are those of a scatter found from the other readings of the table, because a prediction by few
        readings has longer tails than a normal one: without them a healthy reading at 3.8 sds of twenty is an outlier.
        """
        from scipy.special import stdtr

        freedom = max(self.measured - 2, _LEAST_FREEDOM)
        t = np.abs(np.nan_to_num(self.z_score)) * np.sqrt(freedom / (freedom - 2))  # z is in sds of the prediction
        failed = self.decisive & ~self.refitted
        return np.where(failed, np.minimum(2 * stdtr(freedom, -t), self.predicted.tail), self.predicted.tail)

    def readings(self, among: int) -> list[CheckedReading]:
        """One by one.

        Args:
            among: Number of readings of all tables, of which the farthest counts as an outlier.
        """
        found, p = [], self.predicted
        z, chance, decisive = self.z_score, self.chance, self.decisive
        for i, (label, reading, bound) in enumerate(zip(self.labels, self.reading, self.at_most, strict=True)):
            found.append(
                CheckedReading(
                    self.table, label, self.unit, reading, bool(bound),
                    p.median[i], p.sd[i], p.q05[i], p.q95[i], z[i], self.probability[i], chance[i], p.pareto_k[i],
                    bool(self.places.inside[i]), bool(chance[i] * among < FALSE_ALARM), bool(decisive[i]),
                )
            )  # fmt: skip
        return found

    @property
    def measured(self) -> int:
        """Number of readings that are no bounds."""
        return int(np.sum(~self.at_most))

    @property
    def bounds(self) -> int:
        """Number of readings that are bounds."""
        return int(np.sum(self.at_most))

    @property
    def in_interval(self) -> int:
        """Number of measured readings that their 90 % intervals hold."""
        inside = (self.predicted.q05 <= self.reading) & (self.reading <= self.predicted.q95)
        return int(np.sum(inside & ~self.at_most))

    @property
    def uniform(self) -> bool | None:
        """Whether the readings scatter as predicted; None of few."""
        return None if self.uniformity is None else self.uniformity.holds

    @property
    def fault(self) -> str:
        """How else they scatter, in words; empty if they do not."""
        return "" if self.uniformity is None else self.uniformity.fault
