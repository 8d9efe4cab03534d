"""Means over blocks: how long they should be, and the averaging, in which every sample is accounted for."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.recordings.preparation.clock import DROPOUT, GOOD, KINDS, SATURATED
from bowdenfit.recordings.preparation.shapes import ChosenFlags, ChosenVector, Places
from bowdenfit.recordings.recording import Blocks
from bowdenfit.types import Flags, Labels, Vector

MOST_BLOCKS = 4000
FEWEST_BLOCKS = 200
_NOISE_IN_BAND = 0.1


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


def block_samples(common: CommonClock, bandwidth: float, noise: tuple[float, float], loop: bool = False) -> int:
    """Samples of a block, chosen from the data.

    Half a period of the bandwidth; longer where the noise of a mean would be more than a tenth of the friction band; never so
    long that fewer than 200 blocks are left, and at least so long that there are no more than 4000.

    Args:
        common: Both channels.
        bandwidth: Frequency up to which the forces move [Hz].
        noise: Standard deviation of the input and the output force, for a sample of the common clock [N].
        loop: Whether the forces are of a pull-pull loop, whose friction band is one of differences.
    """
    samples = len(common.time)
    wanted = max(round(1 / (2 * bandwidth * common.step)), _quiet_enough(common, noise, loop))
    span = float(common.time[-1] - common.time[0]) / common.step + 1
    return max(1, min(wanted, samples // FEWEST_BLOCKS), int(np.ceil(span / MOST_BLOCKS)))


def _quiet_enough(common: CommonClock, noise: tuple[float, float], loop: bool) -> int:
    """Samples over which the noise of how far the forces are apart comes down to a tenth of half the friction band."""
    good = (common.fault == GOOD) & (loop | ((common.input_force > 0) & (common.output_force > 0)))
    if not good.any():
        return 1
    pulled, given = common.input_force[good], common.output_force[good]
    apart = pulled - given if loop else np.log(pulled / given)
    single = float(np.hypot(*noise) if loop else np.median(np.hypot(noise[0] / pulled, noise[1] / given)))
    low, high = np.quantile(apart, (0.1, 0.9))
    band = np.sqrt(max(((high - low) / 2) ** 2 - single**2, single**2 / 100))
    return int(np.ceil((single / (_NOISE_IN_BAND * band)) ** 2)) if single > 0 else 1


def average(common: CommonClock, samples: int) -> tuple[Blocks, dict[str, int]]:
    """Means of the good samples over equal stretches of time, and where every sample went.

    A block of whose readings more than half are at the end of a load cell's range is marked, and holds the means of those;
    its other samples count as saturated too, since they are the lower half of the noise.

    Args:
        common: Both channels.
        samples: Samples of a block; 0 to leave every sample by itself.
    """
    size = max(samples, 1)
    place = np.floor((common.time - common.time[0]) / (size * common.step) + 0.5 / size).astype(int)
    place = np.arange(len(place)) if samples == 0 else place
    fault = _swept(common.fault, place)
    kept = _means(common, place, fault == GOOD)
    lost = _means(common, place, (common.fault == SATURATED) & _saturated_blocks(fault, place)[place])
    order = np.argsort(np.append(kept[0], lost[0]), kind="stable")
    joined = [np.append(a, b)[order] for a, b in zip(kept, lost, strict=True)]
    middle = common.time[0] + common.step * ((joined[0] + 0.5) * size - 0.5)
    time = common.time[joined[0]] if samples == 0 else middle
    saturated = np.append(np.zeros(len(kept[0]), dtype=bool), np.ones(len(lost[0]), dtype=bool))[order]
    counts = dict(zip(KINDS, np.bincount(fault, minlength=len(KINDS)).tolist(), strict=True))
    return Blocks(time, joined[1], joined[2], joined[3], joined[4], saturated), counts


def _saturated_blocks(fault: Labels, place: Labels) -> ChosenFlags:
    """Whether more than half of the readings of each block are at the end of the range."""
    readings = np.bincount(place, weights=fault < DROPOUT)
    return 2 * np.bincount(place, weights=fault == SATURATED, minlength=len(readings)) > readings


def _swept(fault: Labels, place: Labels) -> Labels:
    """Faults with the good samples of saturated blocks counted as saturated."""
    if not np.any(fault == SATURATED):
        return fault
    return np.where((fault == GOOD) & _saturated_blocks(fault, place)[place], SATURATED, fault)


def _means(
    common: CommonClock, place: Labels, chosen: Flags
) -> tuple[Places, ChosenVector, ChosenVector, ChosenVector, Places]:
    """Number of each block with chosen samples, the means of the two forces and the velocity, and the counts."""
    where = np.flatnonzero(chosen)
    starts = np.flatnonzero(np.append(True, np.diff(place[where]) > 0)) if len(where) else np.zeros(0, dtype=int)
    count = np.diff(np.append(starts, len(where)))
    columns = (common.input_force, common.output_force, common.velocity)
    means = [np.add.reduceat(v[where], starts) / count if len(starts) else np.zeros(0) for v in columns]
    return place[where][starts], means[0], means[1], means[2], count
