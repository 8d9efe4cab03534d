"""Preload between fixed ends."""

from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.preload.table import PreloadTable, read_preload
from bowdenfit.kinds.preload.words import describe, implausible, page, warnings_of

PRELOAD = Kind(
    name="preload",
    table=PreloadTable,
    read=read_preload,
    describe=describe,
    warnings=warnings_of,
    implausible=implausible,
    page=page,
    count=lambda table: f"{len(table.preload)} preloads",
)
