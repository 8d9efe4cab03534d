"""Forces read at both ends of a cable."""

import numpy as np

from bowdenfit.description import Description
from bowdenfit.files.columns import Quantity
from bowdenfit.kinds.asked import Asked, Switch, Wanted
from bowdenfit.kinds.coarse import Coarse, coarse
from bowdenfit.kinds.copies import Compared, copies, places_along, without_runs
from bowdenfit.kinds.forces.following import check_following
from bowdenfit.kinds.forces.gained import check_gains
from bowdenfit.kinds.forces.loads import alone
from bowdenfit.kinds.forces.mountings import ForceSettings
from bowdenfit.kinds.forces.table import ForceTable, read_forces
from bowdenfit.kinds.forces.words import ForceDesign, count, describe, empty, implausible, page, warnings
from bowdenfit.kinds.kind import Kind, itself
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.readings import Readings, efficiencies
from bowdenfit.kinds.rows import RUN, STROKE
from bowdenfit.kinds.wrap_angles import check_rows
from bowdenfit.words import listed


def _typical_speeds(table: ForceTable) -> list[float]:
    """The lowest and the highest."""
    known = np.abs(table.velocity[np.isfinite(table.velocity)])
    return [float(known.min()), float(known.max())] if len(known) else []


def _check(table: ForceTable, description: Description, measurements: Measurements) -> None:
    """Every row has its wrap angles, the output follows the input, and no row gains force."""
    check_rows(table, description, measurements)
    check_following(table)
    check_gains(table, description)


def _copies(table: ForceTable) -> list[str]:
    """Wherever they are said to be read, since a run that is copied is often given another place.

    Runs of one reading are compared by how their losses scatter along the bend, as one table.
    """
    forces = np.column_stack([table.input_force, table.output_force])
    stroke, curve = table.stroke[:, None].astype(float), 3 * table.run + table.stroke
    different = np.unique(np.column_stack([curve, forces]), axis=0)
    if len(different) == len(np.unique(curve)) and np.all(forces > 0):
        settings, loss = np.column_stack([stroke, forces]), np.log(table.input_force / table.output_force)
        return copies(without_runs(table.origin, settings, loss, places_along(table), table.stroke))
    names = tuple(f"run {name}" for name in table.run_names)
    return copies(Compared(listed(table.origin.files), table.run, names, stroke, forces, table.input_force, curve))


def _coarse(table: ForceTable) -> Coarse | None:
    """By the output force; the input force may be set."""
    stroke = table.stroke.astype(float)
    settings = np.column_stack([table.route, table.own.angle, stroke, table.input_force])
    return coarse(listed(table.origin.files), settings, table.output_force, "N")


FORCES = Kind(
    name="forces",
    table=ForceTable,
    settings=ForceSettings,
    readings=(
        efficiencies("run_efficiency", "forces", "force runs", "run {}", are_runs=True),
        Readings("held_ratio", "held forces", "held forces", "{}", "Input over output force"),
    ),
    read=read_forces,
    check=_check,
    describe=describe,
    warnings=warnings,
    copies=_copies,
    coarse=_coarse,
    alone=alone,
    method="All readings of one mounting of the cable shared its error, which was integrated out.",
    implausible=implausible,
    page=page,
    design=ForceDesign,
    empty=empty,
    count=count,
    conditions=itself,
    forces=lambda table: np.concatenate([table.input_force, table.output_force]),
    speeds=lambda table: np.abs(table.velocity),
    typical_speeds=_typical_speeds,
    velocity_unit=lambda table: table.velocity_unit,
    groups=lambda table: table.group,
    asked=Asked(
        "forces at both ends of the cable, a row a pair of readings",
        (
            Wanted(Quantity("input_force", "force"), "the force at the motor", (Quantity("input_torque", "torque"),)),
            Wanted(Quantity("output_force", "force"), "the force at the load", (Quantity("output_torque", "torque"),)),
            RUN,
            STROKE,
        ),
        (Switch("run", "Was the cable mounted anew for every row of {}?", "run", "each row"),),
        has_own_angles=True,
        several=True,
    ),
)
