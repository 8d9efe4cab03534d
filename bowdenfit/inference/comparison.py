"""How well each of several models predicts readings it was not fitted to: leave-one-out, from the draws of one fit each."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

RELIABLE_K = 0.7  # Pareto k up to which the importance weights of a reading can be trusted
_DECISIVE = 2.0  # differences of so many standard errors, and of more than _NOTICEABLE, are said to be seen
_NOTICEABLE = 4.0


@dataclass(frozen=True)
class Prediction:
    """Of one model, reading by reading; a run of forces, whose samples belong together, counts as one.

    Args:
        elpd: Expected log predictive density of each reading, had it been left out.
        pareto_k: Reliability of each.
    """

    elpd: np.ndarray
    pareto_k: np.ndarray

    @property
    def unreliable(self) -> int:
        """Number of readings whose value leans on few draws."""
        return int(np.sum(~(self.pareto_k <= RELIABLE_K)))


@dataclass(frozen=True)
class Difference:
    """How much worse a model predicts than the best.

    Args:
        elpd: Best less this one, 0 for the best itself.
        standard_error: Of that, from the scatter over readings.
        unreliable: Readings of either whose value leans on few draws.
    """

    elpd: float
    standard_error: float
    unreliable: int

    @property
    def is_seen(self) -> bool:
        """Whether the data can tell the two apart."""
        return self.elpd > max(_DECISIVE * self.standard_error, _NOTICEABLE)


def left_out(log_likelihood: Mapping[str, np.ndarray], n_effective: float) -> Prediction:
    """Leave-one-out by Pareto-smoothed importance sampling.

    Args:
        log_likelihood: Of every reading by table, (chain, draw, reading).
        n_effective: Effective number of the draws.

    References:
        Vehtari, Gelman and Gabry 2017, "Practical Bayesian model evaluation using leave-one-out cross-validation and
        WAIC" (Statistics and Computing 27).
    """
    from arviz_stats.base import array_stats

    readings = np.concatenate([values for values in log_likelihood.values() if values.shape[-1]], axis=-1)
    share = min(n_effective / (readings.shape[0] * readings.shape[1]), 1.0)
    parts = [
        array_stats.loo(readings[..., i], chain_axis=0, draw_axis=1, r_eff=share) for i in range(readings.shape[-1])
    ]
    return Prediction(np.array([float(p[0]) for p in parts]), np.array([float(p[1]) for p in parts]))


def differences(predictions: Mapping[str, Prediction]) -> dict[str, Difference]:
    """Every model against the one that predicts best, which comes first.

    Args:
        predictions: By name of the model, of the same readings in the same order.
    """
    order = sorted(predictions, key=lambda name: -float(predictions[name].elpd.sum()))
    best = predictions[order[0]]
    found = {}
    for name in order:
        each = best.elpd - predictions[name].elpd
        error = float(np.sqrt(len(each) * np.var(each, ddof=1))) if len(each) > 1 else float("nan")
        found[name] = Difference(float(each.sum()), error, max(best.unreliable, predictions[name].unreliable))
    return found
