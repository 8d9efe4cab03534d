"""Transmission efficiencies: output force over input force while pulling."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.description import Description, Finite
from bowdenfit.display import Part
from bowdenfit.files.cells import Cell
from bowdenfit.files.columns import Column, Quantity, find_columns, require
from bowdenfit.files.tables import read_table
from bowdenfit.kinds.design import Design
from bowdenfit.kinds.kind import Found, Source
from bowdenfit.kinds.pages import Page, route_cells, route_heading
from bowdenfit.kinds.plausibility import GAIN_ERROR, beyond
from bowdenfit.kinds.rows import OwnAngles, RowOrigin, provenance_of, read_own_angles, read_route, shared_columns
from bowdenfit.types import Vector
from bowdenfit.words import counted, percent

_FRACTION = 0.01  # as a percentage it is as likely a fraction
_SDS = 4.5  # stated standard deviations above 1, which one healthy row of 300,000 exceeds


@dataclass(frozen=True, repr=False)
class EfficiencyTable(Part):
    """Measured transmission efficiencies.

    Args:
        route: Route variable; NaN where the cable has no route.
        efficiency: Output force over input force while pulling [1].
        sd: Standard deviation where given [1], else 0.
        own: Wrap angles measured with the row.
        origin: Where each row was read.
    """

    route: Vector
    efficiency: Vector
    sd: Vector
    own: OwnAngles
    origin: RowOrigin


def read_efficiencies(source: Source) -> Found[EfficiencyTable]:
    """Read a table of transmission efficiencies, 0 to 1 or in percent where the heading or the cell says so.

    Args:
        source: Where it is.

    Raises:
        DatasetError: See `read_table` and `find_columns`; or an efficiency is not positive, or above 1 beyond its error.
    """
    path, route, contacts = source.file, source.description.route, source.description.angle_columns
    table = read_table(path)
    names = (Quantity("efficiency", "ratio"), Quantity("efficiency_sd", "ratio"))
    found = find_columns(table, (*names, *shared_columns(route, contacts)), source.columns)
    column = require(table, found, "efficiency", "efficiency (0 to 1) or efficiency_percent")
    sd, spread = [0.0] * len(table.rows), found.get("efficiency_sd")
    if spread is not None:
        beside = {cell.row: cell for cell in column.cells}
        sd = spread.each(lambda cell: 0.0 if cell.blank else _efficiency_sd(cell, spread, beside[cell.row], column), 0.0)
    errors = dict(zip((cell.row for cell in column.cells), sd, strict=True))
    efficiency = column.each(lambda cell: _efficiency(cell, column, errors[cell.row]), np.nan)
    rows = EfficiencyTable(
        read_route(table, found, route),
        np.array(efficiency),
        np.array(sd),
        read_own_angles(table, found, contacts),
        provenance_of(table),
    )
    return Found(rows, {path.name: path}, _fractions(column, rows), (table.account,))


def _fractions(column: Column, table: EfficiencyTable) -> tuple[str, ...]:
    """What is to be said of efficiencies in percent that look like fractions: the verdict of a fit, but sooner and by name."""
    small = np.flatnonzero(table.efficiency <= _FRACTION)
    if not len(small) or not any(_in_percent(cell, column) for cell in column.cells):
        return ()
    first = int(small[0])
    few = counted(len(small), "efficiency is", "efficiencies are")
    which = "every efficiency is" if len(small) == len(table.efficiency) else few
    return (
        f"{table.origin.place(first)}: {which} at most 1 %; the usual cause is a fraction under a heading that says "
        "percent: call the column efficiency, or write percentages.",
    )


def _ratio(cell: Cell, column: Column) -> float:
    """A number, or a percentage where the heading or the cell says so."""
    percentage = cell.percentage()
    return column.value(cell) if percentage is None else percentage


def _in_percent(cell: Cell, column: Column) -> bool:
    return column.factor != 1 or cell.percentage() is not None


def _efficiency(cell: Cell, column: Column, sd: float) -> float:
    """An efficiency; noise may show one above 1, as it may show more force out than in."""
    value = _ratio(cell, column)
    if value <= 0:
        raise cell.refuse(f"an efficiency of {cell.shown} is not possible; it is output force over input force.")
    if value > 1 + GAIN_ERROR + _SDS * sd:
        usual = (
            "the usual cause is that input and output force were swapped"
            if _in_percent(cell, column)
            else "if it is in percent, name the column efficiency_percent"
        )
        noise = "" if sd else ", or state its standard deviation in efficiency_sd if noise did that"
        raise cell.refuse(f"an efficiency of {cell.shown} is above 1; {usual}{noise}.")
    return value


def _efficiency_sd(cell: Cell, column: Column, efficiency: Cell, efficiency_column: Column) -> float:
    value = _ratio(cell, column)
    if not 0 < value <= 1:
        raise cell.refuse(
            f"a standard deviation of {cell.shown} is not possible for an efficiency; write one up to 1 (100 %)."
        )
    if _in_percent(efficiency, efficiency_column) and not _in_percent(cell, column):
        raise cell.refuse(
            f"{cell.shown} does not say whether it is in percent as the efficiency beside it is; name the column "
            "efficiency_sd_percent, or write 1 % for 0.01."
        )
    return value


def describe(table: EfficiencyTable, description: Description) -> list[str]:
    """How many there are, and how large."""
    del description
    low, high = table.efficiency.min(), table.efficiency.max()
    n = counted(len(table.efficiency), "efficiency", "efficiencies")
    return [f"{table.origin.files[0]}: {n}, {percent(low)} to {percent(high)}"]


def implausible(real: EfficiencyTable, made: EfficiencyTable) -> str:
    """Efficiencies that no bench reads."""
    del real
    return beyond(-np.log(made.efficiency), "an efficiency")


def page(table: EfficiencyTable, description: Description) -> Page:
    """Headings and rows of its file."""
    values = zip(table.route, table.efficiency, strict=True)
    rows = [[*route_cells(length, description), f"{eta:.5f}"] for length, eta in values]
    return [*route_heading(description), "efficiency"], rows


class EfficiencyDesign(Design):
    """[design]: route values at which an efficiency is measured."""

    efficiencies: tuple[Finite, ...] = ()


def empty(design: EfficiencyDesign, description: Description, file: str) -> EfficiencyTable:
    """A table of a design's shape with unremarkable readings."""
    n = len(design.efficiencies)
    own, origin = OwnAngles.none(description.angle_columns, n), RowOrigin.below_heading(file, n)
    return EfficiencyTable(np.array(design.efficiencies), np.full(n, 0.8), np.zeros(n), own, origin)
