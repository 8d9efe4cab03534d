"""Rows of tables as people write them: route value, wrap angles, stroke, forces at both ends; read, and written to files."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import partial
from typing import Literal, Protocol, runtime_checkable

import numpy as np

from bowdenfit.description import Description, Route
from bowdenfit.errors import DatasetError
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column, Quantity, require_column
from bowdenfit.files.row_account import ExcludedReading
from bowdenfit.files.tables import RawTable
from bowdenfit.types import Labels, Matrix, Vector
from bowdenfit.words import shown, significant

LARGEST_ANGLE = float(np.deg2rad(2000.0)) * (1 + 1e-12)  # five and a half turns; more is a mistaken unit. A judgement
_ALIKE = 0.75  # difflib's likeness from which an unknown heading is taken for a misspelled one; a judgement
ENDS = (
    *(Quantity(f"{end}_{what}", what) for end in ("input", "output") for what in ("force", "torque")),
    Quantity("input_current", "current"),
)
FileRows = tuple[list[str], list[list[str]]]
"""Headings and rows."""
_DIGITS = 5  # significant digits of the largest value of a written column; a judgement
STROKE_NAMES = {1: "pull", -1: "return"}
Stroke = Literal["pull", "return"]
_SIGNS = {name: sign for sign, name in STROKE_NAMES.items()}
_WHOLE_NUMBER = re.compile(r"([+\-−]?)0*(\d{1,15})(?:[.,]0*)?")
_LEADING_SIGNS = re.compile(r"[\W_]+")


@dataclass(frozen=True)
class UnusedColumn:
    """A column of a table that the fit does not use.

    Args:
        numbers: Its numbers, or the number of each text among `levels`.
        levels: Its different texts; empty for numbers.
    """

    numbers: Vector
    levels: tuple[str, ...] = ()


@dataclass(frozen=True)
class RowOrigin:
    """File and line of each row of a table, so that any row can be named.

    Args:
        files: File names.
        file: Number of the file of each row.
        row: Line of the file.
    """

    files: tuple[str, ...]
    file: Labels
    row: Labels

    @classmethod
    def below_heading(cls, file: str, n: int) -> "RowOrigin":
        """Return the origin of rows in a file that is written with one line of headings."""
        return cls((file,), np.zeros(n, dtype=int), np.arange(2, n + 2))

    def describe_row(self, i: int) -> str:
        """Return file and line of row `i` in words."""
        return f"{self.files[self.file[i]]}, row {self.row[i]}"


@dataclass(frozen=True)
class OwnAngles:
    """Wrap angles measured row by row: NaN where a row has none and the curve must serve.

    Args:
        names: Column of each contact.
        angle: Wrap angle [rad].
        sd: Its standard deviation where the table gives one [rad], else NaN.
    """

    names: tuple[str, ...]
    angle: Matrix
    sd: Matrix

    @classmethod
    def none(cls, names: tuple[str, ...], n: int) -> "OwnAngles":
        """Return rows without wrap angles of their own."""
        return cls(names, np.full((n, len(names)), np.nan), np.full((n, len(names)), np.nan))

    def column(self, name: str) -> tuple[Vector, Vector]:
        """Return angles and standard deviations of one contact [rad]; all NaN if the table has no such column."""
        if name not in self.names:
            return np.full(len(self.angle), np.nan), np.full(len(self.angle), np.nan)
        k = self.names.index(name)
        return self.angle[:, k], self.sd[:, k]


@runtime_checkable
class ForceRows(Protocol):
    """Length and wrap angles at which forces were measured, row by row."""

    @property
    def route(self) -> Vector:
        """Route variable; NaN where the cable has no route."""
        ...

    @property
    def own(self) -> OwnAngles:
        """Wrap angles measured with the row."""
        ...


@dataclass(frozen=True)
class RowConditions:
    """Length and wrap angles of measurements, row by row; see `ForceRows`."""

    route: Vector
    own: OwnAngles


@runtime_checkable
class Rows(ForceRows, Protocol):
    """Rows of a table that can be named."""

    @property
    def origin(self) -> RowOrigin:
        """Where each row was read."""
        ...


def route_column(route: Route) -> Quantity:
    """Return the route variable as a quantity: column name and the unit to convert to."""
    return Quantity(route.variable, "route", route.unit)


def read_angle(cell: Cell, column: Column) -> float:
    """Return a wrap angle between 0 and 2000 deg [rad]."""
    angle = column.value(cell)
    if angle < 0:
        cell.refuse_missing_code("leave the cell blank")
        raise cell.refuse(f"{cell.shown} is negative; wrap angles add up without sign, so write the absolute value.")
    if angle > LARGEST_ANGLE:
        raise cell.refuse(
            f"{cell.shown} is more than 2000 deg ({np.rad2deg(angle):.5g} deg); check the unit of the column."
        )
    return angle


def shared_columns(description: Description) -> tuple[Quantity, ...]:
    """Return the columns that efficiency and force tables share: the route variable, own wrap angles and their sd.

    An angle may be blank where its contact has a curve.
    """
    curved, route = {contact.wrap_angle.column for contact in description.curved}, description.route
    angles = [Quantity(name, "angle", optional=name in curved) for name in description.angle_columns]
    sds = [Quantity(f"{name}_sd", "angle", optional=True) for name in description.angle_columns]
    return (*([route_column(route)] if route else []), *angles, *sds)


def read_route(table: RawTable, columns: Mapping[str, Column], route: Route | None) -> Vector:
    """Return the route variable of every row; NaN without a route."""
    if route is None:
        return np.full(len(table.rows), np.nan)
    example = f"{route.variable}_{route.unit}"
    return round_lengths(require_column(table, columns, route.variable, example, ("route", "variable")).numbers())


def round_lengths(values: Iterable[float]) -> Vector:
    """Round values to 12 digits, so that one length is one number whatever unit each table gives it in."""
    return np.array([float(f"{value:.12g}") for value in values])


def read_own_angles(table: RawTable, columns: Mapping[str, Column], contacts: Sequence[str]) -> OwnAngles:
    """Return the wrap angles that rows carry themselves."""
    n = len(table.rows)
    angle, sd = np.full((n, len(contacts)), np.nan), np.full((n, len(contacts)), np.nan)
    for k, name in enumerate(contacts):
        for target, column in ((angle, columns.get(name)), (sd, columns.get(f"{name}_sd"))):
            if column is not None:
                target[:, k] = column.read_cells(partial(_own_angle, column), np.nan)
    return OwnAngles(tuple(contacts), angle, sd)


def _own_angle(column: Column, cell: Cell) -> float:
    if cell.blank:
        return np.nan
    if cell.limit() is not None:
        raise cell.refuse(
            f"{cell.shown} is not a measured angle; leave the cell blank where the contact has a curve, or write the angle."
        )
    return read_angle(cell, column)


def number_names(names: Sequence[str]) -> tuple[Labels, tuple[str, ...]]:
    """Return the number of each name among those that differ, in the order in which they come, and these."""
    numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
    return np.array([numbers[name] for name in names], dtype=int), tuple(numbers)


def read_labels(cells: Sequence[Cell], if_blank: str) -> list[str]:
    """Return the label of every row, such as the name of its run; see `unify_labels`.

    Raises:
        DatasetError: Two labels may be the same.
    """
    places = [f"row {cell.row}" for cell in cells]
    column = f"{cells[0].file}, column {shown(cells[0].column)}" if cells else ""
    return unify_labels([cell.text.strip() or if_blank for cell in cells], places, column)


def unify_labels(labels: Sequence[str], places: Sequence[str], column: str) -> list[str]:
    """Return labels with whole numbers that are written differently, such as 7, 7.0 and +7, as they are written first.

    Args:
        labels: Label in each place.
        places: Each in words.
        column: File and column that all of them are in.

    Raises:
        DatasetError: A label is another one behind a sign, as #11 is 11.
    """
    keys = [label_key(label) for label in labels]
    first = {key: i for i, key in reversed(list(enumerate(keys)))}
    for key, i in first.items():
        sign = None if _WHOLE_NUMBER.fullmatch(key) else _LEADING_SIGNS.match(key)
        other = first.get(label_key(key[sign.end() :])) if sign else None
        if other is not None:
            raise DatasetError(
                f"{column}: {shown(labels[i])} in {places[i]} and {shown(labels[other])} in {places[other]} are two labels "
                "that may mean the same; the usual cause is that one of them was typed differently. Write them alike if they "
                "are one mounting of the cable, or call one of them by another name."
            )
    return [labels[first[key]] for key in keys]


def label_key(label: str) -> str:
    """Return what equal labels share: a whole number without plus, leading zeros and decimals, or the label itself."""
    number = _WHOLE_NUMBER.fullmatch(label)
    return f"{'' if number[1] in ('', '+') else '-'}{number[2]}" if number else label


def origin_of_rows(table: RawTable) -> RowOrigin:
    """Return file and line of the rows of one table."""
    rows = np.array([row[0].row for row in table.rows])
    return RowOrigin((table.file,), np.zeros(len(rows), dtype=int), rows)


def read_tension(cell: Cell, column: Column, what: str) -> float:
    """Return a tension [N], 0 for a slack rope; `what` names it in refusals."""
    if cell.limit() is not None:
        raise cell.refuse(f"{cell.shown} is a bound, not a reading; write the value, and 0 for a slack rope.")
    value = column.value(cell)
    if value < 0:
        cell.refuse_missing_code()
        raise cell.refuse(
            f"{what} of {cell.shown} is negative; a rope cannot be pushed: the usual cause is the sign convention of the "
            "load cell or its tare, so write tension as positive, and 0 for a slack rope."
        )
    return value


def check_spelling(table: RawTable, columns: Mapping[str, Column], optional: Sequence[Quantity]) -> None:
    """Refuse a column that nothing reads where its heading is nearly that of an optional one."""
    read = {column.heading for column in columns.values()}
    missing = [quantity.name for quantity in optional if quantity.name not in columns]
    for heading in table.header:
        name = heading.lower().partition(" ")[0].partition("_")[0]
        near = get_close_matches(name, missing, n=1, cutoff=_ALIKE) if heading and heading not in read else []
        with table.faults.collect():
            if near:
                raise DatasetError(
                    f"{table.file}, row {table.header_row}: the column {shown(heading)} is not known; did you mean {near[0]}? "
                    "Rename it, or delete it."
                )


def find_end_column(
    table: RawTable, columns: Mapping[str, Column], end: str, *, is_loop: bool = False, has_motor: bool = False
) -> Column:
    """Return the column of one end, "input" or "output": of its force, or of a torque or a current instead.

    Args:
        table, columns: Where it is looked for.
        end: Which end.
        is_loop: Whether torques are as usual as forces, so that both are named where there are none.
        has_motor: Whether a motor takes the place of a load cell there, whose current or torque is then named.

    Raises:
        DatasetError: There is none, or there are several.
    """
    force, instead = f"{end}_force", [name for name in _other_readings(end) if name in columns]
    several = [name for name in (force, *instead) if name in columns]
    if len(several) > 1:
        raise DatasetError(f"{table.file} has both {several[0]} and {several[1]}; leave one of the two columns out.")
    if has_motor and not several:
        return require_column(table, columns, f"{end}_current", f"{end}_current_A or {end}_torque_N_m")
    named = f"{force}_N or {end}_torque_N_m" if is_loop else f"{force}_N"
    return columns[instead[0]] if instead else require_column(table, columns, force, named)


def convert_to_forces(
    values: Vector, table: RawTable, columns: Mapping[str, Column], end: str, description: Description
) -> Vector:
    """Return the forces on the rope at one end [N], from what its column holds.

    Args:
        values: Numbers of `find_end_column`, in N, N mm or A.
        table, columns: Where they were read.
        end: "input" or "output".
        description: Radii of the pulleys, the motor, and the ratio of the force on the rope to the reading of its cell.

    Raises:
        DatasetError: They are torques or currents, and the radius of that pulley, or the motor, is not stated.
    """
    quantity = next((name for name in _other_readings(end) if name in columns), None)
    if quantity is None and end == "input" and "input_force" in columns:
        description.pulleys.check_input_force(table.file)
    forces = values if quantity is None else description.pulleys.forces(values, quantity, table.file)
    return forces * description.sensors.ratio(end)


def _other_readings(end: str) -> tuple[str, ...]:
    """Return what may be read at an end, "input" or "output", in the place of its force."""
    return tuple(quantity.name for quantity in ENDS if quantity.name.startswith(end) and not quantity.name.endswith("force"))


def route_heading(description: Description) -> list[str]:
    """Return the heading of the route variable's column in a written file; none without a route."""
    return [f"{description.route.variable}_{description.route.unit}"] if description.route else []


