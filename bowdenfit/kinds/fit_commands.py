"""The one command that fits a file without a description, with the options that name what its headings do not say."""

import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.clocks import names_time
from bowdenfit.files.csv_table import RawTable
from bowdenfit.files.headings import heading_of
from bowdenfit.files.matching import Quantity, candidates
from bowdenfit.files.naming import naming
from bowdenfit.files.spellings import spelled
from bowdenfit.files.tables import read_table
from bowdenfit.kinds.single_file import FORCES, HEAD, FileKind, file_kind, numbers_in
from bowdenfit.units import dimension_of, is_unit
from bowdenfit.words import listed, shown

WRAP_ANGLE = Quantity("wrap_angle", "angle")
_ANY_ANGLE = "--wrap-angle 180deg"
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


@dataclass(frozen=True)
class FitCommand:
    """What fits a file.

    Args:
        text: The command, as it can be pasted.
        provided: What it takes for granted, each as a clause.
    """

    text: str
    provided: tuple[str, ...] = ()


def table_command(path: Path, table: RawTable, kind: str, stated: Sequence[str] = (), always: bool = False) -> FitCommand:
    """The command that fits a table.

    Args:
        path: Its file.
        table: What was read of it.
        kind: Name of the kind of measurement.
        stated: Options that the user has given already.
        always: Whether columns are named that say themselves what they are.
    """
    headings = list(zip(table.header, table.units, strict=True))
    options, provided = list(stated), list[str]()
    if kind == "forces" and not stated:
        named, provided = name_ends(columns_of(table), "--column", always)
        options += named
    angle, of_angle = _wrap_angle(headings)
    return _command(path, [*angle, *options], [*of_angle, *provided])


def recording_command(
    path: Path, columns: Sequence[HeadedColumn], has_clock: bool, stated: Sequence[str] = (), always: bool = False
) -> FitCommand:
    """The command that fits a recording.

    Args:
        path: Its file.
        columns: Its channels, without clocks.
        has_clock: Whether the file gives the time of its samples.
        stated: Options that the user has given already.
        always: Whether channels are named that say themselves what they are.
    """
    options, provided = list(stated), list[str]()
    if not stated:
        options, provided = name_ends(columns, "--channel", always)
    if not has_clock and not any(option.startswith("--channel time=") for option in stated):
        options.append("--channel time=1000Hz")
        provided.append("1000 Hz is its sampling rate")
    return _command(path, [_ANY_ANGLE, *options], ["180 deg is the wrap angle of the bench", *provided])


def either(path: Path, table: RawTable, found: FileKind) -> list[FitCommand]:
    """The commands for a file that could be a table or a recording, in this order."""
    kind = found.kind if found.other == "recordings" else found.other
    clocks = [i for i, heading in enumerate(table.header) if names_time(heading)]
    channels = [HeadedColumn(*_split(each.name, each.unit), each.mean) for each in columns_of(table)]
    return [table_command(path, table, kind, (), True), recording_command(path, channels, bool(clocks), (), True)]


def refuse_either(path: Path, table: RawTable, found: FileKind) -> DatasetError:
    """The refusal of a file that could be a table or a recording."""
    of_table, of_recording = either(path, table, found)
    return DatasetError(
        f"{path.name} could be a table of readings or a recording: {found.why}; say which, for a table by {of_table.text}, for "
        f"a recording by {of_recording.text}."
    )


def only_kind(path: Path, has_channels: bool, named: Sequence[str]) -> str:
    """Name of the kind of measurement that a file without a description holds.

    Raises:
        DatasetError: It could be of either of two; says the command for each.
    """
    found = file_kind(path, has_channels, named)
    if found.other:
        raise refuse_either(path, read_table(path, HEAD), found)
    return found.kind


