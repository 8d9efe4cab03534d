r"""Blocks of recordings for the likelihood: usable ones, their weights, and arrays of many recordings side by side.

A weight computed from a block's own forces rises with their noise, and with it the log ratio falls or rises, so that the mean
of a recording would be off by about 1.5 (sd/F)^2 however many blocks it has; see `expected_forces`, which makes the weights
here too. What noise adds to the mean of a log ratio is taken off, and what it adds to its variance lowers the block's weight:
to second order, for a force F with normal noise of standard deviation sigma,

.. math:: \operatorname{var} \log F = (\sigma/F)^2 \left(1 + \tfrac{5}{2} (\sigma/F)^2\right).

Noise is that of the recording from block to block (second differences), which neither drift nor friction that changes with
load or speed enters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from bowdenfit.cable.conditions import LEAST_SHARE
from bowdenfit.cable.drive import LoopDrive, RopeDrive
from bowdenfit.description import Description
from bowdenfit.kinds.row_angles import RowAngles
from bowdenfit.kinds.sliding_rows import expected_forces
from bowdenfit.recordings.preparation.hysteresis import smooth_input, white_noise
from bowdenfit.recordings.recording import Blocks, Recording, Recordings
from bowdenfit.types import Labels, Vector

RECORDED = "recorded_efficiency"  # name of the readings of recordings in results
# Noise of a drift over the spread of drifts; more makes a delay seem small (tests/kinds/recordings/test_block_noise.py).
_QUIET = 0.1
_CORNER = 1  # blocks on both sides of a turn that its rate of change is taken from
_LEAST_KNOWN = 1e-9  # share of a standing phase that is known, to keep weights positive
_NEAR_LIMIT = 0.005  # distance from the end of a range, over it, at which a saturated reading stands; a judgement


MOST_BLOCKS = 600  # of one recording in the play operator: time grows with blocks, information hardly. A judgement
_FREE = ("weight", "n_effective", "censored", "share", "drift", "restart", "input_noise")
WITHOUT_WEIGHT = (*_FREE, "moving", "step")  # arrays that are 0 where a recording has ended; the others stay as they were
_HELD = ("input_force", "likely_force", "output_force", "velocity")


def is_under_tension(recording: Recording) -> np.ndarray:
    """Flag blocks that are readings of a rope under tension."""
    blocks = recording.blocks
    return ~blocks.saturated & (blocks.input_force > 0) & (blocks.output_force > 0)


def effective_counts(recording: Recording, used: np.ndarray) -> np.ndarray:
    """Return how many independent readings each block counts for: by its samples, fewer where deviations persist."""
    samples = recording.blocks.samples[used].astype(float)
    return samples / recording.blocks.samples.mean() / recording.strokes.correlation


def output_drift(recording: Recording) -> np.ndarray:
    """Return the change of log F_out with time [1/s], by which a delay of its channel shifts it.

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


def smooth_forces(blocks: Blocks) -> tuple[Vector, Vector]:
    """Return input and output force of each block with little of their noise, above 0 [N]; see `smooth_input`."""
    forces = (blocks.input_force, blocks.output_force)
    likely_in, likely_out = (np.maximum(smooth_input(f), LEAST_SHARE * np.max(np.abs(f))) for f in forces)
    return likely_in, likely_out


def is_inside_phase(state: np.ndarray) -> np.ndarray:
    """Flag blocks whose neighbors are in the same phase: at a corner a block's mean is of two phases."""
    same = np.diff(state) == 0
    return np.append(True, same) & np.append(same, True)


