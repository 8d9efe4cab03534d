r"""Blocks of a recording in which the rope slides, weighed by what its recording says of their forces, not by their own noise.

A weight made of a block's own forces rises with their noise, and with it the log ratio falls or rises, so that the mean of a
recording would be off by about 1.5 (sd/F)^2 however many blocks it has; see `expected_forces`, which makes the weights here
too. What noise adds to the mean of a log ratio is taken off, and what it adds to its variance makes the block tell less: to
second order, for a force F with normal noise of standard deviation sigma,

.. math:: \operatorname{var} \log F = (\sigma/F)^2 \left(1 + \tfrac{5}{2} (\sigma/F)^2\right).

Noise is that of the recording from block to block (second differences), in which neither drift nor friction that changes with
load or speed has a part.
"""

from dataclasses import dataclass

import numpy as np

from bowdenfit.description import Description
from bowdenfit.kinds.expected_forces import expected_forces
from bowdenfit.kinds.recordings.blocks import positive, worth_of
from bowdenfit.recordings.preparation.play import white_noise
from bowdenfit.recordings.recording import Recording
from bowdenfit.types import Labels, Vector


@dataclass(frozen=True)
class BlocksUsed:
    """Blocks of one recording that enter a likelihood.

    Args:
        used: Their numbers.
        stroke: +1 sliding toward the motor, -1 sliding back.
        input_force, output_force: Forces [N].
        log_ratio: s log(F_in/F_out), without what noise adds to it [1].
        worth: How many independent readings each counts for [1].
        tells: How much one reading as each tells of its log ratio at unit noise of the output cell [N^2].
    """

    used: Labels
    stroke: Labels
    input_force: Vector
    output_force: Vector
    log_ratio: Vector
    worth: Vector
    tells: Vector


def sliding_blocks(recording: Recording, description: Description) -> BlocksUsed:
    """Blocks in which the rope slides, with their log ratio.

    Args:
        recording: The recording.
        description: The cable, which says how the noises of its cells compare.
    """
    ratio, blocks = description.sensors.noise_ratio, recording.blocks
    used = np.flatnonzero(recording.strokes.used_sliding & positive(recording))
    stroke, force_in, force_out = recording.strokes.stroke[used], blocks.input_force[used], blocks.output_force[used]
    noise = noise_of_output(recording, ratio)
    group = np.unique(stroke, return_inverse=True)[1]
    found = expected_forces(force_in, force_out, group, ratio, noise, description.fits_offsets)
    variance = np.zeros(len(used))
    for share, force in ((ratio, found.input_force), (1.0, found.output_force)):
        variance += (share / force) ** 2 * (1 + 2.5 * (share * noise / force) ** 2)
    log_ratio = stroke * (np.log(force_in / force_out) - found.log_ratio_error)
    return BlocksUsed(used, stroke, force_in, force_out, log_ratio, worth_of(recording, used), 1 / variance)


def noise_of_output(recording: Recording, noise_ratio: float) -> float:
    """Standard deviation of a block's output force, from block to block, in both cells together [N].

    Args:
        recording: The recording.
        noise_ratio: Noise of the input cell over that of the output cell [1].
    """
    forces = recording.blocks.output_force, *([recording.blocks.input_force] if noise_ratio else [])
    return float(np.hypot.reduce([white_noise(force) for force in forces]) / np.hypot(1.0, noise_ratio))
