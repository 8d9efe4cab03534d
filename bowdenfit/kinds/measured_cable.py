"""The cable of a data set: what its tables say of wrap angles, loads and speeds completes its description."""

import numpy as np

from bowdenfit.cable.cable import Cable, make_cable
from bowdenfit.cable.conditions import make_conditions
from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds import each_table
from bowdenfit.kinds.measured_groups import measured_groups
from bowdenfit.kinds.measurements import Measurements


def measured_cable(description: Description, measurements: Measurements) -> Cable:
    """The cable of a description, with nominal angles, reference force and speed from its measurements where none is stated.

    Raises:
        DescriptionError: A curve family, contact law or friction model is unknown, or velocities are of two kinds.
    """
    unit = _velocity_unit(measurements)
    forces, tensions = (_positive(measurements, name) for name in ("forces", "tensions"))
    groups = measured_groups(description, measurements)
    conditions = make_conditions(description, forces, tensions, _speeds(measurements), unit, groups)
    return make_cable(description, _own_angles(description, measurements), conditions)


def _own_angles(description: Description, measurements: Measurements) -> dict[str, float]:
    """Mean of the angles that rows and recordings carry in each column of a contact without a nominal angle [rad]."""
    rows = [kind.conditions(table).own for kind, table in each_table(measurements) if kind.conditions]
    sources, means = [c.wrap_angle for c in description.contact], {}
    for name in [s.column for s in sources if s.column is not None and s.curve is None and s.nominal is None]:
        if rows:
            means[name] = float(np.mean(np.concatenate([own.column(name)[0] for own in rows])))
    return means


def _velocity_unit(measurements: Measurements) -> str:
    units = {unit for kind, table in each_table(measurements) if (unit := kind.velocity_unit(table))}
    if len(units) > 1:
        raise DescriptionError(
            "velocities are of the rope (mm/s) in one table and of the motor (r/min) in another; give both in the same kind."
        )
    return units.pop() if units else ""


def _positive(measurements: Measurements, name: str) -> np.ndarray:
    """Forces that friction acted on, or other tensions, wherever they are positive."""
    forces = np.concatenate([np.zeros(0), *(getattr(kind, name)(table) for kind, table in each_table(measurements))])
    return forces[forces > 0]


def _speeds(measurements: Measurements) -> np.ndarray:
    """Speeds while the rope slides."""
    speeds = np.concatenate([np.zeros(0), *(kind.speeds(table) for kind, table in each_table(measurements))])
    return speeds[np.isfinite(speeds) & (speeds > 0)]
