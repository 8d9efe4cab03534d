"""Forces at both ends of a pull-pull loop while it moves."""

import numpy as np

from bowdenfit.files.columns import Quantity
from bowdenfit.kinds.asked import Asked, Wanted
from bowdenfit.kinds.copies import copies, without_runs
from bowdenfit.kinds.kind import Kind, itself
from bowdenfit.kinds.loop.table import LoopTable, read_loop
from bowdenfit.kinds.loop.words import LoopDesign, contradiction, describe, empty, implausible, page, warnings_of
from bowdenfit.kinds.readings import Readings
from bowdenfit.kinds.rows import STROKE
from bowdenfit.kinds.wrap_angles import check_rows
from bowdenfit.words import counted


def _copies(table: LoopTable) -> list[str]:
    places = np.column_stack([table.route, table.own.angle, table.preload])
    _, place = np.unique(np.nan_to_num(places, nan=-1.0), axis=0, return_inverse=True)
    forces = np.column_stack([table.input_force, table.output_force])
    return copies(without_runs(table.origin, places, forces, table.input_force, 3 * place + table.stroke))


LOOP = Kind(
    name="loop",
    table=LoopTable,
    readings=(Readings("loop_output_force", "loop", "loop", "output force in {}", "Output force (N)"),),
    read=read_loop,
    contradiction=contradiction,
    check=check_rows,
    describe=describe,
    warnings=warnings_of,
    copies=_copies,
    method="A loop in motion gave F_out = min(F_in - 2 P Lambda, F_in exp(-Lambda)) at its preload P and friction "
    "exponent Lambda.",
    implausible=implausible,
    page=page,
    design=LoopDesign,
    empty=empty,
    count=lambda table: f"{counted(len(table.stroke), 'reading')} of a loop",
    bends=lambda table: np.nansum(table.own.angle, axis=1),
    conditions=itself,
    forces=lambda table: table.input_force * table.stroke,
    asked=Asked(
        "forces or torques at both ends of a loop of two ropes",
        (
            Wanted(Quantity("input_force", "force"), "the force at the motor", (Quantity("input_torque", "torque"),)),
            Wanted(Quantity("output_force", "force"), "the force at the load", (Quantity("output_torque", "torque"),)),
            STROKE,
        ),
        has_own_angles=True,
        is_guessed=False,
        description={"cable": {"kind": "loop"}},
    ),
)
