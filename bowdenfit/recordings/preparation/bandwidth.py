"""Up to which frequency the forces move together, above which the load cells show only noise."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.types import Vector

_LONGEST_SEGMENT = 8192
_BINS_PER_OCTAVE = 2
_NOISE_TO_SIGNAL = 1.0
_COHERENT = 1 / (1 + _NOISE_TO_SIGNAL) ** 2


@dataclass(frozen=True)
class Spectra:
    """Mean periodograms of both channels, by half octaves.

    Args:
        lower: Lower edge of each half octave [Hz].
        upper: Upper edge of each [Hz].
        input_power: Median power of the input force [N^2].
        output_power: Median power of the output force [N^2].
        coherence: Squared coherence of the two [1].
        input_floor: Power of the input force in the top octave [N^2].
        output_floor: Power of the output force in the top octave [N^2].
    """

    lower: Vector
    upper: Vector
    input_power: Vector
    output_power: Vector
    coherence: Vector
    input_floor: float
    output_floor: float


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
    spectra = spectra_of(input_force, output_force, rate)
    over = max(
        _first_below(spectra.input_power, spectra.input_floor, spectra.lower, rate),
        _first_below(spectra.output_power, spectra.output_floor, spectra.lower, rate),
    )
    coherent = np.flatnonzero(spectra.coherence > _COHERENT) if not loop else np.zeros(0, dtype=int)
    return min(over, float(spectra.upper[coherent[-1]])) if len(coherent) else over


def spectra_of(input_force: Vector, output_force: Vector, rate: float) -> Spectra:
    """Welch's mean periodograms of half-overlapping Hann segments, and the coherence."""
    segment = min(_LONGEST_SEGMENT, max(len(input_force) // 8, 16))
    x, y = (_transforms(force, segment) for force in (input_force, output_force))
    frequency = np.arange(2, x.shape[1]) * rate / segment
    power_x, power_y = (np.mean(np.abs(z) ** 2, axis=0)[2:] for z in (x, y))
    cross = np.mean(np.conj(x) * y, axis=0)[2:]
    place = np.floor(_BINS_PER_OCTAVE * np.log2(frequency / frequency[0]) + 1e-9).astype(int)
    bins = np.unique(place)
    starts = np.searchsorted(place, bins)
    sums = [np.add.reduceat(z, starts) for z in (power_x, power_y, cross)]
    coherence = np.abs(sums[2]) ** 2 / np.maximum(sums[0] * sums[1], np.finfo(float).tiny).real
    top = frequency > rate / 4
    lower, upper = (frequency[0] * 2 ** (b / _BINS_PER_OCTAVE) for b in (bins, bins + 1))
    medians = [np.array([np.median(part) for part in np.split(p, starts[1:])]) for p in (power_x, power_y)]
    floors = [float(np.median(p[top])) for p in (power_x, power_y)]
    return Spectra(lower, np.minimum(upper, rate / 2), medians[0], medians[1], coherence, floors[0], floors[1])


def _transforms(values: Vector, segment: int) -> np.ndarray:
    centered = values - np.mean(values)
    segments = np.lib.stride_tricks.sliding_window_view(centered, segment)[:: segment // 2]
    window = np.hanning(segment + 1)[:-1]
    return np.fft.rfft(segments * window, axis=1)


def _first_below(power: Vector, floor: float, lower: Vector, rate: float) -> float:
    quiet = power < (1 + 1 / _NOISE_TO_SIGNAL) * floor
    return float(lower[np.argmax(quiet)]) if quiet.any() else rate / 2
