"""The cable of a data set: what its tables say of wrap angles, loads and speeds completes its description."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bowdenfit.cable.cable import Cable, make_cable
from bowdenfit.cable.conditions import make_conditions
from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds import each_table
from bowdenfit.kinds.kind import FrictionKind, RopeKind
from bowdenfit.kinds.measured_groups import measured_groups
from bowdenfit.kinds.measurements import Measurements


def measured_cable(description: Description, measurements: Measurements) -> Cable:
    """Return the cable of a description; nominal angles, reference force and speed are measured ones where none is stated.

    Raises:
        DescriptionError: A curve family, contact law or friction model is unknown, or velocities are of two kinds.
    """
    tables = list(each_table(measurements))
    friction = [(kind, table) for kind, table in tables if isinstance(kind, FrictionKind)]
    forces = _positive([kind.forces(table) for kind, table in friction])
    tensions = _positive([kind.tensions(table) for kind, table in tables if isinstance(kind, RopeKind)])
    speeds = _positive([kind.speeds(table) for kind, table in friction])
    unit = _velocity_unit([kind.velocity_unit(table) for kind, table in friction])
    groups = measured_groups(description, measurements)
    conditions = make_conditions(description, forces, tensions, speeds, unit, groups)
    return make_cable(description, _own_angles(description, friction), conditions)


def _own_angles(description: Description, friction: Sequence[tuple[FrictionKind[Any], Any]]) -> dict[str, float]:
    """Return the mean of the measured angles in each column of a contact without a nominal angle [rad]."""
    rows = [kind.conditions(table).own for kind, table in friction]
    sources, means = [c.wrap_angle for c in description.contact], {}
    for name in [s.column for s in sources if s.column is not None and s.curve is None and s.nominal is None]:
        if rows:
            means[name] = float(np.mean(np.concatenate([own.column(name)[0] for own in rows])))
    return means


def _velocity_unit(stated: Sequence[str]) -> str:
    units = {unit for unit in stated if unit}
    if len(units) > 1:
        raise DescriptionError(
            "velocities are of the rope (mm/s) in one table and of the motor (r/min) in another; give both in the same kind."
        )
    return units.pop() if units else ""


def _positive(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Return all values that are positive and finite."""
    values = np.concatenate([np.zeros(0), *parts])
    return values[np.isfinite(values) & (values > 0)]
