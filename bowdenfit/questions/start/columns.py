"""Which column of a file is what, and in which unit: asked where its headings do not say it."""

from collections.abc import Sequence

from bowdenfit.errors import DatasetError
from bowdenfit.files.matching import Quantity
from bowdenfit.kinds.table_files import WantedColumn
from bowdenfit.questions.start.question import Asker, agree, choose, number, unit
from bowdenfit.questions.start.sheet import SeenColumn, Sheet
from bowdenfit.units import ColumnSource
from bowdenfit.words import quoted, shown

_MOST_LABELS = 0.8  # of the rows, up to which a column of different labels may name runs or strokes


def name_columns(sheet: Sheet, ask: Asker) -> None:
    """Name the columns that a file of its kind needs, and those that it may have.

    Args:
        sheet: The file; what is found out is kept there.
        ask: Whom to ask.

    Raises:
        DatasetError: It has no column that could be one of those needed.
    """
    assert sheet.kind is not None and sheet.kind.init_questions is not None  # only files whose kind is known come here
    for each in sheet.kind.init_questions.columns:
        quantity = next((one for one in (each.quantity, *each.also) if sheet.can_be(one)), each.quantity)
        options = sheet.can_be(quantity)
        if len(options) == 1:
            column = options[0]
        elif each.optional:
            maybe = _optional(sheet, each, ask)
            if maybe is None:
                continue
            column = maybe
        else:
            column = _required(sheet, each, options, ask)
        take(sheet, quantity, column, ask)
    for question in sheet.kind.init_questions.yes_no:
        if question.unless not in sheet.taken and ask.ask(agree(question.words.format(sheet.file), False)):
            sheet.settings[question.key] = question.value


def take(sheet: Sheet, quantity: Quantity, column: SeenColumn, ask: Asker) -> None:
    """A column is a quantity; its unit is asked for where the file does not say it."""
    sheet.take(quantity, with_unit(sheet, quantity.dimension, column, ask))


def with_unit(sheet: Sheet, dimension: str, column: SeenColumn, ask: Asker) -> SeenColumn:
    """A column with its unit."""
    if column.unit or dimension == "text" or (dimension == "ratio" and column.high <= 1):
        return column
    what = f"the column {shown(column.name)} of {sheet.file}, which holds {column.low:.5g} to {column.high:.5g}"
    named = "%" if dimension == "ratio" else "N" if dimension == "force" else "deg" if dimension == "angle" else "mm"
    why = f"{sheet.file} does not say the unit of its column {shown(column.name)}; write it into the heading, such as " + (
        f"{shown(f'{column.name} ({named})')}."
    )
    of_route = "length" if dimension == "route" else dimension
    return sheet.with_unit(column, ask.ask(unit(f"In which unit is {what}?", of_route, why)))


def _required(sheet: Sheet, wanted: WantedColumn, options: Sequence[SeenColumn], ask: Asker) -> SeenColumn:
    """The column that must be there."""
    dimension = wanted.quantity.dimension
    options = options or of_dimension(sheet, dimension)
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


def _optional(sheet: Sheet, wanted: WantedColumn, ask: Asker) -> SeenColumn | None:
    """A column of labels that may be there."""
    rows = max((each.values for each in sheet.columns), default=0)
    options = [
        each
        for each in sheet.left
        if not each.unit and 1 < each.values <= max(_MOST_LABELS * rows, 2) and _are_labels(each, wanted)
    ]
    if not options:
        return None
    listed: list[tuple[str, SeenColumn | None]] = [(each.words, each) for each in options]
    question = f"Which column of {sheet.file} says {wanted.words}?"
    return ask.ask(choose(question, [*listed, ("none of them", None)], len(listed) + 1))


def _are_labels(column: SeenColumn, wanted: WantedColumn) -> bool:
    """Whether words, or whole numbers where these can be labels, stand in a column."""
    low, high = wanted.numbers
    return not column.numbers or (low <= column.low == int(column.low) and column.high <= high)


def of_dimension(sheet: Sheet, dimension: str) -> list[SeenColumn]:
    """Columns of numbers that are not known yet and can measure something: in such a unit, or else in none."""
    numbers = [each for each in sheet.left if each.numbers]
    return [each for each in numbers if each.dimension == dimension] or [each for each in numbers if not each.unit]


def name_channels(sheet: Sheet, ask: Asker) -> dict[str, ColumnSource]:
    """The channels of a recording that must be named, and its rate where it has no clock."""
    name_columns(sheet, ask)
    if not sheet.has_clock:
        why = f"{sheet.file} does not say when its samples were taken; add a column of time."
        rate = ask.ask(number(f"How many samples a second has {sheet.file}?", None, why, "1000"))
        sheet.sources["time"] = ColumnSource(name=f"{rate:g} Hz")
    return sheet.sources
