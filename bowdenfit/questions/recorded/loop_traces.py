"""Recordings of a pull-pull loop as points of its output against its input force."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.inference.draws import for_each_value
from bowdenfit.kinds.recordings.reader import angles_of_recordings
from bowdenfit.kinds.row_angles import collect_row_angles, resolve_angles
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.questions.recorded.equations import choose_blocks
from bowdenfit.recordings.recording import Recording, Recordings
from bowdenfit.results.record import Record, parameter_values

_SAME_ANGLE = np.deg2rad(0.05)  # wrap angles that differ by less are shown as one


def loop_points(fit: Record, contact: int | None = None) -> np.ndarray:
    """Wrap angle [rad], input and output force [N] and stroke of every block that was read of a loop, the smallest angle first.

    Args:
        fit: The fit.
        contact: Number of the contact whose wrap angle is meant; that of all contacts together if omitted.

    Returns:
        Four rows; no columns without such recordings.
    """
    recordings, parts = fit.dataset.measurements.table(Recordings), [np.zeros((4, 0))]
    if recordings is None or not recordings.loop:
        return parts[0]
    angles = _recording_angles(fit, recordings)
    angle = angles.sum(axis=1) if contact is None else angles[:, contact]
    order = np.argsort(angle, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(angle[order]) > _SAME_ANGLE) + 1):
        parts += [_recording_points(float(angle[group].mean()), recordings.items[i]) for i in group.tolist()]
    return np.concatenate(parts, axis=1)


def _recording_angles(fit: Record, recordings: Recordings) -> np.ndarray:
    """Wrap angles of each recording in each contact [rad], by the middle of the draws where curves give them."""
    cable, angles = fit.model.cable, fit.dataset.measurements.table(AngleTable)
    measured = collect_row_angles(cable.description, angles_of_recordings(recordings), angles).data
    middle = {name: np.median(draws, keepdims=True) for name, draws in parameter_values(fit).items()}

    def angles_of(values: Mapping[str, jax.Array]) -> jax.Array:
        return resolve_angles(cable, values, {name: jnp.asarray(array) for name, array in measured.items()})[0]

    with jax.enable_x64(True):
        angles_by_recording: np.ndarray = for_each_value(angles_of, middle)[0]
    return angles_by_recording


def _recording_points(angle: float, recording: Recording) -> np.ndarray:
    """Blocks that are readings, moving and at rest."""
    blocks, stroke = recording.blocks, recording.strokes.stroke * recording.strokes.used_sliding
    shown = choose_blocks(len(blocks.time))
    kept = shown[~blocks.saturated[shown]]
    return np.stack([np.full(len(kept), angle), blocks.input_force[kept], blocks.output_force[kept], stroke[kept]])
