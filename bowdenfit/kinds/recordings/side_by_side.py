"""Blocks of many recordings side by side, joined inside their phases where there are many."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from bowdenfit.cable.drive import Loop, Rope
from bowdenfit.kinds.recordings.blocks import (
    input_saturated,
    inside_phase,
    output_saturated,
    restarts,
    standing_share,
    worth_of,
)
from bowdenfit.kinds.sliding_rows import ROW_ARRAYS
from bowdenfit.recordings.preparation.likely_input import likely_input
from bowdenfit.recordings.recording import Recording, Recordings

MOST_BLOCKS = 600  # of one recording in the play operator; more say no more once noise is averaged
_FREE = ("weight", "worth", "censored", "share", "drift", "restart", "input_noise")
WITHOUT_WEIGHT = (*_FREE, "moving")  # arrays that are 0 where a recording has ended; the others stay as they were
_HELD = ("input_force", "likely_force", "output_force", "velocity")


@dataclass(frozen=True)
class Thinned:
    """Blocks of one recording, joined inside their phases where there are many.

    Args:
        recording: The recording.
        starts: First block of each group that is joined.
    """

    recording: Recording
    starts: np.ndarray

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Mean of each group, by samples."""
        samples = self.recording.blocks.samples
        return np.add.reduceat(values * samples, self.starts) / np.add.reduceat(samples, self.starts)

    def any_of(self, flags: np.ndarray) -> np.ndarray:
        """Whether a flag is set in each group."""
        return np.maximum.reduceat(flags, self.starts)

    def arrays(self, drive: type[Rope | Loop], usable: np.ndarray, censored: bool) -> dict[str, Any]:
        """What every likelihood of blocks takes of them, but their weight.

        Args:
            drive: What the recording is of.
            usable: Blocks that are readings.
            censored: Whether a saturated output counts as one beyond the end of the range.
        """
        blocks = self.recording.blocks
        force_in, force_out = (
            np.maximum(self.mean(force), drive.least_share * np.max(np.abs(force)))
            for force in (blocks.input_force, blocks.output_force)
        )
        likely = self.mean(likely_input(blocks.input_force))
        sliding = self.recording.strokes.contact[self.starts] != 0
        off = input_saturated(self.recording)
        lost = self.any_of(off)
        return self._censored(output_saturated(self.recording) & censored, force_out, lost) | {
            "input_force": force_in,
            "likely_force": likely,
            "input_noise": np.where(sliding, force_in - likely, 0.0),
            "output_force": force_out,
            "velocity": self.mean(blocks.velocity),
            "worth": self._worth(usable & ~off, lost),
            "restart": restarts(lost),
            "drift": np.gradient(drive.reading(force_out), self.mean(blocks.time)),
        }

    def _worth(self, counted: np.ndarray, lost: np.ndarray) -> np.ndarray:
        """What each group is worth: the blocks that count, inside their phases, unless its input is not known."""
        contact = self.recording.strokes.contact
        each = worth_of(self.recording, np.arange(len(contact))) * (counted & inside_phase(contact))
        return np.add.reduceat(each * standing_share(contact, self.recording.blocks.input_force), self.starts) * ~lost

    def _censored(self, saturated: np.ndarray, force_out: np.ndarray, lost: np.ndarray) -> dict[str, np.ndarray]:
        """Which end of the range the output lies beyond, and what that says.

        Args:
            saturated: Blocks whose output is beyond the end of the range, as far as that counts.
            force_out: Output force of each group [N].
            lost: Groups whose input is not known.
        """
        low, high = self.recording.account.limits
        end = np.where(force_out > (low + high) / 2 if np.isfinite(low + high) else np.isfinite(high), 1.0, -1.0)
        beyond = self.any_of(saturated) & ~lost
        each = worth_of(self.recording, np.arange(len(saturated)))
        share = np.add.reduceat(each * saturated, self.starts)
        return {"censored": np.where(beyond, end, 0.0), "share": np.where(beyond, share, 0.0)}


def group_blocks(recording: Recording) -> Thinned:
    """The blocks of a recording, in groups where there are more than `MOST_BLOCKS`."""
    return Thinned(recording, first_of_groups(recording.strokes.contact, MOST_BLOCKS))


def side_by_side(
    recordings: Recordings, parts: Sequence[Mapping[str, Any]], angles: Mapping[str, np.ndarray]
) -> dict[str, Any]:
    """Arrays over time and recordings; the shorter ones stand still at their end, with no weight.

    Args:
        recordings: The recordings.
        parts: Arrays of each: those of `Thinned.arrays`, and the weight.
        angles: `ROW_ARRAYS` of each.
    """
    runs = recordings.runs
    run = np.array([runs.index(r.run) for r in recordings.each])
    free = {name: beside([p[name] for p in parts], "constant") for name in _FREE}
    worth = free.pop("worth")
    counted = free["weight"] > 0
    readings = np.minimum(worth, 1.0)  # blocks that are joined are one reading, however well it is known
    ratio = np.where(counted, free["weight"], 1.0) / np.where(counted, readings, 1.0)
    log_weights = np.where(counted, readings * np.log(ratio), 0.0)
    arrays = (
        {name: angles[name] for name in ROW_ARRAYS} | {name: beside([p[name] for p in parts]) for name in _HELD} | free
    )
    return arrays | {
        "run": run,
        "n": np.bincount(run, readings.sum(axis=0)),
        "log_weights": np.bincount(run, log_weights.sum(axis=0)),
    }


def beside(columns: Sequence[np.ndarray], mode: Literal["edge", "constant"] = "edge") -> np.ndarray:
    """Columns side by side, the shorter ones kept at their last value or ("constant") followed by zeros."""
    longest = max(len(column) for column in columns)
    return np.stack([np.pad(column, (0, longest - len(column)), mode) for column in columns], axis=1)


def first_of_groups(state: np.ndarray, most: int) -> np.ndarray:
    """First block of each group of blocks that are joined: of one phase only, its first and last block always alone.

    The operator stands where the end of a stroke left it, so the ends must not be averaged away.
    """
    factor = -(-len(state) // most)
    if factor == 1:
        return np.arange(len(state))
    phase = np.append(0, np.cumsum(np.diff(state) != 0))
    first = np.append(True, np.diff(phase) != 0)
    last = np.append(first[1:], True)
    place = np.arange(len(state)) - np.maximum.accumulate(np.where(first, np.arange(len(state)), 0))
    return np.flatnonzero(first | last | (place % factor == 1))
