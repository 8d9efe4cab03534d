"""Importance sampling of one posterior: proposals, weighted draws, and when they can be trusted.

The first proposal is a mixture about the maxima of the posterior. Only its draws are used as results: draws of proposals that
were learnt from them passed every check and came out 1 to 4 % too narrow, because a learnt proposal leaves out tails that no
draw has reached yet. Walkers that start from learnt proposals, however, forget their starts sooner.

References:
    Vehtari, Simpson, Gelman, Yao and Gabry 2024, "Pareto smoothed importance sampling" (JMLR 25), for when to trust it.
    Cappé, Douc, Guillin, Marin and Robert 2008, "Adaptive importance sampling in general mixture classes" (Statistics and
    Computing 18), for learning from weighted draws.
    Owen and Zhou 2000, "Safe and effective importance sampling" (Journal of the American Statistical Association 95), for the
    draws from the prior, and later from the first proposal, which bound the weights.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from bowdenfit.inference.diagnostics import Diagnostics, describe_low_ess
from bowdenfit.inference.psis import describe_uneven_weights, reliable_k, smooth_weights
from bowdenfit.inference.student_mixture import StudentMixture, start_mixture

_PRIOR_SHARE = 0.05  # share of the prior in the first proposal, which bounds the weights
_MAXIMA_SHARE = 0.1  # share of the first proposal in learnt ones
_PARTS, _FRICTION_PARTS = 6, 2  # components of learnt mixtures
_WIDE, _WIDE_SHARE = 2.5, 0.2  # one more component: how much wider than the draws, and its share
BLOCK = 2048  # draws made at a time
_LEARNING_STEPS = 2  # proposals learnt, one after the other
_MOST_BLOCKS = 16  # blocks drawn at most, where draws are good and more are needed
_LEAST_EFFICIENCY = 0.1  # effective draws per draw below which drawing stops
_LEAST_TO_LEARN_FROM = (  # effective draws needed to learn a proposal; weights are evened out until there are as many
    60  # effective draws at the least that say where to draw next; weights are made as even as that takes
)
_TAILS = (0.05, 0.95)


class ProposedPoints(NamedTuple):
    """The same points in two coordinates: z, and w, in which friction coefficients follow everything else.

    Args:
        w, z: One point a row; 0 where a point does not exist in the other coordinates.
        log_volume: Log of the volume in z of a unit of w; infinite where z has no w.
        log_density: Log density of the posterior in z; minus infinity where it does not exist.
    """

    w: Any
    z: Any
    log_volume: Any
    log_density: Any


@dataclass(frozen=True)
class MaximaProposal:
    """A mixture of Student t distributions in z, and the prior, a standard normal.

    Args:
        students: Student t distributions about the maxima.
    """

    students: StudentMixture

    def draw(self, generator: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Draw points; return them and whether each is a z (True) or a w."""
        n_prior = round(_PRIOR_SHARE * count)
        prior = generator.standard_normal((n_prior, self.students.center.shape[1]))
        z = np.concatenate([prior, self.students.draw(generator, count - n_prior)])
        return z, np.ones(count, dtype=bool)

    def log_density(self, at: ProposedPoints) -> np.ndarray:
        """Return the log density of the proposal in z."""
        prior = -0.5 * (np.einsum("ni,ni->n", at.z, at.z) + at.z.shape[1] * np.log(2 * np.pi))
        return np.logaddexp(self.students.log_density(at.z) + np.log1p(-_PRIOR_SHARE), prior + np.log(_PRIOR_SHARE))


