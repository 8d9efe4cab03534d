"""Importance sampling of one posterior from about its maxima; and, where it is not good enough, from where its draws have been.

Only draws of the first proposal are believed. Those of learnt ones passed every check and came out 1 to 4 % too narrow, because
they leave out tails that no draw was in yet; but walkers that start at them forget sooner where they started.

References:
    Vehtari, Simpson, Gelman, Yao and Gabry 2024, "Pareto smoothed importance sampling" (JMLR 25), for when to trust it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bowdenfit.inference.batch.proposals import MaximaProposal, Proposal, ProposedPoints, learn_proposal
from bowdenfit.inference.diagnostics import Diagnostics, describe_low_ess
from bowdenfit.inference.psis import reliable_k, smooth_weights

BLOCK = 2048  # draws at once
_LEARNING_STEPS = 2  # proposals, one after the other
_MOST_BLOCKS = 16  # blocks, where draws are good and not yet enough
_LEAST_EFFICIENCY = 0.1  # effective draws a draw; of fewer, no more are drawn
_LEAST_TO_LEARN_FROM = 60  # effective draws at the least that say where to draw next; weights are made as even as that takes
_TAILS = (0.05, 0.95)


@dataclass(frozen=True)
class WeightedDraws:
    """Weighted draws.

    Args:
        w, z: One a row, in two coordinates; see `ProposedPoints`.
        log_density: Of the posterior; minus infinity where there is no z, or no density.
        log_proposed: Of what they were drawn from.
    """

    w: np.ndarray
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

    @property
    def is_reliable(self) -> bool:
        """Whether the weights can be trusted."""
        return self.pareto_k <= reliable_k(len(self.z))

    def joined_with(self, other: "WeightedDraws") -> "WeightedDraws":
        """These and more from the same proposal."""
        both = zip(*map(_fields, (self, other)), strict=True)
        return WeightedDraws(*(np.concatenate([own, more]) for own, more in both))

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

    def estimate_sd_errors(self, names: tuple[str, ...]) -> dict[str, float]:
        """Monte Carlo error of each standard deviation as a share of it (section 3.2.3, of the square deviations)."""
        weights = np.exp(self.log_weights)
        squares = (self.z - weights @ self.z) ** 2
        variance = weights @ squares
        errors = np.sqrt(weights**2 @ (squares - variance) ** 2) / (2 * np.maximum(variance, np.finfo(float).tiny))
        return dict(zip(names, errors.tolist(), strict=True))

    def describe_shortfalls(self, diagnostics: Mapping[str, Diagnostics], target_ess: int) -> tuple[str, ...]:
        """What keeps the draws from being trusted, in words; empty if nothing does."""
        reasons = []
        if not self.is_reliable:
            reasons.append(
                f"the weights of the draws are too uneven, Pareto k {self.pareto_k:.2f} where "
                f"{reliable_k(len(self.z)):.2f} is the most"
            )
        for name, d in diagnostics.items():
            low = min(d.ess_bulk, d.ess_tail)
            if not low >= target_ess:
                reasons.append(describe_low_ess(name, low, target_ess))
        return tuple(reasons)


def _fields(of: WeightedDraws) -> tuple[np.ndarray, ...]:
    return of.w, of.z, of.log_density, of.log_proposed


@dataclass(frozen=True)
class ImportanceSampler:
    """What is to be drawn.

    Args:
        evaluate: Of `BLOCK` points, of each of which it is said whether it is a z.
        friction: Which parameters are friction coefficients.
        enough: Whether draws are enough.
    """

    evaluate: Callable[[np.ndarray, np.ndarray], ProposedPoints]
    friction: np.ndarray
    enough: Callable[[WeightedDraws], bool]

    def draw_enough(self, first: MaximaProposal, generator: np.random.Generator) -> WeightedDraws:
        """Draws that are enough, or as many as promise to be.

        Args:
            first: What they are drawn from.
            generator: Of everything random here.
        """
        draws = self._draw_blocks(first, generator, 1)
        while _is_promising(draws) and not self.enough(draws):
            draws = draws.joined_with(self._draw_blocks(first, generator, len(draws.z) // BLOCK))
        return draws

    def draw_nearer(self, draws: WeightedDraws, first: MaximaProposal, generator: np.random.Generator) -> WeightedDraws:
        """Draws nearer to the posterior than those found, for walkers to start at."""
        proposal: Proposal = first
        for _ in range(_LEARNING_STEPS):
            chosen = resample(np.exp(even_weights(draws.log_weights, _LEAST_TO_LEARN_FROM)), BLOCK, 0.5)
            proposal = learn_proposal(proposal, draws.w[chosen], self.friction)
            draws = self._draw_blocks(proposal, generator, 1)
        return draws

    def _draw_blocks(self, proposal: Proposal, generator: np.random.Generator, blocks: int) -> WeightedDraws:
        parts = []
        for _ in range(blocks):
            at = self.evaluate(*proposal.draw(generator, BLOCK))
            log_proposed = proposal.log_density(at)
            known = np.isfinite(at.log_density) & np.isfinite(log_proposed)
            parts.append((at.w, at.z, np.where(known, at.log_density, -np.inf), np.where(known, log_proposed, 0.0)))
        return WeightedDraws(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _is_promising(draws: WeightedDraws) -> bool:
    """Whether more draws from the same proposal may be enough."""
    return len(draws.z) < _MOST_BLOCKS * BLOCK and effective_sample_size(draws.log_weights) >= _LEAST_EFFICIENCY * len(draws.z)


def effective_sample_size(log_weights: np.ndarray) -> float:
    """How many draws of equal weight weighted ones are worth."""
    weights = np.exp(log_weights - log_weights.max())
    return float(weights.sum() ** 2 / np.sum(weights**2))


def even_weights(log_weights: np.ndarray, wanted: float) -> np.ndarray:
    """Log weights of sum 1, to a power at which the draws are worth so many, where they are worth fewer."""
    power = 1.0
    while effective_sample_size(power * log_weights) < min(wanted, 0.5 * np.isfinite(log_weights).sum()):
        power *= 0.9
    weights = np.exp(power * (log_weights - log_weights.max()))
    with np.errstate(divide="ignore"):
        return np.log(weights / weights.sum())


def resample(weights: np.ndarray, count: int, offset: float) -> np.ndarray:
    """Systematic, from a place between 0 and 1: every draw as often as its weight says, to less than one."""
    positions = (np.arange(count) + offset) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), positions), len(weights) - 1)
