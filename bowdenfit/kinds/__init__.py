"""Kinds of measurement: a folder each, what they share, and what all tables of a data set give together.

Imports go downward only (a contract of import-linter in pyproject.toml holds that):

    fit_command  covariates  run_parts                   commands that fit a lone file; covariates of readings; parts of runs
    lone_file                                            what is understood of a lone file
    file_kind  terms                                     the kind of a lone file; TERMS, the kinds in the likelihood (JAX)
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
from inspect import isabstract
from typing import Any
from warnings import warn

from bowdenfit.extensions import KINDS as KIND_GROUP
from bowdenfit.extensions import iterate_extensions, list_problems, report_problem
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


def _collect_added_kinds() -> Iterator[Kind[Any]]:
    """Yield the kinds that add-ons give by entry points."""
    taken = {kind.name for kind in _ALL}
    for name, kind in iterate_extensions(KIND_GROUP):
        is_whole = isinstance(kind, type) and issubclass(kind, Kind) and not isabstract(kind) and kind.term_class
        if is_whole and kind.name == name and name not in taken:
            yield kind()
        else:
            report_problem(
                f"the entry point {name!r} of {KIND_GROUP} is left out: it must be a whole subclass of Kind with a term_class, "
                "whose name is that of the entry point and of no kind of bowdenfit."
            )


KINDS: dict[str, Kind[Any]] = {kind.name: kind for kind in (*_ALL, *_collect_added_kinds())}
"""Every kind by its name, in the order in which tables are read, fitted and spoken of: ours, then those of add-ons."""

for _sentence in list_problems():
    warn(_sentence, RuntimeWarning, stacklevel=2)  # to programs; the command line prints them


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
