"""One folder a kind of measurement: its table (NumPy) and its term in the likelihood (JAX); KINDS lists them all."""

from collections.abc import Iterator
from typing import Any

from bowdenfit.kinds.angles import ANGLES
from bowdenfit.kinds.displacement import DISPLACEMENT
from bowdenfit.kinds.efficiencies import EFFICIENCIES
from bowdenfit.kinds.forces import FORCES
from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.loop import LOOP
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.preload import PRELOAD
from bowdenfit.kinds.readings import Readings
from bowdenfit.kinds.recordings import RECORDINGS
from bowdenfit.kinds.ringdown import RINGDOWN
from bowdenfit.kinds.stretch import STRETCH

KINDS: dict[str, Kind[Any]] = {
    kind.name: kind for kind in (ANGLES, EFFICIENCIES, FORCES, RECORDINGS, STRETCH, PRELOAD, LOOP, DISPLACEMENT, RINGDOWN)
}
"""Every kind by its name, in the order in which tables are read, fitted and spoken of."""


def each_table(measurements: Measurements) -> Iterator[tuple[Kind[Any], Any]]:
    """Every table with its kind, in the order of the kinds."""
    for kind in KINDS.values():
        table = measurements.table(kind.table)
        if table is not None:
            yield kind, table


def kind_of(readings: str) -> Kind[Any] | None:
    """The kind whose readings have a name in results; None if none has."""
    return next((kind for kind in KINDS.values() if any(one.name == readings for one in kind.readings)), None)


def readings_called(name: str) -> Readings:
    """What readings of this name are called; by their name where no kind has such."""
    kind = kind_of(name)
    return next(
        (one for one in (kind.readings if kind else ()) if one.name == name), Readings(name, name, name, "{}", name)
    )


def reading_called(name: str, label: str) -> str:
    """What one of the readings of this name is called."""
    return readings_called(name).one.format(label)
