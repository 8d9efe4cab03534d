"""Readings of one table beside their leave-one-out predictions."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.special import stdtr

from bowdenfit.inference.predictive_checks import LooPredictive, Uniformity
from bowdenfit.inference.psis import RELIABLE_K
from bowdenfit.kinds import find_readings
from bowdenfit.kinds.covariates import Covariates

_MIN_DEGREES_OF_FREEDOM = 5  # for the tails of a prediction by few readings; a judgement: priors limit the scatter too
FALSE_ALARM = 0.01  # chosen: share of healthy fits that are said to have an outlier; the same for the other alarms


@dataclass(frozen=True)
class CheckedReading:
    """One reading beside its prediction from all the others.

    Args:
        table, label, unit: What it is.
        reading: The reading; the bound of one that is only known to be at most so.
        is_bound: Whether it is such a bound.
        expected, sd, q05, q95: Median, standard deviation and interval of the prediction.
        z: Deviation from it in standard deviations; NaN of a bound.
        probability: Where the reading lies in it, uniform between 0 and 1 if all is right.
        p_value: Probability of a deviation as large.
        pareto_k: Pareto k of the leave-one-out weights; above 0.7 the reading is influential.
        inside: Whether it was taken inside the range in which the curves hold.
        outlier: Whether it is so far out that only one healthy fit in a hundred has such a reading.
        influential: Whether the fit would change markedly without it.
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
    p_value: float
    pareto_k: float
    inside: bool
    outlier: bool
    influential: bool

    JSON: ClassVar = (
        "table", "label", "unit", "at_most?", "measured?", "expected", "sd", "q05", "q95", "z", "probability",
        "p_value", "pareto_k", "inside", "outlier", ("decisive", "influential"),
    )  # fmt: skip

    @property
    def at_most(self) -> float | None:
        """The bound, of a bound."""
        return self.reading if self.is_bound else None

    @property
    def measured(self) -> float | None:
        """The reading, of any other."""
        return None if self.is_bound else self.reading


@dataclass(frozen=True)
class TableChecks:
    """All readings of one table.

    Args:
        table: Name of the readings in results.
        unit: Their unit.
        labels: Each in words.
        reading: The readings; the bound of those that are only known to be at most so.
        at_most: Whether a reading is such a bound.
        predicted: Each reading's prediction without itself.
        positions: Where each was taken.
        pit: Where each lies in its prediction (probability integral transform), uniform if the model is right.
        uniformity: Whether these are uniform; None of few readings.
        refitted: Which readings a fit without them predicts.
    """

    table: str
    unit: str
    labels: tuple[str, ...]
    reading: np.ndarray
    at_most: np.ndarray
    predicted: LooPredictive
    positions: Covariates
    pit: np.ndarray
    uniformity: Uniformity | None
    refitted: np.ndarray

    JSON: ClassVar = (
        "table",
        ("readings", "measured"),
        "in_interval",
        "bounds",
        ("uniform", "is_uniform"),
        ("fault", "misfit"),
    )

    @property
    def words(self) -> str:
        """The readings in words, such as "efficiencies"."""
        return find_readings(self.table).words

    @property
    def z_score(self) -> np.ndarray:
        """Deviations from the predictions in their standard deviations; NaN of a bound, 0 where there is none."""
        deviation = np.asarray(self.reading - self.predicted.mean, dtype=float)
        with np.errstate(divide="ignore"):
            z = np.divide(deviation, self.predicted.sd, out=np.zeros_like(deviation), where=deviation != 0)
        return np.where(self.at_most, np.nan, z)

    @property
    def influential(self) -> np.ndarray:
        """Mask of readings so influential that importance weights cannot leave them out."""
        return ~(self.predicted.pareto_k <= RELIABLE_K)

    @property
    def p_values(self) -> np.ndarray:
        """Return the p value of each deviation; where the weights fail, by a Student-t prediction.

        Weights that rest on few draws leave much of the reading's own effect in its prediction, which is then too wide. The
        degrees of freedom are those of a scatter found from the other readings of the table, because a prediction by few
        readings has longer tails than a normal one: without them a healthy reading at 3.8 sds of twenty is an outlier.
        """
        dof = max(self.measured - 2, _MIN_DEGREES_OF_FREEDOM)
        t = np.abs(np.nan_to_num(self.z_score)) * np.sqrt(dof / (dof - 2))  # z is in sds of the prediction
        unreliable = self.influential & ~self.refitted
        return np.where(unreliable, np.minimum(2 * stdtr(dof, -t), self.predicted.tail), self.predicted.tail)

    def readings(self, n_total: int) -> list[CheckedReading]:
        """Return the readings one by one.

        Args:
            n_total: Number of readings of all tables, by which p values are multiplied (Bonferroni).
        """
        readings, p = [], self.predicted
        z, p_values, influential = self.z_score, self.p_values, self.influential
        for i, (label, reading, bound) in enumerate(zip(self.labels, self.reading, self.at_most, strict=True)):
            readings.append(
                CheckedReading(
                    self.table, label, self.unit, reading, bool(bound),
                    p.median[i], p.sd[i], p.q05[i], p.q95[i], z[i], self.pit[i], p_values[i], p.pareto_k[i],
                    bool(self.positions.inside[i]), bool(p_values[i] * n_total < FALSE_ALARM), bool(influential[i]),
                )
            )  # fmt: skip
        return readings

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
    def is_uniform(self) -> bool | None:
        """Whether the readings scatter as predicted; None for few readings."""
        return None if self.uniformity is None else self.uniformity.holds

    @property
    def misfit(self) -> str:
        """How the readings scatter differently, in words; empty if they scatter as predicted."""
        return "" if self.uniformity is None else self.uniformity.fault
