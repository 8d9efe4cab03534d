"""Forces read at both ends of a cable."""

import numpy as np

from bowdenfit.kinds.forces.table import ForceTable, read_forces
from bowdenfit.kinds.forces.words import count, describe, empty, implausible, page
from bowdenfit.kinds.kind import Kind, itself
from bowdenfit.kinds.readings import Readings, efficiencies
from bowdenfit.kinds.wrap_angles import check_rows

FORCES = Kind(
    name="forces",
    table=ForceTable,
    readings=(
        efficiencies("run_efficiency", "forces", "force runs", "run {}", are_runs=True),
        Readings("held_ratio", "held forces", "held forces", "{}", "Input over output force"),
    ),
    read=read_forces,
    check=check_rows,
    describe=describe,
    implausible=implausible,
    page=page,
    empty=empty,
    count=count,
    conditions=itself,
    forces=lambda table: np.concatenate([table.input_force, table.output_force]),
    speeds=lambda table: np.abs(table.velocity),
    velocity_unit=lambda table: table.velocity_unit,
)