def has_own_angles(path: Path, kind: str, named: Sequence[str], stated: bool) -> bool:
    """Whether the rows of a file have wrap angles of their own.

    Args:
        path: The file.
        kind: Name of its kind of measurement.
        named: Quantities whose columns the user names.
        stated: Whether the user states one angle for all rows.

    Raises:
        DatasetError: They have, although one is stated.
    """
    if kind == "recordings":
        return False
    table = read_table(path, HEAD)
    columns = candidates(list(zip(table.header, table.units, strict=True)), (WRAP_ANGLE,))[WRAP_ANGLE.name]
    if not columns and WRAP_ANGLE.name not in named:
        return False
    if stated:
        what = f"has a column of wrap angles, {shown(table.header[columns[0].position])}" if columns else "is to have one"
        raise DatasetError(f"{path.name} {what}, and --wrap-angle states one angle for all rows; leave one of the two out.")
    return True


def columns_of(table: RawTable) -> list[HeadedColumn]:
    """The columns of numbers of a table but for clocks."""
    found = []
    for i, (heading, unit) in enumerate(zip(table.header, table.units, strict=True)):
        known = [value for value in numbers_in(table, i) if np.isfinite(value)]
        if heading and len(known) > len(table.rows) / 2 and not (names_time(heading) and not spelled(heading, unit)):
            found.append(HeadedColumn(heading, unit, float(np.mean(known)), min(known), max(known)))
    return found


def name_ends(columns: Sequence[HeadedColumn], option: str, always: bool) -> tuple[list[str], list[str]]:
    """Options that name the forces at both ends, and what they take for granted.

    Args:
        columns: Columns or channels of numbers.
        option: "--column" or "--channel".
        always: Whether forces are named that say themselves what they are.
    """
    can_be = candidates([(each.name, each.unit) for each in columns], FORCES)
    ends = {name: columns[found[0].position] for name, found in can_be.items() if found}
    sure = {name for name, found in can_be.items() if len(found) == 1}
    provided = []
    missing = [quantity.name for quantity in FORCES if quantity.name not in ends]
    rest = _forces_among([each for each in columns if each not in ends.values()])
    if missing and len(rest) == len(missing):
        rest = sorted(rest, key=lambda each: -each.mean)  # a pulled cable loses force
        ends |= dict(zip(missing, rest, strict=True))
        provided += [f"{shown(ends[name].name)} is the {name}" for name in missing]
    elif missing:
        ends |= {name: HeadedColumn("NAME", "N") for name in missing}
        provided += [f"NAME is the {option.removeprefix('--')} of the {name}" for name in missing]
    elif len(sure) < len(FORCES):
        provided += [f"{shown(ends[name].name)} is the {name}" for name in ends if name not in sure]
    options = []
    for name in (quantity.name for quantity in FORCES):
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


def _split(heading: str, unit: str) -> tuple[str, str]:
    """Name and unit as a recording has them."""
    both = heading_of(heading, unit)
    return both.name, both.unit


def _wrap_angle(headings: Sequence[tuple[str, str]]) -> tuple[list[str], list[str]]:
    """What gives the wrap angle of a table: a column of its own, one that may be, or the user."""
    if candidates(headings, (WRAP_ANGLE,))["wrap_angle"]:
        return [], []
    likely = [
        heading
        for heading, unit in headings
        if (other := spelled(heading, unit)) and other.quantity == "wrap_angle" and other.unit
    ]
    if likely:
        best = next((heading for heading in likely if "measured" in heading.lower()), likely[0])
        rather = "" if len(likely) == 1 else f" rather than {listed([shown(each) for each in likely if each != best])}"
        return [naming("wrap_angle", best)], [f"{shown(best)} is the wrap angle{rather}"]
    return [_ANY_ANGLE], ["180 deg is the wrap angle of the bench"]


def _command(path: Path, options: Sequence[str], provided: Sequence[str]) -> FitCommand:
    return FitCommand(" ".join(["bowdenfit fit", shlex.quote(str(path)), *options]), tuple(provided))
