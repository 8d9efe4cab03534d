"""Agreement of two samplers of one density: differences of their summaries, compared with Monte Carlo errors."""

from collections.abc import Mapping
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, ClassVar

import numpy as np

from bowdenfit.inference.diagnostics import array_stats

FALSE_ALARM = 0.001  # probability that two correct samplers are reported to disagree
SUMMARIES = ("mean", "sd", "5 % quantile", "95 % quantile")
NOTICEABLE = 0.1  # standard deviations; smaller differences do not change an answer; a judgement
SAMPLER_NAMES = {"emcee": "emcee", "nuts": "NUTS", "importance": "importance sampling"}
MANY_PARAMETERS = 25  # parameters above which ensembles of walkers mix slowly; a judgement


@dataclass(frozen=True)
class SamplerDifference:
    """Difference between two samplers in one summary of one quantity.

    Args:
        quantity: A parameter (in z), or the optimal length or efficiency.
        summary: One of `SUMMARIES`.
        sds: The second sampler's summary minus the first's, in standard deviations of the quantity.
        error: Monte Carlo standard error of the difference, in the same unit.
    """

    quantity: str
    summary: str
    sds: float
    error: float

    JSON: ClassVar = (..., "errors")

    @property
    def errors(self) -> float:
        """The difference in Monte Carlo standard errors."""
        if self.sds == 0:
            return 0.0
        return abs(self.sds) / self.error if self.error > 0 else float("inf")


@dataclass(frozen=True)
class SamplerAgreement:
    """Agreement of two samplers on one density.

    Args:
        first: The sampler whose draws are the result.
        second: The other sampler.
        differences: Differences of every summary of every quantity.
        limit: Monte Carlo standard errors that correct samplers exceed anywhere with probability `FALSE_ALARM`.
    """

    first: str
    second: str
    differences: tuple[SamplerDifference, ...]
    limit: float

    false_alarm: ClassVar = FALSE_ALARM
    noticeable_sds: ClassVar = NOTICEABLE
    JSON: ClassVar = (
        "samplers", "agree", "sentence", "false_alarm", ("limit_errors", "limit"), "noticeable_sds", "differences",
    )  # fmt: skip

    @property
    def samplers(self) -> tuple[str, str]:
        """Names of both samplers."""
        return self.first, self.second

    @property
    def significant(self) -> tuple[SamplerDifference, ...]:
        """Differences that are significant and large enough to matter, the largest first."""
        seen = [d for d in self.differences if d.errors > self.limit and abs(d.sds) > NOTICEABLE]
        return tuple(sorted(seen, key=lambda d: -abs(d.sds)))

    @property
    def largest(self) -> SamplerDifference:
        """The largest difference in standard deviations, significant or not."""
        return max(self.differences, key=lambda d: abs(d.sds))

    @property
    def agree(self) -> bool:
        """Whether no difference is both significant and noticeable."""
        return not self.significant

    def sentence(self) -> str:
        """Say whether the samplers agree, for users."""
        one, two, most = SAMPLER_NAMES[self.first], SAMPLER_NAMES[self.second], self.largest
        if self.agree:
            sharper = " A larger sampler.target_ess makes the comparison sharper." if abs(most.sds) > NOTICEABLE else ""
            return (
                f"{one} and {two} agree within Monte Carlo error: the mean, standard deviation, 5 % and 95 % quantile of every "
                f"parameter and answer differ by at most {abs(most.sds):.2f} standard deviations ({most.summary} of "
                f"{most.quantity}, whose Monte Carlo error is {most.error:.2f}).{sharper}"
            )
        first, *others = self.significant
        more = f" and on {len(others)} more" if others else ""
        return (
            f"{one} and {two} disagree on the {first.summary} of {first.quantity}, by {abs(first.sds):.2f} standard "
            f"deviations, {first.errors:.0f} times the Monte Carlo error{more}; one of them has missed part of the posterior."
        )

    def reasons(self) -> tuple[str, ...]:
        """Why the draws should not be trusted; empty if the samplers agree."""
        return () if self.agree else (self.sentence().removesuffix("."),)


