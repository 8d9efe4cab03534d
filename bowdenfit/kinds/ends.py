"""What was read at the ends of a cable: forces, or torques of pulleys whose radii are stated."""

from collections.abc import Mapping

from bowdenfit.description.pulleys import Pulleys
from bowdenfit.errors import DatasetError
from bowdenfit.files.columns import Column, Quantity, require
from bowdenfit.files.csv_table import RawTable
from bowdenfit.types import Vector

ENDS = tuple(Quantity(f"{end}_{what}", what) for end in ("input", "output") for what in ("force", "torque"))


def end_column(table: RawTable, found: Mapping[str, Column], end: str, *, is_loop: bool = False) -> Column:
    """The column of one end, "input" or "output".

    Args:
        table, found: Where it is looked for.
        end: Which end.
        is_loop: Whether torques are as usual as forces, so that both are named where there are none.

    Raises:
        DatasetError: There is none of forces and none of torques, or one of each.
    """
    force, torque = f"{end}_force", f"{end}_torque"
    if force in found and torque in found:
        raise DatasetError(f"{table.file} has both {force} and {torque}; leave one of the two columns out.")
    named = f"{force}_N or {torque}_N_m" if is_loop else f"{force}_N"
    return found[torque] if torque in found else require(table, found, force, named)


def forces_of(values: Vector, table: RawTable, found: Mapping[str, Column], end: str, pulleys: Pulleys) -> Vector:
    """Forces at one end [N], from what its column holds.

    Args:
        values: Numbers of `end_column`, in N or N mm.
        table, found: Where they were read.
        end: "input" or "output".
        pulleys: Their radii.

    Raises:
        DatasetError: They are torques, and the radius of that pulley is not stated.
    """
    return pulleys.forces(values, end, table.file) if f"{end}_torque" in found else values