def route_cells(route: float, description: Description) -> list[str]:
    """Return a row's cell in the route variable's column; none without a route."""
    return [f"{route:g}"] if description.route else []


def format_fixed(values: Iterable[float], decimals: int) -> list[str]:
    """Return cells with so many decimals, and more where the largest value would otherwise have fewer than five digits."""
    column = np.array(list(values), dtype=float)
    largest = float(np.max(np.abs(column[np.isfinite(column)]), initial=0.0))
    enough = _DIGITS - 1 - math.floor(math.log10(largest)) if largest else 0
    return [f"{value:.{max(decimals, enough)}f}" for value in column]


def describe_range(values: np.ndarray, unit: str) -> str:
    """Return the range of values in words, or their one value."""
    low, high = float(values.min()), float(values.max())
    least, most = significant(low, 4), significant(high, 4)
    return f"{least} {unit}" if low == high else f"{least} to {most} {unit}"


def stroke_signs(strokes: Sequence[Stroke]) -> list[int]:
    """Return +1 for each pull and -1 for each return."""
    return [_SIGNS[stroke] for stroke in strokes]


def convert_to_radians(degrees: Sequence[float]) -> Vector:
    """Return wrap angles in rad, as tables have them."""
    return np.deg2rad(np.array(degrees, dtype=float))


def convert_excluded(reading: ExcludedReading, description: Description) -> ExcludedReading:
    """Return a reading that the user leaves out with the forces on the rope, as `convert_to_forces` gives those of others."""
    values = dict(reading.values)
    for end in ("input", "output"):
        force, instead = f"{end}_force", [name for name in _other_readings(end) if name in values]
        with suppress(DatasetError):
            if instead and force not in values:
                reading_at_end = np.array([values[instead[0]]])
                values[force] = float(description.pulleys.forces(reading_at_end, instead[0], reading.file)[0])
        if force in values:
            values[force] *= description.sensors.ratio(end)
    return replace(reading, values=values)
