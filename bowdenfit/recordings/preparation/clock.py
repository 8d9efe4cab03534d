"""One clock for both load cells: steps, gaps, repeated times, and readings of one channel at the times of another."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.types import Flags, Labels, Vector

GAP_STEPS = 5
GOOD, SPIKE, SATURATED, DROPOUT, QUIET, NO_OVERLAP = range(6)
KINDS = ("used", "spike", "saturated", "dropout", "quiet", "no overlap")


@dataclass(frozen=True)
class Sampled:
    """One channel on its clock, with what is wrong with each sample.

    Args:
        time: Time of each sample, strictly increasing [s].
        force: Readings [N]; NaN where missing.
        fault: `GOOD`, `SPIKE`, `SATURATED` or `DROPOUT`, one a sample.
        gap: Whether the clock jumps after a sample; such times count as dropouts of this channel.
    """

    time: Vector
    force: Vector
    fault: Labels
    gap: Flags


def step_of(time: Vector) -> float:
    """Time between samples [s]: the mean step, gaps left out."""
    steps = np.diff(time)
    return float(np.mean(steps[steps <= GAP_STEPS * np.median(steps)]))


def gaps_of(time: Vector) -> Flags:
    """Whether the clock jumps by more than five steps after each sample; never after the last."""
    return np.append(np.diff(time) > GAP_STEPS * step_of(time), False)


def spread(time: Vector) -> Vector:
    """The clock with repeated times spread evenly up to the next different time, so that it increases strictly [s]."""
    first = np.append(True, np.diff(time) > 0)
    if first.all():
        return time
    starts = np.flatnonzero(first)
    last_step = float(np.median(np.diff(time[starts]) / np.diff(starts)))
    ends = np.append(starts, len(time))
    return np.interp(
        np.arange(len(time)), ends, np.append(time[starts], time[-1] + last_step * (ends[-1] - starts[-1]))
    )


def read_at(channel: Sampled, time: Vector) -> tuple[Vector, Labels]:
    """Readings of a channel at other times by linear interpolation, and the worst fault of the samples they come from.

    Args:
        channel: The channel.
        time: Times wanted, increasing [s].

    Returns:
        Readings [N], and faults: `NO_OVERLAP` where the channel was not sampled, `DROPOUT` inside its gaps.
    """
    if len(time) == len(channel.time) and np.array_equal(time, channel.time):
        return channel.force, channel.fault
    tolerance = 1e-9 * step_of(channel.time)
    before = np.clip(np.searchsorted(channel.time, time + tolerance, side="right") - 1, 0, len(channel.time) - 2)
    share = (time - channel.time[before]) / (channel.time[before + 1] - channel.time[before])
    share = np.where(np.abs(share - np.round(share)) < 1e-9, np.round(share), share)
    left, right = share < 1, share > 0
    force = (
        np.where(left, channel.force[before], 0) * (1 - share) + np.where(right, channel.force[before + 1], 0) * share
    )
    fault = np.maximum(np.where(left, channel.fault[before], GOOD), np.where(right, channel.fault[before + 1], GOOD))
    fault = np.maximum(fault, np.where(left & right & channel.gap[before], DROPOUT, GOOD))
    outside = (share < 0) | (share > 1)
    return np.where(outside, np.nan, force), np.where(outside, NO_OVERLAP, fault)
