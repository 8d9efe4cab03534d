"""Which readings several fits have in common, and in words which they have not.

Two models can be compared only by how well they predict the same events. An angle too small to detect is the event "below
the limit" where it is censored, a reading of 0 deg where it counts as zero, and no event where it is dropped.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.kinds.angles.table import AngleSettings
from bowdenfit.kinds.recordings.blocks import RECORDED
from bowdenfit.kinds.recordings.settings import RecordingsTable
from bowdenfit.kinds.term import Term
from bowdenfit.results.record import Record

ANGLES = "wrap_angle"  # the table whose readings depend on how the fit takes what was not detected
_SAME = 1e-6  # relative difference of sums over the same samples in another order

Key = tuple[str, str, int]


@dataclass(frozen=True)
class Omitted:
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
class Common:
    """The readings that several fits share.

    Args:
        readings: Table and label of each.
        positions: Where they are among the readings of each fit.
        omitted: What they do not share, by table.
    """

    readings: tuple[tuple[str, str], ...]
    positions: dict[str, tuple[int, ...]]
    omitted: tuple[Omitted, ...]


def common_readings(fits: Mapping[str, Record]) -> Common:
    """The readings that all fits have, as the same events.

    Args:
        fits: By name.
    """
    events = {name: _events(fit) for name, fit in fits.items()}
    first, *others = events.values()
    shared = [key for key, event in first.items() if all(key in o and _same(event, o[key]) for o in others)]
    places = {name: {key: i for i, key in enumerate(of_fit)} for name, of_fit in events.items()}
    tables = dict.fromkeys(key[0] for of_fit in events.values() for key in of_fit)
    counts = {
        table: (_count(shared, table), max(_count(of_fit, table) for of_fit in events.values())) for table in tables
    }
    return Common(
        tuple((table, label) for table, label, _ in shared),
        {name: tuple(places[name][key] for key in shared) for name in events},
        tuple(
            Omitted(table, some, most, _why(table, fits)) for table, (some, most) in counts.items() if some < most
        ),
    )  # fmt: skip


def _count(keys: Mapping[Key, np.ndarray] | list[Key], table: str) -> int:
    return sum(key[0] == table for key in keys)


def _events(fit: Record) -> dict[Key, np.ndarray]:
    """What each reading says, by table, label and how often that label came before; in the order of the model's terms."""
    found: dict[Key, np.ndarray] = {}
    for term in fit.model.terms:
        for label, event in zip(term.labels, _said(term, fit), strict=True):
            earlier = sum(key[:2] == (term.name, label) for key in found)
            found[term.name, label, earlier] = event
    return found


def _said(term: Term, fit: Record) -> np.ndarray:
    """Of each reading, numbers that are the same wherever it is the same event; NaN where it is a limit alone."""
    if term.name == RECORDED:  # the likelihood of all its blocks; their number tells how they were chosen
        settings = fit.dataset.description.table(RecordingsTable)
        whole = float(settings is not None and settings.likelihood == "whole")
        return np.column_stack([term.data["n"], np.full(len(term.labels), whole)])
    return np.column_stack([term.observed(), term.data["n"]] if "n" in term.data else [term.observed()])


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape == other.shape and np.allclose(one, other, rtol=_SAME, atol=0.0, equal_nan=True)


def _why(table: str, fits: Mapping[str, Record]) -> str:
    """Why the readings of a table are not the same events in all fits."""
    descriptions = [fit.dataset.description for fit in fits.values()]
    if table == RECORDED:
        likelihoods = {said.likelihood for d in descriptions if (said := d.table(RecordingsTable))}
        if len(likelihoods) > 1:
            return (
                "some fits take the sliding blocks of runs and others whole recordings, which are not the same readings"
            )
        return (
            "the fits do not count the same blocks of them, because they prepare them differently, or because friction that "
            'depends on load or speed takes another way through whole recordings; likelihood = "runs" counts them alike'
        )
    if table == ANGLES:
        return (
            "angles too small to detect, and angles where a curve does not hold, are not the same readings in all fits "
            f"({', '.join(f'{name}: {_treatment(fit)}' for name, fit in fits.items())})"
        )
    return "the others are not in all fits"


def _treatment(fit: Record) -> str:
    """How a fit takes angles that are too small to detect."""
    description = fit.dataset.description
    if description.geometry == "published":
        return "zeros, in the published regions"
    settings = description.table(AngleSettings)
    undetected = settings.undetected if settings is not None else "censored"
    return {"censored": "below the limit", "zero": "zeros", "dropped": "dropped"}[undetected]
