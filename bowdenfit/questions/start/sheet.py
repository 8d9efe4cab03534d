"""A measured file without a description: its columns, and the quantities they are assigned to."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.files import read_channels
from bowdenfit.files.clocks import is_clock, names_time
from bowdenfit.files.headings import heading_of, split_brackets
from bowdenfit.files.matching import Quantity, find_candidates, plain_name
from bowdenfit.files.spellings import parse_heading
from bowdenfit.files.tables import read_table
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.file_kind import FORCES, FileKind, file_kind
from bowdenfit.kinds.fit_command import columns_of
from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.table_files import WantedColumn
from bowdenfit.units import ColumnSource, dimension_of, is_unit
from bowdenfit.words import shown


@dataclass(frozen=True)
class FileColumn:
    """A column, or a channel of a recording.

    Args:
        name: Its heading.
        below: The unit that stands elsewhere than in the heading; empty without one.
        unit: Its unit; empty where the file does not say it.
        numbers: Whether it holds numbers.
        low, high: Of these.
        values: How many different things stand in it.
        blanks: How many of its cells are blank.
    """

    name: str
    below: str
    unit: str
    numbers: bool
    low: float = 0.0
    high: float = 0.0
    values: int = 0
    blanks: int = 0

    @property
    def dimension(self) -> str:
        """What its unit measures; empty without one."""
        return dimension_of(self.unit) if self.unit else ""

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
        """How a description names it."""
        return ColumnSource(name=self.name, unit=self.unit or None)


@dataclass
class MeasuredFile:
    """A file, and what is known of it so far.

    Args:
        path: Where it is.
        columns: Its columns or channels, without those of time.
        kind: The kind of measurement that it holds; None where it does not say.
        why: Why it is taken for that, as a clause.
        likely: The kind that it may be where it does not say.
        sources: Columns that the description must name, by quantity.
        assigned: Headings of the columns that are known.
        settings: What else stands beside the file in the description.
        has_clock: Whether a recording says when its samples were taken.
    """

    path: Path
    columns: tuple[FileColumn, ...]
    kind: Kind[Any] | None
    why: str
    likely: Kind[Any] | None = None
    sources: dict[str, ColumnSource] = field(default_factory=dict)
    assigned: dict[str, str] = field(default_factory=dict)
    settings: dict[str, object] = field(default_factory=dict)
    has_clock: bool = True

    @property
    def file(self) -> str:
        """Its name."""
        return self.path.name

    @property
    def unknown_columns(self) -> list[FileColumn]:
        """Columns that are not assigned yet."""
        return [each for each in self.columns if each.name not in self.assigned.values()]

    def columns_for(self, quantity: Quantity) -> list[FileColumn]:
        """Return the columns whose headings name a quantity; the heading of one end may identify the other."""
        headings = [(each.name, each.below) for each in self.columns]
        wanted = FORCES if quantity in FORCES else (quantity,)
        matches = [
            (self.columns[each.position], each.unit or "") for each in find_candidates(headings, wanted)[quantity.name]
        ]
        return [column if column.unit else self.set_unit(column, unit) for column, unit in matches]

    def assign(self, quantity: Quantity, column: FileColumn) -> None:
        """Assign a column to a quantity; the description names it where its heading does not say all of it."""
        self.assigned[quantity.name] = column.name
        in_heading = [each.name for each in self.columns_for(quantity)] == [column.name]
        may_have_none = quantity.dimension == "text" or (quantity.dimension == "ratio" and not column.unit)
        if not in_heading or not (may_have_none or self._says_unit(quantity, column)):
            self.sources[quantity.name] = column.source

    def _says_unit(self, quantity: Quantity, column: FileColumn) -> bool:
        """Whether its unit stands where readers of tables find it."""
        wanted = FORCES if quantity in FORCES else (quantity,)
        (match,) = find_candidates([(column.name, column.below)], wanted)[quantity.name] or (None,)
        return match is not None and match.unit == column.unit and bool(column.unit)

    def set_unit(self, column: FileColumn, unit: str) -> FileColumn:
        """A column whose unit is known."""
        known = replace(column, unit=unit)
        self.columns = tuple(known if each.name == column.name else each for each in self.columns)
        return known


def inspect_file(path: Path) -> MeasuredFile:
    """Inspect a file: its kind and columns.

    Args:
        path: The file.

    Raises:
        DatasetError: It cannot be read.
    """
    detected = file_kind(path)
    if not detected.other and KINDS[detected.kind].takes_channels:
        return inspect_recording(path, detected.why)
    return _inspect_table(path, detected)


def inspect_recording(path: Path, why: str) -> MeasuredFile:
    """Inspect a recording: its channels.

    Raises:
        DatasetError: It cannot be read.
    """
    file = read_channels(path)
    signals = [channel for channel in file.channels if not is_clock(channel)]
    columns = tuple(
        FileColumn(
            channel.name,
            channel.unit,
            channel.unit or heading_of(channel.name).unit,
            True,
            *_range(channel.values),
            len(channel.values),
        )
        for channel in signals
    )
    kind = next(kind for kind in KINDS.values() if kind.takes_channels)
    return MeasuredFile(path, columns, kind, why, has_clock=any(channel.time is not None for channel in signals))


def _range(values: np.ndarray) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)


def _inspect_table(path: Path, detected: FileKind) -> MeasuredFile:
    table = read_table(path)
    number_columns = {each.name: each for each in columns_of(table)}
    columns = []
    for i, (heading, below) in enumerate(zip(table.header, table.units, strict=True)):
        if not heading or (names_time(heading) and not parse_heading(heading, below)):
            continue
        cells = [row[i] for row in table.rows]
        numbers, other = number_columns.get(heading), parse_heading(heading, below)
        unit = (other.unit if other else "") or heading_of(heading, below).unit
        spread = (numbers.low, numbers.high) if numbers else (0.0, 0.0)
        different, blanks = len({cell.text.strip() for cell in cells}), sum(cell.blank for cell in cells)
        unit = unit if unit and is_unit(unit) else ""
        columns.append(FileColumn(heading, below, unit, numbers is not None, *spread, different, blanks))
    sheet = MeasuredFile(path, tuple(columns), None, detected.why)
    fitting = _fitting_kinds(sheet)
    matching = [kind for kind in fitting if kind.name == detected.kind] or fitting
    sheet.kind = matching[0] if len(matching) == 1 and not detected.other else None
    sheet.likely = matching[0] if matching else _likely_kind(sheet)
    return sheet


def _fitting_kinds(sheet: MeasuredFile) -> list[Kind[Any]]:
    """The kinds whose columns a table has by its headings; of these those with most columns."""
    fits: dict[int, list[Kind[Any]]] = {}
    for kind in KINDS.values():
        questions = kind.init_questions
        if questions is None or not questions.is_guessed:
            continue
        if questions.by_length:
            if (
                _columns_of_dimension(sheet, "angle")
                and _columns_of_dimension(sheet, "length")
                and not _columns_of_dimension(sheet, "force")
                and not _columns_of_dimension(sheet, "ratio")
            ):
                fits.setdefault(1, []).append(kind)
            continue
        if _has_columns(sheet, questions.required):
            fits.setdefault(len(questions.required), []).append(kind)
    return fits[max(fits)] if fits else []


def _has_columns(sheet: MeasuredFile, wanted: Sequence[WantedColumn]) -> bool:
    """Whether headings say all that is wanted."""
    ways = [(each.quantity, *each.also) for each in wanted]
    return bool(wanted) and all(any(len(sheet.columns_for(one)) == 1 for one in way) for way in ways)


def _columns_of_dimension(sheet: MeasuredFile, dimension: str) -> list[FileColumn]:
    return [each for each in sheet.columns if each.dimension == dimension]


def _likely_kind(sheet: MeasuredFile) -> Kind[Any] | None:
    """The kind whose required columns there may be, by their units alone, the most of them."""
    dimensions = [each.dimension for each in sheet.columns]
    best: Mapping[int, Kind[Any]] = {}
    for kind in KINDS.values():
        questions = kind.init_questions
        if questions is not None and questions.is_guessed and questions.required:
            needed = [each.quantity.dimension for each in questions.required]
            if all(dimensions.count(each) >= needed.count(each) for each in needed):
                best = {len(needed): kind, **best}
    return best[max(best)] if best else None
