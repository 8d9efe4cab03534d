r"""Identifiability: which combinations of parameters the measurements determine, and which are left to their priors.

In units of the prior's standard deviations the posterior covariance S has eigenvalues between 0 and 1:
the share of the prior variance that is left along each eigenvector. With the prior's unit information,
:math:`S = (J^\top J + I)^{-1}`, so an eigenvalue s belongs to Fisher information 1/s - 1 in units of the prior's. An
eigenvector v is a combination of the parameters with the weights v / (standard deviation of the prior).

References:
    Bates and Watts 1988, Nonlinear Regression Analysis and Its Applications, chapter 3; Gelman, Simpson and Betancourt
    2017, "The prior can often only be understood in the context of the likelihood" (Entropy 19).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.words import significant

# All are judgements. Share of the prior variance below which a parameter may be identified by itself: half the prior's
# standard deviation.
IDENTIFIABLE = 0.25
PRIOR_DOMINATED = 0.8  # share of the prior variance above which the estimate is the prior's
UNINFORMED = 0.9  # share of the prior variance above which the measurements carry no information about a combination
_DETERMINED = 0.25  # share of the prior variance below which a combination counts as determined
_LEAST_WEIGHT = 0.3  # weight in a combination left to the prior, beyond which a parameter is not identified by itself
# variance inflation and share of the prior variance beyond which a parameter is only bounded by a sum
_INFLATED, _BOUNDED = 100.0, 0.1
_PART = 0.1  # weight, in units of the prior's standard deviation, below which a parameter is left out of a combination
_SHARPER = 0.5  # a combination is named if its relative error is below this share of the best single parameter's


@dataclass(frozen=True)
class ParameterContraction:
    """Contraction of one parameter from prior to posterior, in its shown unit.

    Args:
        name: Its name.
        value: Estimate.
        sd: Posterior standard deviation.
        prior_sd: Standard deviation of the prior, at the estimate.
        most_correlated: The parameter that it is most correlated with; empty if there is only one.
        correlation: Correlation with that parameter.
        inflation: Variance inflation factor: its variance over that with all other parameters known.
    """

    name: str
    value: float
    sd: float
    prior_sd: float
    most_correlated: str
    correlation: float
    inflation: float

    JSON: ClassVar = (..., "contraction")

    @property
    def share(self) -> float:
        """Share of the prior variance that is left: 0 where the measurements decide, 1 where the prior does."""
        return (self.sd / self.prior_sd) ** 2

    @property
    def contraction(self) -> float:
        """Posterior contraction: 1 minus the share of the prior variance that is left."""
        return 1 - self.share


@dataclass(frozen=True)
class Combination:
    """A weighted sum of parameters, in shown units.

    Args:
        weights: Weights by name, rounded to two digits; the leading one is 1.
        value: Estimate.
        sd: Standard deviation.
        share: Share of the prior variance left along the direction.
    """

    weights: dict[str, float]
    value: float
    sd: float
    share: float

    JSON: ClassVar = (..., "information", "words")

    @property
    def information(self) -> float:
        """Fisher information along the direction, in units of the prior's."""
        return 1 / max(self.share, 1e-300) - 1

    @property
    def words(self) -> str:
        """The combination in words, such as "mu2 + 0.8 mu1"."""
        lead, *others = self.weights
        factors = {name: "" if abs(w) == 1 else f"{significant(abs(w), 2)} " for name, w in self.weights.items()}
        return " ".join([lead, *(f"{'-' if self.weights[n] < 0 else '+'} {factors[n]}{n}" for n in others)])


@dataclass(frozen=True)
class CovarianceAnalysis:
    """Parameters and combinations that a posterior covariance determines.

    Args:
        parameters: Contraction of each parameter.
        unidentified: Names of parameters that are not identified by themselves.
        directions: All independent combinations, the best determined first.
        determined: Combinations of parameters not identified by themselves that are determined all the same.
        sharpest: The best determined combination, where it is known much better than any single parameter.
        collinearity: Condition number of the Fisher information of the parameters, scaled to unit diagonal: 1 where they are
            orthogonal, beyond 1000 where they cannot be distinguished.
    """

    parameters: tuple[ParameterContraction, ...]
    unidentified: tuple[str, ...]
    directions: tuple[Combination, ...]
    determined: tuple[Combination, ...]
    sharpest: Combination | None
    collinearity: float

    JSON: ClassVar = (
        "parameters",
        "directions",
        ("determined", "sums"),
        ("resting_on_prior", "resting"),
        "collinearity",
    )

    @property
    def identified(self) -> tuple[ParameterContraction, ...]:
        """Parameters that are identified by themselves."""
        return tuple(p for p in self.parameters if p.name not in self.unidentified)

    @property
    def on_prior(self) -> tuple[ParameterContraction, ...]:
        """Parameters left to their priors that belong to no determined combination."""
        return tuple(p for p in self._unexplained if p.share > PRIOR_DOMINATED)

    @property
    def sums(self) -> list[str]:
        """Determined combinations, in words."""
        return [combination.words for combination in self.determined]

    @property
    def resting(self) -> list[str]:
        """Names of the parameters that are left to their priors."""
        return [p.name for p in self.on_prior]

    @property
    def partly_identified(self) -> tuple[ParameterContraction, ...]:
        """Parameters that measurements and prior determine about equally."""
        return tuple(p for p in self._unexplained if p.share <= PRIOR_DOMINATED)

    @property
    def _unexplained(self) -> tuple[ParameterContraction, ...]:
        """Parameters identified neither by themselves nor in a combination."""
        combined = {name for combination in self.determined for name in combination.weights}
        return tuple(p for p in self.parameters if p.name in self.unidentified and p.name not in combined)

    @property
    def undetermined(self) -> Combination | None:
        """The least determined combination, where the measurements carry no information about it; otherwise None."""
        worst = max(self.directions, key=lambda d: d.share, default=None)
        return worst if worst is not None and worst.share > UNINFORMED else None


