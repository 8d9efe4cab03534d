"""The one command that fits a file without a description, with options for columns that its headings do not name."""

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.clocks import names_time
from bowdenfit.files.headings import Quantity, find_candidates, heading_of, option_naming, split_brackets
from bowdenfit.files.layout import is_index
from bowdenfit.files.pivot import find_pivot_headings
from bowdenfit.files.spellings import likely_angle_unit, likely_wrap_angle, parse_heading
from bowdenfit.files.tables import RawTable, read_table
from bowdenfit.kinds.file_kind import (
    BESIDE_FORCES,
    FORCES,
    HEAD,
    FileKind,
    find_stated_angle,
    guess_file_kind,
    read_numbers,
)
from bowdenfit.units import ColumnSource, dimension_of, is_unit, multiple_of
from bowdenfit.words import listed, shown

_SPREAD = re.compile(
    r"(?:^|[\W_])(?:sd|std|stdev|sem|unc|uncertainty|error|err|noise|dev|deviation)(?:$|[\W_])", re.IGNORECASE
)


WRAP_ANGLE = Quantity("wrap_angle", "angle")
_FEW = 20  # rows up to which 1, 2, 3 may be loads as well as an index; a judgement


@dataclass(frozen=True)
class HeadedColumn:
    """A column or channel of numbers: its heading and range.

    Args:
        name: Heading.
        unit: Unit that the file gives; empty without one.
        mean, low, high: Mean and range of its values.
        are_whole: Whether they are whole numbers.
        is_index: Whether it only counts the rows.
    """

    name: str
    unit: str
    mean: float = 0.0
    low: float = 0.0
    high: float = 0.0
    are_whole: bool = False
    is_index: bool = False


def list_number_columns(table: RawTable) -> list[HeadedColumn]:
    """List the columns of numbers of a table, without clocks."""
    columns = []
    for i, (heading, unit) in enumerate(zip(table.header, table.units, strict=True)):
        finite = [value for value in read_numbers(table, i) if np.isfinite(value)]
        if (
            heading
            and len(finite) > len(table.rows) / 2
            and not (names_time(heading) and not parse_heading(heading, unit))
        ):
            values = np.array(finite)
            whole, counts = bool(np.all(values == np.round(values))), len(finite) > _FEW and is_index(values)
            columns.append(HeadedColumn(heading, unit, float(values.mean()), min(finite), max(finite), whole, counts))
    return columns


def name_force_columns(
    columns: Sequence[HeadedColumn],
    option: str,
    stated: Mapping[str, ColumnSource],
    always: bool = False,
    in_order: bool = False,
) -> tuple[list[str], list[str]]:
    """Return the options that name the forces at both ends, and what they take for granted.

    Args:
        columns: Columns or channels of numbers.
        option: "--column" or "--channel".
        stated: Columns that the user has named, by quantity.
        always: Whether forces are named that say themselves what they are.
        in_order: Whether the first of two unnamed forces is taken for the input, rather than the larger: over both strokes the
            output is the larger one on average.
    """
    columns = [column for column in columns if column.name not in [source.name for source in stated.values()]]
    can_be = find_candidates([(column.name, column.unit) for column in columns], FORCES, tuple(stated))
    ends = {name: columns[candidates[0].position] for name, candidates in can_be.items() if candidates}
    sure = {name for name, candidates in can_be.items() if len(candidates) == 1}
    provided = []
    unnamed = [quantity.name for quantity in FORCES if quantity.name not in stated]
    missing = [name for name in unnamed if name not in ends]
    remaining = _forces_among([column for column in columns if column not in ends.values()])
    if missing and len(remaining) == len(missing):
        remaining = remaining if in_order else sorted(remaining, key=lambda column: -column.mean)  # a pulled cable loses force
        ends |= dict(zip(missing, remaining, strict=True))
        provided += [f"{shown(ends[name].name)} is the {name}" for name in missing]
    elif missing:
        ends |= {name: HeadedColumn("NAME", "N") for name in missing}
        provided += [f"NAME is the {option.removeprefix('--')} of the {name}" for name in missing]
    elif len(sure) < len(unnamed):
        provided += [f"{shown(ends[name].name)} is the {name}" for name in ends if name not in sure]
    multiples = {name: multiple for name in unnamed if (multiple := multiple_of(split_brackets(ends[name].name)[1]))}
    for name, (factor, unit) in multiples.items():
        provided.append(f"the numbers under {shown(ends[name].name)} are multiplied by {factor} and headed ({unit})")
    options = []
    for name in [name for name in unnamed if name not in multiples]:
        unit = "" if _unit(ends[name]) else "N"
        if always or unit or name not in sure:
            options.append(option_naming(name, ends[name].name, unit, option))
    if any(not _unit(column) for name, column in ends.items() if name not in multiples):
        provided.append("the forces are in newtons, as the file does not state")
    return options, provided


