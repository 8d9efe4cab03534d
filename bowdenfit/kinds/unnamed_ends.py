"""Which columns or channels can be the forces at both ends of a cable where their headings do not say so."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bowdenfit.files.clocks import names_time
from bowdenfit.files.csv_table import RawTable
from bowdenfit.files.headings import heading_of
from bowdenfit.files.matching import candidates
from bowdenfit.files.naming import naming
from bowdenfit.files.spellings import spelled
from bowdenfit.kinds.single_file import FORCES, numbers_in
from bowdenfit.units import ColumnSource, dimension_of, is_unit
from bowdenfit.words import shown

_SPREAD = re.compile(r"(?:^|[\W_])(?:sd|std|stdev|sem|unc|uncertainty|error|err|noise|dev|deviation)(?:$|[\W_])", re.IGNORECASE)


@dataclass(frozen=True)
class HeadedColumn:
    """A column or channel of numbers as far as naming it goes.

    Args:
        name: What it is called.
        unit: Unit that the file gives; empty without one.
        mean, low, high: Of its values.
    """

    name: str
    unit: str
    mean: float = 0.0
    low: float = 0.0
    high: float = 0.0


def columns_of(table: RawTable) -> list[HeadedColumn]:
    """The columns of numbers of a table but for clocks."""
    found = []
    for i, (heading, unit) in enumerate(zip(table.header, table.units, strict=True)):
        known = [value for value in numbers_in(table, i) if np.isfinite(value)]
        if heading and len(known) > len(table.rows) / 2 and not (names_time(heading) and not spelled(heading, unit)):
            found.append(HeadedColumn(heading, unit, float(np.mean(known)), min(known), max(known)))
    return found


def name_ends(
    columns: Sequence[HeadedColumn], option: str, stated: Mapping[str, ColumnSource], always: bool = False
) -> tuple[list[str], list[str]]:
    """Options that name the forces at both ends, and what they take for granted.

    Args:
        columns: Columns or channels of numbers.
        option: "--column" or "--channel".
        stated: What the user has named already, by quantity.
        always: Whether forces are named that say themselves what they are.
    """
    columns = [each for each in columns if each.name not in [source.name for source in stated.values()]]
    can_be = candidates([(each.name, each.unit) for each in columns], FORCES, tuple(stated))
    ends = {name: columns[found[0].position] for name, found in can_be.items() if found}
    sure = {name for name, found in can_be.items() if len(found) == 1}
    provided = []
    asked = [quantity.name for quantity in FORCES if quantity.name not in stated]
    missing = [name for name in asked if name not in ends]
    rest = _forces_among([each for each in columns if each not in ends.values()])
    if missing and len(rest) == len(missing):
        rest = sorted(rest, key=lambda each: -each.mean)  # a pulled cable loses force
        ends |= dict(zip(missing, rest, strict=True))
        provided += [f"{shown(ends[name].name)} is the {name}" for name in missing]
    elif missing:
        ends |= {name: HeadedColumn("NAME", "N") for name in missing}
        provided += [f"NAME is the {option.removeprefix('--')} of the {name}" for name in missing]
    elif len(sure) < len(asked):
        provided += [f"{shown(ends[name].name)} is the {name}" for name in ends if name not in sure]
    options = []
    for name in asked:
        unit = "" if _unit(ends[name]) else "N"
        if always or unit or name not in sure:
            options.append(naming(name, ends[name].name, unit, option))
    if any(not _unit(each) for each in ends.values()):
        provided.append("the forces are in newtons, as the file does not say")
    return options, provided


def _forces_among(columns: Sequence[HeadedColumn]) -> list[HeadedColumn]:
    """The columns that can be forces: those in units of force, or where there are none those without any unit."""
    measured = [each for each in columns if not _SPREAD.search(each.name)]
    of_force = [each for each in measured if (unit := _unit(each)) and is_unit(unit) and dimension_of(unit) == "force"]
    return of_force or [each for each in measured if not _unit(each)]


def _unit(column: HeadedColumn) -> str:
    other = spelled(column.name, column.unit)
    return (other.unit if other else "") or heading_of(column.name, column.unit).unit