def analyze_covariance(
    names: Sequence[str], value: np.ndarray, covariance: np.ndarray, prior_sd: np.ndarray
) -> CovarianceAnalysis:
    """Analyze which parameters and combinations a posterior covariance determines, given estimates and independent priors."""
    scaled = covariance / np.outer(prior_sd, prior_sd)

    def combinations(which: np.ndarray) -> Iterator[Combination]:
        """Yield independent combinations of some parameters, the best determined first."""
        if len(which):
            shares, vectors = np.linalg.eigh(scaled[np.ix_(which, which)])
            for share, vector in zip(shares, vectors.T, strict=True):
                weights = np.zeros(len(names))
                weights[which], kept = _round_weights(vector, prior_sd[which])
                sd = float(np.sqrt(max(weights @ covariance @ weights, 0.0)))
                by_name = {names[i]: float(weights[i]) for i in which[kept]}
                yield Combination(by_name, float(weights @ value), sd, float(np.clip(share, 0.0, 1.0)))

    directions, tangled = tuple(combinations(np.arange(len(names)))), _find_unidentified(scaled)
    return CovarianceAnalysis(
        _contract_parameters(names, value, covariance, prior_sd),
        tuple(names[i] for i in tangled),
        directions,
        tuple(c for c in combinations(tangled) if c.share < _DETERMINED and len(c.weights) > 1),
        _find_sharpest(directions, value, covariance),
        _collinearity(scaled),
    )


def _find_unidentified(scaled: np.ndarray) -> np.ndarray:
    """Find parameters that are not identified by themselves: weakly, or only as part of a much better known sum.

    The larger part of a sum is bounded by the sum, since the other parts cannot be negative; that does not identify it.
    """
    shares, vectors = np.linalg.eigh(scaled)
    share, inflation = np.diag(scaled), np.diag(scaled) * np.diag(np.linalg.inv(scaled))
    open_ends = np.any((np.abs(vectors) > _LEAST_WEIGHT) & (shares > PRIOR_DOMINATED), axis=1)
    bounded = (inflation > _INFLATED) & (share > _BOUNDED)
    return np.flatnonzero((share >= IDENTIFIABLE) | open_ends | bounded)


def _round_weights(vector: np.ndarray, prior_sd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return an eigenvector's weights, small ones dropped, rounded to two digits; and the parameters kept, largest first."""
    lead = int(np.argmax(np.abs(vector)))
    weights = (vector / prior_sd) / (vector[lead] / prior_sd[lead])
    retained = np.array(sorted(np.flatnonzero(np.abs(vector) >= _PART), key=lambda i: -abs(vector[i])), dtype=int)
    rounded = np.zeros(len(vector))
    rounded[retained] = [float(f"{weights[i]:.2g}") for i in retained]
    return rounded, retained


def _find_sharpest(directions: Sequence[Combination], value: np.ndarray, covariance: np.ndarray) -> Combination | None:
    """Return the best determined combination, if it has several parameters and is known much better than each."""
    best = directions[0] if directions else None
    if best is None or len(best.weights) < 2 or best.value <= 0:
        return None
    singly = np.min(np.sqrt(np.diag(covariance)) / np.maximum(np.abs(value), 1e-300))
    return best if best.sd / best.value < _SHARPER * singly else None


def _contract_parameters(
    names: Sequence[str], value: np.ndarray, covariance: np.ndarray, prior_sd: np.ndarray
) -> tuple[ParameterContraction, ...]:
    """Return the contraction of each parameter."""
    sd, contractions = np.sqrt(np.diag(covariance)), []
    for i, name in enumerate(names):
        correlation = covariance[i] / np.maximum(sd[i] * sd, 1e-300)
        correlation[i] = 0.0
        other = int(np.argmax(np.abs(correlation)))
        correlated = (names[other], float(correlation[other])) if len(names) > 1 else ("", 0.0)
        # Information on one parameter with all others known: that of the measurements and that of the prior.
        information = float(np.linalg.inv(covariance)[i, i])
        inflation = float(covariance[i, i] * information)
        contractions.append(
            ParameterContraction(name, float(value[i]), float(sd[i]), float(prior_sd[i]), *correlated, inflation)
        )
    return tuple(contractions)


def _collinearity(scaled: np.ndarray) -> float:
    """Return the condition number of the information of the measurements, scaled to unit diagonal; infinite if one has none."""
    information = np.linalg.inv(scaled) - np.eye(len(scaled))
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    if not len(size) or np.any(size <= 1e-6):
        return float("inf") if len(size) else 1.0
    values = np.linalg.eigvalsh(information / np.outer(size, size))
    return float(values[-1] / values[0]) if values[0] > 1e-12 * values[-1] else float("inf")
