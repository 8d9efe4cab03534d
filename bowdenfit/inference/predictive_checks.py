"""Leave-one-out predictive checks: what a fit predicts for each reading without it, and whether that is calibrated.

The draws are weighted by the inverse of the reading's own likelihood (Pareto-smoothed), so nothing is fitted again. Where
the Pareto k of a reading is large, the weights cannot remove all of its influence: its deviation is understated, and differs
from seed to seed. Then draws of a fit without the reading replace them.

References:
    Vehtari, Gelman and Gabry, Practical Bayesian model evaluation using leave-one-out cross-validation and WAIC,
    Statistics and Computing 27 (2017), 1413.
    Säilynoja, Bürkner and Vehtari, Graphical test for discrete uniformity and its applications in goodness-of-fit
    evaluation and multiple sample comparison, Statistics and Computing 32 (2022), 32.
"""

from dataclasses import dataclass, fields

import numpy as np

from bowdenfit.inference.psis import smooth_weights

_TAIL = 0.02  # share of the weight on either side to which a Pareto distribution is fitted
_LEAST_TAIL = 20  # least number of draws for that fit
_LEAST = 1e-12  # probability below which differences do not matter
_DRAWS = 10_000  # draws of a prediction that suffice
_FARTHEST = 1e100  # value that replaces overflows of a walker far out
_SIMULATIONS = 1000  # simulations of the band of uniform numbers


@dataclass(frozen=True)
class LooPredictive:
    """Leave-one-out predictive distribution of each reading, and where the reading lies in it.

    Args:
        mean, sd: Mean and standard deviation of the replicated reading.
        q05, median, q95: Quantiles of the replicated reading.
        below, up_to: Probability of a lower reading, and of one no higher; they differ where a reading is only a bound.
        tail: Two-sided probability of a reading as far out as this one.
        pareto_k: Pareto k: influence of the reading on the fit; beyond 0.7 the weights cannot be trusted.
    """

    mean: np.ndarray
    sd: np.ndarray
    q05: np.ndarray
    median: np.ndarray
    q95: np.ndarray
    below: np.ndarray
    up_to: np.ndarray
    tail: np.ndarray
    pareto_k: np.ndarray


