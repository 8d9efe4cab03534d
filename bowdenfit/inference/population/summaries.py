"""What single fits say, as distributions: of each inspection the likelihood of its log coefficients as a multivariate t.

Scatter between mountings that is known from few of them makes the draws of single fits heavy-tailed; a normal distribution of
the same covariance would give their middle too little weight, and their tails too much.

References:
    Lange, Little and Taylor 1989, "Robust statistical modeling using the t distribution" (Journal of the American
    Statistical Association 84); Liu and Rubin 1995, "ML estimation of the t distribution using EM" (Statistica Sinica 5).
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln

_LEAST_FREEDOM, _MOST_FREEDOM = 1.5, 200.0
# Factors that degrees of freedom are tried with in each round. Small ones are among them: scale and freedom are found in turn,
# and steps of a quarter end a quarter too high, with tails that are too light.
_STEPS = (0.5, 0.8, 0.95, 0.99, 1.0, 1.01, 1.05, 1.25, 2.0)
_ROUNDS = 40
_CLIPPED = 0.999  # quantile of the weights beyond which none counts for more


@dataclass(frozen=True)
class Summaries:
    """Multivariate t distributions, one an inspection.

    Args:
        center: Of log coefficients, (inspection, coefficient).
        scale: Scale matrices, (inspection, coefficient, coefficient).
        freedom: Degrees of freedom, (inspection,).
    """

    center: np.ndarray
    scale: np.ndarray
    freedom: np.ndarray

    def log_density(self, values: np.ndarray) -> np.ndarray:
        """Of log coefficients, (inspection, draw, coefficient); (inspection, draw).

        Args:
            values: Log coefficients.
        """
        return _log_t(_distances(values, self.center, self.scale), self.scale, self.freedom)


def summarize_likelihoods(values: np.ndarray, prior_mean: np.ndarray, prior_sd: np.ndarray) -> Summaries:
    """The likelihood of log coefficients that draws stand for, by maximum likelihood from draws without their prior.

    Args:
        values: Draws of log coefficients of equal weight, (inspection, draw, coefficient).
        prior_mean, prior_sd: Of the log coefficients in the single fits, (coefficient,); an infinite sd where it was flat.
    """
    weights = _remove_prior(values, prior_mean, prior_sd)
    dimensions = values.shape[2]
    center = np.median(values, axis=1)
    scale, freedom = _covariances(values, center, weights), np.full(len(values), 5.0)
    for _ in range(_ROUNDS):
        distances = _distances(values, center, scale)
        pull = weights * (freedom[:, None] + dimensions) / (freedom[:, None] + distances)
        center = np.einsum("js,jsk->jk", pull, values) / pull.sum(axis=1)[:, None]
        scale = _covariances(values, center, pull)
        distances = _distances(values, center, scale)
        tried = np.clip(np.multiply.outer(_STEPS, freedom), _LEAST_FREEDOM, _MOST_FREEDOM)
        fits = [np.sum(weights * _log_t(distances, scale, nu), axis=1) for nu in tried]
        freedom = np.take_along_axis(tried, np.argmax(fits, axis=0)[None], axis=0)[0]
    return Summaries(center, scale, freedom)


def _remove_prior(values: np.ndarray, mean: np.ndarray, sd: np.ndarray) -> np.ndarray:
    """Weights of sum 1 under which draws are those of a flat prior, (inspection, draw)."""
    log = np.sum(((values - mean) / sd) ** 2, axis=2) / 2
    weights = np.exp(log - log.max(axis=1, keepdims=True))
    weights = np.minimum(weights, np.quantile(weights, _CLIPPED, axis=1)[:, None])
    return weights / weights.sum(axis=1, keepdims=True)


def _covariances(values: np.ndarray, center: np.ndarray, weights: np.ndarray) -> np.ndarray:
    away = values - center[:, None]
    covariances = np.einsum("js,jsk,jsl->jkl", weights, away, away, optimize=True)
    tiny = np.finfo(float).eps * (1 + np.trace(covariances, axis1=1, axis2=2))
    return covariances + tiny[:, None, None] * np.eye(values.shape[2])


def _distances(values: np.ndarray, center: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Squared Mahalanobis distances, (inspection, draw)."""
    away = np.linalg.solve(np.linalg.cholesky(scale), (values - center[:, None]).transpose(0, 2, 1))
    return np.sum(away**2, axis=1)


def _log_t(distances: np.ndarray, scale: np.ndarray, freedom: np.ndarray) -> np.ndarray:
    dimensions, nu = scale.shape[-1], freedom[:, None]
    constant = gammaln((nu + dimensions) / 2) - gammaln(nu / 2) - dimensions / 2 * np.log(nu * np.pi)
    return constant - np.linalg.slogdet(scale)[1][:, None] / 2 - (nu + dimensions) / 2 * np.log1p(distances / nu)
