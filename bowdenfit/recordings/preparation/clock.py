"""One clock for both load cells: steps, gaps, repeated times, and readings of one channel at the times of another."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.files.pieces import have_same_numbers, never_falls, split_pieces, subsample
from bowdenfit.types import Flags, Labels, OtherLabels, OtherVector, Vector

GAP_STEPS = 5  # judged: usual steps, from which on a step is a gap
GOOD, SPIKE, SATURATED, DROPOUT, QUIET, EXCLUDED, NO_OVERLAP = range(7)
KINDS = ("used", "spike", "saturated", "dropout", "quiet", "by the user", "no overlap")


@dataclass(frozen=True)
class Sampled:
    """One channel on its clock, with what is wrong with each sample.

    Args:
        time: Time of each sample, strictly increasing [s].
        force: Readings [N]; NaN where missing.
        fault: `GOOD`, `SPIKE`, `SATURATED`, `DROPOUT` or `EXCLUDED`, one a sample.
        gap: Whether the clock jumps after a sample; such times count as dropouts of this channel.
    """

    time: Vector
    force: Vector
    fault: Labels
    gap: Flags

    def between(self, start: float, end: float) -> "Sampled":
        """Return the samples from one time up to another [s]."""
        part = slice(*np.searchsorted(self.time, (start, end)).tolist())
        return Sampled(self.time[part], self.force[part], self.fault[part], self.gap[part])


def step_of(time: Vector) -> float:
    """Return the time between samples [s]: the mean step, gaps left out."""
    longest = GAP_STEPS * np.median(np.diff(subsample(time)))
    total, count = 0.0, 0
    for part in split_pieces(len(time) - 1):
        steps = np.diff(time[part.start : part.stop + 1])
        usual = steps[steps <= longest]
        total, count = total + float(np.sum(usual)), count + len(usual)
    return total / count


def gaps_of(time: Vector) -> Flags:
    """Return whether the clock jumps by more than five steps after each sample; never after the last."""
    longest, gaps = GAP_STEPS * step_of(time), np.zeros(len(time), dtype=bool)
    for part in split_pieces(len(time) - 1):
        gaps[part] = np.diff(time[part.start : part.stop + 1]) > longest
    return gaps


def spread_repeated(time: Vector) -> Vector:
    """Return the clock with repeated times spread evenly up to the next different time, so that it increases strictly [s]."""
    if never_falls(time, strictly=True):
        return time
    spread_out = np.empty(len(time))
    for part in split_pieces(len(time)):
        begin = int(np.searchsorted(time, time[part.start], side="left"))
        end = int(np.searchsorted(time, time[part.stop - 1], side="right"))
        times = time[begin : end + 1]
        starts = np.flatnonzero(np.append(True, np.diff(times) > 0))
        times = times[starts]
        if end == len(time):
            starts, times = (
                np.append(starts, end - begin),
                np.append(times, times[-1] + _last_step(time, starts[-1] + begin)),
            )
        spread_out[part] = np.interp(np.arange(part.start, part.stop) - begin, starts, times)
    return spread_out


def _last_step(time: Vector, last: int) -> float:
    """Return how long the last of repeated times lasts, which begins at a sample: as its samples do elsewhere."""
    some = subsample(time)
    starts = np.flatnonzero(np.append(True, np.diff(some) > 0))
    return float(np.median(np.diff(some[starts]) / np.diff(starts))) * (len(time) - last)


def read_at(channel: Sampled, time: OtherVector, late: float = 0.0) -> tuple[OtherVector, OtherLabels]:
    """Readings of a channel at other times by linear interpolation, and the worst fault of the samples they come from.

    Args:
        channel: The channel.
        time: Times wanted, increasing [s].
        late: How much later than it should the channel reads [s].

    Returns:
        Readings [N], and faults: `NO_OVERLAP` where the channel was not sampled, `DROPOUT` inside its gaps.
    """
    if late == 0 and have_same_numbers(time, channel.time):
        return channel.force, channel.fault
    tolerance = 1e-9 * step_of(channel.time)
    force, fault = np.empty(len(time), dtype=channel.force.dtype), np.empty(len(time), dtype=channel.fault.dtype)
    for part in split_pieces(len(time)):
        force[part], fault[part] = _read_piece(channel, time[part] + late, tolerance)
    return force, fault


def _read_piece(channel: Sampled, time: OtherVector, tolerance: float) -> tuple[OtherVector, OtherLabels]:
    before = np.clip(np.searchsorted(channel.time, time + tolerance, side="right") - 1, 0, len(channel.time) - 2)
    share = (time - channel.time[before]) / (channel.time[before + 1] - channel.time[before])
    share = np.where(np.abs(share - np.round(share)) < 1e-9, np.round(share), share)
    left, right = share < 1, share > 0
    at_left, at_right = (np.asarray(channel.force[at], dtype=float) for at in (before, before + 1))
    force = np.where(left, at_left, 0) * (1 - share) + np.where(right, at_right, 0) * share
    fault = np.maximum(np.where(left, channel.fault[before], GOOD), np.where(right, channel.fault[before + 1], GOOD))
    fault = np.maximum(fault, np.where(left & right & channel.gap[before], DROPOUT, GOOD))
    outside = (share < 0) | (share > 1)
    return np.where(outside, np.nan, force), np.where(outside, NO_OVERLAP, fault)
