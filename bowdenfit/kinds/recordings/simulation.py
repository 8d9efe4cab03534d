"""Recordings measured again on the computer, at the level of prepared blocks.

The input force of every block is kept, smoothed, and stands for the true one; the play operator of a cable with known
coefficients makes the output force of it, all sensors' errors and the noise of blocks are added, and the strokes are found anew
as a reader finds them. What happens before blocks are made (clipping, spikes, sampling) is not simulated.
"""

from collections.abc import Mapping
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.cable.conditions import LEAST_SHARE
from bowdenfit.cable.drive import LoopDrive, RopeDrive, make_drive
from bowdenfit.cable.load_cells import BLOCK_NOISE, RUN_SCATTER, LoadCells
from bowdenfit.description import Description
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.recordings.blocks import pad_columns
from bowdenfit.kinds.recordings.reader import angles_of_recordings
from bowdenfit.kinds.term import Truth
from bowdenfit.recordings.preparation.input_smoothing import smooth_input
from bowdenfit.recordings.recording import Blocks, Recording, Recordings, Strokes
from bowdenfit.recordings.strokes import cable_of, find_strokes


def draw_recordings(recordings: Recordings, truth: Truth) -> dict[str, jax.Array]:
    """Draw forces of every block (rows) of every recording (columns), padded to the longest, and the delay's error [s].

    All recordings of a run share the effect of its mounting. Noise is as the likelihood counts it: it stays alike from block
    to block for as long as a block is worth less than an independent reading, and blocks of fewer samples have more.

    Args:
        recordings: The recordings as measured.
        truth: What they are measured with.
    """
    cable, values, scale = truth.cable, truth.values, truth.scale
    of_run, of_angles, of_input, of_output = jax.random.split(jax.random.fold_in(truth.key, 4), 4)
    angles, variance = truth.wrap_angles(angles_of_recordings(recordings))
    error = jnp.sqrt(variance) * jax.random.normal(of_angles, angles.shape)
    run = np.array([recordings.runs.index(r.run) for r in recordings.items])
    mounting = values[RUN_SCATTER] * truth.scatter(of_run, (len(recordings.runs),))[run]
    exponent = cable.friction_exponent(values, angles + scale * error)
    force = jnp.asarray(pad_columns([smooth_input(r.blocks.input_force) for r in recordings.items]))
    velocity = jnp.asarray(pad_columns([r.blocks.velocity for r in recordings.items]))
    cells, drive = LoadCells.of(values), make_drive(cable, values, angles, velocity, exponent)
    at_least = jnp.maximum(force, drive.least_force)
    output, _ = drive.follow(at_least, scale * mounting, _start_positions(drive, recordings, at_least, scale * mounting))
    error_numbers = pad_columns(
        [number_shared_errors(len(r.blocks.time), r.strokes.correlation) for r in recordings.items]
    ).astype(int)
    fewer = jnp.asarray(pad_columns([np.sqrt(r.blocks.samples.mean() / r.blocks.samples) for r in recordings.items]))
    shape, noise = (error_numbers.max() + 1, len(recordings.items)), scale * values[BLOCK_NOISE] * fewer
    noises = ((cable.description.sensors.noise_ratio * noise, of_input), (noise, of_output))
    errors = [sd * jax.random.normal(k, shape)[error_numbers, np.arange(shape[1])] for sd, k in noises]
    return {
        "input_force": cells.shown_input(force) + errors[0],
        "output_force": cells.shown_output(output),
        "output_error": errors[1],
        "delay_error": jnp.asarray(scale * cells.delay_error),
    }


def _start_positions(drive: RopeDrive | LoopDrive, recordings: Recordings, force: jax.Array, mounting: jax.Array) -> jax.Array:
    """Return where the operator starts: a rope where it was in its band when measured, a loop at the measured force."""
    if isinstance(drive, LoopDrive):
        return jnp.array([r.blocks.output_force[0] for r in recordings.items])
    return drive.scaled(force)[0] + drive.band(mounting)[0] * np.array([_start_in_band(r) for r in recordings.items])


def _start_in_band(recording: Recording) -> float:
    """Return where in its friction band a recording starts, from -1 (pulling) to 1 (returning)."""
    blocks, strokes = recording.blocks, recording.strokes
    least = LEAST_SHARE * np.max(np.abs(blocks.input_force))
    ratio = np.log(max(blocks.output_force[0], least) / max(blocks.input_force[0], least))
    return float(np.clip((ratio + strokes.center) / strokes.exponent, -1.0, 1.0))


def number_shared_errors(blocks: int, correlation: float) -> np.ndarray:
    """Return which error each block has, so that means of blocks scatter as those of a `correlation`-th as many would.

    With errors shared by blocks in groups, the mean of N scatters by as much as that of N / c independent ones if c is the size
    of the group that a block is in, on average over blocks. So a share c - k of the blocks, with k the whole part of c, is in
    groups of k + 1, and the others in groups of k; squares of errors then scatter as those of N / c readings do, too.

    Args:
        blocks: How many.
        correlation: c, at least 1.
    """
    least = int(correlation)
    owed, starts, at = 0.0, [], 0
    while at < blocks:
        starts.append(at)
        more = int(owed + (correlation - least) * (least + 1) >= least + 1)
        owed += (correlation - least) * (least + more) - more * (least + 1)
        at += least + more
    return np.searchsorted(starts, np.arange(blocks), "right") - 1


def replace_forces(description: Description, recordings: Recordings, readings: Mapping[str, np.ndarray]) -> Recordings:
    """Return the recordings with forces drawn by `draw_recordings`, their strokes identified again.

    What the likelihood takes a block to be worth is kept: how long deviations stay alike is not found anew.

    Args:
        description: The cable.
        recordings: The recordings as measured.
        readings: What was drawn.

    Raises:
        DatasetError: Strokes cannot be found.
    """
    items = []
    for i, recording in enumerate(recordings.items):
        n, time = len(recording.blocks.time), recording.blocks.time
        shown, error = readings["output_force"][:n, i], readings["output_error"][:n, i]
        late = shown - float(readings["delay_error"]) * np.gradient(shown, time)
        blocks = replace(recording.blocks, input_force=readings["input_force"][:n, i], output_force=late + error)
        strokes = _find_strokes_again(description, recording, blocks)
        items.append(replace(recording, blocks=blocks, strokes=strokes))
    return replace(recordings, items=tuple(items))


def _find_strokes_again(description: Description, recording: Recording, blocks: Blocks) -> Strokes:
    spans = [
        phase
        for entry in description.recording
        if entry.file == recording.file and recording.strokes.by_hand
        for phase in entry.strokes
    ]
    strokes = find_strokes(blocks, recording.file, recording.name, spans, cable_of(description))
    return replace(strokes, correlation=recording.strokes.correlation)


def refuse_saturated(recordings: Recordings) -> None:
    """Refuse recordings with readings at the end of a load cell's range.

    Raises:
        DatasetError: There are such; which ones would be with another friction is not known from blocks.
    """
    for recording in recordings.items:
        if recording.blocks.saturated.any():
            raise DatasetError(
                f"{recording.file}: {int(recording.blocks.saturated.sum())} blocks of the recording {recording.name!r} are at "
                "the end of a load cell's range, and what else would be clipped with another friction cannot be told from "
                "blocks; leave the recording out to calibrate."
            )
