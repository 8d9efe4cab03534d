"""One folder a kind of measurement: its table (NumPy) and its term in the likelihood (JAX); KINDS lists them all."""

from collections.abc import Iterator
from typing import Any

from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.tables import AngleTable, EfficiencyTable, ForceTable, LoopTable, PreloadTable, StretchTable
from bowdenfit.recordings.recording import Recordings

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind("angles", AngleTable),
        Kind("efficiencies", EfficiencyTable),
        Kind("forces", ForceTable),
        Kind("recordings", Recordings),
        Kind("stretch", StretchTable),
        Kind("preload", PreloadTable),
        Kind("loop", LoopTable),
    )
}
"""Every kind by its name, in the order in which tables are read, fitted and spoken of."""


def each_table(measurements: Measurements) -> Iterator[tuple[Kind, Any]]:
    """Every table with its kind, in the order of the kinds."""
    for kind in KINDS.values():
        table = measurements.table(kind.table)
        if table is not None:
            yield kind, table
