"""Samples that are no readings: missing or frozen ones, spikes, and those at the end of a load cell's range."""

import math
from dataclasses import dataclass

import numpy as np

from bowdenfit.description import Preparation
from bowdenfit.files.pieces import first_set, have_same_numbers, interpolate, last_set, split_pieces, subsample
from bowdenfit.recordings.preparation.clock import DROPOUT, GOOD, SATURATED, SPIKE, Sampled, gaps_of, step_of
from bowdenfit.recordings.preparation.delay import RANGE
from bowdenfit.recordings.preparation.noise import noise_of, quantum_of
from bowdenfit.types import ChosenFlags, ChosenVector, Flags, Labels, OtherVector, Positions, Vector

_SPIKE_SDS = 8.0  # judged: one normal sample in 10^15 is so far off
_HALF_WINDOW = 5  # judged: samples on each side of the running median
_SUDDEN = 3.0  # judged: of the steps that 99 % of samples stay below, beyond which a force does not fall in one
_LOADED = 0.2  # judged: of the typical force, above which a force does not fall to 0 and back from sample to sample
_LONGEST_SPIKE = 3  # samples; judged: what is longer may be motion
_SHORTEST_RUN = 10  # judged: equal samples from which a run may be a frozen channel
_PROBABILITY = 1e-6  # that quantised noise makes such a run in a recording; judged
_CLOSED = 1  # samples between two at the end of the range that count as there too


@dataclass(frozen=True)
class EqualRuns:
    """Long stretches of equal successive values: of `_SHORTEST_RUN` samples or more.

    Args:
        start: Index of the first sample of each.
        length: Samples of each.
        value: Its value.
        typical: Length of the stretches, long or short, that half of all samples lie in, or in shorter ones.
    """

    start: Labels
    length: Labels
    value: Vector
    typical: int

    def covered(self, chosen: ChosenFlags, samples: int) -> Flags:
        """Return samples that lie in the chosen stretches."""
        return _from_to(self.start[chosen], self.start[chosen] + self.length[chosen], samples)


def runs_of(values: OtherVector) -> EqualRuns:
    """Split into stretches of equal successive values; each missing value is a stretch of its own."""
    run_start, counts = 0, dict[int, int]()
    starts, lengths = [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)]
    for part in split_pieces(len(values)):
        some = values[part.start : part.stop + 1]
        ends = part.start + 1 + np.flatnonzero(some[1:] != some[:-1])
        ends = np.append(ends, len(values)) if part.stop == len(values) else ends
        first = np.append(run_start, ends[:-1])[: len(ends)]
        length = ends - first
        for samples, count in zip(*np.unique(length, return_counts=True), strict=True):
            counts[int(samples)] = counts.get(int(samples), 0) + int(count)
        starts.append(first[length >= _SHORTEST_RUN])
        lengths.append(length[length >= _SHORTEST_RUN])
        run_start = int(ends[-1]) if len(ends) else run_start
    start, kinds = np.concatenate(starts), sorted(counts)
    covered = np.cumsum([counts[samples] * samples for samples in kinds])
    typical = kinds[int(np.searchsorted(covered, len(values) / 2))]
    return EqualRuns(start, np.concatenate(lengths), np.asarray(values[start], dtype=float), typical)


def flag_samples(
    time: Vector, force: Vector, other_time: OtherVector, other_force: OtherVector, settings: Preparation
) -> tuple[Sampled, tuple[float, float]]:
    """Find what is wrong with the samples of one channel; the readings stay as they are.

    Samples that are not finite are dropouts whatever the settings say, since nothing can be computed from them.

    Args:
        time: Clock of the channel, strictly increasing [s].
        force: Its readings, before any tare [N].
        other_time: Clock of the other channel [s].
        other_force: Readings of the other channel [N].
        settings: Which faults are looked for.

    Returns:
        The channel with its faults, and the ends of the range that were taken [N].
    """
    if settings.dropouts:
        force = _without(force, _skipped(force))
    finite = np.isfinite(force)
    other = _beside(time, other_time, other_force)
    some = subsample(other_force)
    other_noise = resolution(some[np.isfinite(some)])
    off = spikes(force)
    lag = round(RANGE / step_of(time))
    limits = settings.limits.newtons if settings.limits else None
    ends, at_end = saturation(_without(force, off), other, other_noise, limits, lag)
    fault = np.full(len(force), GOOD, dtype=np.int8)
    if settings.saturation != "kept":
        fault[at_end] = SATURATED
    if settings.spikes:
        fault[off] = SPIKE
    if settings.dropouts:
        fault[flag_frozen(force, other, other_noise) & ~at_end] = DROPOUT
    fault[~finite] = DROPOUT
    gap = gaps_of(time) if settings.dropouts else np.zeros(len(time), dtype=bool)
    return Sampled(time, _without(force, ~finite), fault, gap), ends


