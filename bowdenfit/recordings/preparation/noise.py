"""How much a load cell's reading scatters, how finely it is quantised, and how long its noise remembers."""

import numpy as np

from bowdenfit.files.pieces import PLENTY, Series, sample
from bowdenfit.types import Vector

_TO_SD = 1.4826
_MOST_TRENDS = 200_000


def noise_of(values: Vector) -> float:
    """Standard deviation of a single sample about smooth motion, from second differences [unit of the values].

    Robust: spikes, steps and turns of the motion do not raise it. It is right for white noise, and too small for noise
    that a filter has smoothed; 0 where more than half the samples lie on a straight line.
    """
    if len(values) < 3:
        return 0.0
    bends = values[2:] - 2 * values[1:-1] + values[:-2]
    return float(_TO_SD * np.median(np.abs(bends)) / np.sqrt(6))


def quantum_of(values: Vector) -> float:
    """Smallest step that the readings commonly make [unit of the values]: the quantisation step, where there is one."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 0]
    if not len(steps):
        return 0.0
    return float(np.partition(steps, len(steps) // 100)[len(steps) // 100])


def noise_about_trend(values: Series, samples: int) -> float:
    """Standard deviation of a single sample about straight lines through stretches of `samples` [unit of the values].

    The median over the stretches, so that those with a turn of the motion do not count. Unlike `noise_of` it sees the
    slow part of filtered noise. Falls back on `noise_of` for stretches of fewer than four samples.
    """
    stretches = len(values) // samples
    if samples < 4 or stretches < 5:
        return noise_of(sample(values))
    step = max(1, len(values) // _MOST_TRENDS)
    if len(values) <= PLENTY:
        rows = values[: stretches * samples].reshape(stretches, samples)[::step]
    else:
        rows = np.stack([values[i * samples : (i + 1) * samples] for i in range(0, stretches, step)])
    place = np.arange(samples) - (samples - 1) / 2
    centered = rows - rows.mean(axis=1, keepdims=True)
    slope = centered @ place / (place @ place)
    freedom = samples - 2
    variance = (np.sum(centered**2, axis=1) - slope**2 * (place @ place)) / freedom
    median_of_chi_square = (1 - 2 / (9 * freedom)) ** 3
    return float(np.sqrt(max(np.median(variance), 0.0) / median_of_chi_square))


def correlation_time(values: Vector) -> float:
    """Integrated autocorrelation time, at least 1 [samples].

    References:
        Sokal, Monte Carlo methods in statistical mechanics (1997), section 3: the window is five times the time itself.
    """
    n = len(values)
    correlation = autocorrelation(values) if n >= 4 else None
    if correlation is None:
        return 1.0
    times = 2 * np.cumsum(correlation[: n // 2]) - 1
    wide_enough = np.arange(len(times)) >= 5 * times
    return max(1.0, float(times[np.argmax(wide_enough)] if wide_enough.any() else times[-1]))


def autocorrelation(values: Vector) -> Vector | None:
    """Correlation of a series with itself by lag [1]; None for one that does not change."""
    n = len(values)
    centered = values - np.mean(values)
    if not np.any(centered):
        return None
    spectrum = np.abs(np.fft.rfft(centered, 1 << (2 * n - 1).bit_length())) ** 2
    covariance = np.fft.irfft(spectrum)[:n]
    return covariance / covariance[0]
