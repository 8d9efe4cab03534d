"""Kinds of measurement: a folder each, what they share, and what all tables of a data set give together.

Imports go downward only (a contract of import-linter in pyproject.toml holds that):

    fit_command  covariates  run_parts                   commands that fit a lone file; covariates of readings; parts of runs
    file_kind  terms                                     what a lone file holds; TERMS, the kinds in the likelihood (JAX)
    descriptions                                         cable.toml and plans, with a field for every kind
    this module                                          KINDS: the kinds that read and describe tables (NumPy)
    forces                                               also plans runs, as those of tables and of recordings
    angles  displacement  efficiencies  loop  preload  recordings  ringdown  stretch     know nothing of each other
    runs  shared_parameters                              what likelihoods of several kinds share
    sliding_rows
    kind  term                                           the interfaces: Kind and TermKind
    candidate  table_files  plausibility  row_angles     parts of the interfaces; CandidateKind
    bench_error                                          systematic errors as tables would show them
    tables                                               tables that several kinds look at
    rows                                                 rows of tables, read and written
"""

from collections.abc import Iterator
from typing import Any

from bowdenfit.kinds.angles.kind import AngleKind
from bowdenfit.kinds.displacement.kind import DisplacementKind
from bowdenfit.kinds.efficiencies.kind import EfficiencyKind
from bowdenfit.kinds.forces.kind import ForceKind
from bowdenfit.kinds.kind import Kind, Readings
from bowdenfit.kinds.loop.kind import LoopKind
from bowdenfit.kinds.preload.kind import PreloadKind
from bowdenfit.kinds.recordings.kind import RecordingKind
from bowdenfit.kinds.ringdown.kind import RingDownKind
from bowdenfit.kinds.stretch.kind import StretchKind
from bowdenfit.kinds.tables import Measurements

_ALL: tuple[Kind[Any], ...] = (
    AngleKind(),
    EfficiencyKind(),
    ForceKind(),
    RecordingKind(),
    StretchKind(),
    PreloadKind(),
    LoopKind(),
    DisplacementKind(),
    RingDownKind(),
)

KINDS: dict[str, Kind[Any]] = {kind.name: kind for kind in _ALL}
"""Every kind by its name, in the order in which tables are read, fitted and spoken of."""


def iterate_tables(measurements: Measurements) -> Iterator[tuple[Kind[Any], Any]]:
    """Yield every table with its kind, in the order of the kinds."""
    for kind in KINDS.values():
        table = measurements.table(kind.table)
        if table is not None:
            yield kind, table


def find_kind(readings: str) -> Kind[Any] | None:
    """Return the kind that has readings of this name; None if none has."""
    return next((kind for kind in KINDS.values() if any(item.name == readings for item in kind.readings)), None)


def find_readings(name: str) -> Readings:
    """Return the words for readings of this name; the name itself where no kind has such."""
    kind = find_kind(name)
    return next(
        (one for one in (kind.readings if kind else ()) if one.name == name), Readings(name, name, name, "{}", name)
    )


def describe_reading(name: str, label: str) -> str:
    """Return the words for one of the readings of this name."""
    return find_readings(name).one.format(label)
