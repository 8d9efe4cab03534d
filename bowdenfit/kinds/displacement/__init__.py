"""Force at the motor against its displacement: one load cell and one position, with a spring or a stop at the far end."""

import numpy as np

from bowdenfit.files.columns import Quantity
from bowdenfit.kinds.asked import Asked, Wanted
from bowdenfit.kinds.copies import Compared, copies
from bowdenfit.kinds.displacement.reader import read_displacement
from bowdenfit.kinds.displacement.table import DisplacementSettings, DisplacementTable, contradiction
from bowdenfit.kinds.displacement.words import (
    DisplacementDesign,
    count,
    describe,
    empty,
    implausible,
    page,
    warnings_of,
)
from bowdenfit.kinds.kind import Kind, itself
from bowdenfit.kinds.readings import Readings
from bowdenfit.kinds.rows import RUN, STROKE
from bowdenfit.kinds.wrap_angles import check_rows
from bowdenfit.words import listed


def _copies(table: DisplacementTable) -> list[str]:
    files, names = listed(table.origin.files), tuple(f"run {name}" for name in table.run_names)
    moved, force = table.displacement[:, None], table.force[:, None]
    return copies(Compared(files, table.run, names, moved, force, table.displacement, table.run))


DISPLACEMENT = Kind(
    name="displacement",
    table=DisplacementTable,
    readings=(
        Readings(
            "motor_force", "displacement", "force at the motor", "force at the motor in {}", "Force at the motor (N)"
        ),
    ),
    read=read_displacement,
    settings=DisplacementSettings,
    contradiction=contradiction,
    quantities=lambda said, _: [("tables, displacement, stop", said.stop, "length")],
    check=check_rows,
    describe=describe,
    warnings=warnings_of,
    copies=_copies,
    method="The force at the motor followed its displacement as the tension of a rubbing rope does, through every turn of the "
    "motor.",
    implausible=implausible,
    page=page,
    design=DisplacementDesign,
    empty=empty,
    count=count,
    alone=lambda table: f"a table of {len(table.force)} forces against displacement",
    bends=lambda table: np.nansum(table.own.angle, axis=1),
    conditions=itself,
    forces=lambda table: table.force[table.used],
    asked=Asked(
        "one force, at the motor, and the displacement of the motor",
        (
            Wanted(Quantity("force", "force"), "the force at the motor", (Quantity("input_force", "force"),)),
            Wanted(Quantity("displacement", "length"), "the displacement of the motor", (Quantity("position", "length"),)),
            RUN,
            STROKE,
        ),
        has_own_angles=True,
    ),
)
