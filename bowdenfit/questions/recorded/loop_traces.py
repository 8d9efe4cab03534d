"""Recordings of a pull-pull loop as points of its output against its input force."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.kinds.recordings.angles import recorded_angles
from bowdenfit.kinds.resolve_angles import resolve_angles
from bowdenfit.kinds.row_angles import row_angles
from bowdenfit.questions.recorded.equations import blocks_shown
from bowdenfit.recordings.recording import Recording
from bowdenfit.results.record import Record

_ALIKE = np.deg2rad(0.05)  # wrap angles that differ by less are shown as one


@dataclass(frozen=True)
class LoopPoints:
    """Blocks of the recordings that were made at one wrap angle.

    Args:
        wrap_angle: The angle [rad].
        input_force, output_force: Mean forces of the blocks, moving and at rest [N].
        recordings: Names of the recordings.
    """

    wrap_angle: float
    input_force: np.ndarray
    output_force: np.ndarray
    recordings: tuple[str, ...]


def loop_points(fit: Record, contact: int | None = None) -> tuple[LoopPoints, ...]:
    """Blocks of a loop's recordings by wrap angle, the smallest first; empty without such recordings.

    Args:
        fit: The fit.
        contact: Number of the contact whose wrap angle is meant; that of all contacts together if omitted.
    """
    recordings = fit.dataset.measurements.recordings
    if recordings is None or not recordings.loop:
        return ()
    angles = _angles(fit)
    angle = angles.sum(axis=1) if contact is None else angles[:, contact]
    order = np.argsort(angle, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(angle[order]) > _ALIKE) + 1)
    return tuple(_points(float(angle[g].mean()), [recordings.each[i] for i in g.tolist()]) for g in groups)


def _angles(fit: Record) -> np.ndarray:
    """Wrap angles of each recording in each contact [rad], by the middle of the draws where curves give them."""
    tables, cable, space = fit.dataset.measurements, fit.model.cable, fit.model.space
    assert tables.recordings is not None  # the caller checked
    measured = row_angles(cable.description, recorded_angles(tables.recordings), tables.angles).data
    z = fit.least_squares.z if fit.posterior is None else np.median(fit.posterior.flat_z, axis=0)
    with jax.enable_x64(True):
        rows = {name: jnp.asarray(array) for name, array in measured.items()}
        return np.asarray(resolve_angles(cable, space.constrain(jnp.asarray(z)), rows)[0])


def _points(angle: float, each: list[Recording]) -> LoopPoints:
    """Blocks that are readings of these recordings."""
    forces = []
    for recording in each:
        blocks, shown = recording.blocks, blocks_shown(len(recording.blocks.time))
        kept = shown[~blocks.saturated[shown]]
        forces.append((blocks.input_force[kept], blocks.output_force[kept]))
    input_force, output_force = (np.concatenate([pair[end] for pair in forces]) for end in (0, 1))
    return LoopPoints(angle, input_force, output_force, tuple(r.name for r in each))
