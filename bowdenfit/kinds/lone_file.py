"""What is understood of a file without a description: its kind, its columns with their numbers, and what it states.

`understand` is the one place that looks at such a file: `check` shows the result, `fit` reads by it (`kinds/fit_command.py`
makes the command), and `init` and the app ask for what it leaves open.
"""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files import read_channels
from bowdenfit.files.channels import Channel, ChannelFile
from bowdenfit.files.clocks import is_clock, names_time
from bowdenfit.files.headings import Quantity, find_candidates, heading_of, option_naming, plain_name, split_brackets
from bowdenfit.files.layout import is_index
from bowdenfit.files.merged_cells import is_merged
from bowdenfit.files.missing_codes import MissingCodes
from bowdenfit.files.spellings import likely_angle_unit, likely_wrap_angle, names_length, parse_heading
from bowdenfit.files.tables import RawTable, list_sheets, read_table
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.file_kind import FORCES, HEAD, FileKind, guess_file_kind, is_angle_table, read_numbers
from bowdenfit.recordings.angle_channels import AngleChannel, find_angle_channels
from bowdenfit.recordings.channel_clocks import clock_in_doubt
from bowdenfit.recordings.named_channels import WANTED, find_channel
from bowdenfit.types import Vector
from bowdenfit.units import ColumnSource, dimension_of, is_unit
from bowdenfit.words import quoted, shown

WRAP_ANGLE, _EFFICIENCY = Quantity("wrap_angle", "angle"), Quantity("efficiency", "ratio")
_FEW = 20  # rows up to which 1, 2, 3 may be loads as well as an index; a judgement


@dataclass(frozen=True, eq=False)
class FileColumn:
    """A column of a table, or a channel of a recording.

    Args:
        name: Its heading.
        below: Unit that the file gives elsewhere than in the heading; empty without one.
        unit: Its unit; empty where the file states none that is known.
        values: Its numbers as written, one per row; NaN where there is none.
        numbers: Whether it holds numbers; a clock of a table does not count.
        is_clock: Whether it says when the others were read.
        different: Number of different values in it.
        blanks: Number of blank cells.
        first, last: Text of its first and of its last row.
    """

    name: str
    below: str
    unit: str
    values: Vector
    numbers: bool
    is_clock: bool
    different: int = 0
    blanks: int = 0
    first: str = ""
    last: str = ""

    @cached_property
    def finite(self) -> Vector:
        """Its finite values."""
        return self.values[np.isfinite(self.values)]

    @property
    def low(self) -> float:
        """Lowest of its numbers; 0 where it holds none."""
        return float(self.finite.min()) if self.numbers and len(self.finite) else 0.0

    @property
    def high(self) -> float:
        """Highest of its numbers; 0 where it holds none."""
        return float(self.finite.max()) if self.numbers and len(self.finite) else 0.0

    @property
    def mean(self) -> float:
        """Mean of its numbers; 0 where it holds none."""
        return float(self.finite.mean()) if len(self.finite) else 0.0

    @property
    def are_whole(self) -> bool:
        """Whether its numbers are whole."""
        return bool(np.all(self.finite == np.round(self.finite)))

    @property
    def is_index(self) -> bool:
        """Whether it only counts the rows."""
        return len(self.finite) > _FEW and is_index(self.finite)

    @property
    def written_unit(self) -> str:
        """The unit as the file has it, whether it is known or not; empty without one."""
        return _find_unit(self.name, self.below)

    @property
    def dimension(self) -> str:
        """What its unit measures, with a minus for the other sign or without; empty without one."""
        return dimension_of(self.unit.removeprefix("-")) if self.unit else ""

    @property
    def words(self) -> str:
        """Its heading and what it holds."""
        unit = f" {self.unit}" if self.unit else ", no unit"
        holds = f"{self.low:.5g} to {self.high:.5g}{unit}" if self.numbers else "words"
        return f"{shown(self.name)} ({holds})"

    @property
    def plain_name(self) -> str:
        """Its name as tables have it, without its unit: "Sheath angle (deg)" is sheath_angle."""
        name = split_brackets(self.name)[0]
        name = re.sub(rf"[\s_]+{re.escape(self.unit)}$", "", name) if self.unit else name
        return plain_name(name) or plain_name(self.name) or "column"

    @property
    def source(self) -> ColumnSource:
        """The column as a description names it."""
        return ColumnSource(name=self.name, unit=self.unit or None)


