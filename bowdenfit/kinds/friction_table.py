"""Kinds of tables whose rows say themselves where friction was measured: a length, wrap angles, or both."""

from typing import TypeVar

import numpy as np
from typing_extensions import override

from bowdenfit.description import Contact, Description
from bowdenfit.errors import DatasetError, Faults
from bowdenfit.kinds.angles.table import AngleTable
from bowdenfit.kinds.kind import FrictionKind
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.rows import Rows

AnyRows = TypeVar("AnyRows", bound=Rows)


class FrictionTableKind(FrictionKind[AnyRows]):
    """A kind of table that has `route`, `own` wrap angles and `origin` row by row."""

    @override
    def conditions(self, table: AnyRows) -> AnyRows:
        return table

    @override
    def check(self, table: AnyRows, description: Description, measurements: Measurements) -> None:
        """Refuse a row that cannot be given a wrap angle in every contact.

        Raises:
            DatasetError: Says which rows, and what to do.
        """
        faults, angles = Faults(), measurements.table(AngleTable)
        for contact in description.contact:
            with faults.collect():
                if contact.wrap_angle.constant is None:
                    _check_contact(description, angles, contact, table)
        faults.refuse()


def _check_contact(description: Description, angles: AngleTable | None, contact: Contact, table: Rows) -> None:
    column = contact.wrap_angle.column or ""
    own, _ = table.own.column(column)
    if not contact.wrap_angle.curve:
        missing = np.flatnonzero(np.isnan(own))
        if len(missing) == len(own):
            raise DatasetError(
                f"{table.origin.files[0]} has no column {column!r}, the wrap angle of the contact {contact.name!r}; "
                f"add it (as {column}_deg), or give the contact a constant angle or a curve in cable.toml."
            )
        why = f"the cell is blank, but the contact {contact.name!r} has no curve that could stand in for it; fill in the "
        Faults([_in_row(table, i, column, why + "measured angle.") for i in map(int, missing)]).refuse()
        return
    route = description.route
    assert route is not None and angles is not None  # the description guarantees both
    outside = np.isnan(own) & ((table.route < route.range[0]) | (table.route > route.range[1]))
    why = (
        f"lies outside the range {route.range[0]:g} to {route.range[1]:g} {route.unit} where the angle curves hold, and the "
        f"angle table has no row there; measure the wrap angles at that {route.variable.replace('_', ' ')}, or write them "
        "into this row."
    )
    rows = [int(i) for i in np.flatnonzero(outside) if not np.any(angles.route == table.route[i])]
    Faults([_in_row(table, i, route.variable, why, f"{table.route[i]:g} {route.unit} ") for i in rows]).refuse()


def _in_row(table: Rows, i: int, column: str, what: str, value: str = "") -> DatasetError:
    """Return what is wrong with a column in a row of a table, behind the value that stands there."""
    error = DatasetError(f"{table.origin.place(i)}, column {column!r}: {value}{what}")
    error.fault_key, error.row = (table.origin.files[table.origin.file[i]], column, what), int(table.origin.row[i])
    return error
