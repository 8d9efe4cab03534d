"""Importance sampling of one posterior, from a mixture about its maxima: enough draws, or few and no more.

Where the first draws are worth little, more of them cost more than walkers do, and moving the mixture after its weights leaves
Pareto k as high in ten parameters with bent ridges; they still say where walkers may start.

References:
    Vehtari, Simpson, Gelman, Yao and Gabry 2024, "Pareto smoothed importance sampling" (JMLR 25), for when to trust it.
"""

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bowdenfit.inference.batch.mixture import Mixture
from bowdenfit.inference.diagnostics import Diagnostics, too_few
from bowdenfit.inference.psis import reliable_k, smooth_weights

BLOCK = 2048  # draws of a round
_LOOKS = (1, 2, 4, 8, 16)  # rounds at which is looked whether draws are enough
_WORTH = 0.1  # effective draws a draw; of fewer, no more are drawn
_TAILS = (0.05, 0.95)


@dataclass(frozen=True)
class Weighted:
    """Weighted draws.

    Args:
        z: One a row.
        log_density: Of the posterior.
        log_proposed: Of what they were drawn from.
    """

    z: np.ndarray
    log_density: np.ndarray
    log_proposed: np.ndarray

    @cached_property
    def _smooth(self) -> tuple[np.ndarray, float]:
        return smooth_weights(self.log_density - self.log_proposed)

    @property
    def log_weights(self) -> np.ndarray:
        """Of sum 1; minus infinity where the density cannot be computed."""
        return np.where(np.isfinite(self.log_density), self._smooth[0], -np.inf)

    @property
    def pareto_k(self) -> float:
        """Of the weights."""
        return self._smooth[1]

    def diagnose(self, names: tuple[str, ...]) -> dict[str, Diagnostics]:
        """Diagnostics by parameter; weighted draws have no R-hat and no drift (section 3.2.3 for the errors)."""
        weights = np.exp(self.log_weights)
        squares, apart = weights**2, (self.z - weights @ self.z) ** 2
        error, ends = squares @ apart, np.quantile(self.z[resample(weights, BLOCK, 0.5)], _TAILS, axis=0)
        tails = [p * (1 - p) / (squares @ ((self.z <= at) - p) ** 2) for p, at in zip(_TAILS, ends, strict=True)]
        bulk = (weights @ apart) / np.maximum(error, np.finfo(float).tiny)
        unknown = float("nan")
        return {
            name: Diagnostics(
                unknown, float(bulk[i]), float(min(t[i] for t in tails)), float(np.sqrt(error[i])), unknown
            )
            for i, name in enumerate(names)
        }

    def sd_errors(self, names: tuple[str, ...]) -> dict[str, float]:
        """Monte Carlo error of each standard deviation as a share of it (section 3.2.3, of the square deviations)."""
        weights = np.exp(self.log_weights)
        squares = (self.z - weights @ self.z) ** 2
        variance = weights @ squares
        errors = np.sqrt(weights**2 @ (squares - variance) ** 2) / (2 * np.maximum(variance, np.finfo(float).tiny))
        return dict(zip(names, errors.tolist(), strict=True))

    def shortfalls(self, diagnostics: Mapping[str, Diagnostics], target_ess: int) -> tuple[str, ...]:
        """What keeps the draws from being trusted, in words; empty if nothing does."""
        most, reasons = reliable_k(len(self.z)), []
        if not self.pareto_k <= most:
            reasons.append(
                f"the approximation that was corrected is too coarse, {self.pareto_k:.2f} where {most:.2f} is the most"
            )
        for name, d in diagnostics.items():
            low = min(d.ess_bulk, d.ess_tail)
            if not low >= target_ess:
                reasons.append(too_few(name, low, target_ess))
        return tuple(reasons)


def weighted_draws(
    mixture: Mixture, generator: np.random.Generator, enough: Callable[[Weighted], bool]
) -> Generator[np.ndarray, np.ndarray, Weighted]:
    """Weighted draws of a posterior; yields z (rows) and is sent their log densities.

    Args:
        mixture: What is drawn from.
        generator: Of everything random here.
        enough: Whether draws are enough.
    """
    z, log_density, log_proposed = np.zeros((0, mixture.center.shape[1])), np.zeros(0), np.zeros(0)
    for look in _LOOKS:
        while len(z) < look * BLOCK:
            more = mixture.draw(generator, BLOCK)
            z, log_density = np.concatenate([z, more]), np.concatenate([log_density, (yield more)])
            log_proposed = np.concatenate([log_proposed, mixture.log_density(more)])
        weighted = Weighted(z, log_density, log_proposed)
        if effective_draws(weighted.log_weights) < _WORTH * len(z) or enough(weighted):
            break
    return weighted


def effective_draws(log_weights: np.ndarray) -> float:
    """How many draws of equal weight weighted ones are worth."""
    weights = np.exp(log_weights - log_weights.max())
    return float(weights.sum() ** 2 / np.sum(weights**2))


def evened(log_weights: np.ndarray, wanted: float) -> np.ndarray:
    """Log weights of sum 1, to a power at which the draws are worth so many, where they are worth fewer."""
    power = 1.0
    while effective_draws(power * log_weights) < min(wanted, 0.5 * np.isfinite(log_weights).sum()):
        power *= 0.9
    weights = np.exp(power * (log_weights - log_weights.max()))
    with np.errstate(divide="ignore"):
        return np.log(weights / weights.sum())


def resample(weights: np.ndarray, count: int, begin: float) -> np.ndarray:
    """Systematic, from a place between 0 and 1: every draw as often as its weight says, to less than one."""
    places = (np.arange(count) + begin) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), places), len(weights) - 1)
