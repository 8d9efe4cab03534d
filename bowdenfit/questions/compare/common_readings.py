"""Readings that several fits have in common as the same events, and parts of runs that stand in for them.

Two models can be compared only by how well they predict the same events. An angle too small to detect is the event "below
the limit" where it is censored, a reading of 0 deg where it counts as zero, and no event where it is dropped.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.errors import UsageError
from bowdenfit.kinds import find_readings
from bowdenfit.kinds.run_parts import LeaveOut, RunParts, has_rows, split_runs
from bowdenfit.kinds.terms import find_term_kind
from bowdenfit.results.record import Record

_FEW_RUNS = 5  # below which they are left out in parts, because little predicts a whole one; a judgement
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
        """Say what is left out of the comparison, and why."""
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
        omitted: Readings that they do not share, by table.
    """

    readings: tuple[tuple[str, str], ...]
    positions: dict[str, tuple[int, ...]]
    omitted: tuple[OmittedReadings, ...]


def find_common_readings(fits: Mapping[str, Record], parts: Mapping[str, Mapping[str, RunParts]]) -> CommonReadings:
    """Return the readings that all fits share.

    Args:
        fits: By name.
        parts: Parts of runs that stand in for the readings of a table, by fit and table.

    Raises:
        UsageError: The fits are of other measurements, or share fewer than two readings.
    """
    first, *others = fits
    for name in others:
        if _input_files(fits[name]) != _input_files(fits[first]):
            raise UsageError(
                f"{first} and {name} were not fitted to the same readings, so how well they predict them cannot be "
                "compared; fit the same data set twice, such as with and without --friction rate-dependent."
            )
    common = match_events(fits, parts)
    if not common.readings:
        raise UsageError(
            f"{', '.join(fits)} have no reading in common that they take for the same, so they cannot be compared. "
            + " ".join(part.sentence() for part in common.omitted)
        )
    if len(common.readings) < 2:
        table, label = common.readings[0]
        raise UsageError(
            f"{', '.join(fits)} have one reading in common, {label} of {find_readings(table).words}, and nothing predicts it "
            "once it is left out; read the same run at several loads, or mount the cable a second time."
        )
    return common


def choose_parts(
    fits: Mapping[str, Record], leave_out: LeaveOut | None
) -> tuple[LeaveOut, int, dict[str, dict[str, RunParts]]]:
    """Return what is left out of runs at a time; how few runs there are, if that decided it; the parts by fit and table.

    Args:
        fits: By name.
        leave_out: Part to leave out; None if the number of runs is to decide.
    """
    runs = [len(t.labels) for fit in fits.values() for t in fit.model.terms if has_rows(t)]
    few = min(runs, default=_FEW_RUNS) if leave_out is None else 0
    unit: LeaveOut = leave_out or ("load" if few < _FEW_RUNS else "run")
    parts = {name: _run_parts(fit, unit) for name, fit in fits.items()}
    return (unit, few if unit == "load" else 0, parts) if leave_out or any(parts.values()) else ("run", 0, parts)


def _run_parts(fit: Record, unit: LeaveOut) -> dict[str, RunParts]:
    """Return the parts of the runs of every table that has some."""
    parts = {term.name: split_runs(term, unit) for term in fit.model.terms}
    return {name: parts for name, parts in parts.items() if parts is not None}


def _input_files(fit: Record) -> tuple[list[tuple[str, str]], list[tuple[str, tuple[str, ...]]]]:
    """Return files that were read, description aside, with their checksums; and the readings that they leave no choice of."""
    files = sorted((file, digest) for file, digest in fit.dataset.sha256.items() if not file.endswith(".toml"))
    return files, [(term.name, term.labels) for term in fit.model.terms if not find_term_kind(term.name).chooses_rows]


def match_events(fits: Mapping[str, Record], parts: Mapping[str, Mapping[str, RunParts]]) -> CommonReadings:
    """Return the readings that all fits have, as the same events.

    Args:
        fits: By name.
        parts: Parts of runs that stand in for the readings of a table, by fit and table.
    """
    events = {name: _collect_events(fit, parts[name]) for name, fit in fits.items()}
    first, *others = events.values()
    shared = [key for key, event in first.items() if all(key in o and _is_same_event(event, o[key]) for o in others)]
    positions = {name: {key: i for i, key in enumerate(of_fit)} for name, of_fit in events.items()}
    descriptions = {name: fit.dataset.description for name, fit in fits.items()}
    tables = dict.fromkeys(key[0] for of_fit in events.values() for key in of_fit)
    counts = {
        table: (_count_table(shared, table), max(_count_table(of_fit, table) for of_fit in events.values()))
        for table in tables
    }
    return CommonReadings(
        tuple((table, label) for table, label, _ in shared),
        {name: tuple(positions[name][key] for key in shared) for name in events},
        tuple(
            OmittedReadings(table, some, most, find_term_kind(table).why_events_differ(table, descriptions))
            for table, (some, most) in counts.items()
            if some < most
        ),
    )


def _count_table(keys: Mapping[Key, np.ndarray] | list[Key], table: str) -> int:
    return sum(key[0] == table for key in keys)


def _collect_events(fit: Record, parts: Mapping[str, RunParts]) -> dict[Key, np.ndarray]:
    """Return what each reading says, by table, label and how often that label came before, in the order of the terms."""
    events: dict[Key, np.ndarray] = {}
    for term in fit.model.terms:
        in_parts = parts.get(term.name)
        values = in_parts.event_keys if in_parts else find_term_kind(term.name).events(term, fit.dataset.description)
        for label, event in zip((in_parts or term).labels, values, strict=True):
            earlier = sum(key[:2] == (term.name, label) for key in events)
            events[term.name, label, earlier] = event
    return events


def _is_same_event(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape == other.shape and np.allclose(one, other, rtol=_SAME, atol=0.0, equal_nan=True)
