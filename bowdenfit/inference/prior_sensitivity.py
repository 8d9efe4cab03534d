r"""Would other priors, or other weight on the readings, change what was found? By power scaling, without another fit.

The prior of every parameter is a standard normal in z, so that its share of the log prior is :math:`-z^2/2`. Raised to the
power alpha it is the same normal, :math:`1/\sqrt\alpha` times as wide about its median. The draws are weighted accordingly.

References:
    Kallioinen, Paananen, Bürkner and Vehtari, Detecting and diagnosing prior and likelihood sensitivity with
    power-scaling, Statistics and Computing 34 (2024), 57.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.inference.psis import RELIABLE_K, smooth_weights

SENSITIVE = 0.05  # from which a quantity is said to be sensitive
_CONFLICT = 2.0  # prior standard deviations from the prior's median to the posterior, beyond which the two are at odds
_POWERS = (0.99, 1.01)
_WIDER = 0.5  # power at which a prior is sqrt(2) times as wide


@dataclass(frozen=True)
class Sensitivity:
    """How much a quantity depends on one prior and on the readings.

    Args:
        quantity: Name of the quantity.
        parameter: The parameter whose prior matters most to it.
        prior, likelihood: Sensitivities to that prior, and to the weight of all readings together.
        median, sd: Of the quantity.
        wider: Its median were that prior 1.4 times as wide; NaN where the draws cannot tell.
        prior_sds: How far the posterior mean of that parameter lies from the prior's median, in the prior's own
            standard deviations (in z).
    """

    quantity: str
    parameter: str
    prior: float
    likelihood: float
    median: float
    sd: float
    wider: float
    prior_sds: float

    JSON: ClassVar = (..., "diagnosis")

    @property
    def diagnosis(self) -> str:
        """What it means: "readings decide", "prior decides", "conflict", or "both count"."""
        if not self.prior > SENSITIVE:
            return "readings decide"
        if not self.likelihood > SENSITIVE:
            return "prior decides"
        return "conflict" if abs(self.prior_sds) > _CONFLICT else "both count"


def sensitivities(
    quantities: Mapping[str, np.ndarray], z: Mapping[str, np.ndarray], log_likelihood: np.ndarray
) -> tuple[Sensitivity, ...]:
    """How much each quantity depends on the priors and on the readings.

    Args:
        quantities: Draws by name, (chain, draw).
        z: Draws of each parameter in z, by name, (chain, draw).
        log_likelihood: Sum over all readings, (chain, draw).
    """
    of_readings = _scaled(log_likelihood)
    log_priors = {name: -(values**2) / 2 for name, values in z.items()}
    of_priors = {name: _scaled(part) for name, part in log_priors.items()}
    found = []
    for name, draws in quantities.items():
        by_prior = {parameter: sense(draws) for parameter, sense in of_priors.items()}
        most = max(by_prior, key=lambda parameter: by_prior[parameter])
        values = draws.ravel()
        found.append(
            Sensitivity(
                name,
                most,
                by_prior[most],
                of_readings(draws),
                float(np.median(values)),
                float(np.std(values)),
                _median_with_wider_prior(values, log_priors[most].ravel()),
                float(np.mean(z[most])),
            )
        )
    return tuple(found)


def _scaled(part: np.ndarray) -> Callable[[np.ndarray], float]:
    """Function that gives a quantity's sensitivity to one part of the log density."""
    from arviz_stats.base import array_stats

    lower, upper = (np.exp(array_stats.power_scale_lw(part, alpha, axis=(-2, -1))) for alpha in _POWERS)

    def sense(draws: np.ndarray) -> float:
        return float(array_stats.power_scale_sense(draws, lower, upper, *_POWERS))

    return sense


def _median_with_wider_prior(values: np.ndarray, log_prior: np.ndarray) -> float:
    """Median under weights that undo half of one prior; NaN where these lean on few draws."""
    log_weights, pareto_k = smooth_weights((_WIDER - 1) * log_prior)
    if not pareto_k <= RELIABLE_K:
        return float("nan")
    order = np.argsort(values)
    weights = np.exp(log_weights - log_weights.max())[order]
    share = (np.cumsum(weights) - weights / 2) / weights.sum()
    return float(np.interp(0.5, share, values[order]))