def _forces_among(columns: Sequence[HeadedColumn]) -> list[HeadedColumn]:
    """Return the columns that can be forces: those in units of force, or else those without any unit."""
    measured = [column for column in columns if not (_SPREAD.search(column.name) or column.is_index)]
    of_force = [column for column in measured if (unit := _unit(column)) and is_unit(unit) and dimension_of(unit) == "force"]
    return of_force or [column for column in measured if not _unit(column)]


def _unit(column: HeadedColumn) -> str:
    other = parse_heading(column.name, column.unit)
    return (other.unit if other else "") or heading_of(column.name, column.unit).unit


@dataclass(frozen=True)
class FitCommand:
    """A command that fits one file, and what it takes for granted.

    Args:
        text: The command, as it can be pasted.
        provided: Assumptions of the command, each as a clause.
        names_more: Whether it names columns that the user has not.
    """

    text: str
    provided: tuple[str, ...] = ()
    names_more: bool = False


def make_table_command(
    path: Path, table: RawTable, kind: str, stated: Mapping[str, ColumnSource], always: bool = False
) -> FitCommand:
    """Make the command that fits a table.

    Args:
        path: Its file.
        table: Cells and headings of the file.
        kind: Name of the kind of measurement.
        stated: Columns that the user has named, by quantity.
        always: Whether columns are named that say themselves what they are.
    """
    headings = list(zip(table.header, table.units, strict=True))
    options, provided = list[str](), list[str]()
    if find_pivot_headings(table.header) and not stated:
        return _make_command(path, [], [])
    if kind == "forces":
        numbers, others = list_number_columns(table), _find_other_columns(headings)
        words, could_be = _find_columns_of_words(headings, numbers), [column for column in numbers if column.name not in others]
        in_order = bool(find_candidates(headings, BESIDE_FORCES)["stroke"])
        options, provided = name_force_columns(could_be, "--column", {**words, **stated}, always, in_order)
    angle, of_angle = ([], []) if WRAP_ANGLE.name in stated else _wrap_angle_options(table, path)
    command = _make_command(path, [*angle, *_column_options(stated, "--column"), *options], [*of_angle, *provided])
    named = [option for option in (*angle, *options) if option.startswith("--column")]
    return replace(command, names_more=bool(named) and not any(option.endswith("=NAME") for option in named))


def make_recording_command(
    path: Path,
    columns: Sequence[HeadedColumn],
    has_clock: bool,
    stated: Mapping[str, ColumnSource],
    always: bool = False,
    doubtful_clock: str = "",
    angle: tuple[str, str] | None = None,
) -> FitCommand:
    """Make the command that fits a recording.

    Args:
        path: Its file.
        columns: Its channels, without clocks.
        has_clock: Whether the file gives the time of its samples.
        stated: Channels that the user has named, by quantity.
        always: Whether channels are named that say themselves what they are.
        doubtful_clock: Name of a clock that says no unit and is unlikely to be in seconds; empty if there is none.
        angle: The wrap angle, and what says it; what the file states in a line or in its name if omitted.
    """
    options, provided = name_force_columns(columns, "--channel", stated, always, in_order=True)
    if not has_clock and "time" not in stated:
        options.append("--channel time=RATE")
        provided.append("RATE is its sampling rate, such as 1000Hz, which the file does not state")
    elif doubtful_clock and "time" not in stated:
        options.append(option_naming("time", doubtful_clock, "ms", "--channel"))
        provided.append(f"{shown(doubtful_clock)} is in milliseconds, as the file does not state")
    option, of_angle = _stated_angle_options(path, angle)
    return _make_command(path, [*option, *_column_options(stated, "--channel"), *options], [*of_angle, *provided])


