"""Which readings several fits have in common, and in words which they have not.

Two models can be compared only by how well they predict the same events. An angle too small to detect is the event "below
the limit" where it is censored, a reading of 0 deg where it counts as zero, and no event where it is dropped.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.kinds.run_parts import RunParts
from bowdenfit.kinds.terms import term_kind
from bowdenfit.results.record import Record

_SAME = 1e-6  # relative difference of sums over the same samples in another order

Key = tuple[str, str, int]


@dataclass(frozen=True)
class OmittedReadings:
    """Readings of one table that the fits do not share.

    Args:
        table: Name of the readings.
        shared: Number of readings that all fits have.
        most: Number of readings of the fit that has most.
        why: The reason, in words.
    """

    table: str
    shared: int
    most: int
    why: str

    JSON: ClassVar = (..., "sentence")

    def sentence(self) -> str:
        """What is left out of the comparison, and why."""
        what = self.table.replace("_", " ")
        if not self.shared:
            return f"All readings of {what} are left out of the comparison: {self.why}."
        return f"Of {what} only {self.shared} of {self.most} readings are compared: {self.why}."


@dataclass(frozen=True)
class CommonReadings:
    """The readings that several fits share.

    Args:
        readings: Table and label of each.
        positions: Where they are among the readings of each fit.
        omitted: What they do not share, by table.
    """

    readings: tuple[tuple[str, str], ...]
    positions: dict[str, tuple[int, ...]]
    omitted: tuple[OmittedReadings, ...]


def find_common_readings(fits: Mapping[str, Record], parts: Mapping[str, Mapping[str, RunParts]]) -> CommonReadings:
    """The readings that all fits have, as the same events.

    Args:
        fits: By name.
        parts: Parts of runs that stand in for the readings of a table, by fit and table.
    """
    events = {name: _events(fit, parts[name]) for name, fit in fits.items()}
    first, *others = events.values()
    shared = [key for key, event in first.items() if all(key in o and _is_same_event(event, o[key]) for o in others)]
    positions = {name: {key: i for i, key in enumerate(of_fit)} for name, of_fit in events.items()}
    descriptions = {name: fit.dataset.description for name, fit in fits.items()}
    tables = dict.fromkeys(key[0] for of_fit in events.values() for key in of_fit)
    counts = {
        table: (_count_table(shared, table), max(_count_table(of_fit, table) for of_fit in events.values())) for table in tables
    }
    return CommonReadings(
        tuple((table, label) for table, label, _ in shared),
        {name: tuple(positions[name][key] for key in shared) for name in events},
        tuple(
            OmittedReadings(table, some, most, term_kind(table).why_events_differ(table, descriptions))
            for table, (some, most) in counts.items()
            if some < most
        ),
    )


def _count_table(keys: Mapping[Key, np.ndarray] | list[Key], table: str) -> int:
    return sum(key[0] == table for key in keys)


def _events(fit: Record, parts: Mapping[str, RunParts]) -> dict[Key, np.ndarray]:
    """What each reading says, by table, label and how often that label came before; in the order of the model's terms."""
    events: dict[Key, np.ndarray] = {}
    for term in fit.model.terms:
        run_parts = parts.get(term.name)
        values = run_parts.said if run_parts else term_kind(term.name).events(term, fit.dataset.description)
        for label, event in zip((run_parts or term).labels, values, strict=True):
            earlier = sum(key[:2] == (term.name, label) for key in events)
            events[term.name, label, earlier] = event
    return events


def _is_same_event(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape == other.shape and np.allclose(one, other, rtol=_SAME, atol=0.0, equal_nan=True)
