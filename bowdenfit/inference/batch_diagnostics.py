"""Whether the draws of one of many data sets can be trusted, by as few of them as a rank or an interval needs."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bowdenfit.inference.diagnostics import MAXIMUM_DRIFT, Diagnostics, diagnose_all
from bowdenfit.inference.psis import reliable_k

_TAILS = (0.05, 0.95)


def diagnose_few_draws(draws: Mapping[str, np.ndarray], n_ensembles: int) -> dict[str, Diagnostics]:
    """Diagnostics of a few hundred effective draws.

    Two halves of n effective draws differ by 2.5 / sqrt(n) of their spread by chance alone, which at a thousand is all that
    `MAXIMUM_DRIFT` allows; here twice what chance does is allowed, whatever n is.
    """
    found = diagnose_all(draws, n_ensembles)
    by_chance = {name: 2.5 / np.sqrt(max(min(d.ess_bulk, d.ess_tail), 1.0)) for name, d in found.items()}
    return {name: replace(d, drift=float(d.drift / by_chance[name]) / 2 * MAXIMUM_DRIFT) for name, d in found.items()}


def effective_draws(log_weights: np.ndarray) -> float:
    """How many draws of equal weight weighted ones are worth."""
    weights = np.exp(log_weights - log_weights.max())
    return float(weights.sum() ** 2 / np.sum(weights**2))


def diagnose_weighted(draws: Mapping[str, np.ndarray], weights: np.ndarray) -> dict[str, Diagnostics]:
    """Diagnostics of independent weighted draws; they have no R-hat and no drift.

    Args:
        draws: By parameter.
        weights: Of the draws, of sum 1.

    References:
        Vehtari, Simpson, Gelman, Yao and Gabry 2024, "Pareto smoothed importance sampling", section 3.2.3.
    """
    found = {}
    for name, values in draws.items():
        mean = float(weights @ values)
        variance, error = weights @ (values - mean) ** 2, np.sum(weights**2 * (values - mean) ** 2)
        tail = min(_effective_below(values, weights, probability) for probability in _TAILS)
        bulk = float(variance / error) if error > 0 else float(len(values))
        found[name] = Diagnostics(float("nan"), bulk, tail, float(np.sqrt(error)), float("nan"))
    return found


def _effective_below(values: np.ndarray, weights: np.ndarray, probability: float) -> float:
    """Effective draws for the probability of being below a quantile."""
    order = np.argsort(values)
    at = values[order][min(int(np.searchsorted(np.cumsum(weights[order]), probability)), len(values) - 1)]
    error = np.sum(weights**2 * ((values <= at) - probability) ** 2)
    return float(probability * (1 - probability) / error)


def weight_shortfalls(
    pareto_k: float, n_draws: int, diagnostics: Mapping[str, Diagnostics], target_ess: int
) -> tuple[str, ...]:
    """What keeps weighted draws from being trusted, in words; empty if nothing does."""
    most, reasons = reliable_k(n_draws), []
    if not pareto_k <= most:
        reasons.append(f"Pareto k of the importance weights is {pareto_k:.2f} and should be at most {most:.2f}")
    for name, d in diagnostics.items():
        low = min(d.ess_bulk, d.ess_tail)
        if not low >= target_ess:
            reasons.append(f"effective sample size of {name} is {low:.0f} and should be at least {target_ess}")
    return tuple(reasons)