def standing_share(state: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return the weight of each block in its phase: 1 while sliding, a share of one while standing still.

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
    change = np.abs(np.diff(smooth_input(force), prepend=force[0]))
    near = np.clip(first[:, None] + np.arange(-_CORNER, _CORNER + 1), 0, len(state) - 1)
    noise, turn = white_noise(force), np.max(change[near], axis=1) / 2
    known = np.maximum(noise**2 / np.maximum(noise**2 + turn**2, 1e-300), _LEAST_KNOWN)
    return np.where(state == 0, (0.5 * known / np.bincount(phase))[phase], 1.0)


def _is_at_limit(recording: Recording, force: np.ndarray) -> np.ndarray:
    """Flag saturated blocks in which this force stands at the end of the range, as its saturated samples do."""
    ends = [end for end in recording.account.limits if np.isfinite(end)]
    near = [np.abs(force - end) <= _NEAR_LIMIT * max(np.abs(ends)) for end in ends]
    return recording.blocks.saturated & (np.any(near, axis=0) if near else np.zeros(len(force), dtype=bool))


def is_output_saturated(recording: Recording) -> np.ndarray:
    """Flag blocks whose output force is at least as large as what was read."""
    return _is_at_limit(recording, recording.blocks.output_force)


def is_input_saturated(recording: Recording) -> np.ndarray:
    """Flag blocks whose input force is not known."""
    return _is_at_limit(recording, recording.blocks.input_force)


def find_restarts(lost: np.ndarray) -> np.ndarray:
    """Flag blocks after a stretch of unknown input, where the operator's state must be read anew."""
    return ~lost & np.append(False, lost[:-1])


@dataclass(frozen=True)
class SelectedBlocks:
    """Blocks of one recording that enter a likelihood.

    Args:
        used: Their numbers.
        stroke: +1 sliding toward the motor, -1 sliding back.
        input_force, output_force: Forces [N].
        log_ratio: s log(F_in/F_out), without what noise adds to it [1].
        n_effective: How many independent readings each counts for [1].
        information: Information of one such reading on its log ratio at unit noise of the output cell [N^2].
    """

    used: Labels
    stroke: Labels
    input_force: Vector
    output_force: Vector
    log_ratio: Vector
    n_effective: Vector
    information: Vector


def select_sliding_blocks(recording: Recording, description: Description) -> SelectedBlocks:
    """Select the blocks in which the rope slides, with their log ratio.

    Args:
        recording: The recording.
        description: The cable, which says how the noises of its cells compare.
    """
    ratio, blocks = description.sensors.noise_ratio, recording.blocks
    used = np.flatnonzero(recording.strokes.used_sliding & is_under_tension(recording))
    stroke, force_in, force_out = recording.strokes.stroke[used], blocks.input_force[used], blocks.output_force[used]
    noise = estimate_output_noise(recording, ratio)
    group = np.unique(stroke, return_inverse=True)[1]
    expected = expected_forces(force_in, force_out, group, ratio, noise, description.shifts_forces)
    variance = np.zeros(len(used))
    for share, force in ((ratio, expected.input_force), (1.0, expected.output_force)):
        variance += (share / force) ** 2 * (1 + 2.5 * (share * noise / force) ** 2)
    log_ratio = stroke * (np.log(force_in / force_out) - expected.log_ratio_error)
    return SelectedBlocks(used, stroke, force_in, force_out, log_ratio, effective_counts(recording, used), 1 / variance)


def estimate_output_noise(recording: Recording, noise_ratio: float) -> float:
    """Estimate the standard deviation of a block's output force from block to block, from both cells together [N].

    Args:
        recording: The recording.
        noise_ratio: Noise of the input cell over that of the output cell [1].
    """
    forces = recording.blocks.output_force, *([recording.blocks.input_force] if noise_ratio else [])
    return float(np.hypot.reduce([white_noise(force) for force in forces]) / np.hypot(1.0, noise_ratio))


@dataclass(frozen=True)
class BlockGroups:
    """Blocks of one recording, joined inside their phases where there are many.

    Args:
        recording: The recording.
        starts: First block of each group that is joined.
    """

    recording: Recording
    starts: np.ndarray

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Return the mean of each group, weighted by samples."""
        samples = self.recording.blocks.samples
        return np.add.reduceat(values * samples, self.starts) / np.add.reduceat(samples, self.starts)

    def any_of(self, flags: np.ndarray) -> np.ndarray:
        """Return whether a flag is set in each group."""
        return np.maximum.reduceat(flags, self.starts)

    def arrays(
        self, drive: type[RopeDrive | LoopDrive], usable: np.ndarray, censored: bool, *, counts_turns: bool = False
    ) -> dict[str, Any]:
        """Return the arrays that every likelihood of blocks takes, without their weight.

        Args:
            drive: Class of the cable: a rope, or a loop.
            usable: Blocks that are readings.
            censored: Whether a saturated output counts as one beyond the end of the range.
            counts_turns: Whether each block of a standing phase counts, and not all of them together as one reading.
        """
        blocks = self.recording.blocks
        force_in, force_out = (
            np.maximum(self.mean(force), drive.least_share * np.max(np.abs(force)))
            for force in (blocks.input_force, blocks.output_force)
        )
        likely = self.mean(smooth_input(blocks.input_force))
        sliding = self.recording.strokes.contact[self.starts] != 0
        off = is_input_saturated(self.recording)
        lost = self.any_of(off)
        return self._censored(is_output_saturated(self.recording) & censored, force_out, lost) | {
            "input_force": force_in,
            "likely_force": likely,
            "input_noise": np.where(sliding, force_in - likely, 0.0),
            "output_force": force_out,
            "velocity": self.mean(blocks.velocity),
            "n_effective": self._count_effective(usable & ~off, lost, counts_turns),
            "restart": find_restarts(lost),
            "drift": np.gradient(drive.reading(force_out), self.mean(blocks.time)),
        }

    def _count_effective(self, counted: np.ndarray, lost: np.ndarray, counts_turns: bool) -> np.ndarray:
        """Return how many independent readings each group counts for; 0 where its input is not known."""
        contact = self.recording.strokes.contact
        effective = effective_counts(self.recording, np.arange(len(contact))) * (counted & is_inside_phase(contact))
        share = 1.0 if counts_turns else standing_share(contact, self.recording.blocks.input_force)
        return np.add.reduceat(effective * share, self.starts) * ~lost

    def _censored(self, saturated: np.ndarray, force_out: np.ndarray, lost: np.ndarray) -> dict[str, np.ndarray]:
        """Return which end of the range the output lies beyond, and the weight of that bound.

        Args:
            saturated: Blocks whose output is beyond the end of the range, as far as that counts.
            force_out: Output force of each group [N].
            lost: Groups whose input is not known.
        """
        low, high = self.recording.account.limits
        end = np.where(force_out > (low + high) / 2 if np.isfinite(low + high) else np.isfinite(high), 1.0, -1.0)
        beyond = self.any_of(saturated) & ~lost
        effective = effective_counts(self.recording, np.arange(len(saturated)))
        share = np.add.reduceat(effective * saturated, self.starts)
        return {"censored": np.where(beyond, end, 0.0), "share": np.where(beyond, share, 0.0)}


def group_blocks(recording: Recording) -> BlockGroups:
    """Group the blocks of a recording where there are more than `MOST_BLOCKS`."""
    return BlockGroups(recording, group_starts(recording.strokes.contact, MOST_BLOCKS))


def stack_recordings(
    recordings: Recordings, parts: Sequence[Mapping[str, Any]], angles: RowAngles
) -> dict[str, Any]:
    """Stack recordings into arrays over time and recordings; the shorter ones stand still at their end, with no weight.

    Args:
        recordings: The recordings.
        parts: Arrays of each: those of `BlockGroups.arrays`, and the weight.
        angles: Wrap angles of each.

    Returns:
        The fields of `BlocksData`, by name.
    """
    runs = recordings.runs
    run = np.array([runs.index(r.run) for r in recordings.items])
    free = {name: pad_columns([p[name] for p in parts], "constant") for name in _FREE}
    n_effective = free.pop("n_effective")
    counted = free["weight"] > 0
    readings = np.minimum(n_effective, 1.0)  # blocks that are joined are one reading, however well it is known
    ratio = np.where(counted, free["weight"], 1.0) / np.where(counted, readings, 1.0)
    log_weights = np.where(counted, readings * np.log(ratio), 0.0)
    return free | {name: pad_columns([p[name] for p in parts]) for name in _HELD} | {
        "angles": angles,
        "run": run,
        "n": np.bincount(run, readings.sum(axis=0)),
        "log_weights": np.bincount(run, log_weights.sum(axis=0)),
    }


def pad_columns(columns: Sequence[np.ndarray], mode: Literal["edge", "constant"] = "edge") -> np.ndarray:
    """Put columns side by side, the shorter ones kept at their last value or ("constant") followed by zeros."""
    longest = max(len(column) for column in columns)
    return np.stack([np.pad(column, (0, longest - len(column)), mode) for column in columns], axis=1)


def block_steps(time: np.ndarray) -> np.ndarray:
    """Return the time since the block before [s]; 0 of the first."""
    return np.diff(time, prepend=time[:1])


def group_starts(state: np.ndarray, most: int) -> np.ndarray:
    """Return the first block of each group of joined blocks, which is of one phase; a phase's first and last block stay single.

    The operator stands where the end of a stroke left it, so the ends must not be averaged away.
    """
    factor = -(-len(state) // most)
    if factor == 1:
        return np.arange(len(state))
    phase = np.append(0, np.cumsum(np.diff(state) != 0))
    first = np.append(True, np.diff(phase) != 0)
    last = np.append(first[1:], True)
    position = np.arange(len(state)) - np.maximum.accumulate(np.where(first, np.arange(len(state)), 0))
    return np.flatnonzero(first | last | (position % factor == 1))