@dataclass(frozen=True)
class LearntProposal:
    """Student t mixtures in w, one of friction coefficients and one of everything else, and draws of the first proposal.

    Args:
        first: The first proposal, about the maxima.
        groups: Parameters that are drawn together, and their mixture.
    """

    first: MaximaProposal
    groups: tuple[tuple[np.ndarray, StudentMixture], ...]

    def draw(self, generator: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
        """See `MaximaProposal`."""
        z, is_z = self.first.draw(generator, round(_MAXIMA_SHARE * count))
        w = np.zeros((count - len(z), z.shape[1]))
        for which, students in self.groups:
            w[:, which] = generator.permutation(
                students.draw(generator, len(w))
            )  # else the same parts would always meet
        return np.concatenate([z, w]), np.concatenate([is_z, np.zeros(len(w), dtype=bool)])

    def log_density(self, at: ProposedPoints) -> np.ndarray:
        """See `MaximaProposal`."""
        learnt = -at.log_volume
        for which, students in self.groups:
            learnt = learnt + students.log_density(at.w[:, which])
        return np.logaddexp(learnt + np.log1p(-_MAXIMA_SHARE), self.first.log_density(at) + np.log(_MAXIMA_SHARE))


Proposal: TypeAlias = MaximaProposal | LearntProposal


def learn_proposal(previous: Proposal, w: np.ndarray, friction: np.ndarray) -> LearntProposal:
    """Fit a proposal that is nearer to the posterior.

    Args:
        previous: The proposal before it.
        w: Approximate draws of the posterior, one a row.
        friction: Which parameters are friction coefficients.
    """
    first = previous.first if isinstance(previous, LearntProposal) else previous
    groups = []
    for which, parts in ((np.flatnonzero(friction), _FRICTION_PARTS), (np.flatnonzero(~friction), _PARTS)):
        if len(which):
            rows = w[:, which]
            groups.append(
                (which, start_mixture(rows, parts).refine(rows).with_wide_component(rows, _WIDE, _WIDE_SHARE))
            )
    return LearntProposal(first, tuple(groups))


@dataclass(frozen=True)
class WeightedDraws:
    """Weighted draws of one posterior.

    Args:
        w, z: One draw a row, in two coordinates; see `ProposedPoints`.
        log_density: Log density of the posterior; minus infinity where it does not exist.
        log_proposed: Log density of the proposal.
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
        """Smoothed log weights, whose exponentials sum to 1; minus infinity where the density cannot be computed."""
        return np.where(np.isfinite(self.log_density), self._smooth[0], -np.inf)

    @property
    def pareto_k(self) -> float:
        """Pareto k of the weights."""
        return self._smooth[1]

    @property
    def is_reliable(self) -> bool:
        """Whether the weights can be trusted."""
        return self.pareto_k <= reliable_k(len(self.z))

    def joined_with(self, other: "WeightedDraws") -> "WeightedDraws":
        """Return these draws and more of the same proposal."""
        both = zip(*map(_list_fields, (self, other)), strict=True)
        return WeightedDraws(*(np.concatenate([own, more]) for own, more in both))

    def diagnose(self, names: tuple[str, ...]) -> dict[str, Diagnostics]:
        """Return diagnostics by parameter; weighted draws have no R-hat and no drift (section 3.2.3 for the errors)."""
        return diagnose_weighted(self.z, np.exp(self.log_weights), names)

    def estimate_sd_errors(self, names: tuple[str, ...]) -> dict[str, float]:
        """Return relative errors of standard deviations (section 3.2.3, of the squared deviations)."""
        weights = np.exp(self.log_weights)
        squares = (self.z - weights @ self.z) ** 2
        variance = weights @ squares
        errors = np.sqrt(weights**2 @ (squares - variance) ** 2) / (2 * np.maximum(variance, np.finfo(float).tiny))
        return dict(zip(names, errors.tolist(), strict=True))

    def describe_shortfalls(self, diagnostics: Mapping[str, Diagnostics], target_ess: int) -> tuple[str, ...]:
        """Describe why the draws should not be trusted; empty if they can be."""
        reasons = list(describe_uneven_weights(self.pareto_k, len(self.z)))
        for name, d in diagnostics.items():
            low = min(d.ess_bulk, d.ess_tail)
            if not low >= target_ess:
                reasons.append(describe_low_ess(name, low, target_ess))
        return tuple(reasons)


def diagnose_weighted(values: np.ndarray, weights: np.ndarray, names: tuple[str, ...]) -> dict[str, Diagnostics]:
    """Return diagnostics of weighted draws by quantity; those have no R-hat and no drift (section 3.2.3 for the errors).

    Args:
        values: Values of every quantity, (draw, quantity).
        weights: Weights of the draws, which sum to 1.
        names: Names of the quantities.
    """
    squares, apart = weights**2, (values - weights @ values) ** 2
    error, ends = squares @ apart, np.quantile(values[resample(weights, BLOCK, 0.5)], _TAILS, axis=0)
    tails = [p * (1 - p) / (squares @ ((values <= at) - p) ** 2) for p, at in zip(_TAILS, ends, strict=True)]
    bulk = (weights @ apart) / np.maximum(error, np.finfo(float).tiny)
    bulk = np.where(np.ptp(values, axis=0) > 0, bulk, len(values))  # such as an optimum always at the edge
    unknown = float("nan")
    return {
        name: Diagnostics(unknown, float(bulk[i]), float(min(t[i] for t in tails)), float(np.sqrt(error[i])), unknown)
        for i, name in enumerate(names)
    }


def _list_fields(draws: WeightedDraws) -> tuple[np.ndarray, ...]:
    return draws.w, draws.z, draws.log_density, draws.log_proposed


@dataclass(frozen=True)
class ImportanceSampler:
    """Importance sampling of one posterior.

    Args:
        evaluate: Function that evaluates `BLOCK` points, each of them a z (True) or a w.
        friction: Which parameters are friction coefficients.
        enough: Function that says whether draws are enough.
    """

    evaluate: Callable[[np.ndarray, np.ndarray], ProposedPoints]
    friction: np.ndarray
    enough: Callable[[WeightedDraws], bool]

    def draw_enough(self, first: MaximaProposal, generator: np.random.Generator) -> WeightedDraws:
        """Draw until the draws are enough, or until more would not help.

        Args:
            first: The proposal.
            generator: Random generator.
        """
        draws = self._draw_blocks(first, generator, 1)
        while _is_promising(draws) and not self.enough(draws):
            draws = draws.joined_with(self._draw_blocks(first, generator, len(draws.z) // BLOCK))
        return draws

    def draw_nearer(self, draws: WeightedDraws, first: MaximaProposal, generator: np.random.Generator) -> WeightedDraws:
        """Return draws of learnt proposals, nearer to the posterior, for walkers to start from."""
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
            finite = np.isfinite(at.log_density) & np.isfinite(log_proposed)
            parts.append((at.w, at.z, np.where(finite, at.log_density, -np.inf), np.where(finite, log_proposed, 0.0)))
        return WeightedDraws(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _is_promising(draws: WeightedDraws) -> bool:
    """Return whether more draws from the same proposal may be enough."""
    return len(draws.z) < _MOST_BLOCKS * BLOCK and effective_sample_size(draws.log_weights) >= _LEAST_EFFICIENCY * len(
        draws.z
    )


def effective_sample_size(log_weights: np.ndarray) -> float:
    """Return how many draws of equal weight the weighted ones are worth."""
    weights = np.exp(log_weights - log_weights.max())
    return float(weights.sum() ** 2 / np.sum(weights**2))


def even_weights(log_weights: np.ndarray, wanted: float) -> np.ndarray:
    """Return log weights raised to a power at which at least `wanted` effective draws are left; their exponentials sum to 1."""
    power = 1.0
    while effective_sample_size(power * log_weights) < min(wanted, 0.5 * np.isfinite(log_weights).sum()):
        power *= 0.9
    weights = np.exp(power * (log_weights - log_weights.max()))
    with np.errstate(divide="ignore"):
        return np.log(weights / weights.sum())


def resample(weights: np.ndarray, count: int, offset: float) -> np.ndarray:
    """Return indices of a systematic resample: every draw as often as its weight says, to less than one.

    `offset` lies between 0 and 1.
    """
    positions = (np.arange(count) + offset) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), positions), len(weights) - 1)