@dataclass(frozen=True)
class LoneFile:
    """A file without a description, as it is understood.

    Args:
        path: Where it is.
        kind: The kind of measurement that it holds, and why.
        columns: Its columns or channels, without those that have no heading.
        named: Columns or channels that the user names, by quantity.
        table: Its rows; None for a recording.
        recording: Its channels; None for a table.
        angle: The channel that says at which wrap angle it was recorded; None without one.
        sheet: Title of its sheet where it is one of a workbook; empty where nobody chose one.
    """

    path: Path
    kind: FileKind
    columns: tuple[FileColumn, ...] = ()
    named: Mapping[str, ColumnSource] = field(default_factory=dict)
    table: RawTable | None = None
    recording: ChannelFile | None = None
    angle: AngleChannel | None = None
    sheet: str = ""

    @property
    def name(self) -> str:
        """Its name, with that of its sheet."""
        return f"{self.path.name}, sheet {shown(self.sheet)}" if self.sheet else self.path.name

    @property
    def signals(self) -> tuple[FileColumn, ...]:
        """Its columns but for clocks."""
        return tuple(column for column in self.columns if not column.is_clock)

    @property
    def numbers(self) -> tuple[FileColumn, ...]:
        """Its columns of numbers but for clocks."""
        return tuple(column for column in self.columns if column.numbers and not column.is_clock)

    @property
    def has_clock(self) -> bool:
        """Whether it says when its rows were read."""
        if self.recording is None:
            return any(names_time(column.name) for column in self.columns)
        return any(channel.time is not None for channel in self.recording.channels if not is_clock(channel))

    @property
    def doubtful_clock(self) -> str:
        """Name of a clock that states no unit and is unlikely to be in seconds; empty without one."""
        channels = self.recording.channels if self.recording else ()
        doubtful = [clock_in_doubt(self.recording, channel) for channel in channels if self.recording and not is_clock(channel)]
        return next((clock.name for clock in doubtful if clock), "")

    @property
    def headings(self) -> list[tuple[str, str]]:
        """The headings of a table with the units that the file gives elsewhere; empty for a recording."""
        return list(zip(self.table.header, self.table.units, strict=True)) if self.table else []

    @property
    def stated_headings(self) -> dict[str, str]:
        """Quantities of the columns that the user names, by heading."""
        return {source.name: quantity.rpartition(".")[2] for quantity, source in self.named.items()}

    @property
    def likely_wrap_angles(self) -> dict[str, str | None]:
        """Columns of numbers that are likely wrap angles, with the unit to state; empty where the heading has it.

        A column without a unit is taken to be in rad where its values are none of degrees: whole turns at most, not all whole.
        Small whole numbers count bends, and have None. With the same number in every row it may be a count or a label.
        """
        likely = dict[str, str | None]()
        for column in self.numbers:
            spelling = likely_wrap_angle(column.name, column.below)
            if spelling is not None and (column.high > column.low or (spelling.unit and column.high > 0)):
                unwritten = likely_angle_unit(column.name, column.high, column.are_whole) or None
                likely[column.name] = "" if spelling.unit else unwritten
        return likely

    @property
    def is_angles(self) -> bool:
        """Whether it holds nothing but wrap angles by length."""
        return self.table is not None and is_angle_table(self.table)

    @property
    def is_bench(self) -> bool:
        """Whether it can be fitted alone by its headings: a recording, both forces of a cable, or its efficiency."""
        columns = find_candidates(self.headings, (*FORCES, _EFFICIENCY))
        return bool(self.recording or columns["efficiency"] or (columns["input_force"] and columns["output_force"]))

    @property
    def lengths(self) -> int:
        """At how many lengths its rows were read; 0 where a table has no such column or says its wrap angles itself."""
        if self.table is None or self.wrap_angle_heading or WRAP_ANGLE.name in self.named or self.likely_wrap_angles:
            return 0
        columns = [column for column in self.numbers if column.dimension == "length" and names_length(column.name)]
        counts = [len(np.unique(column.finite)) for column in columns]
        return counts[0] if len(counts) == 1 and counts[0] > 1 else 0

    @property
    def wrap_angle_heading(self) -> str:
        """Heading of the column that states the wrap angle of each row; empty without one."""
        columns = find_candidates(self.headings, (WRAP_ANGLE,))[WRAP_ANGLE.name]
        return self.headings[columns[0].position][0] if columns else ""

    def has_own_angles(self, is_stated: bool) -> bool:
        """Return whether its rows have wrap angles of their own.

        Args:
            is_stated: Whether the user states one angle for all rows.

        Raises:
            DatasetError: They have, although one is stated.
        """
        if self.table is None:
            return False
        heading = self.wrap_angle_heading
        if not heading and WRAP_ANGLE.name not in self.named:
            if is_stated:
                self._refuse_passed_over()
            return False
        if is_stated:
            fault = f"has a column of wrap angles, {shown(heading)}" if heading else "is to have one"
            raise DatasetError(
                f"{self.path.name} {fault}, and --wrap-angle states one angle for all rows; leave one of the two out."
            )
        return True

    def _refuse_passed_over(self) -> None:
        """Refuse one angle for all rows of a table in which a column is likely to hold their wrap angles.

        Raises:
            DatasetError: There is such a column.
        """
        for name, unit in self.likely_wrap_angles.items():
            if unit is None:
                raise DatasetError(
                    f"{self.path.name} has a column {shown(name)}, which is likely to count the bends of each row, and "
                    "--wrap-angle states one angle for all rows. Write the wrap angle into a column of its own, headed "
                    f"wrap_angle_deg: the number in {shown(name)} times the angle of one bend. If it counts something else, "
                    "take it out of the file."
                )
            raise DatasetError(
                f"{self.path.name} has a column {shown(name)}, which is likely to hold the wrap angle of each row, and "
                f"--wrap-angle states one angle for all rows. Name it instead: {option_naming('wrap_angle', name, unit)}; if "
                "it is another angle, take the column out of the file."
            )


