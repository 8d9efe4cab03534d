"""Up to which frequency the forces move together, above which the load cells show only noise."""

import numpy as np

from bowdenfit.types import Vector

_LONGEST_SEGMENT = 8192
_BINS_PER_OCTAVE = 2
_NOISE_TO_SIGNAL = 1.0
_COHERENT = 1 / (1 + _NOISE_TO_SIGNAL) ** 2


def bandwidth_of(input_force: Vector, output_force: Vector, rate: float, loop: bool = False) -> float:
    """Frequency up to which the forces move together [Hz].

    The lower of two estimates, each a signal-to-noise ratio of 1. The first is where the spectra have come down to twice
    the floor of their top octave, for the channel that reaches it later; a hum common to both does not deceive it. The
    second is the highest frequency at which the two channels are coherent; noise that a filter smoothed does not
    deceive it. Of a pull-pull loop only the first: its output stands still at every reversal and has corners, overtones
    that a smooth input force has not, and they are motion all the same.

    Args:
        input_force: Input force at equal steps, gaps filled [N].
        output_force: Output force on the same clock [N].
        rate: Samples a second [1/s].
        loop: Whether the forces are of a pull-pull loop.
    """
    segment = min(_LONGEST_SEGMENT, max(len(input_force) // 8, 16))
    x, y = (_transforms(force, segment) for force in (input_force, output_force))
    frequency = np.arange(2, x.shape[1]) * rate / segment
    powers = [np.mean(np.abs(z) ** 2, axis=0)[2:] for z in (x, y)]
    cross = np.mean(np.conj(x) * y, axis=0)[2:]
    octave = np.floor(_BINS_PER_OCTAVE * np.log2(frequency / frequency[0]) + 1e-9).astype(int)
    bins = np.unique(octave)
    starts = np.searchsorted(octave, bins)
    lower, upper = (frequency[0] * 2 ** (b / _BINS_PER_OCTAVE) for b in (bins, bins + 1))
    over = max(_first_below(power, starts, frequency > rate / 4, lower, rate) for power in powers)
    if loop:
        return over
    sums = [np.add.reduceat(z, starts) for z in (*powers, cross)]
    coherence = np.abs(sums[2]) ** 2 / np.maximum(sums[0] * sums[1], np.finfo(float).tiny).real
    coherent = np.flatnonzero(coherence > _COHERENT)
    return min(over, float(upper[coherent[-1]]), rate / 2) if len(coherent) else over


def _transforms(values: Vector, segment: int) -> np.ndarray:
    """Spectra of half-overlapping Hann segments, for Welch's mean periodograms."""
    centered = values - np.mean(values)
    segments = np.lib.stride_tricks.sliding_window_view(centered, segment)[:: segment // 2]
    window = np.hanning(segment + 1)[:-1]
    return np.fft.rfft(segments * window, axis=1)


def _first_below(power: np.ndarray, starts: np.ndarray, top: np.ndarray, lower: np.ndarray, rate: float) -> float:
    """Lower edge of the first half octave whose median power comes down to twice the floor of the top octave [Hz]."""
    medians = np.array([np.median(part) for part in np.split(power, starts[1:])])
    quiet = medians < (1 + 1 / _NOISE_TO_SIGNAL) * float(np.median(power[top]))
    return float(lower[np.argmax(quiet)]) if quiet.any() else rate / 2
