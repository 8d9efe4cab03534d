"""What a study of metabolic cost shows: paired differences, numbers that cannot all be right, and both in words."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar

import numpy as np

from bowdenfit.addons.metabolic.study import (
    LEVEL,
    MetabolicCosts,
    PrintedDifference,
    Study,
    half_width,
    mean_and_error,
    persons_needed,
    power,
    probability_below,
    smallest_detectable,
    t_from_p,
    two_sided_p,
)
from bowdenfit.display import Block, Display, ResultTable, Rows, blocks_of, separate
from bowdenfit.errors import DatasetError
from bowdenfit.multiple_testing import adjust_p_values
from bowdenfit.words import counted, percent

EXPECTED = 0.03  # of the cost: standard deviation of differences that one who doubts expects; a judgement
_ROUNDING_SLACK = 0.02  # of correlations and their eigenvalues, for what rounding of printed numbers may do; a judgement
Range = tuple[float, float]


@dataclass(frozen=True)
class ConditionDifference:
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


@dataclass(frozen=True)
class ConditionCost:
    """Mean net cost of one condition.

    Args:
        name: The condition.
        mean: Mean over persons [W/kg].
        error: Standard error of the mean [W/kg]; None where it was not printed.
    """

    name: str
    mean: float
    error: float | None


@dataclass(frozen=True, repr=False)
class Metabolic(Display):
    """Result of a study.

    Args:
        name, source: Name and source of the study.
        comparisons: Comparisons of all pairs.
        contradictions: Numbers that cannot all be right, a sentence each.
        order: Conditions in the order in which all persons walked; empty where each had its own.
        from_persons: Whether it follows from each person's numbers, not from what was printed.
        costs: Mean of each condition that is compared, in the order of the study.
    """

    name: str
    source: str
    comparisons: tuple[ConditionDifference, ...]
    contradictions: tuple[str, ...]
    order: tuple[str, ...]
    from_persons: bool
    costs: tuple[ConditionCost, ...] = ()

    JSON: ClassVar = (...,)

    def _table(self) -> Rows:
        return [vars(comparison) for comparison in self.comparisons], dict.fromkeys(
            ("difference", "low", "high", "least"), "W/kg"
        )


def analyze_study(study: Study, costs: MetabolicCosts | None) -> Metabolic:
    """Return what a study shows.

    Args:
        study: What it says of itself.
        costs: Costs of each person, where they are known.

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
    compared = {name for comparison in comparisons for name in (comparison.condition, comparison.less)}
    return Metabolic(
        study.name, study.source, comparisons, tuple(find_contradictions(study)), study.order, costs is not None,
        tuple(cost for cost in _condition_costs(study, costs) if cost.name in compared),
    )  # fmt: skip


def _condition_costs(study: Study, costs: MetabolicCosts | None) -> Iterator[ConditionCost]:
    """Yield the mean of each condition, measured or as printed."""
    if costs is None:
        for printed in study.condition:
            if printed.mean is not None:
                yield ConditionCost(printed.name, float(printed.mean), None if printed.sem is None else float(printed.sem))
        return
    for name, column in zip(costs.conditions, costs.net.T, strict=True):
        walked = column[np.isfinite(column)]
        if len(walked) >= 2:
            yield ConditionCost(name, *mean_and_error(walked))


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


def find_contradictions(study: Study) -> Iterator[str]:
    """Yield what of a study cannot all be right, a sentence each.

    Args:
        study: Published numbers.
    """
    means = {difference.name: difference.mean for difference in study.condition if difference.mean is not None}
    baselines: dict[str, list[tuple[PrintedDifference, Range]]] = {}
    for difference in study.difference:
        if difference.percent is None or difference.condition not in means or difference.less not in means:
            continue
        mean, less = means[difference.condition], means[difference.less]
        follows = 100 * (float(mean) / float(less) - 1)
        if not _overlaps(
            _percent_change(rounding_range(mean), (float(less), float(less))), rounding_range(difference.percent)
        ):
            yield (
                f"{difference.percent} % for {difference.condition} does not follow from the means as printed, which "
                f"give {follows:+.2f} % "
                f"({mean} and {less} W/kg)."
            )
        low, high = rounding_range(mean)
        change = rounding_range(difference.percent)
        baselines.setdefault(difference.less, []).append(
            (difference, (low / (1 + change[1] / 100), high / (1 + change[0] / 100)))
        )
    for less, implied in baselines.items():
        for (one, first), (other, second) in combinations(implied, 2):
            if not _overlaps(first, second):
                yield (
                    f"No mean of {less} gives both {one.percent} % for {one.condition} and {other.percent} % for "
                    f"{other.condition}: that takes {_format_range(first)} W/kg for the one and {_format_range(second)} "
                    "for the other."
                )
    yield from _check_scatter(study)


