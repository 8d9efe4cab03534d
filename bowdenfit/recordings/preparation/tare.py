"""The reading without load: the mean of a quiet interval, with its standard error."""

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.recordings.preparation.noise import correlation_time, quantum_of
from bowdenfit.types import Flags, Vector

_FEWEST = 10
_PARTS = 8
_LARGEST_MOVE = 5.0


def estimate_tare(
    file: str, name: str, time: Vector, force: Vector, quiet: tuple[float, float], good: Flags
) -> tuple[float, float]:
    """Mean of a channel's good samples in the quiet interval and its standard error [N].

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
