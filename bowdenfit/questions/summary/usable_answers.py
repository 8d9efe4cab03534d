"""Which answers of a fit may be used where the measurements do not determine every friction coefficient.

Which length is best may be certain although no coefficient is. The design answer may be used if it does not rest on what was
assumed of the coefficients: with each prior moved up or down by half its standard deviation, by weighted draws, the same
lengths stay good enough, and the efficiency at the best stays where it was.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bowdenfit.inference.psis import reliable_k, smooth_weights
from bowdenfit.questions.error_budget import with_bench_errors
from bowdenfit.questions.identify.judgment import find_unidentified
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, Record, cached_per_fit

# All are judgements. Probability with which each length of the window must be good enough under each other prior.
_STILL_GOOD = 0.9
_MOVE = 0.5  # of each prior, in its standard deviations: a usual coefficient is then twice as large, or half
_CENTRAL = 0.25, 0.75  # quantiles between which the median of the efficiency must stay under each other prior
_EFFECTIVE = 200  # least effective number of weighted draws


@dataclass(frozen=True)
class UsableAnswers:
    """Which answers may be used, as far as the priors of coefficients are concerned.

    Args:
        length: The best length and the window of lengths that are good enough; None without a route or draws.
        efficiency: The efficiency at the best length; None without a route or draws.
        undetermined: Names of the friction coefficients that rest on their priors, and must not be used by themselves.
    """

    length: bool | None
    efficiency: bool | None
    undetermined: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """Whether the design answer may be used: length and efficiency."""
        return bool(self.length and self.efficiency)


@cached_per_fit
def find_usable_answers(fit: Record) -> UsableAnswers:
    """Which answers of a fit may be used."""
    undetermined = tuple(find_unidentified(fit).names)
    if fit.sampled is None or fit.dataset.description.route is None:
        return UsableAnswers(None, None, undetermined)
    fit = with_bench_errors(fit)
    best = fit.optimal_length_of_draws()
    if not undetermined:
        return UsableAnswers(best.is_certain, True, ())
    if not best.is_certain:
        return UsableAnswers(False, False, undetermined)
    weights = list(_weights_of_other_priors(fit, undetermined))
    along, optimum = fit.along_route, fit.draws().optimum[OPTIMAL_EFFICIENCY].ravel()
    in_window = (along.grid >= best.window.start) & (along.grid <= best.window.stop)
    good = along.curves["efficiency"][:, in_window] >= (1 - best.window.within) * optimum[:, None]
    low, high = np.quantile(optimum, _CENTRAL)
    length = all(of_prior is not None and np.all(of_prior @ good >= _STILL_GOOD) for of_prior in weights)
    efficiency = all(of_prior is not None and low <= _median(optimum, of_prior) <= high for of_prior in weights)
    return UsableAnswers(length, efficiency, undetermined)


def _weights_of_other_priors(fit: Record, names: Sequence[str]) -> Iterator[np.ndarray | None]:
    """Weights of all draws for the prior of each coefficient moved up, then down; None where the draws cannot tell."""
    for name in names:
        z = fit.draws().flat_z[:, fit.model.space.index[name]]
        yield weights_for_moved_prior(z, _MOVE)
        yield weights_for_moved_prior(z, -_MOVE)


def weights_for_moved_prior(z: np.ndarray, move: float) -> np.ndarray | None:
    """Weights of draws, which sum to 1, for the standard normal prior of one z moved along; None where they are unreliable.

    Args:
        z: The draws.
        move: By how much the mean of the prior moves.
    """
    log_weights, k = smooth_weights(move * z)
    weights = np.exp(log_weights - np.max(log_weights))
    weights /= np.sum(weights)
    return weights if k <= reliable_k(len(z)) and np.sum(weights**2) <= 1 / _EFFECTIVE else None


def _median(values: np.ndarray, weights: np.ndarray) -> float:
    """Median of weighted values."""
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(weights[order]), 0.5)])