def make_both_commands(path: Path, table: RawTable, guess: FileKind) -> list[FitCommand]:
    """Make the commands that fit a file as a table and as a recording, in this order."""
    kind = guess.kind if guess.other == "recordings" else guess.other
    clocks = [i for i, heading in enumerate(table.header) if names_time(heading)]
    numbers = [column for column in list_number_columns(table) if not column.is_index]
    channels = [HeadedColumn(*_split_heading(column.name, column.unit), column.mean) for column in numbers]
    return [make_table_command(path, table, kind, {}, True), make_recording_command(path, channels, bool(clocks), {}, True)]


def make_ambiguity_error(path: Path, table: RawTable, guess: FileKind) -> DatasetError:
    """Return the refusal of a file that could be a table or a recording."""
    of_table, of_recording = make_both_commands(path, table, guess)
    return DatasetError(
        f"{path.name} could be a table of readings or a recording: {guess.why}; say which, for a table by {of_table.text}, for "
        f"a recording by {of_recording.text}."
    )


def require_one_kind(path: Path, has_channels: bool, named: Sequence[str]) -> str:
    """Return the name of the kind of measurement that a file without a description holds.

    Raises:
        DatasetError: It could be of either of two; says the command for each.
    """
    guess = guess_file_kind(path, has_channels, named)
    if guess.other:
        raise make_ambiguity_error(path, read_table(path, HEAD), guess)
    return guess.kind


def require_recordings(paths: Sequence[Path], has_channels: bool, named: Sequence[str]) -> None:
    """Refuse files of two loggers that are no recordings.

    Raises:
        DatasetError: One is a table of readings; says how to join it.
    """
    if named:
        raise DatasetError(
            f"--column names columns of a table, and {paths[1].name} is joined to a recording, whose channels are named by "
            "--channel; put two tables of readings into one by hand, a row for each reading."
        )
    for path in paths:
        guess = guess_file_kind(path, has_channels)
        if guess.kind != "recordings":
            raise DatasetError(
                f"{path.name} is a table of readings and no recording, because {guess.why}; put both forces into one table by "
                "hand, a row for each reading with the force at both ends. Only recordings are joined by their clocks."
            )