def predict_left_out(
    log_likelihood: np.ndarray, replicated: np.ndarray, observed: np.ndarray, at_most: np.ndarray, n_effective: float
) -> LooPredictive:
    """Return leave-one-out predictions of the readings of one table.

    Args:
        log_likelihood: Log likelihood of every reading at every draw, (draw, reading).
        replicated: Posterior predictive draws, (draw, reading).
        observed: The readings, or the bound where only an upper limit is known.
        at_most: Whether a reading is such a bound.
        n_effective: Effective number of the draws.
    """
    share, every = min(n_effective / len(log_likelihood), 1.0), max(1, len(log_likelihood) // _DRAWS)
    rows = []
    for likelihood, replicates, reading, bound in zip(log_likelihood.T, replicated.T, observed, at_most, strict=True):
        log_weights, k = smooth_weights(-likelihood, share)
        weights = np.exp(log_weights - log_weights.max())[::every]
        rows.append((*_locate_reading(replicates[::every], weights / weights.sum(), float(reading), bool(bound)), k))
    return LooPredictive(*np.array(rows).reshape(-1, len(fields(LooPredictive))).T)


def replace_by_refit(
    predictions: LooPredictive, index: int, replicates: np.ndarray, reading: float, at_most: bool
) -> LooPredictive:
    """Replace one prediction by that of a fit without the reading; its Pareto k remains.

    Args:
        predictions: The predictions of a table.
        index: Position of the reading.
        replicates: Replicated reading at the draws of the fit without it.
        reading, at_most: See `predict_left_out`.
    """
    row = (
        *_locate_reading(replicates, np.full(len(replicates), 1 / len(replicates)), reading, at_most),
        predictions.pareto_k[index],
    )
    changed = {field.name: np.array(getattr(predictions, field.name)) for field in fields(LooPredictive)}
    for column, value in zip(changed.values(), row, strict=True):
        column[index] = value
    return LooPredictive(**changed)


def _locate_reading(replicates: np.ndarray, weights: np.ndarray, reading: float, at_most: bool) -> tuple[float, ...]:
    """Return the fields of `LooPredictive` for one reading, except its Pareto k."""
    within = np.clip(np.nan_to_num(replicates, nan=_FARTHEST), -_FARTHEST, _FARTHEST)
    order = np.argsort(within)
    x, w = within[order], weights[order]
    mean = float(w @ x)
    sd = float(np.sqrt(w @ (x - mean) ** 2))
    rank = np.cumsum(w) - w / 2
    q05, median, q95 = (float(q) for q in np.interp((0.05, 0.5, 0.95), rank, x))
    up_to = float(w[: np.searchsorted(x, reading, "right")].sum())
    below = 0.0 if at_most else float(w[: np.searchsorted(x, reading, "left")].sum())
    low, high = _tail_probability(-x[::-1], w[::-1], -reading), _tail_probability(x, w, reading)
    tail = low if at_most else 2 * min(low, high, 0.5)
    return mean, sd, q05, median, q95, below, up_to, tail


def _tail_probability(x: np.ndarray, weights: np.ndarray, reading: float) -> float:
    r"""Return the probability of a value as large as the reading, by a Pareto tail beyond the draws.

    .. math:: P(X > y) = P(X > u) \left(1 + \xi \frac{y - u}{s}\right)^{-1/\xi}

    References:
        Hosking and Wallis, Parameter and quantile estimation for the generalized Pareto distribution, Technometrics 29
        (1987), 339: probability-weighted moments.
    """
    above = np.cumsum(weights[::-1])[::-1]  # of each draw and all beyond it
    start = min(int(np.searchsorted(-above, -_TAIL)), len(x) - _LEAST_TAIL)
    if start <= 0 or reading <= x[start]:
        return float(weights[np.searchsorted(x, reading, "left") :].sum())
    excess, w, mass = x[start + 1 :] - x[start], weights[start + 1 :], above[start + 1]
    if not mass > 0:
        return float(above[start])
    mean = float(w @ excess) / mass
    lower = float(w @ (excess * (above[start + 1 :] - w / 2))) / mass**2
    if not mean > 2 * lower > 0:
        return float(above[start])
    shape = 2 - mean / (mean - 2 * lower)
    scale = 2 * mean * lower / (mean - 2 * lower)
    return float(np.maximum(mass * _pareto_survival((reading - x[start]) / scale, shape), _LEAST))


def _pareto_survival(excess: float, shape: float) -> float:
    """Return the probability beyond an excess in units of the scale; the shape is not negative, as noise is unbounded."""
    shape = max(shape, 0.0)
    return float(np.exp(-excess) if shape < 1e-6 else (1 + shape * excess) ** (-1 / shape))


def draw_randomized_pit(predictions: LooPredictive, generator: np.random.Generator) -> np.ndarray:
    """Return the probability integral transform (PIT) of each reading, uniform between 0 and 1 if predictions are calibrated.

    For a bound only an interval is known, in which a value is drawn at random.
    """
    return np.clip(generator.uniform(predictions.below, np.maximum(predictions.up_to, predictions.below)), 0.0, 1.0)


@dataclass(frozen=True)
class Uniformity:
    """Test that numbers are uniform between 0 and 1, by their empirical distribution function.

    Args:
        at: Positions at which it is evaluated.
        share: Share of the numbers up to each position.
        low, high: Simultaneous band for uniform numbers.
        probability: Probability with which uniform numbers stay in the band.
    """

    at: np.ndarray
    share: np.ndarray
    low: np.ndarray
    high: np.ndarray
    probability: float

    @property
    def holds(self) -> bool:
        """Whether the distribution function stays in the band."""
        return bool(np.all((self.low <= self.share) & (self.share <= self.high)))

    @property
    def fault(self) -> str:
        """What is wrong, in words; empty if nothing is."""
        if self.holds:
            return ""
        low, high = (np.interp(quarter, self.at, self.share - self.at) for quarter in (0.25, 0.75))
        if abs(low - high) > abs(low + high):
            return "scatter more than the fit predicts" if low > high else "scatter less than the fit predicts"
        return "lie lower than the fit predicts" if low + high > 0 else "lie higher than the fit predicts"


def check_uniformity(pit: np.ndarray, probability: float) -> Uniformity:
    """Compare the distribution function of numbers between 0 and 1 with the simultaneous band of uniform ones.

    Args:
        pit: The numbers; at least two.
        probability: Probability that uniform numbers stay in the whole band.
    """
    from arviz_stats.ecdf_utils import ecdf_pit

    at, share, low, high = ecdf_pit(pit, probability, _SIMULATIONS)
    return Uniformity(at, share, low, high, probability)
