r"""Which combinations of parameters the measurements determine, and which rest on their priors.

In units of the prior's standard deviations the covariance S that the measurements leave has eigenvalues between 0 and 1:
the share of the prior variance that is left along each eigenvector. With the prior's unit information,
:math:`S = (J^\top J + I)^{-1}`, so an eigenvalue s belongs to Fisher information 1/s - 1 in units of the prior's. An
eigenvector v is a combination of the parameters with the weights v / (standard deviation of the prior).

References:
    Bates and Watts 1988, Nonlinear Regression Analysis and Its Applications, chapter 3; Gelman, Simpson and Betancourt
    2017, "The prior can often only be understood in the context of the likelihood" (Entropy 19).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.inference.compilation import compiled
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import noise_scales

OWN = 0.25  # share of the prior variance below which a parameter may be known by itself: half the prior's sd
RESTS_ON_PRIOR = 0.8  # share above which the prior alone speaks
NOTHING = 0.9  # share above which the measurements say nothing of a combination
_DETERMINED = 0.25  # share below which a combination counts as determined
_TANGLED = 0.3  # weight in a combination that rests on the prior, beyond which a parameter is not known by itself
_INFLATED, _BOUNDED = 100.0, 0.1  # variance inflation and share beyond which a parameter is only bounded by a sum
_PART = 0.1  # weight, in units of the prior's sd, below which a parameter does not belong to a combination
_SHARPER = 0.5  # a combination is worth naming if it is known to less than this share of its best single parameter


@dataclass(frozen=True)
class Known:
    """What is known of one parameter, in its shown unit.

    Args:
        name: Its name.
        value: Estimate.
        sd: Standard deviation that the measurements and the prior leave.
        prior_sd: Standard deviation of the prior, at the estimate.
        most_alike: The parameter that it is most correlated with; empty of one alone.
        correlation: With that.
        inflation: How much larger its variance is than if all others were known (variance inflation factor).
    """

    name: str
    value: float
    sd: float
    prior_sd: float
    most_alike: str
    correlation: float
    inflation: float

    JSON: ClassVar = (..., "contraction")

    @property
    def share(self) -> float:
        """Share of the prior variance that is left; 0 where the measurements decide, 1 where the prior does."""
        return (self.sd / self.prior_sd) ** 2

    @property
    def contraction(self) -> float:
        """1 less the share that is left."""
        return 1 - self.share


@dataclass(frozen=True)
class Combination:
    """A weighted sum of parameters, in shown units.

    Args:
        weights: By name, the leading one 1; two digits.
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
        """Such as "mu2 + 0.8 mu1"."""
        lead, *others = self.weights.items()
        signed = [f"{'-' if weight < 0 else '+'} {_factor(abs(weight))}{name}" for name, weight in others]
        return " ".join([lead[0], *signed])


@dataclass(frozen=True)
class Knowledge:
    """What is known of several parameters together.

    Args:
        parameters: One by one.
        tangled: Names of those that are not known by themselves.
        directions: All independent combinations, the best determined first.
        determined: Combinations of parameters not known by themselves that are determined all the same.
        sharpest: The best determined combination, where it is known much better than any single parameter.
        collinearity: Condition number of the Fisher information of the parameters, scaled to unit diagonal: 1 where they
            are told apart, beyond 1000 where they are not.
    """

    parameters: tuple[Known, ...]
    tangled: tuple[str, ...]
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
    def by_themselves(self) -> tuple[Known, ...]:
        """Parameters that are known each by itself."""
        return tuple(p for p in self.parameters if p.name not in self.tangled)

    @property
    def on_prior(self) -> tuple[Known, ...]:
        """Parameters that rest on their priors and belong to no combination that is determined."""
        return tuple(p for p in self._left if p.share > RESTS_ON_PRIOR)

    @property
    def sums(self) -> list[str]:
        """Combinations that are determined, in words."""
        return [combination.words for combination in self.determined]

    @property
    def resting(self) -> list[str]:
        """Names of the parameters that rest on their priors."""
        return [p.name for p in self.on_prior]

    @property
    def partly(self) -> tuple[Known, ...]:
        """Parameters that measurements and prior determine about equally."""
        return tuple(p for p in self._left if p.share <= RESTS_ON_PRIOR)

    @property
    def _left(self) -> tuple[Known, ...]:
        """Parameters known neither by themselves nor in a combination."""
        combined = {name for combination in self.determined for name in combination.weights}
        return tuple(p for p in self.parameters if p.name in self.tangled and p.name not in combined)

    @property
    def undetermined(self) -> Combination | None:
        """The least known combination, where the measurements say nothing of it; else None."""
        worst = max(self.directions, key=lambda d: d.share, default=None)
        return worst if worst is not None and worst.share > NOTHING else None


def information_at(posterior: LogDensity, z: np.ndarray) -> MaximumPosterior:
    """A point and the covariance that measurements would leave there, at the noise scales of that point.

    Args:
        posterior: The posterior, of readings without noise.
        z: The true values, in z.
    """

    def residuals(at: Array, data: Any) -> Array:
        return jnp.concatenate(list(posterior.residuals(at, data).values()))

    jacobian = compiled(
        jax.jacfwd(residuals), jax.ShapeDtypeStruct(z.shape, jnp.float64), posterior.data, run_once=True
    )
    slopes = np.where(noise_scales(posterior), 0.0, np.asarray(jacobian(z, posterior.data)))
    return MaximumPosterior(z, np.linalg.inv(slopes.T @ slopes + np.eye(len(z))))


