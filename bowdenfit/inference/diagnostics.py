"""Convergence diagnostics: R-hat across ensembles, effective sample sizes, drift, and trajectories of NUTS."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bowdenfit.types import ChainDraws
from bowdenfit.words import percent

MAXIMUM_DRIFT = 0.08  # 2.5 times the Monte Carlo error of 3 % at 1000 effective draws
MOST_FINE_DIVERGED = 0.001  # share of the trajectories with fine steps, a judgement; if more diverge, a narrow region is missed
MOST_DIVERGED = 0.01  # share of all trajectories, a judgement; ordinary steps may diverge where the fine ones do not
LEAST_ENERGY_MIXING = 0.3  # lower limit of the E-BFMI (Betancourt 2016)


@dataclass(frozen=True)
class Diagnostics:
    """Convergence diagnostics of one quantity.

    Args:
        r_hat: Nested R-hat, rank-normalized and split, with the ensembles as superchains.
        ess_bulk: Bulk effective sample size.
        ess_tail: Tail effective sample size (the smaller of the 5 % and 95 % quantiles').
        mcse_mean: Monte Carlo standard error of the mean.
        drift: How far the draws of the second half lie from those of the first, from their normal scores: the shift of the mean
            or the change of the standard deviation, whichever is larger, in standard deviations of all draws.
    """

    r_hat: float
    ess_bulk: float
    ess_tail: float
    mcse_mean: float
    drift: float


def diagnose_all(draws: Mapping[str, ChainDraws], n_ensembles: int) -> dict[str, Diagnostics]:
    """Return diagnostics of several quantities by name; see `diagnose`."""
    return {name: diagnose(values, n_ensembles) for name, values in draws.items()}


def diagnose(draws: ChainDraws, n_ensembles: int) -> Diagnostics:
    """Return diagnostics of one quantity.

    R-hat compares whole ensembles, because the walkers of one ensemble move by each other's positions and are not independent.
    Effective sample sizes and the error of the mean are computed from `as_chains`. Computed with every walker as a chain of
    twenty draws, they would come out up to 1.3 times too large.

    Args:
        draws: Draws, one row a walker, ordered by ensemble.
        n_ensembles: Number of independent ensembles.

    References:
        Vehtari et al. 2021, "Rank-normalization, folding, and localization" (Bayesian Analysis 16); Margossian et al.
        2024, "Nested R-hat" (Bayesian Analysis).
    """
    if not np.all(np.isfinite(draws)):
        return Diagnostics(np.nan, 0.0, 0.0, np.nan, np.nan)
    if np.ptp(draws) == 0.0:  # a quantity that cannot vary, such as an optimum always at the edge
        return Diagnostics(1.0, float(draws.size), float(draws.size), 0.0, 0.0)
    superchains = np.repeat(np.arange(n_ensembles), len(draws) // n_ensembles)
    chains, axes = as_chains(draws, n_ensembles), {"chain_axis": 0, "draw_axis": 1}
    scores = normal_scores(draws), normal_scores(np.abs(draws - np.median(draws)))  # of the middle and of the tails
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # ties of an optimum at the edge divide by zero inside
        return Diagnostics(
            max(float(array_stats().rhat_nested(s, superchain_ids=superchains, method="split", **axes)) for s in scores),
            float(array_stats().ess(as_chains(scores[0], n_ensembles), method="mean", **axes)),
            float(array_stats().ess(chains, method="tail", prob=(0.05, 0.95), **axes)),
            float(array_stats().mcse(chains, method="mean", **axes)),
            _measure_drift(scores[0]),
        )


def quantile_error(draws: ChainDraws, n_ensembles: int, probability: float) -> float:
    """Return the Monte Carlo standard error of a quantile; NaN where draws are infinite, 0 where they do not vary.

    Args:
        draws: Draws, one row a walker, ordered by ensemble.
        n_ensembles: Number of independent ensembles.
        probability: Probability of the quantile, such as 0.05.

    References:
        Vehtari et al. 2021, "Rank-normalization, folding, and localization" (Bayesian Analysis 16), section 4.4.
    """
    if not np.all(np.isfinite(draws)) or np.ptp(draws) == 0.0:
        return 0.0 if np.all(np.isfinite(draws)) else float("nan")
    chains = as_chains(draws, n_ensembles)
    return float(array_stats().mcse(chains, method="quantile", prob=probability, chain_axis=0, draw_axis=1))


def array_stats() -> Any:
    """Return ArviZ's statistics of arrays, imported when first needed because ArviZ takes a second to load."""
    from arviz_stats.base import array_stats as functions

    return functions


def normal_scores(draws: np.ndarray) -> np.ndarray:
    """Return normal quantiles of the ranks of draws; equal draws share their mean rank.

    References:
        Vehtari et al. 2021, equation 14, with Blom's offset of 3/8.
    """
    from scipy import special, stats  # as long as ArviZ to load

    return np.asarray(special.ndtri((stats.rankdata(draws) - 3 / 8) / (draws.size + 1 / 4))).reshape(draws.shape)


def as_chains(draws: np.ndarray, n_ensembles: int) -> np.ndarray:
    """Return the draws of walkers as one chain an ensemble: the path of one walker after the other.

    This keeps the autocorrelation of the paths. Ordering by steps would treat walkers as independent, and one chain a walker is
    too short for the usual R-hat.

    Args:
        draws: Draws, one row a walker, ordered by ensemble; further axes stay as they are.
        n_ensembles: Number of independent ensembles.
    """
    return draws.reshape(n_ensembles, -1, *draws.shape[2:])


def _measure_drift(scores: np.ndarray) -> float:
    """Return the change from the first to the second half of the draws, from their normal scores.

    Walkers that are still moving in from an over-dispersed start agree with each other, so comparisons between ensembles do not
    detect it; drift does. Means and standard deviations of scores have four fifths and three quarters of the Monte Carlo error
    of medians and quantiles, so that a drift of the same size is detected sooner.
    """
    half = scores.shape[1] // 2
    first, second = scores[:, :half], scores[:, -half:]
    low, middle, high = np.quantile([first, second], (0.16, 0.5, 0.84), axis=(1, 2))
    if np.any(low == high):  # an optimum that is mostly at the edge
        return float(middle[0] != middle[1])
    return float(max(abs(second.mean() - first.mean()), abs(second.std() - first.std())))


def describe_convergence_shortfalls(
    diagnostics: Mapping[str, Diagnostics], target_r_hat: float, target_ess: int
) -> tuple[str, ...]:
    """Describe why the draws have not converged; empty if they have."""
    reasons = []
    for name, d in diagnostics.items():
        if not d.r_hat < target_r_hat:
            wider, most = percent(d.r_hat - 1), percent(target_r_hat - 1)
            spread = f"{name} spreads {wider} wider over all chains than within one"
            reasons.append(f"{spread} (R-hat minus 1), and the limit is {most}")
        if not d.drift < MAXIMUM_DRIFT:
            reasons.append(f"{name} still drifts during sampling, by {percent(d.drift, 0)} of its spread")
        low = min(d.ess_bulk, d.ess_tail)
        if not low >= target_ess:
            part = "middle" if d.ess_bulk <= d.ess_tail else "tails"
            reasons.append(describe_low_ess(f"the {part} of {name}", low, target_ess))
    return tuple(reasons)


def describe_low_ess(quantity: str, ess: float, target: int) -> str:
    """Describe a quantity whose effective sample size is too small.

    Args:
        quantity: The quantity.
        ess: Its effective sample size.
        target: The least effective sample size that is acceptable.
    """
    return f"the effective sample size of {quantity} is {ess:.0f} (independent draws), and should be at least {target}"


@dataclass(frozen=True)
class Trajectories:
    """Statistics of the trajectories of Hamiltonian Monte Carlo.

    Args:
        warm_up: Warm-up steps of each chain, which tune the sampler and are not among the draws.
        total: Trajectories of all chains after warm-up.
        diverged: Number of trajectories that diverged.
        fine: Number of trajectories with fine steps, which reach regions where the others diverge.
        fine_diverged: Number of these that diverged.
        saturated: Number of the other trajectories that reached the maximum tree depth.
        energy_mixing: Lowest E-BFMI of the chains.
        step_size: Step size after tuning, the same for all chains.
        gradients: Gradients computed in all, warm-up included.
        statistics: Statistics of every kept draw under ArviZ's names, (chain, draw).
    """

    warm_up: int
    total: int
    diverged: int
    fine: int
    fine_diverged: int
    saturated: int
    energy_mixing: float
    step_size: float
    gradients: int
    statistics: dict[str, np.ndarray]


def compute_energy_mixing(energy: np.ndarray) -> float:
    """Return the lowest E-BFMI of the chains: how far one step may change the energy, relative to its spread.

    Args:
        energy: Energy of every draw, (chain, draw), none left out.

    References:
        Betancourt 2016, "Diagnosing suboptimal cotangent disintegrations in Hamiltonian Monte Carlo" (arXiv:1604.00695).
    """
    if not np.all(np.isfinite(energy)) or np.any(np.ptp(energy, axis=1) == 0):
        return float("nan")
    return float(np.min(array_stats().bfmi(energy, chain_axis=0, draw_axis=1)))


def describe_trajectory_shortfalls(trajectories: Trajectories) -> tuple[str, ...]:
    """Describe why draws of Hamiltonian Monte Carlo should not be trusted; empty if they can be."""
    reasons = []
    for diverged, total, most, kind in (
        (trajectories.fine_diverged, trajectories.fine, MOST_FINE_DIVERGED, " of fine steps"),
        (trajectories.diverged, trajectories.total, MOST_DIVERGED, ""),
    ):
        if diverged > most * total:
            reasons.append(
                f"{diverged} of {total} trajectories{kind} diverged, and at most 1 in {1 / most:.0f} may: a narrow region of "
                "the posterior may be missing; raise sampler.target_acceptance, or state what is known as priors"
            )
    if not trajectories.energy_mixing >= LEAST_ENERGY_MIXING:
        reasons.append(
            f"the energy of a chain mixes slowly (E-BFMI {trajectories.energy_mixing:.2f}, which should be at least "
            f"{LEAST_ENERGY_MIXING:g}): its tails may be missing; let it run longer, or state what is known as priors"
        )
    return tuple(reasons)
