"""Pareto-smoothed importance sampling: weights of draws for another density, and how far they can be trusted.

References:
    Vehtari, Simpson, Gelman, Yao and Gabry 2024, "Pareto smoothed importance sampling" (JMLR 25).
"""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

RELIABLE_K = 0.7  # Pareto k up to which importance weights can be trusted
_NO_WEIGHT = 1e4  # so far below the largest a log weight is none at all
_FLAT = 1e-9  # range of log ratios below which they say nothing, as those of a bound far off


def reliable_k(n_draws: int) -> float:
    """Pareto k up to which importance weights of so many draws can be trusted; section 3.2.4."""
    return min(1 - 1 / np.log10(n_draws), RELIABLE_K) if n_draws > 10 else 0.0


def smooth_weights(log_ratio: np.ndarray, share: float = 1.0) -> tuple[np.ndarray, float]:
    """Smoothed log weights of sum 1, and Pareto k.

    Ratios that cannot be computed have no weight; those that are all alike have equal weights and k = 0. So much weight on a
    handful of draws, or so many draws alike, that no Pareto distribution fits leaves equal weights and an infinite k.

    Args:
        log_ratio: Log importance ratio of every draw, up to a constant.
        share: Effective draws a draw.
    """
    from arviz_stats.base import array_stats

    usable, equal = np.isfinite(log_ratio), np.full(len(log_ratio), -np.log(len(log_ratio)))
    ratios = np.where(usable, log_ratio, np.max(log_ratio[usable], initial=0.0) - _NO_WEIGHT)
    if not np.ptp(ratios) > _FLAT:
        return equal, 0.0
    try:
        with _raise_without_tail():
            # ArviZ's function takes what is left out, the log likelihood, and turns its sign itself.
            log_weights, k = array_stats.psislw(-ratios, r_eff=share, axis=0)
    except (ValueError, UserWarning):
        return equal, float("inf")
    if not (np.isfinite(k) and np.all(np.isfinite(log_weights))):
        return equal, float("inf")
    return np.asarray(log_weights), float(k)


def weighted_elpd(log_ratio: np.ndarray, log_likelihood: np.ndarray, share: float) -> tuple[float, float, float]:
    """Expected log density of one reading from weighted draws, its Pareto k, and its Monte Carlo standard error (3.2.3).

    Args:
        log_ratio: Log importance ratio of every draw, up to a constant.
        log_likelihood: Of the reading, at every draw.
        share: Effective draws a draw.
    """
    log_weights, k = smooth_weights(log_ratio, share)
    parts = log_weights + log_likelihood
    top = float(np.max(parts))
    elpd = top + float(np.log(np.sum(np.exp(parts - top))))
    relative = np.exp(parts - elpd) - np.exp(log_weights)  # weight times the relative deviation of the density
    return elpd, k, float(np.sqrt(np.sum(relative**2) / share))


def power_weights(part: np.ndarray, alpha: float) -> np.ndarray:
    """Weights of draws for the density with a part of its logarithm times alpha, up to a factor.

    They are as they come, not smoothed, where so many draws are alike, as walkers that stood still leave them, or so few that
    there is no tail to fit a Pareto distribution to.

    Args:
        part: That part at every draw, (chain, draw).
        alpha: About 1.
    """
    from arviz_stats.base import array_stats

    try:
        with _raise_without_tail():
            return np.exp(array_stats.power_scale_lw(part, alpha, axis=(-2, -1)))
    except (ValueError, UserWarning):
        return np.exp((alpha - 1) * part - np.max((alpha - 1) * part))


@contextmanager
def _raise_without_tail() -> Iterator[None]:
    """ArviZ raises where all draws of a tail are alike, and warns where they are too few: an error too, for its caller.

    Where the lower quarter of a tail is alike it divides by zero; what is not finite then is looked at by the caller.
    """
    with warnings.catch_warnings(), np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        warnings.simplefilter("error", UserWarning)
        yield