def _skipped(force: Vector) -> Flags:
    """Return samples that are exactly 0 between samples far above it, as a multiplexer or a loose plug writes them.

    The lowest reading stands for 0 if it is far below the others and repeated: a channel may have been tared, though by no more
    than it reads; what is lower still is a code. Zeros that last for more than a few samples are those of a slack rope unless
    the force falls to them faster than it moves.
    """
    some = subsample(force)
    loaded = _LOADED * float(np.nanmedian(some[some > 0])) if np.any(some > 0) else np.inf
    lowest = min(float(np.nanmin(some)), loaded) if np.any(np.isfinite(some)) else 0.0
    lowest = lowest if lowest > -float(np.nanmax(some, initial=0.0)) else 0.0
    zero = (force == 0) | (force == lowest)
    if np.count_nonzero(zero) < 2:
        return np.zeros(len(force), dtype=bool)
    edges = np.diff(zero.astype(np.int8), prepend=0, append=0)
    start, end = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    inside = (start > 0) & (end < len(force))
    start, end = start[inside], end[inside]
    steps = np.abs(np.diff(some[(some != 0) & (some != lowest)]))
    fall = _SUDDEN * float(np.nanquantile(steps, 0.99)) if len(steps) else 0.0
    sudden = (force[start - 1] > loaded) & (force[end] > loaded)
    sudden &= (end - start <= _LONGEST_SPIKE) | (np.minimum(force[start - 1], force[end]) > fall)
    return _from_to(start[sudden], end[sudden], len(force))


def _beside(time: Vector, other_time: OtherVector, other_force: OtherVector) -> Vector:
    """Return the force of the other channel at the times of one."""
    there = np.isfinite(other_force)
    if there.all() and have_same_numbers(time, other_time):
        return other_force
    return interpolate(time, other_time, other_force, there)


def _without(force: Vector, off: Flags) -> Vector:
    """Return a force with nothing in the place of some samples."""
    return np.where(off, np.array(np.nan, dtype=force.dtype), force) if off.any() else force


def resolution(force: Vector) -> float:
    """Return the smallest change of a channel that means motion [N]: six standard deviations of noise and two of its steps."""
    return 6 * noise_of(force) + 2 * quantum_of(force)


def flag_frozen(force: Vector, other: Vector, other_resolution: float) -> Flags:
    """Return samples that repeat one value for so long that quantisation cannot explain it, while the other channel moves.

    How long is too long follows from the noise: where it covers at least a third of a quantisation step, the chance of
    so many repeats is below one in a million. A channel with less noise is never called frozen, because a force that
    stands still at a reversal looks the same. Repeats that the whole channel has, as after a slower converter, are no fault.
    """
    runs = runs_of(force)
    return runs.covered(_long_while_moving(force, other, other_resolution, runs), len(force))


def saturation(
    force: Vector, other: Vector, other_resolution: float, limits: tuple[float, float] | None, lag: int
) -> tuple[tuple[float, float], Flags]:
    """Return samples at the end of the load cell's range, and the ends [N]; infinite where none was stated or seen.

    With limits stated, everything within a quantisation step of them. Without, the largest or smallest value of the
    channel where it is held for longer than noise allows, or where the largest is held while the other force goes on
    rising by more than its resolution, which no cable does; not within the first `lag` samples, in which it may only be later.
    """
    if limits is not None:
        step = min(quantum_of(_sampled(force)), 1e-3 * (limits[1] - limits[0]))
        ends = limits
    else:
        step, ends = 0.0, _clipped_at(force, other, other_resolution, lag)
    at_end = (force <= ends[0] + step) | (force >= ends[1] - step)
    return ends, _closed(at_end) if limits is None else at_end


def _clipped_at(force: Vector, other: Vector, other_resolution: float, lag: int) -> tuple[float, float]:
    runs = runs_of(force)
    long = _long_while_moving(force, other, other_resolution, runs)
    low, high = _range_of(force)
    clipped_low = np.any(long & (runs.value == low))
    clipped_high = np.any(long & (runs.value == high)) or _rises_at(high, other, runs, lag) > other_resolution
    return (low if clipped_low else -math.inf, high if clipped_high else math.inf)


def _longest_by_noise(force: Vector, runs: EqualRuns) -> float:
    """Repeats that noise makes less than once in a million recordings; infinite for a channel without enough noise."""
    finite = _sampled(force)
    noise, step = noise_of(finite), quantum_of(finite)
    if noise < 0.3 * step or noise == 0:
        return math.inf
    same = math.erf(step / (2 * math.sqrt(2) * noise))
    by_noise = math.log(_PROBABILITY / len(force)) / math.log(same) if 0 < same < 1 else 0.0
    return max(float(_SHORTEST_RUN), by_noise, 5.0 * runs.typical)


def _sampled(force: Vector) -> ChosenVector:
    """Plenty of the readings of a channel."""
    some = subsample(force)
    return some[np.isfinite(some)]