def rounding_range(text: str) -> Range:
    """Return the range of numbers that are written so when they are rounded."""
    _, _, decimals = text.partition(".")
    half = 0.5 * 10.0 ** -len(decimals)
    return float(text) - half, float(text) + half


def _check_scatter(study: Study) -> Iterator[str]:
    """Yield standard errors and probabilities that no persons could have."""
    errors = {difference.name: float(difference.sem) for difference in study.condition if difference.sem is not None}
    means = {difference.name: float(difference.mean) for difference in study.condition if difference.mean is not None}
    names, persons = list(errors), study.persons or 2
    matrix = np.eye(len(names))
    for difference in study.difference:
        if difference.p is None or not {difference.condition, difference.less} <= set(errors) & set(means):
            continue
        i, j = names.index(difference.condition), names.index(difference.less)
        error = abs(means[difference.condition] - means[difference.less]) / t_from_p(float(difference.p), persons)
        one, other = errors[difference.condition], errors[difference.less]
        matrix[i, j] = matrix[j, i] = (one**2 + other**2 - error**2) / (2 * one * other)
        if abs(matrix[i, j]) > 1 + _ROUNDING_SLACK:
            yield (
                f"p = {difference.p} for {difference.condition} minus {difference.less} contradicts their standard errors: "
                f"the two conditions would have to correlate by {matrix[i, j]:.2f}."
            )
            return
    if (
        len(names) > 2
        and len(study.difference) == math.comb(len(names), 2)
        and np.linalg.eigvalsh(matrix).min() < -_ROUNDING_SLACK
    ):
        yield "The p-values contradict the standard errors: no correlations between the conditions give both."


def _percent_change(mean: Range, less: Range) -> Range:
    """Return the lowest and highest change in percent."""
    return 100 * (mean[0] / less[1] - 1), 100 * (mean[1] / less[0] - 1)


def _overlaps(one: Range, other: Range) -> bool:
    return one[0] <= other[1] and other[0] <= one[1]


def _format_range(span: Range) -> str:
    return f"{span[0]:.2f} to {span[1]:.2f}"


@blocks_of.register
def _(result: Metabolic) -> list[Block]:
    """Return a study for people: what it shows, what it does not, and what of it cannot be right."""
    heads = ("condition", "minus", "W/kg", "95 % from", "to", "change", "p", "p (Holm)", "lower with prob.")
    rows = [
        (c.condition, c.less, f"{c.difference:+.3f}", f"{c.low:+.3f}", f"{c.high:+.3f}", percent(c.share, sign="+"),
         f"{c.p:.2g}", f"{c.p_holm:.2g}", f"{c.lower_doubted:.2f} to {c.lower:.2f}")
        for c in result.comparisons
    ]  # fmt: skip
    contradictions = [f"- {sentence}" for sentence in result.contradictions]
    return separate(
        (f"{result.name}:", *map(_difference_sentence, result.comparisons)),
        [ResultTable(heads, rows, left=("minus",), narrow=True)],
        ["Numbers that cannot all be right", *contradictions] if contradictions else [],
        _remark_sentences(result),
    )


def _difference_sentence(comparison: ConditionDifference) -> str:
    """Say whether a difference is shown."""
    way = "lower" if comparison.difference < 0 else "higher"
    size = f"{abs(comparison.difference):.2f} W/kg ({percent(abs(comparison.share))})"
    if comparison.is_significant:
        return (
            f"{comparison.condition} is {way} than {comparison.less} by {size}; the difference is significant "
            f"(p = {comparison.p_holm:.2g}, adjusted for all pairs)."
        )
    needed = f"{comparison.needed} persons would" if comparison.needed else "no realistic number of persons would"
    return (
        f"{comparison.condition} is not significantly {way} than {comparison.less}: {size} with {comparison.persons} "
        f"persons, p = {comparison.p:.2g}; "
        f"{needed} show a difference as large in four of five studies."
    )


def _remark_sentences(result: Metabolic) -> list[str]:
    """Say what the numbers hold for."""
    lines = []
    if result.order:
        lines.append(
            f"All walked in the same order ({', '.join(result.order)}), so what changes with time, such as getting used to the "
            "device or tiring, cannot be separated from the effect of the conditions."
        )
    persons = counted(max(comparison.persons for comparison in result.comparisons), "person")
    least = max(result.comparisons, key=lambda comparison: comparison.least)
    lines.append(
        f"With {persons} the smallest true difference that four of five studies would detect is {least.least:.2f} W/kg "
        f"({least.condition} minus {least.less})."
    )
    lines.append(
        "Lower with prob.: probability that the cost is truly lower; the first number is by a prior on which differences are a "
        "few percent either way, the second by a flat prior."
    )
    if not result.from_persons:
        lines.append("The results of each person were not printed; everything follows from the printed means and p-values.")
    return lines
