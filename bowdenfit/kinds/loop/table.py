"""Forces, or torques, at both ends of a pull-pull loop while it moves."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bowdenfit.description.pulleys import Pulleys
from bowdenfit.display import Part
from bowdenfit.errors import DatasetError, together
from bowdenfit.files.columns import Column, Quantity, find_columns
from bowdenfit.files.csv_table import RawTable
from bowdenfit.files.matching import meanings
from bowdenfit.files.tables import read_table
from bowdenfit.kinds.ends import ENDS, end_column, forces_of
from bowdenfit.kinds.kind import Found, Source
from bowdenfit.kinds.rows import (
    OwnAngles,
    RowOrigin,
    check_spelling,
    provenance_of,
    read_own_angles,
    read_route,
    read_strokes,
    read_tension,
    shared_columns,
)
from bowdenfit.types import Labels, Vector
from bowdenfit.words import shown

_UNUSED = ("time", "position", "run")  # columns that such a table may have and that nothing reads


@dataclass(frozen=True, repr=False)
class LoopTable(Part):
    """Forces at both ends of a pull-pull loop while it moves.

    Args:
        route: Route variable; NaN where the cable has no route.
        input_force: Difference of the tensions at the motor side [N].
        output_force: Difference of the tensions at the load side [N].
        stroke: +1 moving forward, -1 moving back.
        preload: Preload measured with the row [N]; NaN where the cable's own counts.
        own: Wrap angles measured with the row.
        origin: Where each row was read.
    """

    route: Vector
    input_force: Vector
    output_force: Vector
    stroke: Labels
    preload: Vector
    own: OwnAngles
    origin: RowOrigin


def read_loop(source: Source) -> Found[LoopTable]:
    """Read a table of forces, or torques, at both ends of a pull-pull loop while it moves.

    Args:
        source: Where it is.

    Raises:
        DatasetError: See `read_table` and `find_columns`; or a preload is negative, a torque has no radius, or the output is
            larger than the input while moving forward.
    """
    path, route, contacts = source.file, source.description.route, source.description.angle_columns
    table, pulleys = read_table(path), source.description.cable.pulleys
    others = (Quantity("stroke", "text"), Quantity("preload", "force"))
    found = find_columns(table, (*ENDS, *others, *shared_columns(route, contacts)), source.columns, _UNUSED)
    check_spelling(table, found, others)
    nothing = np.full(len(table.rows), np.nan)
    ends_read = table.faults.each(lambda end: _end_forces(table, found, end, pulleys), ("input", "output"), nothing)
    input_force, output_force = ends_read
    stroke = read_strokes(found, len(table.rows), held="")
    preload = nothing
    if (column := found.get("preload")) is not None:
        preload = np.array(column.each(lambda c: np.nan if c.blank else read_tension(c, column, "a preload"), np.nan))
    at, own = read_route(table, found, route), read_own_angles(table, found, contacts)
    table.faults.refuse()
    if not stroke.all():
        why = "a loop that is held still tells nothing but bounds; write pull (moving forward) or return, or leave the row out."
        raise together([found["stroke"].cells[i].refuse(why) for i in np.flatnonzero(stroke == 0)])
    made = LoopTable(
        at,
        input_force,
        output_force,
        stroke,
        preload,
        own,
        provenance_of(table),
    )
    _check_loss(table, made)
    remarks = []
    if "stroke" not in found:
        remarks.append(f"{table.file} has no stroke column: every row is taken as moving forward (the motor pulls).")
    angles = [h for h in table.header if _plain_angle(h) and h not in {column.heading for column in found.values()}]
    if angles:
        remarks.append(
            f"{table.file} has the column {shown(angles[0])}, which no contact in cable.toml reads; it is left out of account."
        )
    return Found(made, {path.name: path}, tuple(remarks), (table.account,))


def _end_forces(table: RawTable, found: Mapping[str, Column], end: str, pulleys: Pulleys) -> Vector:
    """Forces at one end [N], from its force column or from its torques and the radius of its pulley."""
    read = np.asarray(end_column(table, found, end, is_loop=True).numbers())
    return forces_of(read, table, found, end, pulleys)


def _plain_angle(heading: str) -> bool:
    return any(unit for _, unit in meanings(heading, (Quantity("wrap_angle", "angle"),)))


def _check_loss(table: RawTable, made: LoopTable) -> None:
    """A loop loses force: over all rows the output is behind the input in the direction of motion."""
    gained = made.stroke * (made.output_force - made.input_force)
    if np.median(gained) > 0:
        worst = int(np.argmax(gained))
        raise DatasetError(
            f"{table.file}: in most rows the output is larger than the input in the direction of motion, as in row "
            f"{made.origin.row[worst]} (input {made.input_force[worst]:.4g} N, output {made.output_force[worst]:.4g} N); the "
            "usual cause is that input and output columns, or pull and return, were swapped."
        )