def _long_while_moving(force: Vector, other: Vector, other_resolution: float, runs: EqualRuns) -> ChosenFlags:
    """Return which of the runs are longer than chance makes them, while the other force changes by more than its resolution."""
    chosen = runs.length >= _longest_by_noise(force, runs)
    for i in np.flatnonzero(chosen).tolist():
        inside = other[runs.start[i] : runs.start[i] + runs.length[i]]
        chosen[i] = float(inside.max()) - float(inside.min()) > other_resolution
    return chosen


def _range_of(force: Vector) -> tuple[float, float]:
    """Lowest and highest reading."""
    there = np.isfinite(force)
    return float(np.min(force, where=there, initial=np.inf)), float(np.max(force, where=there, initial=-np.inf))


def _rises_at(value: float, other: Vector, runs: EqualRuns, lag: int) -> float:
    """Return how far the other force rises at most while a channel rests at a value, after the first `lag` samples."""
    chosen = (runs.value == value) & (runs.length > max(lag, _SHORTEST_RUN))
    parts = [other[s + lag : s + n] for s, n in zip(runs.start[chosen], runs.length[chosen], strict=True)]
    return max((float(part.max() - part[0]) for part in parts), default=0.0)


def _closed(flags: Flags) -> Flags:
    """Flag the few samples between flagged ones too: what is left of a clipped stretch is the lower half of its noise."""
    positions = np.flatnonzero(flags)
    if not len(positions):
        return flags
    near = np.flatnonzero(np.diff(positions) <= _CLOSED + 1)
    return flags | _from_to(positions[near], positions[near + 1], len(flags))


def _from_to(start: Positions, end: Positions, samples: int) -> Flags:
    """Return samples from any start up to its end."""
    edges = np.zeros(samples + 1, dtype=np.int8)
    edges[start] += 1  # neither any start nor any end is there twice
    edges[end] -= 1
    return np.cumsum(edges[:-1], dtype=np.int8) > 0


def spikes(force: Vector) -> Flags:
    """Return one to three successive samples more than eight standard deviations off the running median of eleven.

    Quick motion is no spike: the distance allowed grows with the typical step between the neighbors, and more than three
    successive samples are left alone.
    """
    there, flags = np.isfinite(force), np.zeros(len(force), dtype=bool)
    if np.count_nonzero(there) <= 2 * _HALF_WINDOW:
        return flags
    values, (low, high) = _sampled(force), _range_of(force)
    within = values[(values > low) & (values < high)]  # clipped stretches would hide the noise
    noise = math.hypot(noise_of(within), quantum_of(values) / math.sqrt(12))
    for part in split_pieces(len(force)):
        start, stop = _with_neighbors(there, part)
        indices = start + np.flatnonzero(there[start:stop])
        positions = (
            indices[_spikes_in(np.asarray(force[indices], dtype=float), noise)]
            if len(indices) > 2 * _HALF_WINDOW
            else indices[:0]
        )
        flags[positions[(positions >= part.start) & (positions < part.stop)]] = True
    return flags


def _with_neighbors(there: Flags, part: slice) -> tuple[int, int]:
    """Return a piece, and so many good samples on both sides that its spikes are those of the whole."""
    start, stop = part.start, part.stop
    for _ in range(2 * _HALF_WINDOW + 2 * _LONGEST_SPIKE):
        start, stop = max(last_set(there, start), 0), min(first_set(there, stop) + 1, len(there))
    return start, stop


def _spikes_in(values: Vector, noise: float) -> Positions:
    padded = np.pad(values, _HALF_WINDOW, mode="reflect")
    beside = (padded[: -2 * _HALF_WINDOW] + padded[2 * _HALF_WINDOW :]) / 2
    suspects = np.flatnonzero(np.abs(values - beside) > _SPIKE_SDS / 2 * noise)
    windows = padded[suspects[:, None] + np.arange(2 * _HALF_WINDOW + 1)]
    steps = np.median(np.abs(np.diff(windows, axis=1)), axis=1)
    allowed = _SPIKE_SDS * noise + 3 * np.maximum(steps - 1.5 * noise, 0)
    distance = np.abs(values[suspects] - np.median(windows, axis=1))
    off, distance = suspects[distance > allowed], distance[distance > allowed]
    return off[_sudden(padded, off, distance)] if len(off) else off


def _sudden(padded: OtherVector, off: Positions, distance: ChosenVector) -> ChosenFlags:
    """Return whether each suspect is in a short group that the force jumps to, and back from, by half its distance or more."""
    first = np.append(True, np.diff(off) > 1)
    group = np.cumsum(first) - 1
    starts = np.flatnonzero(first)
    length = np.bincount(group)
    steps = np.abs(np.diff(padded))
    before = steps[off[starts] + _HALF_WINDOW - 1]
    after = steps[off[starts] + length - 1 + _HALF_WINDOW]
    short = length <= _LONGEST_SPIKE
    return (short & (np.minimum(before, after) > np.maximum.reduceat(distance, starts) / 2))[group]
