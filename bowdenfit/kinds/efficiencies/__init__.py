"""Transmission efficiencies."""

import numpy as np

from bowdenfit.files.columns import Quantity
from bowdenfit.kinds.asked import Asked, Wanted
from bowdenfit.kinds.coarse import Coarse, coarse
from bowdenfit.kinds.copies import copies, places_along, without_runs
from bowdenfit.kinds.efficiencies.table import (
    EfficiencyDesign,
    EfficiencyTable,
    describe,
    empty,
    implausible,
    page,
    read_efficiencies,
)
from bowdenfit.kinds.kind import Kind, itself
from bowdenfit.kinds.readings import efficiencies
from bowdenfit.kinds.wrap_angles import check_rows
from bowdenfit.words import counted, listed


def _copies(table: EfficiencyTable) -> list[str]:
    places = np.column_stack([table.route, table.own.angle])
    return copies(without_runs(table.origin, places, table.efficiency, places_along(table)))


def _coarse(table: EfficiencyTable) -> Coarse | None:
    """Where no scatter is stated."""
    if np.any(table.sd > 0):
        return None
    places = np.column_stack([table.route, table.own.angle])
    return coarse(listed(table.origin.files), places, table.efficiency)


EFFICIENCIES = Kind(
    name="efficiencies",
    table=EfficiencyTable,
    readings=(efficiencies("efficiency", "efficiencies", "efficiencies", "efficiency at {}"),),
    read=read_efficiencies,
    check=check_rows,
    describe=describe,
    copies=_copies,
    coarse=_coarse,
    alone=lambda table: f"a table of {counted(len(table.efficiency), 'efficiency', 'efficiencies')}",
    method="The logarithm of a measured efficiency was that of the model, give or take the scatter between mountings.",
    implausible=implausible,
    page=page,
    design=EfficiencyDesign,
    empty=empty,
    count=lambda table: counted(len(table.efficiency), "efficiency", "efficiencies"),
    conditions=itself,
    asked=Asked(
        "efficiencies: output force over input force while pulling",
        (Wanted(Quantity("efficiency", "ratio"), "the efficiency"),),
        has_own_angles=True,
    ),
)
