"""What each block of a recording is worth to a likelihood: whether it can be used, and how much it says."""

import numpy as np

from bowdenfit.cable.conditions import LEAST_SHARE
from bowdenfit.recordings.preparation.likely_input import likely_input
from bowdenfit.recordings.preparation.play import white_noise
from bowdenfit.recordings.recording import Blocks, Recording
from bowdenfit.types import Vector

RECORDED = "recorded_efficiency"  # name of the readings of recordings in results
_QUIET = 0.1  # share of the drifts' own spread, up to which noise may be in a drift
_CORNER = 1  # blocks before and after a turn, over which the force changes as it does there
_LEAST_KNOWN = 1e-9
_NEAR_LIMIT = 0.005  # of the end of a range, within which a saturated reading is at it


def positive(recording: Recording) -> np.ndarray:
    """Blocks that are readings of a rope under tension."""
    blocks = recording.blocks
    return ~blocks.saturated & (blocks.input_force > 0) & (blocks.output_force > 0)


def worth_of(recording: Recording, used: np.ndarray) -> np.ndarray:
    """What each block is worth: in proportion to its samples, and less where deviations stay alike for long."""
    samples = recording.blocks.samples[used].astype(float)
    return samples / recording.blocks.samples.mean() / recording.strokes.correlation


def drift_of(recording: Recording) -> np.ndarray:
    """Change of log F_out with time [1/s], by which a delay of its channel shifts it.

    From one block to the next where that is clear of noise, else over as many blocks on both sides as that takes, as far as
    the phase goes: a change that holds noise makes the delay seem smaller than it is, and better known.
    """
    blocks = recording.blocks
    least = LEAST_SHARE * np.max(np.abs(blocks.output_force))
    log_force, at = np.log(np.maximum(blocks.output_force, least)), np.arange(len(blocks.time))
    noise = white_noise(blocks.output_force) / float(np.median(np.maximum(blocks.output_force, least)))
    first = np.append(True, np.diff(recording.strokes.stroke) != 0)
    starts = np.maximum.accumulate(np.where(first, at, 0))
    ends = np.append(np.flatnonzero(first)[1:], len(at))[np.cumsum(first) - 1] - 1
    drift, reach = np.gradient(log_force, blocks.time), 1
    while noise / np.sqrt(2) / reach > _QUIET * np.std(drift * np.gradient(blocks.time)) and reach < len(at) // 2:
        reach *= 2
        side = np.minimum(np.minimum(at - starts, ends - at), reach)
        wide = side > 1
        before, after = (at - side)[wide], (at + side)[wide]
        drift[wide] = (log_force[after] - log_force[before]) / (blocks.time[after] - blocks.time[before])
    return drift


def likely_forces(blocks: Blocks) -> tuple[Vector, Vector]:
    """Input and output force of each block with as little of their noise as can be, above 0 [N]; see `likely_input`."""
    each = (blocks.input_force, blocks.output_force)
    likely_in, likely_out = (np.maximum(likely_input(f), LEAST_SHARE * np.max(np.abs(f))) for f in each)
    return likely_in, likely_out


def inside_phase(state: np.ndarray) -> np.ndarray:
    """Blocks whose neighbors are in the same phase: at a corner a block's mean is of two phases."""
    same = np.diff(state) == 0
    return np.append(True, same) & np.append(same, True)


def standing_share(state: np.ndarray, force: np.ndarray) -> np.ndarray:
    """What a block is worth beside others of its phase: all of it while sliding, a share of one while standing still.

    The operator stands where the highest (or lowest) input left it, noise and all: every block of that phase has this one
    error in common, and together they are worth no more than one reading with twice the noise. Where inside its block the
    force turned is not known either, which is an error of about half the change of a block there.

    Args:
        state: Contact of each block.
        force: Its input force [N].
    """
    if not len(state):
        return np.ones(0)
    phase = np.append(0, np.cumsum(np.diff(state) != 0))
    first = np.flatnonzero(np.append(True, np.diff(phase) != 0))
    change = np.abs(np.diff(likely_input(force), prepend=force[0]))
    near = np.clip(first[:, None] + np.arange(-_CORNER, _CORNER + 1), 0, len(state) - 1)
    noise, turn = white_noise(force), np.max(change[near], axis=1) / 2
    known = np.maximum(noise**2 / np.maximum(noise**2 + turn**2, 1e-300), _LEAST_KNOWN)
    return np.where(state == 0, (0.5 * known / np.bincount(phase))[phase], 1.0)


def _at_limit(recording: Recording, force: np.ndarray) -> np.ndarray:
    """Saturated blocks in which this of the two forces stands at the end of the range, as its saturated samples do."""
    ends = [end for end in recording.account.limits if np.isfinite(end)]
    near = [np.abs(force - end) <= _NEAR_LIMIT * max(np.abs(ends)) for end in ends]
    return recording.blocks.saturated & (np.any(near, axis=0) if near else np.zeros(len(force), dtype=bool))


def output_saturated(recording: Recording) -> np.ndarray:
    """Blocks whose output force is at least as large as what was read."""
    return _at_limit(recording, recording.blocks.output_force)


def input_saturated(recording: Recording) -> np.ndarray:
    """Blocks whose input force is not known."""
    return _at_limit(recording, recording.blocks.input_force)


def restarts(lost: np.ndarray) -> np.ndarray:
    """Blocks after a stretch whose input is not known: where the operator stands there must be read anew."""
    return ~lost & np.append(False, lost[:-1])
