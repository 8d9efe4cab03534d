"""Up to which frequency the forces move together, above which the load cells show only noise."""

from collections.abc import Iterator

import numpy as np

from bowdenfit.files import pieces
from bowdenfit.files.pieces import Series
from bowdenfit.recordings.preparation.shapes import OtherVector

_LONGEST_SEGMENT = 8192
_MOST_OF_MOTION = 1 << 17  # samples that the main motion is looked for in: else segments would be shorter than its period
_PERIODS = 4  # of the main motion in a segment, at the most: more of them show equal cycles as lines with nothing in between
_SHORTEST_SEGMENT = 64
_CLEAR = 10  # times the floor: the highest of some thousand frequencies of noise is three times as high
_BINS_PER_OCTAVE = 2
_NOISE_TO_SIGNAL = 1.0
_COHERENT = 1 / (1 + _NOISE_TO_SIGNAL) ** 2


def estimate_bandwidth(input_force: Series, output_force: Series, rate: float, main: float, loop: bool = False) -> float:
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
    *powers, cross = (z[2:] for z in _spectra(input_force, output_force, segment))
    frequency = np.arange(2, len(cross) + 2) * rate / segment
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


def main_frequency(input_force: Series, output_force: Series, rate: float) -> float:
    """Frequency at which the forces move most [Hz]; 0 where they hardly move more than their noise does.

    Power counts by the root of its frequency: a drift three times as large as cycles a hundred times as fast is not taken for
    the motion, and neither is a hum of 50 Hz a fifth as large as cycles of 10 s.

    Args:
        input_force: See `bandwidth_of`.
        output_force: See `bandwidth_of`.
        rate: See `bandwidth_of`.
    """
    joined = -(-len(input_force) // _MOST_OF_MOTION)
    slow_in, slow_out = (_joined(force, joined) for force in (input_force, output_force))
    segment, rate = _segment(len(slow_in)), rate / joined
    of_input, of_output, _ = _spectra(slow_in, slow_out, segment)
    power = (of_input + of_output)[1:]
    frequency = np.arange(1, len(power) + 1) * rate / segment
    most = int(np.argmax(power * np.sqrt(frequency)))
    return float(frequency[most]) if power[most] > _CLEAR * np.median(power[frequency > rate / 4]) else 0.0


def _joined(values: Series, samples: int) -> OtherVector:
    """Means of so many samples each, as a channel would have that is so much slower."""
    if samples == 1:
        return values[: len(values)]
    whole, at_once = len(values) // samples, max(pieces.PIECE // samples, 1)
    starts = range(0, whole, at_once)
    parts = (values[slice(start * samples, min(start + at_once, whole) * samples)] for start in starts)
    return np.concatenate([np.asarray(part, dtype=float).reshape(-1, samples).mean(axis=1) for part in parts])


def _segment(samples: int) -> int:
    return min(_LONGEST_SEGMENT, max(samples // 8, 16))


def _spectra(input_force: Series, output_force: Series, segment: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Welch's mean periodograms of the input, of the output, and across, from half-overlapping Hann segments."""
    bins, count = segment // 2 + 1, 0
    sums = np.zeros(bins), np.zeros(bins), np.zeros(bins, dtype=complex)
    for x, y in zip(*(_transforms(force, segment) for force in (input_force, output_force)), strict=True):
        for total, power in zip(sums, (np.abs(x) ** 2, np.abs(y) ** 2, np.conj(x) * y), strict=True):
            total += np.sum(power, axis=0)
        count += len(x)
    return sums[0] / count, sums[1] / count, sums[2] / count


def _transforms(values: Series, segment: int) -> Iterator[np.ndarray]:
    """Spectra of all segments, so many at once as fill a piece."""
    samples, hop = len(values), segment // 2
    mean = sum(float(np.sum(values[part], dtype=float)) for part in pieces.parts(samples)) / samples
    window = np.hanning(segment + 1)[:-1]
    at_once, all_of_them = max((pieces.PIECE - segment) // hop + 1, 1), (samples - segment) // hop + 1
    for first in range(0, all_of_them, at_once):
        last = min(first + at_once, all_of_them) - 1
        centered = values[slice(first * hop, last * hop + segment)] - mean
        segments = np.lib.stride_tricks.sliding_window_view(centered, segment)[::hop]
        yield np.fft.rfft(segments * window, axis=1)


def _first_below(
    power: np.ndarray, starts: np.ndarray, top: np.ndarray, lower: np.ndarray, rate: float, main: float
) -> float:
    """Lower edge of the first half octave above the main motion whose median power is down to twice the top octave's [Hz]."""
    medians = np.array([np.median(part) for part in np.split(power, starts[1:])])
    quiet = medians < (1 + 1 / _NOISE_TO_SIGNAL) * float(np.median(power[top]))
    quiet &= lower > main
    return float(lower[np.argmax(quiet)]) if quiet.any() else rate / 2
