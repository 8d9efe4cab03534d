"""Where each reading was taken: lengths, loads, wrap angles, strokes and runs, which residuals are looked at against."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.kinds.term import Term

LOAD, WRAP_ANGLE, RUN, STROKE = "Load (N)", "Wrap angle (deg)", "Run", "Stroke"


@dataclass(frozen=True)
class Places:
    """Where the readings of one table were taken.

    Args:
        numbers: By axis label, such as "Load (N)"; the first is what the table varies most.
        group: Contact or the like that each reading belongs to; empty where all are of one kind.
        back: Whether a reading was taken on the way back, or while unloading.
        inside: Whether it lies inside the range in which the curves hold.
    """

    numbers: Mapping[str, np.ndarray]
    group: tuple[str, ...]
    back: np.ndarray
    inside: np.ndarray


def places_of(dataset: Dataset, term: Term) -> Places:
    """Where the readings of a term were taken; numbered in their order where nothing else is known.

    Args:
        dataset: The data set.
        term: One table of its model.
    """
    n, route = len(term.labels), dataset.description.route
    numbers, back = _elastic(dataset, term)
    at = route_values(term)
    inside = np.ones(n, dtype=bool)
    if route is not None and at is not None and np.isfinite(at).all():
        numbers = {route.label: at} | numbers
        inside = (at >= route.range[0]) & (at <= route.range[1])
    varying = {label: values for label, values in numbers.items() if len(np.unique(values)) > 1}
    return Places(varying or {RUN: np.arange(1.0, n + 1)}, _groups(term), back, inside)


def _elastic(dataset: Dataset, term: Term) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Loads and wrap angles of the tables that have them."""
    tables, nothing = dataset.measurements, np.zeros(len(term.labels), dtype=bool)
    if term.name == "stretch" and tables.stretch is not None:
        table = tables.stretch
        return {LOAD: table.load, WRAP_ANGLE: np.rad2deg(table.wrap_angle)}, table.unloading
    if term.name == "measured_preload":
        return {WRAP_ANGLE: np.rad2deg(term.data["wrap_angle"])}, nothing
    if term.name == "loop_output_force" and tables.loop is not None:
        angle = np.rad2deg(np.nansum(np.nan_to_num(tables.loop.own.angle), axis=1))
        return {LOAD: tables.loop.input_force, WRAP_ANGLE: angle}, tables.loop.stroke < 0
    return {}, nothing


def route_values(term: Term) -> np.ndarray | None:
    """Route value of each reading: of its row, of its curve's reading, or the mean over its run."""
    data, n = term.data, len(term.labels)
    at = data.get("route")
    if at is None:
        return None
    if isinstance(at, Mapping):
        return _flat(at)[data["order"]]
    values = np.asarray(at, dtype=float)
    if "run" not in data:
        return values if len(values) == n else None
    return np.array([values[data["run"] == run].mean() for run in range(n)])


def _flat(by_curve: Mapping[str, Any]) -> np.ndarray:
    return np.concatenate([np.asarray(values, dtype=float) for values in by_curve.values()])


def _groups(term: Term) -> tuple[str, ...]:
    """The column of each angle reading; nothing of other tables."""
    at = term.data.get("route")
    if not isinstance(at, Mapping):
        return ("",) * len(term.labels)
    columns = [column for column, values in at.items() for _ in values]
    return tuple(columns[i] for i in term.data["order"])