def understand(
    path: Path,
    channels: Mapping[str, ColumnSource] | None = None,
    columns: Mapping[str, ColumnSource] | None = None,
    missing: Sequence[float | str] = (),
    is_whole: bool = True,
    sheet: str = "",
) -> LoneFile:
    """Return what is understood of a file without a description.

    Args:
        path: The file.
        channels: Channels of a recording that the user names, by quantity.
        columns: Columns of a table, likewise.
        missing: Missing-value codes.
        is_whole: Whether all of it is read; else the first rows of a table, and of a recording its kind alone.
        sheet: Title of a sheet of a workbook; that with the readings if empty.

    Raises:
        DatasetError: It cannot be read.
    """
    kind = guess_file_kind(path, bool(channels), tuple(columns or ()), sheet)
    if KINDS[kind.kind].takes_channels and not kind.other:
        if is_whole:
            return understand_recording(path, kind.why, channels, missing, sheet)
        return LoneFile(path, kind, named=channels or {}, sheet=sheet)
    table = MissingCodes(tuple(missing)).mark(read_table(path, None if is_whole else HEAD, sheet))
    return LoneFile(path, kind, _columns_of_table(table), columns or {}, table, sheet=sheet)


def understand_sheets(path: Path) -> tuple[dict[str, LoneFile], dict[str, str]]:
    """Return what is understood of every sheet of a workbook, and why the others cannot be used, by their titles.

    Of another file, or of a workbook with one sheet, both are empty.

    Raises:
        DatasetError: It is no workbook that can be read.
    """
    files, reasons = dict[str, LoneFile](), dict[str, str]()
    titles = list_sheets(path)
    for title in titles if len(titles) > 1 else ():
        try:
            file = understand(path, sheet=title)
        except DatasetError as error:
            reasons[title] = str(error)
            continue
        if file.numbers:
            files[title] = file
        else:
            reasons[title] = "It has no columns of numbers."
    return files, reasons


