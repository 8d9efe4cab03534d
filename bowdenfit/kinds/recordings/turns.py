r"""Every block of whole recordings, those after each turn of the motion too: where friction builds up shows there.

A play operator stands where the highest (or lowest) input left it, with its noise: all blocks of a standing phase have one
error in common, and together they are worth no more than one reading of where the output stands (`standing_share`). But how
the output moves on meanwhile is known from each of them. With weights w of sum W in a phase the common error is integrated out,

.. math:: \sum w (d - \bar d)^2 + \alpha^2 W \bar d^2 = \sum w \left(d - (1 - \alpha) \bar d\right)^2, \quad
          \bar d = \sum w d / W

where :math:`\alpha^2` is what the mean is still worth. So a deviation d counts less what its phase has in common, and the
likelihood is otherwise that of `WholeRecordingsTerm`. A play operator that is counted so is `friction_model = "play"`.

A turn lies somewhere inside a block, and where it lies matters as much as how the rope creeps. So the operator takes `_PARTS`
steps a block, along the parabola that has the means of the block and of its neighbors, with the velocity on a straight line.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from typing_extensions import override

from bowdenfit.cable.drive import LoopDrive, PerRecording, PerTime, RopeDrive, make_drive
from bowdenfit.cable.sensors import LoadCells
from bowdenfit.kinds.recordings.blocks import group_blocks, output_drift, pad_columns, standing_share
from bowdenfit.kinds.recordings.whole_recordings import (
    Data,
    RopeBlocksData,
    Values,
    WholeRecordingsTerm,
    stack_rope_recordings,
)
from bowdenfit.kinds.row_angles import RowAngles, resolve_angles
from bowdenfit.recordings.preparation.hysteresis import smooth_input
from bowdenfit.recordings.recording import Recording, Recordings
from bowdenfit.types import DataArray

# Middles of parts of a block, in blocks. Of 20 ropes at 1000 samples a second, 90 % intervals of the Stribeck speed, the
# viscous part and the damping contained the truth in 17, 18 and 10 of 13 with three parts, and in 19, 19 and 16 of 17 with
# five; scripts/check_creeping_ropes.py.
_PARTS = tuple((i - 2) / 5 for i in range(5))
_SAME_STEP = 1e-3  # relative difference of times between blocks that are evenly spaced


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TurnsData(RopeBlocksData):
    """Blocks of recordings of a single rope, with their parts and phases.

    Args:
        part_force: Likely input force in each part of a block [N], (blocks, parts, recordings).
        part_velocity: Velocity there, (blocks, parts, recordings).
        phase_start, phase_stop: First block of the phase, and the first after it, (blocks, recordings).
        common: Part of the phase's mean that is one error [1], (blocks, recordings).
        widening: What a delay adds to half the width of the loop, on the scale of the exponent [1/s], (recordings,).
    """

    part_force: DataArray
    part_velocity: DataArray
    phase_start: DataArray
    phase_stop: DataArray
    common: DataArray
    widening: DataArray


@dataclass(frozen=True)
class TurnsTerm(WholeRecordingsTerm):
    """Likelihood of every block of whole recordings of a single rope, standing phases by how the output moves in them."""

    is_slow: ClassVar = True

    @override
    def _drive(self, values: Values, data: Data) -> tuple[RopeDrive | LoopDrive, Array, Array]:
        angles, variance = resolve_angles(self.cable, values, data.angles)
        step = _repeat(data.step) / len(_PARTS)
        drive = make_drive(self.cable, values, angles, jnp.reshape(data.part_velocity, step.shape), step=step)
        return drive, angles, variance

    @override
    def _typical_exponent(self, drive: RopeDrive, data: Data) -> PerRecording:
        """Return the exponent that the width of the loop shows, which an error of the delay changes.

        A rope that creeps seems late, so its delay is estimated with a larger error than that of others.
        """
        return super()._typical_exponent(drive, data) + LoadCells.of(drive.values).late(data.widening)

    @override
    def _follow(
        self, drive: RopeDrive | LoopDrive, cells: LoadCells, data: Data, mounting: PerRecording
    ) -> tuple[PerTime, PerTime]:
        assert isinstance(drive, RopeDrive)  # friction models of turns are refused for loops
        stands = drive.scaled(cells.true_output(data.output_force, drive.least_force))
        parts = jnp.asarray(data.part_force)
        force = cells.true_input(parts.reshape(-1, parts.shape[2]), drive.least_force)
        anew = jnp.full(parts.shape, jnp.nan).at[:, 0].set(jnp.where(data.restart, stands, jnp.nan))
        followed = drive.follow(force, mounting, stands[0], anew.reshape(force.shape), _repeat(data.input_noise))
        output, slope = (values.reshape(parts.shape).mean(axis=1) for values in followed)
        expected, loading = drive.shown(cells, output, slope)
        deviation = data.reading + cells.late(data.drift) - expected
        return _subtract_common(deviation, data), _subtract_common(loading, data)


def _repeat(values: PerTime) -> Array:
    """Return values of blocks for each part of theirs."""
    return jnp.repeat(values, len(_PARTS), axis=0)


def _subtract_common(values: PerTime, data: Data) -> PerTime:
    """Return values of blocks less the part of their phase's mean that stands for one error."""
    return values - data.common * _phase_sum(data.weight * values, data) / jnp.maximum(
        _phase_sum(data.weight, data), 1e-300
    )


