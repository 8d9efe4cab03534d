"""Covariates of readings, which residuals are plotted and tested against: lengths, loads, wrap angles, strokes and runs."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from bowdenfit.description import Description
from bowdenfit.kinds import find_kind
from bowdenfit.kinds.angles.term import AnglesData
from bowdenfit.kinds.rows import UnusedColumn
from bowdenfit.kinds.sliding_rows import STROKE as STROKE
from bowdenfit.kinds.tables import Measurements
from bowdenfit.kinds.term import WRAP_ANGLE, Term, find_row_angles
from bowdenfit.kinds.terms import find_term_kind

RUN = "Run"
_ONE_PLACE = 0.02  # range within a run over that of all readings, up to which the run has one value; a judgement


@dataclass(frozen=True)
class Covariates:
    """Covariates of the readings of one table: what residuals are plotted and tested against.

    Args:
        numbers: By axis label, such as "Load (N)"; the first is what the table varies most.
        group: Contact or the like that each reading belongs to; empty where all are of one kind.
        back: Whether a reading was taken on the way back, or while unloading.
        inside: Whether it lies inside the range in which the curves hold.
        unused: Columns that the fit does not use, by heading.
    """

    numbers: Mapping[str, np.ndarray]
    group: tuple[str, ...]
    back: np.ndarray
    inside: np.ndarray
    unused: Mapping[str, UnusedColumn] = field(default_factory=dict[str, UnusedColumn])


def collect_covariates(description: Description, measurements: Measurements, term: Term) -> Covariates:
    """Collect the covariates of a term's readings; their order where nothing else is known.

    Args:
        description: Parsed cable.toml.
        measurements: Everything measured on it.
        term: One table of its model.
    """
    n, route = len(term.labels), description.route
    numbers, unused, back = _covariates_of_kind(measurements, term)
    bends = _mean_wrap_angles(term)
    if bends is not None:
        numbers = {WRAP_ANGLE: bends, **numbers}
    at = route_values(term)
    inside = np.ones(n, dtype=bool)
    if route is not None and at is not None and np.isfinite(at).all():
        numbers = {route.label: at, **numbers}
        inside = (at >= route.range[0]) & (at <= route.range[1])
    varying = {label: values for label, values in numbers.items() if len(np.unique(values)) > 1}
    return Covariates(varying or {RUN: np.arange(1.0, n + 1)}, _columns_of_angles(term), back, inside, unused)


def _covariates_of_kind(
    measurements: Measurements, term: Term
) -> tuple[Mapping[str, np.ndarray], Mapping[str, UnusedColumn], np.ndarray]:
    """Return what the kind knows: loads, wrap angles and the like, unused columns, and which readings are of the return."""
    kind = find_kind(term.name)
    table = measurements.table(kind.table) if kind is not None else None
    if table is None:
        return {}, {}, np.zeros(len(term.labels), dtype=bool)
    terms = find_term_kind(term.name)
    back = terms.on_way_back(table)
    none_back = np.zeros(len(term.labels), dtype=bool)
    return terms.covariates(table, term), terms.unused_columns(table, term), none_back if back is None else back


def _mean_wrap_angles(term: Term) -> np.ndarray | None:
    """Return the total measured wrap angle of each reading or run [deg]; None where curves give it, or a run has several."""
    rows = getattr(term, "rows", None)
    angles = find_row_angles(term.data) if rows is None else rows.angles
    if angles is None:
        return None
    own_angles, n = np.asarray(angles.is_own), len(term.labels)
    curved = [bool(contact.wrap_angle.curve) for contact in term.cable.description.contact]
    if own_angles.shape[1:] != (len(curved),) or not own_angles.any() or not own_angles[:, curved].all():
        return None
    bends = np.rad2deg(np.sum(np.where(own_angles, angles.own, 0.0), axis=1))
    if rows is not None:
        angles_of_runs = [bends[rows.run == run] for run in np.unique(rows.run)]
        if any(np.ptp(of_run) > _ONE_PLACE * np.ptp(bends) for of_run in angles_of_runs):
            return None
        bends = np.array([of_run.mean() for of_run in angles_of_runs])
    return bends if len(bends) == n else None


def route_values(term: Term) -> np.ndarray | None:
    """Return the route value of each reading or run; NaN for a run that was read at several."""
    data, n = term.data, len(term.labels)
    if isinstance(data, AnglesData):
        return np.concatenate([np.asarray(values, dtype=float) for values in data.route.values()])[data.order]
    angles = find_row_angles(data)
    if angles is None:
        return None
    values, run_of_row = np.asarray(angles.route, dtype=float), getattr(getattr(data, "cells", data), "run", None)
    if run_of_row is None:
        return values if len(values) == n else None
    of_run = [values[run_of_row == run] for run in range(n)]
    return np.array([at_run.mean() if np.ptp(at_run) <= _ONE_PLACE * np.ptp(values) else np.nan for at_run in of_run])


def _columns_of_angles(term: Term) -> tuple[str, ...]:
    """Return the column of each angle reading; empty strings for other tables."""
    data = term.data
    if not isinstance(data, AnglesData):
        return ("",) * len(term.labels)
    columns = [column for column, values in data.route.items() for _ in values]
    return tuple(columns[i] for i in data.order)
