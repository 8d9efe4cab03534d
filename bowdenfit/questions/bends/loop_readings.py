"""What was read of a loop: forces by wrap angle and stroke, and the efficiency at an input force between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from bowdenfit.results.record import Record

RECORDED = 2  # times the stroke of a block of a recording, which are many
NEAR, MOST_NEAR = 0.6, 3  # share of a force within which readings are next to it, and how many to either side


def loop_readings(fit: Record, bends: np.ndarray) -> np.ndarray:
    """Every reading and recorded block: wrap angle [rad], input and output force [N], stroke.

    The stroke is +1 forward and -1 back, `RECORDED` times that of a recording, and 0 where it is neither.
    """
    from bowdenfit.kinds.tables import LoopTable
    from bowdenfit.questions.bends.answer import elastic_answers
    from bowdenfit.questions.recorded.loop_traces import loop_points

    contact, table = elastic_answers(fit).contact, fit.dataset.measurements.table(LoopTable)
    recorded = loop_points(fit, contact)
    parts = [recorded * np.array([[1], [1], [1], [RECORDED]])]
    if table is not None:
        column = fit.dataset.description.contact[contact].wrap_angle.column
        angle = np.full(len(table.stroke), bends[0]) if column is None else np.nan_to_num(table.own.column(column)[0])
        parts.append(np.stack([angle, table.input_force, table.output_force, table.stroke]))
    return np.concatenate(parts, axis=1)


def efficiency_between_readings(points: np.ndarray, force: float) -> tuple[np.ndarray, np.ndarray]:
    """Wrap angle [deg] and efficiency [1] wherever a loop was moved forward by less and by more than a force.

    Args:
        points: Of `readings_of_loop`.
        force: Input force [N].
    """
    angle, force_in, force_out = points[:3, points[3] > 0]
    angles, efficiency = [], []
    for bend in np.unique(angle.round(9)):
        here = np.isclose(angle, bend)
        sides = [_mean_near(force_in[here], force_out[here], force, way) for way in (-1, 1)]
        if all(side is not None for side in sides):
            (low, out_low), (high, out_high) = sides  # type: ignore[misc]
            part = (force - low) / (high - low) if high > low else 0.0
            angles.append(np.rad2deg(bend))
            efficiency.append((out_low + part * (out_high - out_low)) / force)
    return np.array(angles), np.array(efficiency)


def _mean_near(force_in: np.ndarray, force_out: np.ndarray, force: float, way: int) -> tuple[float, float] | None:
    """Mean input and output force of the readings next to a force, below or above; None where none is near."""
    beyond = way * (force_in - force)
    near = np.flatnonzero((beyond >= 0) & (beyond <= NEAR * force))
    near = near[np.argsort(beyond[near])[:MOST_NEAR]]
    return (float(force_in[near].mean()), float(force_out[near].mean())) if len(near) else None
