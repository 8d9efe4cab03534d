"""Preload between fixed ends."""

from bowdenfit.files.columns import Quantity
from bowdenfit.kinds.asked import Asked, Wanted
from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.preload.table import PreloadTable, PreloadTableSettings, read_preload
from bowdenfit.kinds.preload.words import PreloadDesign, describe, empty, implausible, page, warnings_of
from bowdenfit.kinds.readings import Readings
from bowdenfit.words import counted

PRELOAD = Kind(
    name="preload",
    table=PreloadTable,
    readings=(Readings("measured_preload", "preload", "preload", "preload at {}", "Preload (N)"),),
    read=read_preload,
    settings=PreloadTableSettings,
    describe=describe,
    warnings=warnings_of,
    method="The preload between fixed ends was that of the model at each wrap angle.",
    implausible=implausible,
    page=page,
    design=PreloadDesign,
    empty=empty,
    count=lambda table: counted(len(table.preload), "preload"),
    bends=lambda table: table.wrap_angle,
    tensions=lambda table: table.preload,
    asked=Asked(
        "preload between fixed ends at several wrap angles",
        (
            Wanted(Quantity("preload", "force"), "the preload"),
            Wanted(Quantity("wrap_angle", "angle"), "the wrap angle of the cable"),
        ),
    ),
)
