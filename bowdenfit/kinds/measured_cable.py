"""The cable of a data set: what its tables say of wrap angles, loads and speeds completes its description."""

import numpy as np

from bowdenfit.cable.cable import Cable, make_cable
from bowdenfit.cable.conditions import make_conditions
from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds.measurements import Measurements


def measured_cable(description: Description, measurements: Measurements) -> Cable:
    """The cable of a description, with nominal angles, reference force and speed from its measurements where none is stated.

    Raises:
        DescriptionError: A curve family, contact law or friction model is unknown, or velocities are of two kinds.
    """
    unit = _velocity_unit(measurements)
    conditions = make_conditions(description, _forces(measurements), _speeds(measurements), unit)
    return make_cable(description, _own_angles(description, measurements), conditions)


def _own_angles(description: Description, measurements: Measurements) -> dict[str, float]:
    """Mean of the angles that rows and recordings carry in each column of a contact without a nominal angle [rad]."""
    tables = [t for t in (measurements.efficiencies, measurements.forces, measurements.loop) if t is not None]
    recordings = measurements.recordings
    sources, means = [c.wrap_angle for c in description.contact], {}
    for name in [s.column for s in sources if s.column is not None and s.curve is None and s.nominal is None]:
        angles = [table.own.column(name)[0] for table in tables]
        if recordings is not None:
            k = recordings.columns.index(name)
            angles.append(np.array([recording.own_angle[k] for recording in recordings.each]))
        if angles:
            means[name] = float(np.mean(np.concatenate(angles)))
    return means


def _velocity_unit(measurements: Measurements) -> str:
    forces, recordings = measurements.forces, measurements.recordings
    units = {u for u in (forces and forces.velocity_unit, recordings and recordings.velocity_unit) if u}
    if len(units) > 1:
        raise DescriptionError(
            "velocities are of the rope (mm/s) in one table and of the motor (r/min) in another; give both in the same kind."
        )
    return units.pop() if units else ""


def _forces(measurements: Measurements) -> np.ndarray:
    """Forces of both ends, wherever they are positive."""
    parts = [np.zeros(0)]
    if measurements.forces is not None:
        parts += [measurements.forces.input_force, measurements.forces.output_force]
    if measurements.loop is not None:
        parts.append(measurements.loop.input_force * measurements.loop.stroke)
    if measurements.recordings is not None:
        read = [f for r in measurements.recordings.each for f in (r.blocks.input_force, r.blocks.output_force)]
        # A loop's force passes through zero; what is asked of it is asked under load.
        parts += [f[f > 0.2 * f.max()] for f in read] if measurements.recordings.loop else read
    forces = np.concatenate(parts)
    return forces[forces > 0]


def _speeds(measurements: Measurements) -> np.ndarray:
    """Speeds while the rope slides."""
    parts = [np.zeros(0)]
    if measurements.forces is not None:
        parts.append(np.abs(measurements.forces.velocity))
    if measurements.recordings is not None:
        parts += [np.abs(r.blocks.velocity[r.strokes.used_sliding]) for r in measurements.recordings.each]
    speeds = np.concatenate(parts)
    return speeds[np.isfinite(speeds) & (speeds > 0)]