@dataclass(frozen=True)
class SamplerDraws:
    """Draws of one sampler.

    Args:
        sampler: Name of the sampler.
        draws: Draws by quantity, (walker, draw), ordered by ensemble.
        n_ensembles: Number of independent ensembles; each chain counts as one.
    """

    sampler: str
    draws: Mapping[str, np.ndarray]
    n_ensembles: int

    def error_scale(self) -> float:
        """Return the factor on Monte Carlo errors that accounts for dependent walkers, at least 1.

        Walkers of one ensemble move by each other's positions, so errors that treat them as independent are too small. The
        spread between ensembles shows by how much, pooled over all quantities and summaries, because four ensembles are few.
        """
        ratios = []
        for draws in self.draws.values():
            parts = [_summarize(part) for part in np.split(draws, self.n_ensembles)]
            between = np.var(parts, axis=0, ddof=1) / self.n_ensembles
            errors = np.array(_standard_errors(draws))
            finite = np.isfinite(errors) & (errors > 0)
            ratios += list(between[finite] / errors[finite] ** 2)
        return float(np.sqrt(max(np.mean(ratios), 1.0))) if ratios else 1.0


def compare_samplers(first: SamplerDraws, second: SamplerDraws) -> SamplerAgreement:
    """Compare two samplers on every quantity; the first of them drew the result.

    The limit is Bonferroni's over all comparisons, so two correct samplers are reported to disagree in at most one of a
    thousand fits.
    """
    scales = first.error_scale(), second.error_scale()
    differences = tuple(d for name in first.draws for d in _differences(name, first, second, scales))
    limit = NormalDist().inv_cdf(1 - FALSE_ALARM / 2 / max(len(differences), 1))
    return SamplerAgreement(first.sampler, second.sampler, differences, limit)


def _differences(name: str, first: SamplerDraws, second: SamplerDraws, scales: tuple[float, float]) -> list[SamplerDifference]:
    draws, others = first.draws[name], second.draws[name]
    sd = float(np.sqrt((np.var(draws) + np.var(others)) / 2)) or 1.0
    differences = []
    for summary, value, other, error, other_error in zip(
        SUMMARIES, _summarize(draws), _summarize(others), _standard_errors(draws), _standard_errors(others), strict=True
    ):
        both = float(np.hypot(scales[0] * error, scales[1] * other_error))
        differences.append(SamplerDifference(name, summary, float(other - value) / sd, both / sd))
    return differences


def _summarize(draws: np.ndarray) -> list[float]:
    """Return the `SUMMARIES` of draws."""
    return [float(np.mean(draws)), float(np.std(draws)), *map(float, np.quantile(draws, (0.05, 0.95)))]


def _standard_errors(draws: np.ndarray) -> list[float]:
    """Return Monte Carlo standard errors of `SUMMARIES`, treating walkers as independent."""
    if np.ptp(draws) == 0:
        return [0.0] * len(SUMMARIES)
    statistics: tuple[dict[str, Any], ...] = (
        {"method": "mean"},
        {"method": "sd"},
        *({"method": "quantile", "prob": p} for p in (0.05, 0.95)),
    )
    return [float(array_stats().mcse(draws, chain_axis=0, draw_axis=1, **options)) for options in statistics]


def recommend_sampler(sampler: str, n_parameters: int, short: bool) -> str:
    """Recommend another sampler where draws have not converged, or probably will not; empty otherwise."""
    if sampler == "importance" and short:
        return "The weighted draws do not suffice. Walkers take far longer and need no weights: fit again with --sampler emcee."
    if sampler != "emcee":
        return ""
    if short:
        return (
            "The ensembles of walkers have not converged. NUTS copes better with posteriors that are narrow, curved or of many "
            "parameters: fit again with --sampler nuts."
        )
    if n_parameters > MANY_PARAMETERS:
        return (
            f"With {n_parameters} free parameters NUTS needs fewer draws than ensembles of walkers, which mix more slowly the "
            "more there are: consider --sampler nuts, or --sampler both to have one check the other."
        )
    return ""
