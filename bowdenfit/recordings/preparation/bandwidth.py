"""Up to which frequency the forces move together, above which the load cells show only noise."""

import numpy as np

from bowdenfit.types import Vector

_LONGEST_SEGMENT = 8192
_PERIODS = 4  # of the main motion in a segment, at the most: more of them show equal cycles as lines with nothing in between
_SHORTEST_SEGMENT = 64
_CLEAR = 10  # times the floor: the highest of some thousand frequencies of noise is three times as high
_BINS_PER_OCTAVE = 2
_NOISE_TO_SIGNAL = 1.0
_COHERENT = 1 / (1 + _NOISE_TO_SIGNAL) ** 2


def bandwidth_of(input_force: Vector, output_force: Vector, rate: float, main: float, loop: bool = False) -> float:
    """Frequency up to which the forces move together [Hz].

    The lower of two estimates, each a signal-to-noise ratio of 1. The first is where the spectra have come down to twice
    the floor of their top octave, for the channel that reaches it later; a hum common to both does not deceive it. The
    second is the highest frequency at which the two channels are coherent; noise that a filter smoothed does not
    deceive it. Of a pull-pull loop only the first: its output stands still at every reversal and has corners, overtones
    that a smooth input force has not, and they are motion all the same.

    Both are sought above the main motion, since below that of equal cycles there is nothing but noise.

    Args:
        input_force: Input force at equal steps, gaps filled [N].
        output_force: Output force on the same clock [N].
        rate: Samples a second [1/s].
        main: Frequency at which they move most [Hz], by `main_frequency`.
        loop: Whether the forces are of a pull-pull loop.
    """
    segment = _segment(len(input_force))
    if main > 0:
        segment = min(segment, max(int(_PERIODS * rate / main), _SHORTEST_SEGMENT))
    x, y = (_transforms(force, segment) for force in (input_force, output_force))
    frequency = np.arange(2, x.shape[1]) * rate / segment
    powers = [np.mean(np.abs(z) ** 2, axis=0)[2:] for z in (x, y)]
    cross = np.mean(np.conj(x) * y, axis=0)[2:]
    octave = np.floor(_BINS_PER_OCTAVE * np.log2(frequency / frequency[0]) + 1e-9).astype(int)
    bins = np.unique(octave)
    starts = np.searchsorted(octave, bins)
    lower, upper = (frequency[0] * 2 ** (b / _BINS_PER_OCTAVE) for b in (bins, bins + 1))
    over = max(_first_below(power, starts, frequency > rate / 4, lower, rate, main) for power in powers)
    if loop:
        return over
    sums = [np.add.reduceat(z, starts) for z in (*powers, cross)]
    coherence = np.abs(sums[2]) ** 2 / np.maximum(sums[0] * sums[1], np.finfo(float).tiny).real
    coherent = np.flatnonzero(coherence > _COHERENT)
    return min(over, float(upper[coherent[-1]]), rate / 2) if len(coherent) else over


def main_frequency(input_force: Vector, output_force: Vector, rate: float) -> float:
    """Frequency at which the forces move most [Hz]; 0 where they hardly move more than their noise does.

    Power counts by the root of its frequency: a drift three times as large as cycles a hundred times as fast is not taken for
    the motion, and neither is a hum of 50 Hz a fifth as large as cycles of 10 s.

    Args:
        input_force: See `bandwidth_of`.
        output_force: See `bandwidth_of`.
        rate: See `bandwidth_of`.
    """
    segment = _segment(len(input_force))
    spectra = [np.abs(_transforms(force, segment)[:, 1:]) ** 2 for force in (input_force, output_force)]
    frequency = np.arange(1, spectra[0].shape[1] + 1) * rate / segment
    power = np.mean(spectra[0] + spectra[1], axis=0)
    most = int(np.argmax(power * np.sqrt(frequency)))
    return float(frequency[most]) if power[most] > _CLEAR * np.median(power[frequency > rate / 4]) else 0.0


def _segment(samples: int) -> int:
    return min(_LONGEST_SEGMENT, max(samples // 8, 16))


def _transforms(values: Vector, segment: int) -> np.ndarray:
    """Spectra of half-overlapping Hann segments, for Welch's mean periodograms."""
    centered = values - np.mean(values)
    segments = np.lib.stride_tricks.sliding_window_view(centered, segment)[:: segment // 2]
    window = np.hanning(segment + 1)[:-1]
    return np.fft.rfft(segments * window, axis=1)


def _first_below(
    power: np.ndarray, starts: np.ndarray, top: np.ndarray, lower: np.ndarray, rate: float, main: float
) -> float:
    """Lower edge of the first half octave above the main motion whose median power is down to twice the top octave's [Hz]."""
    medians = np.array([np.median(part) for part in np.split(power, starts[1:])])
    quiet = medians < (1 + 1 / _NOISE_TO_SIGNAL) * float(np.median(power[top]))
    quiet &= lower > main
    return float(lower[np.argmax(quiet)]) if quiet.any() else rate / 2