def _phase_sum(values: PerTime, data: Data) -> PerTime:
    """Return the sum over the phase of each block."""
    total = jnp.concatenate([jnp.zeros_like(values[:1]), jnp.cumsum(values, axis=0)])
    return jnp.take_along_axis(total, data.phase_stop, axis=0) - jnp.take_along_axis(total, data.phase_start, axis=0)


def stack_turns(
    recordings: Recordings, angles: RowAngles, censored: bool, noise_ratio: float
) -> TurnsData:
    """Stack recordings of a rope as `stack_rope_recordings` does, with what `TurnsTerm` takes besides."""
    data = stack_rope_recordings(recordings, angles, censored, noise_ratio, counts_turns=True)
    phases = [_find_phases(recording) for recording in recordings.items]
    divided = [_divide_blocks(recording) for recording in recordings.items]
    of_phases: dict[str, Any] = {name: pad_columns([phase[name] for phase in phases]) for name in phases[0]}
    force, velocity = (
        np.stack([pad_columns([blocks[which][part] for blocks in divided]) for part in range(len(_PARTS))], axis=1)
        for which in range(2)
    )
    widening = np.array([_measure_widening(recording) for recording in recordings.items])
    return TurnsData(**vars(data), part_force=force, part_velocity=velocity, widening=widening, **of_phases)


def _measure_widening(recording: Recording) -> float:
    """Return what a delay of the output adds to half the width of the loop, by how fast the output changes in contact [1/s]."""
    contact = recording.strokes.contact
    slides = contact != 0
    return float(np.mean((contact * output_drift(recording))[slides])) if slides.any() else 0.0


def _find_phases(recording: Recording) -> dict[str, np.ndarray]:
    """Return where the phase of each group of blocks starts and stops, and the part of its mean that is one error."""
    groups = group_blocks(recording)
    contact = recording.strokes.contact
    share = np.minimum(groups.mean(standing_share(contact, recording.blocks.input_force)), 1.0)
    changes = np.flatnonzero(np.diff(contact[groups.starts])) + 1
    ends = np.concatenate([[0], changes, [len(groups.starts)]])
    phase = np.searchsorted(changes, np.arange(len(groups.starts)), side="right")
    return {"phase_start": ends[phase], "phase_stop": ends[phase + 1], "common": 1 - np.sqrt(share)}


def _divide_blocks(recording: Recording) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the likely input force [N] and the velocity in each part of the blocks, with the means of the block."""
    groups, force = group_blocks(recording), recording.blocks.input_force
    likely, time = groups.mean(smooth_input(force)), groups.mean(recording.blocks.time)
    before, after = np.roll(likely, 1), np.roll(likely, -1)
    even = np.zeros(len(likely), dtype=bool)
    if len(likely) > 2:
        even[1:-1] = np.abs(np.diff(time, 2)) < _SAME_STEP * np.diff(time)[1:]
    slope, curvature = (np.where(even, values, 0.0) for values in ((after - before) / 2, (after + before) / 2 - likely))
    mean_square = np.mean(np.square(_PARTS))
    least = RopeDrive.least_share * np.max(np.abs(force))
    forces = [np.maximum(likely + slope * part + curvature * (part**2 - mean_square), least) for part in _PARTS]
    velocity = groups.mean(recording.blocks.velocity)
    to_here, from_here = velocity - np.roll(velocity, 1), np.roll(velocity, -1) - velocity
    steady = even & (to_here * from_here > 0)  # not where the speed jumps
    change = np.where(steady, np.sign(from_here) * np.minimum(np.abs(to_here), np.abs(from_here)), 0.0)
    return forces, [velocity + change * part for part in _PARTS]
