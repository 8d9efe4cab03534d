"""Noise of a load cell: how much its reading scatters, how finely it is quantised, how long its noise remembers, its tare."""

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.pieces import PLENTY, Series, subsample
from bowdenfit.types import Flags, Vector

_TO_SD = 1.4826  # 1/Phi^-1(3/4): from the median of absolute deviations of a normal variable to its standard deviation
_MOST_TRENDS = 200_000  # judged: stretches that tell a median to a part in hundreds
_FEWEST = 10  # judged: samples of a tare
_PARTS = 8  # judged: parts of a quiet interval whose means are compared
_MOST_DOUBLINGS = 13  # of the distance of third differences: 4096 samples
_LEVEL, _GROWS, _MOVES = 1.15, 1.6, 2.5  # judged: growth of their variance by a doubling that is none; too much; motion
_WHITE = 0.8  # judged: share of that variance that white noise has at the first
_NOISE_IN_MOTION = 0.1  # judged: the most that noise is, of the standard deviation of a recorded force
_LARGEST_MOVE = 5.0  # judged: by how many standard deviations of a sample these means may differ


def noise_of(values: Vector) -> float:
    """Return the standard deviation of a single sample about smooth motion, from second differences [as the values].

    Robust: spikes, steps and turns of the motion do not raise it. It is right for white noise, and too small for noise
    that a filter has smoothed; 0 where more than half the samples lie on a straight line.
    """
    if len(values) < 3:
        return 0.0
    bends = values[2:] - 2 * values[1:-1] + values[:-2]
    return float(_TO_SD * np.median(np.abs(bends)) / np.sqrt(6))


def quantum_of(values: Vector) -> float:
    """Return the smallest step that the readings commonly make [as values]: the quantisation step, where there is one."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 0]
    if not len(steps):
        return 0.0
    return float(np.partition(steps, len(steps) // 100)[len(steps) // 100])


def noise_about_trend(values: Series, samples: int) -> float:
    """Return the standard deviation of a single sample about straight lines through stretches of `samples` [as values].

    The median over the stretches, so that those with a turn of the motion do not count. Unlike `noise_of` it sees the
    slow part of filtered noise. Falls back on `noise_of` for stretches of fewer than four samples.
    """
    stretches = len(values) // samples
    if samples < 4 or stretches < 5:
        return noise_of(subsample(values))
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


def describe_noise(values: Series) -> tuple[float, float]:
    """Return the standard deviation of the noise of a sample [as values], and its correlation time [samples], 0 if it is white.

    Third differences over k samples leave out parabolas, and so most of the motion. Their variance grows with k to 20 times
    that of a sample, once noise has forgotten what it was; where it has grown to half of that, noise of first order (an RC
    filter) has a correlation of 0.39, after 0.94 of its correlation time. What grows on is motion. Robust as `noise_of` is.
    """
    some = subsample(values)
    lags = [1 << i for i in range(_MOST_DOUBLINGS) if 3 << i <= len(some) // 10]
    if len(lags) < 3:
        return noise_of(some), 0.0
    thirds = (some[3 * k :] - 3 * some[2 * k : -k] + 3 * some[k : -2 * k] - some[: -3 * k] for k in lags)
    variances = np.array([_TO_SD * np.median(np.abs(third)) for third in thirds]) ** 2
    growth = np.full(len(lags) - 1, np.inf)
    np.divide(variances[1:], variances[:-1], out=growth, where=variances[:-1] > 0)
    growth[variances[:-1] > 20 * (_NOISE_IN_MOTION * np.std(some)) ** 2] = np.inf
    level = np.flatnonzero(growth < _LEVEL)
    last = int(level[0]) if len(level) else int(np.argmin(growth))
    noise = variances[last] / 20
    if growth[last] > _GROWS:  # motion hides the end of its memory, or all of it
        moving = np.flatnonzero(growth > _MOVES)
        last = int(moving[0]) if len(moving) else len(lags) - 1
        noise = variances[last] / (10 if last else 20)
    if not noise or variances[0] > _WHITE * 20 * noise:
        return float(np.sqrt(noise)), 0.0
    half = np.interp(np.log(10 * noise), np.log(np.maximum(variances[: last + 1], 1e-9 * noise)), np.log(lags[: last + 1]))
    return float(np.sqrt(noise)), float(np.exp(half) / 0.94)


def correlation_time(values: Vector) -> float:
    """Return the integrated autocorrelation time, at least 1 [samples].

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
    """Return correlation of a series with itself by lag [1]; None for one that does not change."""
    n = len(values)
    centered = values - np.mean(values)
    if not np.any(centered):
        return None
    spectrum = np.abs(np.fft.rfft(centered, 1 << (2 * n - 1).bit_length())) ** 2
    covariance = np.fft.irfft(spectrum)[:n]
    return covariance / covariance[0]


def estimate_tare(
    file: str, name: str, time: Vector, force: Vector, quiet: tuple[float, float], good: Flags
) -> tuple[float, float]:
    """Return the mean of a channel's good samples in the quiet interval and its standard error [N].

    The standard error allows for noise that remembers: the variance of the mean is that of a sample times the
    integrated autocorrelation time over the number of samples.

    Args:
        file: File name, for errors.
        name: Channel, for errors.
        time: Time of each sample [s].
        force: Readings [N].
        quiet: Start and end of the interval [s].
        good: Samples that may be used.

    Raises:
        DatasetError: The interval lies outside the recording or has fewer than ten good samples, or the force moves in
            it by more than five times its noise.
    """
    start, end = quiet
    if not time[0] - 1e-9 <= start < end <= time[-1] + 1e-9:
        raise DatasetError(
            f"{file}: the quiet interval from {start:g} to {end:g} s does not lie inside {name}, which was sampled from "
            f"{time[0]:g} to {time[-1]:g} s. State an interval without load inside the recording, or no tare."
        )
    inside = force[(time >= start) & (time <= end) & good]
    if len(inside) < _FEWEST:
        raise DatasetError(
            f"{file}: the quiet interval from {start:g} to {end:g} s has {len(inside)} good samples of {name}, and a "
            f"tare needs at least {_FEWEST}. State a longer interval, or no tare."
        )
    _check_still(file, name, inside, quiet)
    error = float(np.std(inside, ddof=1)) * np.sqrt(correlation_time(inside) / len(inside))
    return float(np.mean(inside)), float(error)


def _check_still(file: str, name: str, inside: Vector, quiet: tuple[float, float]) -> None:
    """Compare how far the means of the interval's parts move with the scatter about a straight line in each part."""
    parts = np.array_split(inside, min(_PARTS, len(inside) // 5))
    move = float(np.ptp([part.mean() for part in parts]))
    scatter = max(float(np.median([_scatter(part) for part in parts])), quantum_of(inside))
    if move > _LARGEST_MOVE * scatter:
        raise DatasetError(
            f"{file}: {name} moves by {move:.3g} N in the quiet interval from {quiet[0]:g} to {quiet[1]:g} s, much more "
            f"than its noise of {scatter:.2g} N; the usual cause is an interval that reaches into the motion. State one "
            "without load, or no tare."
        )


def _scatter(part: Vector) -> float:
    place = np.arange(len(part)) - (len(part) - 1) / 2
    centered = part - part.mean()
    residuals = centered - place * (centered @ place) / (place @ place)
    return float(np.sqrt(residuals @ residuals / (len(part) - 2)))
