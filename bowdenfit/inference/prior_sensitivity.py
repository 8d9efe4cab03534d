r"""Prior sensitivity: would other priors, or another weight of the readings, change the results?

All answers come from weighted draws, without a refit.

Power scaling finds the priors that matter: the prior of every parameter is a standard normal in z, so its part of the log prior
is :math:`-z^2/2`, and raised to the power alpha it is a normal :math:`1/\sqrt\alpha` times as wide. Power scaling measures
small changes of the whole distribution and can miss that the width of an interval is proportional to the scale of a prior. So
the width is checked separately, with the scale of each prior doubled and halved and the draws weighted accordingly.

References:
    Kallioinen, Paananen, Bürkner and Vehtari, Detecting and diagnosing prior and likelihood sensitivity with
    power-scaling, Statistics and Computing 34 (2024), 57.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from bowdenfit.inference.diagnostics import array_stats
from bowdenfit.inference.psis import RELIABLE_K, power_weights, smooth_weights

if TYPE_CHECKING:
    from bowdenfit.parameters.priors import Prior
    from bowdenfit.parameters.space import Parameter

SENSITIVE = 0.05  # sensitivity above which a quantity counts as sensitive (Kallioinen and others 2024)
# Factor on a width, by a doubled or halved scale of a prior, above which the width is said to follow the prior; a judgement.
FOLLOWS = 1.15
# Prior standard deviations from the prior's median beyond which a prior that counts conflicts with the readings: 5 % of a
# normal prior lies beyond.
_CONFLICT_SDS = 2.0
FAR_SDS = 3.0  # such standard deviations beyond which any prior conflicts: 0.3 % of a normal prior lies beyond
_POWERS = (0.99, 1.01)  # priorsense's default
_TAILS = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class WidthSensitivity:
    """Change of the width of a quantity's 90 % interval with the scale of one prior.

    Args:
        parameter: The parameter whose prior it is.
        doubled, halved: Width with the scale of that prior doubled or halved, relative to the width; NaN where the weights are
            unreliable.
        k_doubled, k_halved: Pareto k of the weights.
    """

    parameter: str
    doubled: float
    halved: float
    k_doubled: float
    k_halved: float

    @property
    def size(self) -> float:
        """Larger of the two factors by which the width changes; NaN where the weights are unreliable."""
        known = [abs(np.log(ratio)) for ratio in (self.doubled, self.halved) if ratio > 0]
        return float(np.exp(max(known))) if known else float("nan")


@dataclass(frozen=True)
class Sensitivity:
    """Sensitivity of a quantity to the priors and to the readings.

    Args:
        quantity: Name of the quantity.
        parameter: The parameter whose prior matters most to it.
        prior, likelihood: Sensitivities to that prior, and to the weight of all readings together.
        median, sd: Median and standard deviation of the quantity.
        wider: Its median if the scale of that prior were doubled; NaN where the weights are unreliable.
        prior_sds: How far the posterior mean of that parameter lies from the prior's median, in the prior's own
            standard deviations (in z); 0 at an end of its range that the prior allows.
        widths: How the width of its interval follows every prior.
    """

    quantity: str
    parameter: str
    prior: float
    likelihood: float
    median: float
    sd: float
    wider: float
    prior_sds: float
    widths: tuple[WidthSensitivity, ...] = ()

    JSON: ClassVar = (..., "diagnosis")

    @property
    def diagnosis(self) -> str:
        """The conclusion: "readings decide", "prior decides", "conflict", "both count" or "prior sets the width"."""
        if not self.prior > SENSITIVE:
            return "prior sets the width" if self.followed or self.undetermined else "readings decide"
        if not self.likelihood > SENSITIVE:
            return "prior decides"
        return "conflict" if abs(self.prior_sds) > _CONFLICT_SDS else "both count"

    @property
    def followed(self) -> list[WidthSensitivity]:
        """Priors that the width of its interval follows, the strongest first."""
        return sorted((w for w in self.widths if w.size > FOLLOWS), key=lambda w: -w.size)

    @property
    def undetermined(self) -> list[str]:
        """Parameters for which the draws cannot show whether the width follows their priors."""
        return [w.parameter for w in self.widths if np.isnan(w.size)]


@dataclass(frozen=True)
class PriorConflict:
    """A parameter whose posterior lies where its prior hardly allows it.

    Args:
        parameter: Its name.
        prior_sds: How far the posterior median lies from the prior's, in the prior's own standard deviations (in z).
    """

    parameter: str
    prior_sds: float


def find_prior_conflicts(
    z: Mapping[str, np.ndarray], parameters: Mapping[str, "Parameter"]
) -> tuple[PriorConflict, ...]:
    """Return parameters beyond 3 standard deviations of their priors, except those at an end that the prior allows.

    Args:
        z: Draws of each parameter in z, by name.
        parameters: The parameters.
    """
    conflicts = [
        PriorConflict(name, _z_unless_at_end(parameters[name].prior.allowed_ends, float(np.median(draws))))
        for name, draws in z.items()
    ]
    return tuple(
        sorted(
            (conflict for conflict in conflicts if abs(conflict.prior_sds) > FAR_SDS),
            key=lambda conflict: -abs(conflict.prior_sds),
        )
    )


@dataclass(frozen=True)
class RescaledPrior:
    """Effect of other scales of one prior on the prior density of every draw.

    Args:
        doubled, halved: Log of the prior's density with its scale doubled or halved over its own, up to a constant.
        allowed_ends: See `Prior`.
    """

    doubled: np.ndarray
    halved: np.ndarray
    allowed_ends: tuple[bool, bool]


def rescale_prior(prior: "Prior", values: np.ndarray) -> RescaledPrior:
    """Rescale a prior, given draws of its parameter [internal units]."""
    doubled, halved = (np.asarray(prior.widening(values.ravel(), factor)) for factor in (2.0, 0.5))
    return RescaledPrior(doubled, halved, prior.allowed_ends)


def compute_sensitivities(
    quantities: Mapping[str, np.ndarray],
    z: Mapping[str, np.ndarray],
    log_likelihood: np.ndarray,
    priors: Mapping[str, RescaledPrior],
) -> tuple[Sensitivity, ...]:
    """Return how much each quantity depends on the priors and on the readings.

    Args:
        quantities: Draws by name, (chain, draw).
        z: Draws of each parameter in z, by name, (chain, draw).
        log_likelihood: Log likelihood summed over all readings, (chain, draw).
        priors: Rescaled prior of each parameter, by name.
    """
    of_readings = _make_power_scaling(log_likelihood)
    of_priors = {name: _make_power_scaling(-(values**2) / 2) for name, values in z.items()}
    weighted = {name: _ScaleWeights.of(prior) for name, prior in priors.items()}
    results = []
    for name, draws in quantities.items():
        by_prior = {parameter: sense(draws) for parameter, sense in of_priors.items()}
        most = max(by_prior, key=lambda parameter: by_prior[parameter])
        flat = draws.ravel()
        order = np.argsort(flat)
        plain = _quantiles(flat, order, np.ones(len(flat)))
        results.append(
            Sensitivity(
                name,
                most,
                by_prior[most],
                of_readings(draws),
                float(plain[1]),
                float(np.std(flat)),
                float(_quantiles(flat, order, weighted[most].doubled)[1]),
                _z_unless_at_end(priors[most].allowed_ends, float(np.mean(z[most]))),
                tuple(w.measure_width(parameter, flat, order, plain) for parameter, w in weighted.items()),
            )
        )
    return tuple(results)


def _z_unless_at_end(allowed_ends: tuple[bool, bool], z: float) -> float:
    """Return z, or 0 at an end of the range that the prior allows."""
    lower, upper = allowed_ends
    return 0.0 if (lower and z < 0) or (upper and z > 0) else z


@dataclass(frozen=True)
class _ScaleWeights:
    """Weights of the draws with the scale of one prior doubled and halved; NaN where few draws carry most of the weight."""

    doubled: np.ndarray
    halved: np.ndarray
    k_doubled: float
    k_halved: float

    @classmethod
    def of(cls, prior: RescaledPrior) -> "_ScaleWeights":
        """Compute the weights of a rescaled prior."""
        (doubled, k_doubled), (halved, k_halved) = (_reliable_weights(ratio) for ratio in (prior.doubled, prior.halved))
        return cls(doubled, halved, k_doubled, k_halved)

    def measure_width(self, parameter: str, values: np.ndarray, order: np.ndarray, plain: np.ndarray) -> WidthSensitivity:
        """Return the effect on the width of a quantity's interval."""
        wide, narrow = (_quantiles(values, order, weights) for weights in (self.doubled, self.halved))
        width = plain[2] - plain[0]  # none of an optimum that nine of ten draws have at the end of the range
        doubled, halved = (float((q[2] - q[0]) / width) if width > 0 else float("nan") for q in (wide, narrow))
        return WidthSensitivity(parameter, doubled, halved, self.k_doubled, self.k_halved)


def _reliable_weights(log_ratio: np.ndarray) -> tuple[np.ndarray, float]:
    """Return importance weights, NaN where Pareto k is too large, and Pareto k."""
    log_weights, pareto_k = smooth_weights(log_ratio)
    reliable = pareto_k <= RELIABLE_K
    return (np.exp(log_weights - log_weights.max()) if reliable else np.full(len(log_weights), np.nan)), pareto_k


def _quantiles(values: np.ndarray, order: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return 5 %, 50 % and 95 % quantiles of weighted draws, given the order that sorts them; NaN without weights."""
    if np.isnan(weights[0]):
        return np.full(len(_TAILS), np.nan)
    share = (np.cumsum(weights[order]) - weights[order] / 2) / np.sum(weights)
    return np.interp(_TAILS, share, values[order])


def _make_power_scaling(part: np.ndarray) -> Callable[[np.ndarray], float]:
    """Return a function that gives a quantity's sensitivity to one part of the log density."""
    lower, upper = (power_weights(part, alpha) for alpha in _POWERS)

    def measure_sensitivity(draws: np.ndarray) -> float:
        return float(array_stats().power_scale_sense(draws, lower, upper, *_POWERS))

    return measure_sensitivity
