"""Numbers of one study that cannot all be right, whatever was rounded."""

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np

from bowdenfit.questions.metabolic.paired import t_of_p
from bowdenfit.questions.metabolic.study import Printed, Study

Range = tuple[float, float]


def rounded(text: str) -> Range:
    """The numbers that are written so when they are rounded."""
    _, _, decimals = text.partition(".")
    half = 0.5 * 10.0 ** -len(decimals)
    return float(text) - half, float(text) + half


def contradictions(study: Study) -> Iterator[str]:
    """What of a study cannot all be right, a sentence each.

    Args:
        study: What was printed.
    """
    means = {each.name: each.mean for each in study.condition if each.mean is not None}
    baselines: dict[str, list[tuple[Printed, Range]]] = {}
    for each in study.difference:
        if each.percent is None or each.condition not in means or each.less not in means:
            continue
        mean, less = means[each.condition], means[each.less]
        follows = 100 * (float(mean) / float(less) - 1)
        if not _overlap(_change(rounded(mean), (float(less), float(less))), rounded(each.percent)):
            yield (
                f"{each.percent} % for {each.condition} does not follow from the means as printed, which give {follows:+.2f} % "
                f"({mean} and {less} W/kg)."
            )
        low, high = rounded(mean)
        change = rounded(each.percent)
        baselines.setdefault(each.less, []).append((each, (low / (1 + change[1] / 100), high / (1 + change[0] / 100))))
    for less, implied in baselines.items():
        for (one, first), (other, second) in combinations(implied, 2):
            if not _overlap(first, second):
                yield (
                    f"No mean of {less} gives both {one.percent} % for {one.condition} and {other.percent} % for "
                    f"{other.condition}: that takes {_written(first)} W/kg for the one and {_written(second)} for the other."
                )
    yield from _of_scatter(study)


def _of_scatter(study: Study) -> Iterator[str]:
    """Standard errors and probabilities that no persons could have."""
    errors = {each.name: float(each.sem) for each in study.condition if each.sem is not None}
    means = {each.name: float(each.mean) for each in study.condition if each.mean is not None}
    names, persons = list(errors), study.persons or 2
    matrix = np.eye(len(names))
    for each in study.difference:
        if each.p is None or not {each.condition, each.less} <= set(errors) & set(means):
            continue
        i, j = names.index(each.condition), names.index(each.less)
        error = abs(means[each.condition] - means[each.less]) / t_of_p(float(each.p), persons)
        one, other = errors[each.condition], errors[each.less]
        matrix[i, j] = matrix[j, i] = (one**2 + other**2 - error**2) / (2 * one * other)
        if abs(matrix[i, j]) > 1.02:
            yield (
                f"p = {each.p} for {each.condition} less {each.less} does not go with their standard errors: persons would "
                f"have to agree with a correlation of {matrix[i, j]:.2f}."
            )
            return
    if len(names) > 2 and len(study.difference) == math.comb(len(names), 2) and np.linalg.eigvalsh(matrix).min() < -0.02:
        yield "The probabilities do not go with the standard errors: no persons have such correlations between conditions."


def _change(mean: Range, less: Range) -> Range:
    """Change in percent."""
    return 100 * (mean[0] / less[1] - 1), 100 * (mean[1] / less[0] - 1)


def _overlap(one: Range, other: Range) -> bool:
    return one[0] <= other[1] and other[0] <= one[1]


def _written(span: Range) -> str:
    return f"{span[0]:.2f} to {span[1]:.2f}"
