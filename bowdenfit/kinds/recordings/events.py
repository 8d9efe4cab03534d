"""Which events the readings of recordings are, for comparing fits of the same files."""

from collections.abc import Mapping

import numpy as np

from bowdenfit.description import Description
from bowdenfit.kinds.recordings.blocks import RECORDED
from bowdenfit.kinds.recordings.settings import RecordingsTable
from bowdenfit.kinds.term import Events, Term, what_was_read, why_not_alike


def _said(term: Term, description: Description) -> np.ndarray:
    """A run is the likelihood of all its blocks; their number tells how they were chosen."""
    if term.name != RECORDED:
        return what_was_read(term, description)
    settings = description.table(RecordingsTable)
    whole = float(settings is not None and settings.likelihood == "whole")
    return np.column_stack([term.data["n"], np.full(len(term.labels), whole)])


def _why_not_alike(name: str, descriptions: Mapping[str, Description]) -> str:
    if name != RECORDED:
        return why_not_alike(name, descriptions)
    if len({said.likelihood for d in descriptions.values() if (said := d.table(RecordingsTable))}) > 1:
        return "some fits take the sliding blocks of runs and others whole recordings, which are not the same readings"
    return (
        "the fits do not count the same blocks of them, because they prepare them differently, or because friction that "
        'depends on load or speed takes another way through whole recordings; likelihood = "runs" counts them alike'
    )


EVENTS = Events(_said, _why_not_alike)
