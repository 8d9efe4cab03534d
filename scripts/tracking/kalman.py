"""The extended and the unscented Kalman filter of a textbook, for a cable, as MATLAB has them.

The state is the friction exponent, a random walk, and the output force, which stays inside the friction band of the measured
input force. What is read is the output force with white noise. Both filters know the noise of the samples and how far the
exponent wanders, and start where the estimator under test does. Many recordings run at once, along the first axis.
"""

from collections.abc import Callable

import numpy as np

Band = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
Filter = Callable[..., tuple[np.ndarray, np.ndarray]]
ALPHA, BETA, KAPPA = 1e-3, 2.0, 0.0  # defaults of MATLAB's unscentedKalmanFilter
_STEP = 1e-6  # relative, of a difference quotient: as MATLAB takes it where no Jacobian is given


def rope_band(force: np.ndarray, exponent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the output forces [N] between which a rope sticks."""
    return force * np.exp(-exponent), force * np.exp(exponent)


def loop_band(preload: float) -> Band:
    """Return the function that gives the output forces [N] between which a pull-pull loop sticks."""

    def band(force: np.ndarray, exponent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        edges = np.stack([force * np.exp(-exponent), force * np.exp(exponent)])
        loss = 2 * preload * exponent
        return np.minimum(force - loss, edges.min(axis=0)), np.maximum(force + loss, edges.max(axis=0))

    return band


def _move(state: np.ndarray, force: np.ndarray, band: Band) -> np.ndarray:
    """Return the state (..., 2) after the input force has changed to `force`."""
    low, high = band(force, state[..., 0])
    return np.stack([state[..., 0], np.clip(state[..., 1], low, high)], axis=-1)


def _process_noise(force: np.ndarray, exponent: np.ndarray, band: Band, drift: float, force_sd: float, step: float):
    """Return the covariance of the process noise: the walk, and the noise of the measured input force."""
    low, high = band(force + force_sd, exponent)
    still_low, still_high = band(force, exponent)
    by_input = 0.5 * ((low - still_low) + (high - still_high))
    noise = np.zeros((len(force), 2, 2))
    noise[:, 0, 0], noise[:, 1, 1] = drift**2 * step, by_input**2
    return noise


def extended_filter(
    forces: np.ndarray, outputs: np.ndarray, band: Band, start: tuple[float, float], drift: float, force_sd: float, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return exponent and standard deviation by recording and sample, of an extended Kalman filter.

    Args:
        forces, outputs: Input and output forces by recording and sample [N].
        band: Output forces between which the cable sticks.
        start: Exponent and its standard deviation.
        drift, force_sd: How far the exponent wanders in a second; noise of a sample [N].
        step: Time between samples [s].
    """
    n, samples = forces.shape
    state, covariance = _start(outputs, start, force_sd)
    exponents, sds = np.empty((n, samples)), np.empty((n, samples))
    for k in range(samples):
        force = forces[:, k]
        moved = _move(state, force, band)
        jacobian = np.empty((n, 2, 2))
        for i in range(2):
            shift = _STEP * np.maximum(np.abs(state[:, i]), 1e-3)
            other = state.copy()
            other[:, i] += shift
            jacobian[:, :, i] = (_move(other, force, band) - moved) / shift[:, None]
        noise = _process_noise(force, state[:, 0], band, drift, force_sd, step)
        covariance = jacobian @ covariance @ jacobian.transpose(0, 2, 1) + noise
        gain = covariance[:, :, 1] / (covariance[:, 1, 1] + force_sd**2)[:, None]
        state = moved + gain * (outputs[:, k] - moved[:, 1])[:, None]
        covariance = covariance - gain[:, :, None] * covariance[:, None, 1, :]
        exponents[:, k], sds[:, k] = state[:, 0], np.sqrt(np.maximum(covariance[:, 0, 0], 0.0))
    return exponents, sds


def unscented_filter(
    forces: np.ndarray, outputs: np.ndarray, band: Band, start: tuple[float, float], drift: float, force_sd: float, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the same as `extended_filter`, of an unscented Kalman filter."""
    n, samples = forces.shape
    state, covariance = _start(outputs, start, force_sd)
    exponents, sds = np.empty((n, samples)), np.empty((n, samples))
    spread = ALPHA**2 * (2 + KAPPA)
    mean_weights = np.full(5, 0.5 / spread)
    mean_weights[0] = 1 - 2 / spread
    weights = mean_weights.copy()
    weights[0] += 1 - ALPHA**2 + BETA
    for k in range(samples):
        root = np.sqrt(spread) * _cholesky(covariance).transpose(0, 2, 1)
        points = np.concatenate([state[:, None], state[:, None] + root, state[:, None] - root], axis=1)
        moved = _move(points, forces[:, k, None], band)
        mean = np.einsum("p,npi->ni", mean_weights, moved)
        apart = moved - mean[:, None]
        noise = _process_noise(forces[:, k], state[:, 0], band, drift, force_sd, step)
        covariance = np.einsum("p,npi,npj->nij", weights, apart, apart) + noise
        gain = covariance[:, :, 1] / (covariance[:, 1, 1] + force_sd**2)[:, None]
        state = mean + gain * (outputs[:, k] - mean[:, 1])[:, None]
        covariance = covariance - gain[:, :, None] * covariance[:, None, 1, :]
        exponents[:, k], sds[:, k] = state[:, 0], np.sqrt(np.maximum(covariance[:, 0, 0], 0.0))
    return exponents, sds


def _start(outputs: np.ndarray, start: tuple[float, float], force_sd: float) -> tuple[np.ndarray, np.ndarray]:
    """Return state and covariance before the first sample."""
    n = len(outputs)
    state = np.stack([np.full(n, start[0]), outputs[:, 0]], axis=-1)
    return state, np.tile(np.diag([start[1] ** 2, force_sd**2]), (n, 1, 1))


def _cholesky(covariance: np.ndarray) -> np.ndarray:
    """Return lower Cholesky factors of 2 by 2 matrices, of what rounding made indefinite the nearest."""
    a, b, c = covariance[:, 0, 0], covariance[:, 1, 0], covariance[:, 1, 1]
    first = np.sqrt(np.maximum(a, 1e-18))
    lower = np.zeros_like(covariance)
    lower[:, 0, 0], lower[:, 1, 0] = first, b / first
    lower[:, 1, 1] = np.sqrt(np.maximum(c - (b / first) ** 2, 1e-18))
    return lower