def knowledge(names: Sequence[str], value: np.ndarray, covariance: np.ndarray, prior_sd: np.ndarray) -> Knowledge:
    """What a covariance says of parameters whose priors are independent.

    Args:
        names: Of the parameters.
        value: Their estimates.
        covariance: That measurements and priors leave.
        prior_sd: Standard deviations of the priors, at the estimates.
    """
    scaled = covariance / np.outer(prior_sd, prior_sd)
    directions = _combinations(names, value, covariance, prior_sd, np.arange(len(names)))
    tangled = _tangled(scaled)
    determined = tuple(
        c
        for c in _combinations(names, value, covariance, prior_sd, tangled)
        if c.share < _DETERMINED and len(c.weights) > 1
    )
    return Knowledge(
        tuple(_known(names, value, covariance, prior_sd, i) for i in range(len(names))),
        tuple(names[i] for i in tangled),
        directions,
        determined,
        _sharpest(directions, value, covariance),
        _collinearity(scaled),
    )


def _tangled(scaled: np.ndarray) -> np.ndarray:
    """Which parameters are not known by themselves: little, or as part of a sum that is known far better than its parts.

    The larger part of a sum is bounded by the sum, since the others cannot be negative; that does not make it known.
    """
    shares, vectors = np.linalg.eigh(scaled)
    share, inflation = np.diag(scaled), np.diag(scaled) * np.diag(np.linalg.inv(scaled))
    open_ends = np.any((np.abs(vectors) > _TANGLED) & (shares > RESTS_ON_PRIOR), axis=1)
    bounded = (inflation > _INFLATED) & (share > _BOUNDED)
    return np.flatnonzero((share >= OWN) | open_ends | bounded)


def _combinations(
    names: Sequence[str], value: np.ndarray, covariance: np.ndarray, prior_sd: np.ndarray, which: np.ndarray
) -> tuple[Combination, ...]:
    """Independent combinations of some of the parameters, the best determined first."""
    if not len(which):
        return ()
    scaled = (covariance / np.outer(prior_sd, prior_sd))[np.ix_(which, which)]
    shares, vectors = np.linalg.eigh(scaled)
    return tuple(
        _combination(names, value, covariance, prior_sd, which, vectors[:, i], float(shares[i]))
        for i in range(len(which))
    )


def _combination(
    names: Sequence[str],
    value: np.ndarray,
    covariance: np.ndarray,
    prior_sd: np.ndarray,
    which: np.ndarray,
    vector: np.ndarray,
    share: float,
) -> Combination:
    """The combination of one eigenvector, as it is printed: small parts dropped, weights of two digits."""
    lead = int(np.argmax(np.abs(vector)))
    weights = np.zeros(len(names))
    weights[which] = (vector / prior_sd[which]) / (vector[lead] / prior_sd[which[lead]])
    kept = sorted(np.flatnonzero(np.abs(vector) >= _PART), key=lambda i: -abs(vector[i]))
    rounded = np.zeros(len(names))
    for i in which[kept]:
        rounded[i] = float(f"{weights[i]:.2g}")
    sd = float(np.sqrt(max(rounded @ covariance @ rounded, 0.0)))
    by_name = {names[i]: float(rounded[i]) for i in which[kept]}
    return Combination(by_name, float(rounded @ value), sd, float(np.clip(share, 0.0, 1.0)))


def _sharpest(directions: Sequence[Combination], value: np.ndarray, covariance: np.ndarray) -> Combination | None:
    """The best determined combination, if it is of several parameters and known much better than each."""
    best = directions[0] if directions else None
    if best is None or len(best.weights) < 2 or best.value <= 0:
        return None
    singly = np.min(np.sqrt(np.diag(covariance)) / np.maximum(np.abs(value), 1e-300))
    return best if best.sd / best.value < _SHARPER * singly else None


def _known(names: Sequence[str], value: np.ndarray, covariance: np.ndarray, prior_sd: np.ndarray, i: int) -> Known:
    sd = np.sqrt(np.diag(covariance))
    correlation = covariance[i] / np.maximum(sd[i] * sd, 1e-300)
    correlation[i] = 0.0
    other = int(np.argmax(np.abs(correlation))) if len(names) > 1 else -1
    # Information on one parameter with all others known: that of the measurements and that of the prior.
    alone = float(np.linalg.inv(covariance)[i, i])
    alike = (names[other], float(correlation[other])) if other >= 0 else ("", 0.0)
    return Known(names[i], float(value[i]), float(sd[i]), float(prior_sd[i]), *alike, float(covariance[i, i] * alone))


def _collinearity(scaled: np.ndarray) -> float:
    """Condition number of the information of the measurements, each parameter scaled to 1; infinite if one has none."""
    information = np.linalg.inv(scaled) - np.eye(len(scaled))
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    if not len(size) or np.any(size <= 1e-6):
        return float("inf") if len(size) else 1.0
    values = np.linalg.eigvalsh(information / np.outer(size, size))
    return float(values[-1] / values[0]) if values[0] > 1e-12 * values[-1] else float("inf")


def _factor(weight: float) -> str:
    return "" if weight == 1 else f"{weight:.2g} "
