"""What the rows of several kinds of table have in common: route variable, wrap angles, stroke, and where they stand."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bowdenfit.files.columns import Column, Quantity, require
from bowdenfit.files.csv_table import Cell, RawTable
from bowdenfit.kinds.tables import OwnAngles, Provenance
from bowdenfit.types import Labels, Vector

LARGEST_ANGLE = float(np.deg2rad(2000.0)) * (1 + 1e-12)
_STROKES = {
    **dict.fromkeys(("pull", "pulling", "+1", "1", "+1.0", "1.0"), 1),
    **dict.fromkeys(("return", "returning", "release", "-1", "-1.0"), -1),
    **dict.fromkeys(("hold", "0", "0.0"), 0),
}


@dataclass(frozen=True)
class Route:
    """The route variable as tables call it: column name and the unit to convert to."""

    variable: str
    unit: str

    def quantity(self) -> Quantity:
        """Its column."""
        return Quantity(self.variable, "route", self.unit)


def read_angle(cell: Cell, column: Column) -> float:
    """A wrap angle between 0 and 2000 deg [rad]."""
    angle = column.value(cell)
    if angle < 0:
        raise cell.refuse(f"{cell.shown} is negative; wrap angles add up without sign, so write the absolute value.")
    if angle > LARGEST_ANGLE:
        raise cell.refuse(
            f"{cell.shown} is more than 2000 deg ({np.rad2deg(angle):.5g} deg); check the unit of the column."
        )
    return angle


def read_strokes(
    found: Mapping[str, Column], n_rows: int, held: str = ", or hold (0, read while nothing slides)"
) -> Labels:
    """Strokes of a table; all pulling without a column.

    Args:
        found: Columns of the table.
        n_rows: Number of its rows.
        held: What a refusal says of held readings; empty where the table may have none.
    """
    if "stroke" not in found:
        return np.ones(n_rows, dtype=int)
    strokes = []
    for cell in found["stroke"].cells:
        text = cell.text.strip().lower().replace("\u2212", "-").replace(",", ".")
        if text not in _STROKES:
            raise cell.refuse(f"{cell.shown} is no stroke; write pull (+1) or return (-1){held}.")
        strokes.append(_STROKES[text])
    return np.array(strokes)


def shared_columns(route: Route | None, contacts: Sequence[str]) -> tuple[Quantity, ...]:
    """Columns that efficiency and force tables share: the route variable, own wrap angles and their sd."""
    angles = [Quantity(name + suffix, "angle") for name in contacts for suffix in ("", "_sd")]
    return (*([route.quantity()] if route else []), *angles)


def read_route(table: RawTable, found: Mapping[str, Column], route: Route | None) -> Vector:
    """Route variable of every row; NaN without a route."""
    if route is None:
        return np.full(len(table.rows), np.nan)
    return rounded(require(table, found, route.variable, f"{route.variable}_{route.unit}").numbers())


def rounded(values: Iterable[float]) -> Vector:
    """Values to 12 digits, so that one length is one number whatever unit each table gives it in."""
    return np.array([float(f"{value:.12g}") for value in values])


def read_own_angles(table: RawTable, found: Mapping[str, Column], contacts: Sequence[str]) -> OwnAngles:
    """Wrap angles that rows carry themselves."""
    n = len(table.rows)
    angle, sd = np.full((n, len(contacts)), np.nan), np.full((n, len(contacts)), np.nan)
    for k, name in enumerate(contacts):
        for target, column in ((angle, found.get(name)), (sd, found.get(f"{name}_sd"))):
            if column is not None:
                target[:, k] = [np.nan if cell.blank else _own_angle(cell, column) for cell in column.cells]
    return OwnAngles(tuple(contacts), angle, sd)


def _own_angle(cell: Cell, column: Column) -> float:
    if cell.limit() is not None:
        raise cell.refuse(
            f"{cell.shown} is no measured angle; leave the cell blank where the contact has a curve, or write the angle."
        )
    return read_angle(cell, column)


def provenance_of(table: RawTable) -> Provenance:
    """Where the rows of one file stand."""
    rows = np.array([row[0].row for row in table.rows])
    return Provenance((table.file,), np.zeros(len(rows), dtype=int), rows)
