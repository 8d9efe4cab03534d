"""Whether draws can be trusted: R-hat across independent ensembles, and effective sample sizes."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bowdenfit.types import ChainDraws

MAXIMUM_DRIFT = 0.08  # a Monte Carlo error of 3 % at 1000 effective draws, two and a half times over


@dataclass(frozen=True)
class Diagnostics:
    """Of one quantity.

    Args:
        r_hat: Nested R-hat, rank-normalized and split, with the ensembles as superchains.
        ess_bulk: Bulk effective sample size.
        ess_tail: Tail effective sample size (the smaller of the 5 % and 95 % quantiles').
        mcse_mean: Monte Carlo standard error of the mean.
        drift: How far the draws of the second half lie from those of the first: the shift of the median in units of
            the spread, or the relative change of the spread (16 % to 84 % quantile), whichever is larger.
    """

    r_hat: float
    ess_bulk: float
    ess_tail: float
    mcse_mean: float
    drift: float


def diagnose_all(draws: Mapping[str, ChainDraws], n_ensembles: int) -> dict[str, Diagnostics]:
    """Diagnostics of several quantities by name; see `diagnose`."""
    return {name: diagnose(values, n_ensembles) for name, values in draws.items()}


def diagnose(draws: ChainDraws, n_ensembles: int) -> Diagnostics:
    """Diagnostics of one quantity.

    Walkers are the chains of the effective sample size; R-hat compares whole ensembles, because the walkers of one
    ensemble move by each other's positions and are not independent.

    Args:
        draws: One row a walker, ordered by ensemble.
        n_ensembles: Number of independent ensembles.

    References:
        Vehtari et al. 2021, "Rank-normalization, folding, and localization" (Bayesian Analysis 16); Margossian et al.
        2024, "Nested R-hat" (Bayesian Analysis).
    """
    from arviz_stats.base import array_stats

    if not np.all(np.isfinite(draws)):
        return Diagnostics(np.nan, 0.0, 0.0, np.nan, np.nan)
    if np.ptp(draws) == 0.0:  # a quantity that cannot vary, such as an optimum always at the edge
        return Diagnostics(1.0, float(draws.size), float(draws.size), 0.0, 0.0)
    superchains = np.repeat(np.arange(n_ensembles), len(draws) // n_ensembles)
    axes = {"chain_axis": 0, "draw_axis": 1}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # ties of an optimum at the edge divide by zero inside
        return Diagnostics(
            float(array_stats.rhat_nested(draws, superchain_ids=superchains, method="rank", **axes)),
            float(array_stats.ess(draws, method="bulk", **axes)),
            float(array_stats.ess(draws, method="tail", prob=(0.05, 0.95), **axes)),
            float(array_stats.mcse(draws, method="mean", **axes)),
            _drift(draws),
        )


def _drift(draws: ChainDraws) -> float:
    """Change from the first to the second half of the draws.

    Many walkers that still creep in from an over-dispersed start agree with each other, so that no comparison between
    ensembles sees it; this does.
    """
    half = draws.shape[1] // 2
    quantiles = [np.quantile(part, (0.16, 0.5, 0.84)) for part in (draws[:, :half], draws[:, -half:])]
    (low, median, high), (low2, median2, high2) = quantiles
    if high == low or high2 == low2:  # an optimum that is mostly at the edge
        return float(abs(median2 - median) > 0)
    return float(max(abs(median2 - median) / (high2 - low2) * 2, abs(np.log((high2 - low2) / (high - low)))))


def shortfalls(diagnostics: Mapping[str, Diagnostics], target_r_hat: float, target_ess: int) -> tuple[str, ...]:
    """What keeps the draws from being trusted, in words; empty if nothing does."""
    reasons = []
    for name, d in diagnostics.items():
        if not d.r_hat < target_r_hat:
            reasons.append(f"R-hat of {name} is {d.r_hat:.3f} and should be below {target_r_hat:g}")
        if not d.drift < MAXIMUM_DRIFT:
            reasons.append(f"{name} still drifts along the chain, by {d.drift:.0%} of its spread")
        low = min(d.ess_bulk, d.ess_tail)
        if not low >= target_ess:
            which = "bulk" if d.ess_bulk <= d.ess_tail else "tail"
            reasons.append(f"{which} effective sample size of {name} is {low:.0f} and should be at least {target_ess}")
    return tuple(reasons)
