"""What a study of metabolic cost shows, and what it does not."""

import math
from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar

import numpy as np

from bowdenfit.display import Display, Part, Rows
from bowdenfit.errors import DatasetError
from bowdenfit.multiple_testing import adjust_p_values
from bowdenfit.questions.metabolic.contradictions import contradictions
from bowdenfit.questions.metabolic.paired import (
    LEVEL,
    half_width,
    least_found,
    persons_needed,
    power,
    probability_below,
    t_of,
    t_of_p,
    two_sided,
)
from bowdenfit.questions.metabolic.study import Costs, Study

EXPECTED = 0.03  # of the cost: standard deviation of differences that one who doubts expects


@dataclass(frozen=True, repr=False)
class Comparison(Part):
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
    def shown(self) -> bool:
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
    comparisons: tuple[Comparison, ...]
    contradictions: tuple[str, ...]
    order: tuple[str, ...]
    from_persons: bool

    JSON: ClassVar = (...,)

    def _table(self) -> Rows:
        return [vars(each) for each in self.comparisons], dict.fromkeys(("difference", "low", "high", "least"), "W/kg")


def answered(study: Study, costs: Costs | None) -> Metabolic:
    """What a study shows.

    Args:
        study: What it says of itself.
        costs: Of each person, where they are known.

    Raises:
        DatasetError: Nothing can be compared.
    """
    pairs = list(_of_persons(costs)) if costs is not None else list(_of_printed(study))
    if not pairs:
        raise DatasetError("no two conditions can be compared; a pair needs two persons, or means and a p that were printed.")
    adjusted = adjust_p_values([two_sided(mean / error, n) for _, _, n, mean, error, _ in pairs])
    found = tuple(_compared(*pair, p) for pair, p in zip(pairs, adjusted.tolist(), strict=True))
    return Metabolic(study.name, study.source, found, tuple(contradictions(study)), study.order, costs is not None)


def _of_persons(costs: Costs) -> list[tuple[str, str, int, float, float, float]]:
    pairs = []
    for j, i in combinations(range(len(costs.conditions)), 2):
        both = np.isfinite(costs.net[:, [i, j]]).all(axis=1)
        differences = costs.net[both, i] - costs.net[both, j]
        if both.sum() >= 2 and np.ptp(differences) > 0:
            baseline = float(costs.net[both, j].mean())
            pairs.append((costs.conditions[i], costs.conditions[j], int(both.sum()), *t_of(differences), baseline))
    return pairs


def _of_printed(study: Study) -> list[tuple[str, str, int, float, float, float]]:
    means = {each.name: float(each.mean) for each in study.condition if each.mean is not None}
    pairs = []
    for each in study.difference:
        if each.p is None or each.condition not in means or each.less not in means:
            continue
        difference, persons = means[each.condition] - means[each.less], study.persons or 2
        if difference != 0:
            error = abs(difference) / t_of_p(float(each.p), persons)
            pairs.append((each.condition, each.less, persons, difference, error, means[each.less]))
    return pairs


def _compared(
    condition: str, less: str, persons: int, mean: float, error: float, baseline: float, adjusted: float
) -> Comparison:
    half, spread = half_width(error, persons), error * math.sqrt(persons)
    return Comparison(
        condition, less, persons, mean, mean - half, mean + half, mean / baseline, two_sided(mean / error, persons), adjusted,
        probability_below(mean, error, persons), probability_below(mean, error, persons, EXPECTED * abs(baseline)),
        power(mean / spread, persons), persons_needed(mean / spread), least_found(persons) * spread,
    )  # fmt: skip