def refuse_several_sheets(path: Path) -> None:
    """Refuse a workbook of which several sheets can be fitted, each by itself.

    Raises:
        DatasetError: It is one, or cannot be read.
    """
    benches = [title for title, file in understand_sheets(path)[0].items() if file.is_bench]
    if len(benches) > 1:
        raise DatasetError(
            f"{path.name} has several sheets that can be fitted, {quoted(tuple(benches))}; state which, such as --sheet "
            f"{shown(benches[0])}, or fit them together: bowdenfit init my-cable --from {path.name}."
        )


def understand_recording(
    path: Path,
    why: str,
    channels: Mapping[str, ColumnSource] | None = None,
    missing: Sequence[float | str] = (),
    sheet: str = "",
) -> LoneFile:
    """Return what is understood of a file that is a recording, for the reason given as a clause.

    Raises:
        DatasetError: It cannot be read.
    """
    file, notes = MissingCodes(tuple(missing)).blank_samples(read_channels(path, sheet))
    file, angle, sources = replace(file, remarks=(*file.remarks, *notes)), None, channels or {}
    with suppress(DatasetError):
        force = find_channel(file, WANTED[0], sources)
        angle = next(iter(find_angle_channels(file, sources, np.zeros(0) if force is None else force.values)), None)
    kind = next(kind.name for kind in KINDS.values() if kind.takes_channels)
    clocks = {channel.clock for channel in file.channels}
    columns = tuple(_column_of_channel(channel, channel.name in clocks) for channel in file.channels)
    return LoneFile(path, FileKind(kind, why), columns, sources, None, file, angle, sheet)


def _columns_of_table(table: RawTable) -> tuple[FileColumn, ...]:
    """Return the columns of a table that have a heading."""
    columns = []
    for i, (heading, below) in enumerate(zip(table.header, table.units, strict=True)):
        if not heading:
            continue
        cells, values = [row[i] for row in table.rows], np.array(read_numbers(table, i))
        is_time, unit = names_time(heading) and not parse_heading(heading, below), _find_unit(heading, below)
        is_merged_angle = likely_wrap_angle(heading, below) is not None and is_merged(cells)
        least = sum(not cell.blank for cell in cells) if is_merged_angle else len(cells)
        are_numbers = not is_time and 2 * np.count_nonzero(np.isfinite(values)) > least
        ends = [" ".join(cell.text.split()) for cell in (cells[0], cells[-1])] if cells else ["", ""]
        different, blanks = len({cell.text.strip() for cell in cells}), sum(cell.blank for cell in cells)
        valid_unit = unit if unit and is_unit(unit) else ""
        columns.append(FileColumn(heading, below, valid_unit, values, bool(are_numbers), is_time, different, blanks, *ends))
    return tuple(columns)


def _find_unit(heading: str, below: str) -> str:
    """Return the unit of a column as the file has it; empty without one."""
    other = parse_heading(heading, below)
    return (other.unit if other else "") or heading_of(heading, below).unit


def _column_of_channel(channel: Channel, times_others: bool) -> FileColumn:
    """Return a channel as a column; one that gives others their times is a clock, whatever group stands before its name."""
    unit = channel.unit or heading_of(channel.name).unit
    ends = ["".join(f"{value:.5g}" for value in part) for part in (channel.values[:1], channel.values[-1:])]
    different, is_time = len(channel.values), times_others or is_clock(channel)
    valid_unit = unit if unit and is_unit(unit) else ""
    return FileColumn(channel.name, channel.unit, valid_unit, channel.values, True, is_time, different, 0, *ends)