def has_own_angles(path: Path, kind: str, named: Sequence[str], stated: bool) -> bool:
    """Return whether the rows of a file have wrap angles of their own.

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
    columns = find_candidates(list(zip(table.header, table.units, strict=True)), (WRAP_ANGLE,))[WRAP_ANGLE.name]
    if not columns and WRAP_ANGLE.name not in named:
        if stated:
            _refuse_passed_over(path, table)
        return False
    if stated:
        what = (
            f"has a column of wrap angles, {shown(table.header[columns[0].position])}" if columns else "is to have one"
        )
        raise DatasetError(
            f"{path.name} {what}, and --wrap-angle states one angle for all rows; leave one of the two out."
        )
    return True


def _refuse_passed_over(path: Path, table: RawTable) -> None:
    """Refuse one angle for all rows of a table in which a column is likely to hold their wrap angles.

    Raises:
        DatasetError: There is such a column.
    """
    for name, unit in likely_wrap_angles(table).items():
        if unit is None:
            raise DatasetError(
                f"{path.name} has a column {shown(name)}, which is likely to count the bends of each row, and --wrap-angle "
                "states one angle for all rows. Write the wrap angle into a column of its own, headed wrap_angle_deg: the "
                f"number in {shown(name)} times the angle of one bend. If it counts something else, take it out of the file."
            )
        raise DatasetError(
            f"{path.name} has a column {shown(name)}, which is likely to hold the wrap angle of each row, and --wrap-angle "
            f"states one angle for all rows. Name it instead: {option_naming('wrap_angle', name, unit)}; if it is another "
            "angle, take the column out of the file."
        )


def _find_columns_of_words(headings: Sequence[tuple[str, str]], numbers: Sequence[HeadedColumn]) -> dict[str, ColumnSource]:
    """Find forces whose columns hold no numbers, so that no other column is taken for them."""
    known = {column.name for column in numbers}
    names_of = {
        name: [headings[column.position][0] for column in columns]
        for name, columns in find_candidates(headings, FORCES).items()
    }
    return {
        name: ColumnSource(name=named[0]) for name, named in names_of.items() if named and not known.intersection(named)
    }


def _find_other_columns(headings: Sequence[tuple[str, str]]) -> set[str]:
    """Find columns whose headings say that they are not forces, such as the label of a run."""
    candidates = find_candidates(headings, BESIDE_FORCES)
    return {headings[columns[0].position][0] for columns in candidates.values() if len(columns) == 1}


def _split_heading(heading: str, unit: str) -> tuple[str, str]:
    """Return name and unit as a recording has them."""
    both = heading_of(heading, unit)
    return both.name, both.unit


def _wrap_angle_options(table: RawTable, path: Path) -> tuple[list[str], list[str]]:
    """Return options that give the wrap angle of a table, and what they assume."""
    if find_candidates(list(zip(table.header, table.units, strict=True)), (WRAP_ANGLE,))["wrap_angle"]:
        return [], []
    likely = likely_wrap_angles(table)
    if not likely:
        return _stated_angle_options(path)
    best = next((name for name in likely if "measured" in name.lower()), next(iter(likely)))
    remaining = [shown(name) for name in likely if name != best]
    rather = f" rather than {listed(remaining)}, and not one of several bends, whose angles add up" if remaining else ""
    unit, clause = likely[best], f"{shown(best)} is the wrap angle{rather}"
    if unit is None:
        return [], [f"the table has a column wrap_angle_deg, the number of bends in {shown(best)} times the angle of one"]
    return [option_naming("wrap_angle", best, unit)], [clause + (f", in {unit}" if unit else "")]


def likely_wrap_angles(table: RawTable) -> dict[str, str | None]:
    """Return columns of numbers that are likely wrap angles, with the unit to state; empty where the heading has it.

    A column without a unit is taken to be in rad where its values are none of degrees: whole turns at most, not all whole.
    Small whole numbers count bends, and have None. With the same number in every row it may be a count or a label.
    """
    likely = dict[str, str | None]()
    units = dict(zip(table.header, table.units, strict=True))
    for column in list_number_columns(table):
        spelling = likely_wrap_angle(column.name, units[column.name])
        if spelling is not None and (column.high > column.low or (spelling.unit and column.high > 0)):
            unwritten = likely_angle_unit(column.name, column.high, column.are_whole) or None
            likely[column.name] = "" if spelling.unit else unwritten
    return likely


def _column_options(stated: Mapping[str, ColumnSource], option: str) -> list[str]:
    return [option_naming(quantity, source.name, source.unit or "", option) for quantity, source in stated.items()]


def _stated_angle_options(path: Path, measured: tuple[str, str] | None = None) -> tuple[list[str], list[str]]:
    """Return the option for one wrap angle, as a channel or the file states it or as an example, and what it assumes."""
    stated = measured or find_stated_angle(path)
    if stated is None:
        return ["--wrap-angle 180deg"], ["180 deg is the wrap angle of the bench"]
    angle, where = stated
    return [f"--wrap-angle {angle}"], [f"{angle} is the wrap angle, as {where} says"]


def _make_command(path: Path, options: Sequence[str], provided: Sequence[str]) -> FitCommand:
    return FitCommand(" ".join(["bowdenfit fit", shlex.quote(str(path)), *options]), tuple(provided))
