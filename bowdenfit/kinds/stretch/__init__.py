"""Stretch of the rope under load."""

import numpy as np

from bowdenfit.files.columns import Quantity
from bowdenfit.kinds.asked import Asked, Wanted
from bowdenfit.kinds.copies import Compared, copies
from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.readings import Readings
from bowdenfit.kinds.stretch.table import StretchTable, read_stretch
from bowdenfit.kinds.stretch.words import StretchDesign, describe, empty, implausible, page, warnings_of
from bowdenfit.words import counted, listed


def _copies(table: StretchTable) -> list[str]:
    names = tuple(f"cycle {name}" for name in table.cycle_names)
    places = np.column_stack([table.load, table.wrap_angle, table.unloading])
    curve = 2 * table.cycle + table.unloading
    read = table.stretch[:, None]
    return copies(Compared(listed(table.origin.files), table.cycle, names, places, read, table.load, curve))


STRETCH = Kind(
    name="stretch",
    table=StretchTable,
    readings=(Readings("stretch", "stretch", "stretch", "stretch under {}", "Stretch (mm)"),),
    read=read_stretch,
    describe=describe,
    warnings=warnings_of,
    copies=_copies,
    method="Under the tension T the rope stretched by e(T) = T/k + d (1 - exp(-T/T_c)), with what friction held back along it.",
    implausible=implausible,
    page=page,
    design=StretchDesign,
    empty=empty,
    count=lambda table: f"{counted(len(table.load), 'reading')} of stretch",
    bends=lambda table: table.wrap_angle,
    tensions=lambda table: table.load,
    asked=Asked(
        "stretch of the rope under load, the far end held",
        (
            Wanted(Quantity("load", "force"), "the load on the rope's end"),
            Wanted(Quantity("wrap_angle", "angle"), "the wrap angle of the cable"),
            Wanted(Quantity("stretch", "length"), "the stretch"),
        ),
    ),
)
