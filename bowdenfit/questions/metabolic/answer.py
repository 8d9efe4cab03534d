"""What a study of metabolic cost shows, and what it does not."""

import math
from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar

import numpy as np

from bowdenfit.display import Display, Part, Rows
from bowdenfit.errors import DatasetError
from bowdenfit.multiple_testing import adjust_p_values
from bowdenfit.questions.metabolic.contradictions import find_contradictions
from bowdenfit.questions.metabolic.paired import (
    LEVEL,
    half_width,
    mean_and_error,
    persons_needed,
    power,
    probability_below,
    smallest_detectable,
    t_from_p,
    two_sided_p,
)
from bowdenfit.questions.metabolic.study import MetabolicCosts, Study

EXPECTED = 0.03  # of the cost: standard deviation of differences that one who doubts expects


@dataclass(frozen=True, repr=False)
class ConditionDifference(Part):
    """A condition less another, of the same persons.

    Args:
        condition, less: The conditions.
        persons: How many walked in both.
        difference: Mean of the net cost [W/kg].
        low, high: 95 % interval of the true difference.
        share: The difference over the cost of the second.
        p: Two-sided probability of such a difference by chance.
        p_holm: The same for all comparisons of the study at once.
        lower: Probability that the first is truly lower, where nothing was known before.
        lower_doubted: The same for one who expects differences of a few percent either way.
        power: Probability of finding a true difference as large as this with so many persons.
        needed: Persons with whom it is found in four of five studies; None where they are too many.
        least: Least true difference that is found in four of five studies with so many persons [W/kg].
    """

    condition: str
    less: str
    persons: int
    difference: float
    low: float
    high: float
    share: float
    p: float
    p_holm: float
    lower: float
    lower_doubted: float
    power: float
    needed: int | None
    least: float

    @property
    def is_significant(self) -> bool:
        """Whether the study shows a difference."""
        return self.p_holm < LEVEL


@dataclass(frozen=True, repr=False)
class Metabolic(Display):
    """What a study shows.

    Args:
        name, source: Of the study.
        comparisons: Of all pairs.
        contradictions: Numbers that cannot all be right, a sentence each.
        order: Conditions in the order in which all persons walked; empty where each had its own.
        from_persons: Whether it follows from each person's numbers, not from what was printed.
    """

    name: str
    source: str
    comparisons: tuple[ConditionDifference, ...]
    contradictions: tuple[str, ...]
    order: tuple[str, ...]
    from_persons: bool

    JSON: ClassVar = (...,)

    def _table(self) -> Rows:
        return [vars(comparison) for comparison in self.comparisons], dict.fromkeys(
            ("difference", "low", "high", "least"), "W/kg"
        )


def analyze_study(study: Study, costs: MetabolicCosts | None) -> Metabolic:
    """What a study shows.

    Args:
        study: What it says of itself.
        costs: Of each person, where they are known.

    Raises:
        DatasetError: Nothing can be compared.
    """
    pairs = list(_pairs_from_persons(costs)) if costs is not None else list(_pairs_from_printed(study))
    if not pairs:
        raise DatasetError(
            "no two conditions can be compared; a pair needs two persons, or means and a p that were printed."
        )
    adjusted = adjust_p_values([two_sided_p(mean / error, n) for _, _, n, mean, error, _ in pairs])
    comparisons = tuple(_compare(*pair, p) for pair, p in zip(pairs, adjusted.tolist(), strict=True))
    return Metabolic(
        study.name, study.source, comparisons, tuple(find_contradictions(study)), study.order, costs is not None
    )


def _pairs_from_persons(costs: MetabolicCosts) -> list[tuple[str, str, int, float, float, float]]:
    pairs = []
    for j, i in combinations(range(len(costs.conditions)), 2):
        both = np.isfinite(costs.net[:, [i, j]]).all(axis=1)
        differences = costs.net[both, i] - costs.net[both, j]
        if both.sum() >= 2 and np.ptp(differences) > 0:
            baseline = float(costs.net[both, j].mean())
            pairs.append(
                (costs.conditions[i], costs.conditions[j], int(both.sum()), *mean_and_error(differences), baseline)
            )
    return pairs


def _pairs_from_printed(study: Study) -> list[tuple[str, str, int, float, float, float]]:
    means = {printed.name: float(printed.mean) for printed in study.condition if printed.mean is not None}
    pairs = []
    for printed in study.difference:
        if printed.p is None or printed.condition not in means or printed.less not in means:
            continue
        difference, persons = means[printed.condition] - means[printed.less], study.persons or 2
        if difference != 0:
            error = abs(difference) / t_from_p(float(printed.p), persons)
            pairs.append((printed.condition, printed.less, persons, difference, error, means[printed.less]))
    return pairs


def _compare(
    condition: str, less: str, persons: int, mean: float, error: float, baseline: float, adjusted: float
) -> ConditionDifference:
    half, spread = half_width(error, persons), error * math.sqrt(persons)
    return ConditionDifference(
        condition, less, persons, mean, mean - half, mean + half, mean / baseline, two_sided_p(mean / error, persons), adjusted,
        probability_below(mean, error, persons), probability_below(mean, error, persons, EXPECTED * abs(baseline)),
        power(mean / spread, persons), persons_needed(mean / spread), smallest_detectable(persons) * spread,
    )  # fmt: skip
