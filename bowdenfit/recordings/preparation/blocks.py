"""Means over blocks: how long they should be, and the averaging, in which every sample is accounted for.

A block must be long enough that its noise is independent of the next, and short against the motion: up to the bandwidth in
which the forces move together, above which the load cells show only noise (`estimate_bandwidth`).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files import pieces
from bowdenfit.files.pieces import Series
from bowdenfit.recordings.preparation.clock import DROPOUT, GOOD, KINDS, SATURATED
from bowdenfit.recordings.recording import Blocks
from bowdenfit.types import ChosenVector, Flags, Labels, OtherVector, Positions, Vector

MOST_PARTS = 8  # judged: of one long recording; 2000 cycles say far more of a mounting than mountings scatter
MOST_BLOCKS = 4000  # judged: the play operator is a loop over them in every step of a sampler
FINER = 4  # finer blocks to a usual one
FEWEST_BLOCKS = 200  # judged: that are left, where the recording has as many samples
_NOISE_IN_BAND = 0.1  # judged: noise of a mean over half the friction band
_BLOCKS_OF_PERIOD, _LEAST_OF_PERIOD = 16, 11  # judged: blocks that show a stroke each way, usually and at the least
_LONGEST_SEGMENT = 8192  # judged: samples of a periodogram
_MOST_OF_MOTION = 1 << 17  # samples that the main motion is looked for in: else segments would be shorter than its period
_PERIODS = 4  # of the main motion in a segment, at the most: more of them show equal cycles as lines with nothing in between
_SHORTEST_SEGMENT = 64  # judged: samples, enough for some half octaves
_CLEAR = 10  # times the floor: the highest of some thousand frequencies of noise is three times as high
_BINS_PER_OCTAVE = 2  # judged
_NOISE_TO_SIGNAL = 1.0  # at the bandwidth, by definition
_COHERENT = 1 / (1 + _NOISE_TO_SIGNAL) ** 2  # squared coherence of two channels that both have this much noise


@dataclass(frozen=True)
class CommonClock:
    """Both channels on one clock.

    Args:
        time: Common clock [s].
        step: Time between samples [s].
        input_force: Input force [N].
        output_force: Output force, shifted back by the delay [N].
        velocity: Velocity [mm/s or rad/s]; NaN without one.
        fault: What became of each sample: a place in `clock.KINDS`.
    """

    time: Vector
    step: float
    input_force: Vector
    output_force: Vector
    velocity: Vector
    fault: Labels

    def part(self, some: slice) -> "CommonClock":
        """Return a piece of it, in double precision."""
        input_, output, velocity = (
            pieces.to_floats(column, some) for column in (self.input_force, self.output_force, self.velocity)
        )
        return CommonClock(self.time[some], self.step, input_, output, velocity, self.fault[some])


def choose_block_samples(
    common: CommonClock, bandwidth: float, main: float, noise: tuple[float, float], loop: bool = False
) -> int:
    """Return samples of a block, chosen from the data.

    Half a period of the bandwidth; longer where the noise of a mean would be more than a tenth of the friction band; never so
    long that a period of the main motion has fewer than 16 or that fewer than 200 are left, and at least so long that there
    are no more than 4000.

    Args:
        common: Both channels.
        bandwidth: Frequency up to which the forces move [Hz].
        main: Frequency at which they move most [Hz]; 0 where they do not.
        noise: Standard deviation of the input and the output force, for a sample of the common clock [N].
        loop: Whether the forces are of a pull-pull loop, whose friction band is one of differences.
    """
    wanted = max(round(1 / (2 * bandwidth * common.step)), _quiet_enough(common, noise, loop))
    most = len(common.time) // FEWEST_BLOCKS
    if main > 0:
        most = min(most, int(1 / (_BLOCKS_OF_PERIOD * main * common.step)))
    return max(1, min(wanted, most), int(np.ceil((_span(common) / common.step + 1) / MOST_BLOCKS)))


def cut_into_windows(common: CommonClock, main: float) -> list[tuple[float, float]]:
    """Return start and end [s] of the parts of a recording that its blocks cannot show as a whole; none of any other.

    Args:
        common: Both channels.
        main: Frequency at which they move most [Hz]; 0 where they do not.
    """
    span = _span(common)
    if span * main * _LEAST_OF_PERIOD <= MOST_BLOCKS:
        return []
    longest = MOST_BLOCKS / (_BLOCKS_OF_PERIOD * main)
    count = min(int(np.ceil(span / longest)), MOST_PARTS)
    length = min(span / count, longest)
    starts = common.time[0] + np.linspace(0, span - length, count)
    return [(float(start), float(start) + length) for start in starts]


def refuse_too_long(file: str, name: str, common: CommonClock, main: float) -> None:
    """Refuse a recording so long that its blocks would mix pulling with returning.

    A simulated hysteresis loop is as wide as it should be with 11 blocks or more in a period, 2 % too narrow with 10 and
    13 % with 8; nothing is left of it with 5.

    Args:
        file: File name, for the error.
        name: Name of the recording, for the error.
        common: Both channels.
        main: Frequency at which they move most [Hz]; 0 where they do not.

    Raises:
        DatasetError: It is.
    """
    span = _span(common)
    if span * main * _LEAST_OF_PERIOD > MOST_BLOCKS:
        raise DatasetError(
            f"{file}: the recording {name!r} lasts {span:,.0f} s, too long for forces that go up and down every "
            f"{1 / main:.3g} s: each of {MOST_BLOCKS} blocks, which is as many as are made, would hold pulling and returning. "
            f"Cut the file into recordings of at most {MOST_BLOCKS / (_LEAST_OF_PERIOD * main):,.0f} s."
        )


def _span(common: CommonClock) -> float:
    return float(common.time[-1] - common.time[0])


def _quiet_enough(common: CommonClock, noise: tuple[float, float], loop: bool) -> int:
    """Return samples over which the noise of how far the forces are apart comes down to a tenth of half the friction band."""
    evenly = slice(None, None, -(-len(common.time) // pieces.PLENTY))
    input_, output = (pieces.to_floats(force, evenly) for force in (common.input_force, common.output_force))
    good = (common.fault[evenly] == GOOD) & (loop | ((input_ > 0) & (output > 0)))
    if not good.any():
        return 1
    input_, output = input_[good], output[good]
    apart = input_ - output if loop else np.log(input_ / output)
    single = float(np.hypot(*noise) if loop else np.median(np.hypot(noise[0] / input_, noise[1] / output)))
    low, high = np.quantile(apart, (0.1, 0.9))
    band = np.sqrt(max(((high - low) / 2) ** 2 - single**2, single**2 / 100))
    return int(np.ceil((single / (_NOISE_IN_BAND * band)) ** 2)) if single > 0 else 1


def average_blocks(common: CommonClock, samples: int, input_noise: float) -> tuple[Blocks, dict[str, int]]:
    """Return means of the good samples over equal stretches of time, and where every sample went.

    A block of whose readings more than half are at the end of a load cell's range is marked, and holds the means of those;
    its other samples count as saturated too, since they are the lower half of the noise.

    Args:
        common: Both channels.
        samples: Samples of a block; 0 to leave every sample by itself.
        input_noise: Standard deviation of a single sample of the input force [N].
    """
    retained, lost, counts, start = [], [], np.zeros(len(KINDS), dtype=int), 0
    while start < len(common.time):
        place, stop = _whole_blocks(common, start, samples)
        part = common.part(slice(start, stop))
        fault = _swept(part.fault, place)
        retained.append(_means(part, place, fault == GOOD))
        lost.append(_means(part, place, (part.fault == SATURATED) & _saturated_blocks(fault, place)))
        counts += np.bincount(fault, minlength=len(KINDS))
        start = stop
    joined = [np.concatenate(column) for column in zip(*retained, *lost, strict=True)]
    order = np.argsort(joined[0], kind="stable")
    place, input_, output, velocity, lowest, highest, count = (column[order] for column in joined)
    middle = common.time[0] + common.step * ((place + 0.5) * max(samples, 1) - 0.5)
    saturated = (np.arange(len(order)) >= sum(len(column[0]) for column in retained))[order]
    time = common.time[place] if samples == 0 else middle
    turn = _turning_values(input_, lowest, highest, input_noise)
    blocks = Blocks(time, input_, output, velocity, count, saturated, turn)
    return blocks, dict(zip(KINDS, counts.tolist(), strict=True))


def _turning_values(mean: Vector, lowest: Vector, highest: Vector, noise: float) -> Vector:
    """Return the force at which each block turned: what means of a valley or a peak cut off; the mean elsewhere.

    Args:
        mean, lowest, highest: Of the samples of each block.
        noise: Standard deviation of a sample, about as much as it adds to the extreme of the few samples near a turn.
    """
    before, after = np.append(mean[:1], mean[:-1]), np.append(mean[1:], mean[-1:])
    down = np.minimum(lowest + noise, mean)
    up = np.maximum(highest - noise, mean)
    return np.where((mean < before) & (mean < after), down, np.where((mean > before) & (mean > after), up, mean))


def _whole_blocks(common: CommonClock, start: int, samples: int) -> tuple[Positions, int]:
    """Return the block of each sample from one on, as far as whole blocks go in a piece, and where they end."""
    length = pieces.PIECE
    while True:
        stop = min(start + length, len(common.time))
        if samples == 0:
            return np.arange(start, stop), stop
        since = common.time[start:stop] - common.time[0]
        place = np.floor(since / (samples * common.step) + 0.5 / samples).astype(int)
        whole = int(np.searchsorted(place, place[-1])) if stop < len(common.time) else len(place)
        if whole:
            return place[:whole], start + whole
        length *= 2


def _saturated_blocks(fault: Labels, place: Labels) -> Flags:
    """Return which samples are in blocks more than half of whose readings are at the end of the range."""
    block = place - place[0]
    readings = np.bincount(block, weights=fault < DROPOUT)
    return (2 * np.bincount(block, weights=fault == SATURATED, minlength=len(readings)) > readings)[block]


def _swept(fault: Labels, place: Labels) -> Labels:
    """Faults with the good samples of saturated blocks counted as saturated."""
    if not np.any(fault == SATURATED):
        return fault
    return np.where((fault == GOOD) & _saturated_blocks(fault, place), SATURATED, fault)


def _means(
    common: CommonClock, place: Labels, chosen: Flags
) -> tuple[Positions, ChosenVector, ChosenVector, ChosenVector, ChosenVector, ChosenVector, Positions]:
    """Return the number of each block with chosen samples; the means of the two forces and the velocity, and the lowest and
    the highest input force, of these; and their counts.
    """
    positions = np.flatnonzero(chosen)
    starts = np.flatnonzero(np.append(True, np.diff(place[positions]) > 0)) if len(positions) else np.zeros(0, dtype=int)
    count = np.diff(np.append(starts, len(positions)))
    columns = (common.input_force, common.output_force, common.velocity)
    means = [np.add.reduceat(v[positions], starts) / count if len(starts) else np.zeros(0) for v in columns]
    input_ = common.input_force[positions]
    ends = [of.reduceat(input_, starts) if len(starts) else np.zeros(0) for of in (np.minimum, np.maximum)]
    return place[positions][starts], means[0], means[1], means[2], ends[0], ends[1], count


def estimate_bandwidth(input_force: Series, output_force: Series, rate: float, main: float, loop: bool = False) -> float:
    """Return the frequency up to which the forces move together [Hz].

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
    """Return the frequency at which the forces move most [Hz]; 0 where they hardly move more than their noise does.

    Power counts by the root of its frequency: a drift three times as large as cycles a hundred times as fast is not taken for
    the motion, and neither is a hum of 50 Hz a fifth as large as cycles of 10 s.

    Args:
        input_force: See `estimate_bandwidth`.
        output_force: Likewise.
        rate: Likewise.
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
    """Return means of so many samples each, as a channel would have that is so much slower."""
    if samples == 1:
        return values[: len(values)]
    whole, at_once = len(values) // samples, max(pieces.PIECE // samples, 1)
    starts = range(0, whole, at_once)
    parts = (values[slice(start * samples, min(start + at_once, whole) * samples)] for start in starts)
    return np.concatenate([np.asarray(part, dtype=float).reshape(-1, samples).mean(axis=1) for part in parts])


def _segment(samples: int) -> int:
    return min(_LONGEST_SEGMENT, max(samples // 8, 16))


def _spectra(input_force: Series, output_force: Series, segment: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Welch's mean periodograms of the input, of the output, and across, from half-overlapping Hann segments."""
    bins, count = segment // 2 + 1, 0
    sums = np.zeros(bins), np.zeros(bins), np.zeros(bins, dtype=complex)
    for x, y in zip(*(_transforms(force, segment) for force in (input_force, output_force)), strict=True):
        for total, power in zip(sums, (np.abs(x) ** 2, np.abs(y) ** 2, np.conj(x) * y), strict=True):
            total += np.sum(power, axis=0)
        count += len(x)
    return sums[0] / count, sums[1] / count, sums[2] / count


def _transforms(values: Series, segment: int) -> Iterator[np.ndarray]:
    """Yield spectra of all segments, so many at once as fill a piece."""
    samples, hop = len(values), segment // 2
    mean = sum(float(np.sum(values[part], dtype=float)) for part in pieces.split_pieces(samples)) / samples
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
    """Return the lower edge [Hz] of the first half octave above the main motion with median power of twice the top's."""
    medians = np.array([np.median(part) for part in np.split(power, starts[1:])])
    quiet = medians < (1 + 1 / _NOISE_TO_SIGNAL) * float(np.median(power[top]))
    quiet &= lower > main
    return float(lower[np.argmax(quiet)]) if quiet.any() else rate / 2
