"""Assign columns of a file to quantities, and their units; ask where the headings do not say it."""

from collections.abc import Sequence

from bowdenfit.errors import DatasetError
from bowdenfit.files.matching import Quantity
from bowdenfit.kinds.table_files import WantedColumn
from bowdenfit.questions.start.question import Asker, choose, number, unit, yes_or_no
from bowdenfit.questions.start.sheet import FileColumn, MeasuredFile
from bowdenfit.units import ColumnSource
from bowdenfit.words import quoted, shown

_MAX_LABEL_SHARE = 0.8  # of the rows, up to which a column of different labels may name runs or strokes


def name_columns(sheet: MeasuredFile, ask: Asker) -> None:
    """Name the columns that a file of its kind needs, and those that it may have.

    Args:
        sheet: The file; what is found out is kept there.
        ask: Whom to ask.

    Raises:
        DatasetError: It has no column that could be one of those needed.
    """
    assert sheet.kind is not None and sheet.kind.init_questions is not None  # only files whose kind is known come here
    for wanted in sheet.kind.init_questions.columns:
        quantity = next((one for one in (wanted.quantity, *wanted.also) if sheet.columns_for(one)), wanted.quantity)
        options = sheet.columns_for(quantity)
        if len(options) == 1:
            column = options[0]
        elif wanted.optional:
            optional = _ask_optional_column(sheet, wanted, ask)
            if optional is None:
                continue
            column = optional
        else:
            column = _ask_required_column(sheet, wanted, options, ask)
        assign_column(sheet, quantity, column, ask)
    for question in sheet.kind.init_questions.yes_no:
        if question.unless not in sheet.assigned and ask.ask(yes_or_no(question.words.format(sheet.file), False)):
            sheet.settings[question.key] = question.value


def assign_column(sheet: MeasuredFile, quantity: Quantity, column: FileColumn, ask: Asker) -> None:
    """Assign a column to a quantity; ask for its unit where the file does not say it."""
    sheet.assign(quantity, ask_unit(sheet, quantity.dimension, column, ask))


def ask_unit(sheet: MeasuredFile, dimension: str, column: FileColumn, ask: Asker) -> FileColumn:
    """Return a column with its unit, asked for where the file does not say it."""
    if column.unit or dimension == "text" or (dimension == "ratio" and column.high <= 1):
        return column
    what = f"the column {shown(column.name)} of {sheet.file}, which holds {column.low:.5g} to {column.high:.5g}"
    example = "%" if dimension == "ratio" else "N" if dimension == "force" else "deg" if dimension == "angle" else "mm"
    why = (
        f"{sheet.file} does not say the unit of its column {shown(column.name)}; write it into the heading, such as "
        + (f"{shown(f'{column.name} ({example})')}.")
    )
    dimension_in_file = "length" if dimension == "route" else dimension
    return sheet.set_unit(column, ask.ask(unit(f"In which unit is {what}?", dimension_in_file, why)))


def _ask_required_column(
    sheet: MeasuredFile, wanted: WantedColumn, options: Sequence[FileColumn], ask: Asker
) -> FileColumn:
    """The column that must be there."""
    dimension = wanted.quantity.dimension
    options = options or unknown_columns_of(sheet, dimension)
    if not options:
        raise DatasetError(
            f"{sheet.file} has no column that could be {wanted.words}; it has {quoted(tuple(c.name for c in sheet.columns))}. "
            "Add that column, or leave the file out."
        )
    listed = [(each.words, each) for each in options]
    why = (
        f"{sheet.file} does not say which of its columns is {wanted.words}; name that column {wanted.quantity.name}, with its "
        "unit."
    )
    proposed = 1 if len(options) == 1 else None
    return ask.ask(choose(f"Which column of {sheet.file} is {wanted.words}?", listed, proposed, why))


def _ask_optional_column(sheet: MeasuredFile, wanted: WantedColumn, ask: Asker) -> FileColumn | None:
    """A column of labels that may be there."""
    rows = max((each.values for each in sheet.columns), default=0)
    options = [
        each
        for each in sheet.unknown_columns
        if not each.unit and 1 < each.values <= max(_MAX_LABEL_SHARE * rows, 2) and _holds_labels(each, wanted)
    ]
    if not options:
        return None
    listed: list[tuple[str, FileColumn | None]] = [(each.words, each) for each in options]
    question = f"Which column of {sheet.file} says {wanted.words}?"
    return ask.ask(choose(question, [*listed, ("none of them", None)], len(listed) + 1))


def _holds_labels(column: FileColumn, wanted: WantedColumn) -> bool:
    """Whether words, or whole numbers where these can be labels, stand in a column."""
    low, high = wanted.numbers
    return not column.numbers or (low <= column.low == int(column.low) and column.high <= high)


def unknown_columns_of(sheet: MeasuredFile, dimension: str) -> list[FileColumn]:
    """Columns of numbers that are not known yet and can measure something: in such a unit, or else in none."""
    numbers = [column for column in sheet.unknown_columns if column.numbers]
    return [column for column in numbers if column.dimension == dimension] or [
        column for column in numbers if not column.unit
    ]


def name_channels(sheet: MeasuredFile, ask: Asker) -> dict[str, ColumnSource]:
    """The channels of a recording that must be named, and its rate where it has no clock."""
    name_columns(sheet, ask)
    if not sheet.has_clock:
        why = f"{sheet.file} does not say when its samples were taken; add a column of time."
        rate = ask.ask(number(f"How many samples a second has {sheet.file}?", None, why, "1000"))
        sheet.sources["time"] = ColumnSource(name=f"{rate:g} Hz")
    return sheet.sources
