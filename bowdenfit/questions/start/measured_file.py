"""A measured file without a description: its columns, its kind, and the quantities that its columns are assigned to.

Headings and units say most of that; `name_columns` asks for the rest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from bowdenfit.errors import DatasetError
from bowdenfit.files.headings import Quantity, find_candidates
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.file_kind import FORCES, columns_of_kind
from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.lone_file import FileColumn, LoneFile, understand, understand_recording, understand_sheets
from bowdenfit.kinds.table_files import WantedColumn
from bowdenfit.questions.start.question import Asker, choice_question, number_question, unit_question, yes_no_question
from bowdenfit.units import ColumnSource
from bowdenfit.words import quoted, shown

_MAX_LABEL_SHARE = (
    0.8  # most labels per row of a column of runs or strokes; a judgement: most labels stand in several rows
)


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
        settings: Other settings of the file in the description.
        has_clock: Whether a recording says when its samples were taken.
        sheet: Title of its sheet where the workbook has several; else empty.
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
    sheet: str = ""

    @property
    def name(self) -> str:
        """Its name, with that of its sheet."""
        return f"{self.path.name}, sheet {shown(self.sheet)}" if self.sheet else self.path.name

    @property
    def holds(self) -> str:
        """Its contents in words; empty where its kind is open."""
        return self.kind.init_questions.holds if self.kind and self.kind.init_questions else ""

    @property
    def meanings(self) -> dict[str, str]:
        """Quantities that its columns may be, with their words."""
        wanted = self.kind.init_questions.columns if self.kind and self.kind.init_questions else ()
        words = {quantity.name: column.words for column in wanted for quantity in (column.quantity, *column.also)}
        has_table = self.kind is not None and not self.kind.takes_channels
        more = [quantity.name for quantity in columns_of_kind(self.kind.name)] if self.kind and has_table else []
        return words | {name: "" for name in (*more, *self.assigned) if name not in words}

    def meaning_of(self, column: FileColumn) -> str:
        """Return the quantity that a column is read as; empty where it is not used."""
        return next((quantity for quantity, heading in self.assigned.items() if heading == column.name), "")

    @property
    def unknown_columns(self) -> list[FileColumn]:
        """Columns that are not assigned yet."""
        return [column for column in self.columns if column.name not in self.assigned.values()]

    def columns_for(self, quantity: Quantity) -> list[FileColumn]:
        """Return the columns whose headings name a quantity; the heading of one end may identify the other."""
        headings = [(column.name, column.below) for column in self.columns]
        wanted = FORCES if quantity in FORCES else (quantity,)
        matches = [
            (self.columns[match.position], match.unit or "")
            for match in find_candidates(headings, wanted)[quantity.name]
        ]
        return [column if column.unit else self.set_unit(column, unit) for column, unit in matches]

    def assign(self, quantity: Quantity, column: FileColumn) -> None:
        """Assign a column to a quantity; the description names it where its heading does not say all of it."""
        self.assigned[quantity.name] = column.name
        in_heading = [column.name for column in self.columns_for(quantity)] == [column.name]
        may_have_none = quantity.dimension == "text" or (quantity.dimension == "ratio" and not column.unit)
        if not in_heading or not (may_have_none or self._says_unit(quantity, column)):
            self.sources[quantity.name] = column.source

    def _says_unit(self, quantity: Quantity, column: FileColumn) -> bool:
        """Return whether its unit stands where readers of tables find it."""
        wanted = FORCES if quantity in FORCES else (quantity,)
        headings = [(other.name, other.below) for other in self.columns]  # some say what they are only next to others
        matches = find_candidates(headings, wanted)[quantity.name]
        is_alone = [headings[match.position][0] for match in matches] == [column.name]
        return is_alone and matches[0].unit == column.unit and bool(column.unit)

    def state(self, heading: str, quantity: str, unit: str) -> None:
        """Take what somebody states of a column, in place of what its heading says.

        Args:
            heading: Its heading; a heading that the file has not is passed over.
            quantity: Quantity in the column; empty where only its unit is stated.
            unit: Its unit; empty where the heading says it.
        """
        for column in [column for column in self.columns if column.name == heading]:
            known = self.set_unit(column, unit) if unit else column
            if quantity:
                self.assigned[quantity], self.sources[quantity] = heading, known.source

    def set_unit(self, column: FileColumn, unit: str) -> FileColumn:
        """Set the unit of a column, and return the column with it."""
        known = replace(column, unit=unit)
        self.columns = tuple(known if other.name == column.name else other for other in self.columns)
        return known


def inspect_file(path: Path) -> tuple[list[MeasuredFile], list[str]]:
    """Inspect a file, or each sheet of a workbook: its columns, and the kind that their headings and units say.

    Returns:
        The file, or the sheets that hold measurements; and why other sheets are left out, in sentences.

    Raises:
        DatasetError: It cannot be read.
    """
    sheets, reasons = understand_sheets(path)
    if not sheets:
        return [_open_file(understand(path))], []
    files = [_open_file(sheet) for sheet in sheets.values()]
    measured = [file for file in files if file.kind is not None] or files
    left_out = [f"Sheet {shown(title)} of {path.name} is left out. {reason}" for title, reason in reasons.items()]
    left_out += [f"{file.name}, is left out. Its headings do not say what it holds." for file in files if file not in measured]
    return measured, left_out


def _open_file(lone: LoneFile) -> MeasuredFile:
    """Return a file of which nothing is assigned yet."""
    if lone.recording is not None:
        return _open_recording(lone)
    file = MeasuredFile(lone.path, lone.signals, None, lone.kind.why, sheet=lone.sheet)
    fitting = _fitting_kinds(file)
    matching = [kind for kind in fitting if kind.name == lone.kind.kind] or fitting
    file.kind = matching[0] if len(matching) == 1 and not lone.kind.other else None
    file.likely = matching[0] if matching else _likely_kind(file)
    return file


def inspect_recording(path: Path, why: str, sheet: str = "") -> MeasuredFile:
    """Inspect a recording: its channels.

    Raises:
        DatasetError: It cannot be read.
    """
    return _open_recording(understand_recording(path, why, sheet=sheet))


def _open_recording(lone: LoneFile) -> MeasuredFile:
    """Return a recording of which nothing is assigned yet."""
    kind = KINDS[lone.kind.kind]
    return MeasuredFile(lone.path, lone.signals, kind, lone.kind.why, has_clock=lone.has_clock, sheet=lone.sheet)


def _fitting_kinds(file: MeasuredFile) -> list[Kind[Any]]:
    """Return the kinds whose columns a table has by its headings; of these those with most columns."""
    fits: dict[int, list[Kind[Any]]] = {}
    for kind in KINDS.values():
        questions = kind.init_questions
        if questions is None or not questions.is_guessed:
            continue
        if questions.by_length:
            if (
                _columns_of_dimension(file, "angle")
                and _columns_of_dimension(file, "length")
                and not _columns_of_dimension(file, "force")
                and not _columns_of_dimension(file, "ratio")
            ):
                fits.setdefault(1, []).append(kind)
            continue
        if _has_columns(file, questions.required):
            fits.setdefault(len(questions.required), []).append(kind)
    return fits[max(fits)] if fits else []


def _has_columns(file: MeasuredFile, wanted: Sequence[WantedColumn]) -> bool:
    """Return whether headings identify every wanted column."""
    ways = [(column.quantity, *column.also) for column in wanted]
    return bool(wanted) and all(any(len(file.columns_for(one)) == 1 for one in way) for way in ways)


def _columns_of_dimension(file: MeasuredFile, dimension: str) -> list[FileColumn]:
    """Return the columns whose unit measures a dimension."""
    return [column for column in file.columns if column.dimension == dimension]


def _likely_kind(file: MeasuredFile) -> Kind[Any] | None:
    """Return the kind with most required columns that the units alone allow; None without any."""
    dimensions = [column.dimension for column in file.columns]
    best: Mapping[int, Kind[Any]] = {}
    for kind in KINDS.values():
        questions = kind.init_questions
        if questions is not None and questions.is_guessed and questions.required:
            needed = [column.quantity.dimension for column in questions.required]
            if all(dimensions.count(dimension) >= needed.count(dimension) for dimension in needed):
                best = {len(needed): kind, **best}
    return best[max(best)] if best else None


def name_columns(file: MeasuredFile, asker: Asker) -> None:
    """Name the columns that a file of its kind needs, and those that it may have.

    Args:
        file: The file; its columns are assigned to quantities.
        asker: Whom to ask.

    Raises:
        DatasetError: It has no column that could be one of those needed.
    """
    assert file.kind is not None and file.kind.init_questions is not None  # only files whose kind is known come here
    for wanted in file.kind.init_questions.columns:
        if {one.name for one in (wanted.quantity, *wanted.also)}.intersection(file.assigned):
            continue  # it was stated
        quantity = next((one for one in (wanted.quantity, *wanted.also) if file.columns_for(one)), wanted.quantity)
        options = file.columns_for(quantity)
        if len(options) == 1:
            column = options[0]
        elif wanted.optional:
            optional = _ask_optional_column(file, wanted, asker)
            if optional is None:
                continue
            column = optional
        else:
            column = _ask_required_column(file, wanted, options, asker)
        assign_column(file, quantity, column, asker)
    for question in file.kind.init_questions.yes_no:
        if question.unless not in file.assigned and asker.ask(yes_no_question(question.words.format(file.name), False)):
            file.settings[question.key] = question.value


def assign_column(file: MeasuredFile, quantity: Quantity, column: FileColumn, asker: Asker) -> None:
    """Assign a column to a quantity; ask for its unit where the file does not say it."""
    file.assign(quantity, ask_unit(file, quantity.dimension, column, asker))


def ask_unit(file: MeasuredFile, dimension: str, column: FileColumn, asker: Asker) -> FileColumn:
    """Return a column with its unit, asked for where the file does not say it."""
    if column.unit or dimension == "text" or (dimension == "ratio" and column.high <= 1):
        return column
    what = f"the column {shown(column.name)} of {file.name}, which holds {column.low:.5g} to {column.high:.5g}"
    example = "%" if dimension == "ratio" else "N" if dimension == "force" else "deg" if dimension == "angle" else "mm"
    reason = (
        f"{file.name} does not say the unit of its column {shown(column.name)}; write it into the heading, such as "
        + (f"{shown(f'{column.name} ({example})')}.")
    )
    dimension_in_file = "length" if dimension == "route" else dimension
    return file.set_unit(column, asker.ask(unit_question(f"In which unit is {what}?", dimension_in_file, reason)))


def _ask_required_column(
    file: MeasuredFile, wanted: WantedColumn, options: Sequence[FileColumn], asker: Asker
) -> FileColumn:
    """Return a column that must be there, asked for where headings do not identify it."""
    dimension = wanted.quantity.dimension
    options = options or unknown_columns_of(file, dimension)
    if not options:
        raise DatasetError(
            f"{file.name} has no column that could be {wanted.words}; it has {quoted(tuple(c.name for c in file.columns))}. "
            "Add that column, or leave the file out."
        )
    options_in_words = [(column.words, column) for column in options]
    reason = (
        f"{file.name} does not say which of its columns is {wanted.words}; name that column {wanted.quantity.name}, with its "
        "unit."
    )
    proposed = 1 if len(options) == 1 else None
    return asker.ask(
        choice_question(f"Which column of {file.name} is {wanted.words}?", options_in_words, proposed, reason)
    )


def _ask_optional_column(file: MeasuredFile, wanted: WantedColumn, asker: Asker) -> FileColumn | None:
    """Return a column of labels that may be there, as answered; None without one."""
    rows = max((column.different for column in file.columns), default=0)
    options = [
        column
        for column in file.unknown_columns
        if not column.unit and 1 < column.different <= max(_MAX_LABEL_SHARE * rows, 2) and _holds_labels(column, wanted)
    ]
    if not options:
        return None
    options_in_words: list[tuple[str, FileColumn | None]] = [(column.words, column) for column in options]
    question = f"Which column of {file.name} says {wanted.words}?"
    return asker.ask(choice_question(question, [*options_in_words, ("none of them", None)], len(options_in_words) + 1))


def _holds_labels(column: FileColumn, wanted: WantedColumn) -> bool:
    """Return whether a column holds words, or whole numbers where these can be labels."""
    low, high = wanted.numbers
    return not column.numbers or (low <= column.low == int(column.low) and column.high <= high)


def unknown_columns_of(file: MeasuredFile, dimension: str) -> list[FileColumn]:
    """Return the unassigned columns of numbers whose unit measures a dimension; without any, those without a unit."""
    numbers = [column for column in file.unknown_columns if column.numbers]
    return [column for column in numbers if column.dimension == dimension] or [
        column for column in numbers if not column.unit
    ]


def name_channels(file: MeasuredFile, asker: Asker) -> None:
    """Name the channels that a recording needs, and its sample rate where it has no clock."""
    name_columns(file, asker)
    if not file.has_clock:
        reason = f"{file.name} does not say when its samples were taken; add a column of time."
        rate = asker.ask(number_question(f"How many samples per second has {file.name}?", None, reason, "1000"))
        file.sources["time"] = ColumnSource(name=f"{rate:g} Hz")
