"""Which readings could be taken next of a cable, if none is named: whatever its tables can hold."""

from dataclasses import replace

import numpy as np

from bowdenfit.errors import UsageError
from bowdenfit.kinds.tables import OwnAngles
from bowdenfit.questions.next.possible_candidates import columns_without_curve, why_not
from bowdenfit.questions.next.possible_readings import KINDS, Candidate
from bowdenfit.questions.next.possible_runs import typical_run
from bowdenfit.results.record import Record

GRID, MOST_ANGLES, MOST_LOADS = 11, 9, 5  # lengths without choices; wrap angles and loads of default candidates


def default_candidates(fit: Record) -> tuple[Candidate, ...]:
    """Everything the tables of the description can hold, at the lengths and wrap angles that suggest themselves.

    Raises:
        UsageError: There is nothing that could be simulated.
    """
    found = [c for kind in KINDS for c in _of_kind(fit, kind) if not why_not(fit, c)]
    if not found:
        raise UsageError(
            "this fit's tables hold nothing whose next reading can be simulated (recordings of a loop cannot be yet); name "
            "candidates with --candidate, such as preload@90deg."
        )
    return tuple(found)


def _of_kind(fit: Record, kind: str) -> list[Candidate]:
    """Candidates of one kind that the description has a table for."""
    stated, measured = fit.dataset.description.tables.stated, fit.dataset.measurements
    if kind == "angle":
        return [Candidate(kind, at) for at in _lengths(fit)] if "angles" in stated else []
    if kind == "efficiency":
        table = measured.efficiencies
        return _along_cable(fit, kind, table.own if table is not None else None) if "efficiencies" in stated else []
    if kind == "force":
        table_of_forces = measured.forces
        own = table_of_forces.own if table_of_forces is not None else _own_of_recordings(fit)
        return _along_cable(fit, kind, own) if typical_run(measured) is not None else []
    if kind == "stretch" and measured.stretch is not None:
        bends, loads = _bends(measured.stretch.wrap_angle), _loads(measured.stretch.load)
        return [Candidate(kind, angles=(bend,), load=load) for bend in bends for load in loads]
    if kind == "preload" and measured.preload is not None:
        return [Candidate(kind, angles=(bend,)) for bend in _bends(measured.preload.wrap_angle)]
    if kind == "loop" and measured.loop is not None:
        cases = _along_cable(fit, kind, measured.loop.own)
        return [replace(c, load=load) for c in cases for load in _loads(np.abs(measured.loop.input_force))]
    return []


def _own_of_recordings(fit: Record) -> OwnAngles | None:
    recordings = fit.dataset.measurements.recordings
    if recordings is None:
        return None
    shape = (len(recordings.each), len(recordings.columns))
    angle = np.array([r.own_angle for r in recordings.each]).reshape(shape)
    return OwnAngles(recordings.columns, angle, np.full(shape, np.nan))


def _lengths(fit: Record) -> list[float]:
    """Lengths that can be bought, or a grid over the range; none without a route."""
    route = fit.dataset.description.route
    if route is None:
        return []
    return [float(at) for at in (route.choices or np.linspace(*route.range, GRID))]


def _along_cable(fit: Record, kind: str, own: OwnAngles | None) -> list[Candidate]:
    """At each length, also those outside the range at which angles were read; without a route at angles measured before."""
    route, measured = fit.dataset.description.route, fit.dataset.measurements
    if route is not None:
        read = measured.angles.route if measured.angles is not None else np.zeros(0)
        beyond = np.unique(read[(read < route.range[0]) | (read > route.range[1])])
        return [Candidate(kind, at) for at in sorted({*_lengths(fit), *(float(at) for at in beyond)})]
    without_curve = columns_without_curve(fit)
    if own is None or not without_curve:
        return [Candidate(kind)]
    angles = np.column_stack([own.column(name)[0] for name in without_curve])
    cases = np.unique(np.deg2rad(np.rad2deg(angles[np.isfinite(angles).all(axis=1)]).round(1)), axis=0)
    chosen = cases[np.unique(np.linspace(0, len(cases) - 1, MOST_ANGLES).round().astype(int))] if len(cases) else cases
    return [Candidate(kind, angles=tuple(float(angle) for angle in case)) for case in chosen]


def _some(values: np.ndarray, most: int) -> list[float]:
    """Distinct values, evenly chosen where there are many."""
    different = np.unique(values)
    if not len(different):
        return []
    return [float(v) for v in different[np.unique(np.linspace(0, len(different) - 1, most).round().astype(int))]]


def _loads(loads: np.ndarray) -> list[float]:
    """Some of the loads measured at, to two digits: as they were meant, without the noise of their reading."""
    return _some(np.array([float(f"{load:.2g}") for load in loads if load > 0]), MOST_LOADS)


def _bends(angles: np.ndarray) -> list[float]:
    """Some of the wrap angles measured at [rad], to a tenth of a degree."""
    return _some(np.deg2rad(np.rad2deg(angles).round(1)), MOST_ANGLES)
