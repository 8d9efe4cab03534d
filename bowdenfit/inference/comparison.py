"""Model comparison by leave-one-out: how well each model predicts readings that it was not fitted to, from draws of its fit."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from bowdenfit.inference.psis import RELIABLE_K, weighted_elpd

FEW_READINGS = 100  # readings below which the standard error of a difference is usually too small (Sivula and others 2020)
_CLEAR_ERRORS = 2.0  # standard errors, together with _NOTICEABLE, beyond which a difference counts (Vehtari's loo FAQ)
_NOTICEABLE = 4.0  # difference of elpd below which models predict about equally well (Sivula and others 2020)

LooMethod = Literal["importance sampling", "moment matching", "refit", "rough"]
Verdict = Literal["clear", "leaning", "open"]


@dataclass(frozen=True)
class LooPrediction:
    """Leave-one-out prediction of every reading by one model; a run of forces, whose samples belong together, counts as one.

    Args:
        elpd: Expected log predictive density (elpd) of each reading, had it been left out.
        pareto_k: Pareto k of each reading, from the draws of the fit.
        error: Monte Carlo standard error of each elpd; empty where not computed.
        readings: Table and label of each reading; empty where not given.
        how: Method used for each reading; empty where all are by importance sampling, reliable or not.
    """

    elpd: np.ndarray
    pareto_k: np.ndarray
    error: np.ndarray = field(default_factory=lambda: np.zeros(0))
    readings: tuple[tuple[str, str], ...] = ()
    how: tuple[LooMethod, ...] = ()

    def describe_reading(self, i: int) -> dict[str, Any]:
        """Return the results of one reading as plain data."""
        return {
            "elpd": self.elpd[i],
            "monte_carlo_error": self.error[i],
            "pareto_k": self.pareto_k[i],
            "how": self.how[i],
        }

    @property
    def unreliable(self) -> int:
        """Number of readings whose value depends on few draws."""
        if self.how:
            return self.how.count("rough")
        return int(np.sum(~(self.pareto_k <= RELIABLE_K)))


@dataclass(frozen=True)
class ElpdDifference:
    """Difference in expected log predictive density between a model and the best one.

    Args:
        elpd: elpd of the best model minus that of this one; 0 for the best itself.
        standard_error: Standard error of the difference, from its scatter over readings.
        unreliable: Number of readings of either model whose value depends on few draws.
    """

    elpd: float
    standard_error: float
    unreliable: int

    @property
    def is_distinguishable(self) -> bool:
        """Whether the data distinguish the two models."""
        return self.elpd > max(_CLEAR_ERRORS * self.standard_error, _NOTICEABLE)

    def verdict(self, n_readings: int) -> Verdict:
        """Return whether the data distinguish the two models, given the number of readings.

        Below a hundred readings the standard error is itself uncertain, and usually too small. A difference between two and
        four standard errors then only counts as leaning.

        References:
            Sivula, Magnusson, Matamoros and Vehtari 2020, "Uncertainty in Bayesian leave-one-out cross-validation based
            model comparison" (arXiv:2008.10296).
        """
        if not self.is_distinguishable:
            return "open"
        return "leaning" if n_readings < FEW_READINGS and self.elpd < 2 * _CLEAR_ERRORS * self.standard_error else "clear"


def psis_loo(log_likelihood: Mapping[str, np.ndarray], n_effective: float) -> LooPrediction:
    """Compute leave-one-out by Pareto-smoothed importance sampling.

    Args:
        log_likelihood: Log likelihood of every reading by table, (chain, draw, reading).
        n_effective: Effective number of the draws.

    References:
        Vehtari, Gelman and Gabry 2017, "Practical Bayesian model evaluation using leave-one-out cross-validation and
        WAIC" (Statistics and Computing 27).
    """
    readings = np.concatenate([values for values in log_likelihood.values() if values.shape[-1]], axis=-1)
    draws = readings.reshape(-1, readings.shape[-1])
    share = min(n_effective / len(draws), 1.0)
    parts = [weighted_elpd(-draws[:, i], draws[:, i], share) for i in range(draws.shape[1])]
    elpd, pareto_k, error = (np.array(part) for part in zip(*parts, strict=True))
    return LooPrediction(elpd, pareto_k, error)


def compare_predictions(predictions: Mapping[str, LooPrediction]) -> dict[str, ElpdDifference]:
    """Compare every model with the one that predicts best, which comes first.

    Args:
        predictions: Predictions by name of the model, of the same readings in the same order.
    """
    order = sorted(predictions, key=lambda name: -float(predictions[name].elpd.sum()))
    best = predictions[order[0]]
    differences = {}
    for name in order:
        difference = best.elpd - predictions[name].elpd
        error = float(np.sqrt(len(difference) * np.var(difference, ddof=1))) if len(difference) > 1 else float("nan")
        differences[name] = ElpdDifference(float(difference.sum()), error, max(best.unreliable, predictions[name].unreliable))
    return differences


def stacking_weights(predictions: Mapping[str, LooPrediction]) -> dict[str, float]:
    r"""Return the weights of the mixture of models that best predicts left-out readings.

    .. math:: \max_w \sum_i \log \sum_k w_k \exp(\text{elpd}_{ik}), \quad w_k \ge 0, \quad \sum_k w_k = 1

    A run of forces has a log density of hundreds, whose exponential overflows; so each reading's are taken relative to the
    best model's for it, which leaves the weights as they are.

    Args:
        predictions: Predictions by name of the model, of the same readings in the same order.

    References:
        Yao, Vehtari, Simpson and Gelman 2018, "Using stacking to average Bayesian predictive distributions" (Bayesian
        Analysis 13), equation 5.
    """
    from scipy.optimize import minimize  # here, because a fit, which stacks nothing, must not wait for it

    elpd = np.column_stack([p.elpd for p in predictions.values()])
    density = np.exp(elpd - elpd.max(axis=1, keepdims=True))
    n = len(predictions)

    def loss(weights: np.ndarray) -> tuple[float, np.ndarray]:
        mixed = np.maximum(density @ weights, 1e-300)
        return -float(np.mean(np.log(mixed))), -np.mean(density / mixed[:, None], axis=0)

    sum_to_one = {"type": "eq", "fun": lambda w: np.sum(w) - 1, "jac": np.ones_like}
    optimum = minimize(
        loss, np.full(n, 1 / n), jac=True, method="SLSQP", bounds=[(0, 1)] * n, constraints=[sum_to_one], tol=1e-10
    )
    weights = np.clip(optimum.x, 0.0, 1.0)
    return {name: float(w) for name, w in zip(predictions, weights / weights.sum(), strict=True)}
