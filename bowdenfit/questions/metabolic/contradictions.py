"""Numbers of one study that cannot all be right, whatever was rounded."""

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np

from bowdenfit.questions.metabolic.paired import t_from_p
from bowdenfit.questions.metabolic.study import PrintedDifference, Study

Range = tuple[float, float]


def rounding_range(text: str) -> Range:
    """The numbers that are written so when they are rounded."""
    _, _, decimals = text.partition(".")
    half = 0.5 * 10.0 ** -len(decimals)
    return float(text) - half, float(text) + half


def find_contradictions(study: Study) -> Iterator[str]:
    """What of a study cannot all be right, a sentence each.

    Args:
        study: What was printed.
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


def _check_scatter(study: Study) -> Iterator[str]:
    """Standard errors and probabilities that no persons could have."""
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
        if abs(matrix[i, j]) > 1.02:
            yield (
                f"p = {difference.p} for {difference.condition} less {difference.less} does not go with their standard "
                "errors: persons would "
                f"have to agree with a correlation of {matrix[i, j]:.2f}."
            )
            return
    if (
        len(names) > 2
        and len(study.difference) == math.comb(len(names), 2)
        and np.linalg.eigvalsh(matrix).min() < -0.02
    ):
        yield "The probabilities do not go with the standard errors: no persons have such correlations between conditions."


def _percent_change(mean: Range, less: Range) -> Range:
    """Change in percent."""
    return 100 * (mean[0] / less[1] - 1), 100 * (mean[1] / less[0] - 1)


def _overlaps(one: Range, other: Range) -> bool:
    return one[0] <= other[1] and other[0] <= one[1]


def _format_range(span: Range) -> str:
    return f"{span[0]:.2f} to {span[1]:.2f}"
