"""Contacts of a cable, and the source of their wrap angles: a curve along the route, the rows, or a constant."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bowdenfit.cable.registry import CURVES
from bowdenfit.description import Route
from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.files.headings import Quantity
from bowdenfit.files.spellings import names_length
from bowdenfit.kinds.file_kind import find_stated_angle
from bowdenfit.questions.start.curve_choice import NO_FAMILY, propose_curve
from bowdenfit.questions.start.measured_file import (
    FileColumn,
    MeasuredFile,
    ask_unit,
    assign_column,
    unknown_columns_of,
)
from bowdenfit.questions.start.question import (
    Asker,
    Question,
    choice_question,
    coefficient_name_question,
    contact_name_question,
    numbers_question,
    quantity_question,
    word_question,
    yes_no_question,
)
from bowdenfit.units import conversion_factor
from bowdenfit.words import listed, quoted, shown

CURVE_SHAPES = {  # of the families that are proposed
    "gaussian": "a bell, largest at some length", "line": "a straight line", "logistic": "from 0 to a plateau",
    "smooth": "no known curve",
}  # fmt: skip
_WRAP_ANGLE, _LENGTH = "wrap_angle", "cable_length"  # columns of tables where headings give no name of their own
_ANGLE_WORDS = re.compile(
    r"\b(?:wrap|bend|angles?|winkel|umschlingungswinkel|biegewinkel|angulo|angolo)\b|_", re.IGNORECASE
)


@dataclass
class CableLayout:
    """The route and the contacts of a cable, as plain data for its description.

    Args:
        route: Plain data of [route]; empty without one.
        contacts: Plain data of every [[contact]].
        columns: Columns of wrap angles that rows may carry.
    """

    route: dict[str, Any] = field(default_factory=dict)
    contacts: list[dict[str, Any]] = field(default_factory=list)
    columns: list[str] = field(default_factory=list)

    def add_contact(self, name: str, angle: dict[str, Any]) -> None:
        """Add a contact with its wrap angle."""
        self.contacts.append({"name": name, "friction": "", "wrap_angle": angle})
        if "column" in angle:
            self.columns.append(angle["column"])

    @property
    def length_quantity(self) -> Quantity:
        """The route variable as tables have it."""
        return Quantity(self.route["variable"], "route", self.route["unit"])


def find_layout(measured_files: Sequence[MeasuredFile], asker: Asker) -> CableLayout:
    """Find the route and the contacts of a cable from its files and from answers.

    Args:
        measured_files: All files; their columns of lengths and of wrap angles are named.
        asker: Whom to ask.

    Raises:
        DatasetError: A file has not the columns that it needs.
    """
    layout = CableLayout()
    for file in measured_files:
        if file.kind and file.kind.init_questions and file.kind.init_questions.by_length:
            _add_route(file, layout, asker)
    rows = [
        file
        for file in measured_files
        if file.kind and file.kind.init_questions and file.kind.init_questions.has_own_angles
    ]
    if layout.route:
        for file in rows:
            _assign_length(file, layout, asker)
    for file in rows:
        _assign_angles(file, layout, asker)
    if not layout.contacts:
        _add_single_contact(measured_files, layout, asker)
    while asker.ask(
        yes_no_question("Does the rope rub at another place, with a wrap angle that never changes?", False)
    ):
        name = _ask_name(layout, "What is that place called?", None, asker)
        value, unit = asker.ask(
            quantity_question(f"What is the wrap angle at {shown(name)}, with its unit?", "angle", "45 deg")
        )
        layout.add_contact(name, {"value": value, "unit": unit})
    _ask_coefficients(layout, asker)
    return layout


def _add_route(file: MeasuredFile, layout: CableLayout, asker: Asker) -> None:
    """Add the route and the curved contacts of a table of wrap angles at several lengths."""
    lengths = unknown_columns_of(file, "length")
    if not lengths:
        raise DatasetError(
            f"{file.name} has no column of lengths next to the wrap angles; add one, such as cable_length_mm."
        )
    reason = f"{file.name} does not say which of its columns is the length; name that column cable_length_mm."
    sure = len(lengths) == 1 and bool(lengths[0].dimension)
    column = ask_unit(file, "length", lengths[0] if sure else _ask_length_column(file, lengths, reason, asker), asker)
    ends = asker.ask(_range_question(column))
    named = column.plain_name if column.plain_name.isascii() and column.plain_name.endswith("length") else _LENGTH
    layout.route = {"variable": named, "unit": column.unit, "range": list(ends)}
    if bought := asker.ask(_choices_question(ends, column.unit)):
        layout.route["choices"] = list(bought)
    assign_column(file, layout.length_quantity, column, asker)
    _add_curved_contacts(file, column, layout, asker)


def _range_question(column: FileColumn) -> Question[tuple[float, ...]]:
    """Ask for the range of lengths that the best one may lie in, inside the range in which angles were measured."""
    words = f"Between which lengths, in {column.unit}, may the best one lie? The curves of the wrap angles are fitted there."
    question = numbers_question(words, f"{column.low:.12g} {column.high:.12g}", exactly=2)

    def read(typed: str) -> tuple[float, ...]:
        range_ends = question.read(typed)
        if range_ends[0] < column.low or range_ends[1] > column.high:
            raise UsageError(
                f"{shown(typed)}: angles were measured from {column.low:g} to {column.high:g} {column.unit} only; stay between."
            )
        return range_ends

    return Question(words, read, question.default)


def _choices_question(ends: Sequence[float], unit: str) -> Question[tuple[float, ...]]:
    """Ask which lengths can be bought; no lengths stand for any."""
    question = numbers_question(f"Which lengths can be bought, in {unit}? (- for any)", "-")

    def read(typed: str) -> tuple[float, ...]:
        lengths = () if typed.strip() in {"-", "any"} else question.read(typed)
        if outside := [length for length in lengths if not ends[0] <= length <= ends[1]]:
            raise UsageError(
                f"{outside[0]:g} is not between {ends[0]:g} and {ends[1]:g}; leave it out, or write - for any."
            )
        return lengths

    return Question(question.words, read, "-")


def _ask_curve(layout: CableLayout, length: FileColumn, angle: FileColumn, asker: Asker) -> str:
    """Return the curve that an angle follows along the length, as answered."""
    *shapes, last = (f"{name} ({shape})" for name, shape in CURVE_SHAPES.items())
    question = (
        f"How does that angle follow the length: {', '.join(shapes)} or {last}? bowdenfit compare says whether another fits "
        "better."
    )
    route = Route(variable=layout.route["variable"], unit=layout.route["unit"], range=tuple(layout.route["range"]))
    has_length, radians = np.isfinite(length.values), conversion_factor(angle.unit, "angle", "rad")
    proposed = propose_curve(route, length.values[has_length], radians * angle.values[has_length])
    if proposed == NO_FAMILY:
        asker.say(f"Another curve than a bell predicts each angle of {shown(angle.name)} better from the rest.")
    return asker.ask(word_question(question, sorted(CURVES), proposed))


def _add_curved_contacts(file: MeasuredFile, length: FileColumn, layout: CableLayout, asker: Asker) -> None:
    """Add a contact for every column of wrap angles along the route."""
    angles = unknown_columns_of(file, "angle")
    if not angles:
        raise DatasetError(
            f"{file.name} has no column of wrap angles; it has {quoted(tuple(c.name for c in file.columns))}."
        )
    if not angles[0].dimension and len(angles) > 1:
        angles = asker.ask(
            _several_columns_question(f"Which columns of {file.name} are wrap angles?", angles, file.name)
        )
    blanks = False
    for column in angles:
        column = ask_unit(file, "angle", column, asker)
        name = _ask_name(
            layout, f"What is the place called whose wrap angle is {shown(column.name)}?", _propose_name(column), asker
        )
        curve = _ask_curve(layout, length, column, asker)
        assign_column(file, Quantity(column.plain_name, "angle"), column, asker)
        layout.add_contact(name, {"curve": curve, "column": column.plain_name})
        blanks = blanks or column.blanks > 0
    if blanks:
        reason = (
            f"{file.name} has blank cells, and does not say below which angle nothing could be read; write <10 in them."
        )
        words = (
            f"{file.name} has blank cells, which are read as angles too small to be measured; where nothing was measured at "
            "all, delete the row instead. Below which angle could nothing be measured?"
        )
        value, unit = asker.ask(quantity_question(words, "angle", "10 deg", reason))
        file.settings["detection_limit"] = {"value": value, "unit": unit}


def _several_columns_question(words: str, columns: Sequence[FileColumn], file: str) -> Question[list[FileColumn]]:
    """Ask for some of several columns."""

    def read(typed: str) -> list[FileColumn]:
        numbers_typed = typed.replace(",", " ").split()
        if not numbers_typed or not all(
            number.isdecimal() and 1 <= int(number) <= len(columns) for number in numbers_typed
        ):
            raise UsageError(f"{shown(typed)} are not among them; write their numbers separated by spaces, such as 1 2.")
        return [columns[i - 1] for i in sorted({int(number) for number in numbers_typed})]

    reason = f"{file} does not say which of its columns are wrap angles; write their unit into their headings."
    options = tuple(column.words for column in columns)
    return Question(f"{words} Write their numbers separated by spaces.", read, None, reason, "1", options, "several")


def _assign_length(file: MeasuredFile, layout: CableLayout, asker: Asker) -> None:
    """Assign the column of lengths of a table whose rows were read at several."""
    options = file.columns_for(layout.length_quantity) or unknown_columns_of(file, "length")
    if not options:
        raise DatasetError(
            f"{file.name} has no column of lengths, and the wrap angles depend on the length; add one, named as in the table "
            f"of wrap angles, {layout.route['variable']}_{layout.route['unit']}."
        )
    reason = f"{file.name} does not say which of its columns is the length; name it as in the table of wrap angles."
    matching = file.columns_for(layout.length_quantity) or [
        column for column in options if names_length(column.name)
    ]
    assign_column(
        file,
        layout.length_quantity,
        matching[0] if len(matching) == 1 else _ask_length_column(file, options, reason, asker),
        asker,
    )


def _ask_length_column(file: MeasuredFile, lengths: Sequence[FileColumn], why: str, asker: Asker) -> FileColumn:
    """Return the column of lengths, as answered."""
    options = [(column.words, column) for column in lengths]
    proposed = 1 if len(lengths) == 1 else None
    return asker.ask(
        choice_question(f"Which column of {file.name} is the length of the cable?", options, proposed, why)
    )


def _assign_angles(file: MeasuredFile, layout: CableLayout, asker: Asker) -> None:
    """Assign the wrap angles that rows carry themselves, of known contacts or of new ones."""
    if _WRAP_ANGLE in file.assigned and _WRAP_ANGLE not in layout.columns:  # it was stated
        layout.add_contact("cable", {"column": _WRAP_ANGLE})
    for name in layout.columns:
        matching = file.columns_for(Quantity(name, "angle"))
        if len(matching) == 1:
            assign_column(file, Quantity(name, "angle"), matching[0], asker)
    unknown = [column for column in file.unknown_columns if column.dimension == "angle"]
    missing = [name for name in layout.columns if name not in file.assigned]
    if not layout.route and len(missing) == len(unknown) == 1:
        if _is_wrap_angle(file, unknown[0], asker):
            assign_column(file, Quantity(missing[0], "angle"), unknown[0], asker)
    elif not layout.contacts and len(unknown) == 1:
        if _is_wrap_angle(file, unknown[0], asker):
            assign_column(file, Quantity(_WRAP_ANGLE, "angle"), unknown[0], asker)
            layout.add_contact("cable", {"column": _WRAP_ANGLE})
    elif unknown and not (layout.columns and not layout.route):
        listing = "Which of these were measured at places where the rope rubs"
        question = f"{file.name} has {listed([shown(column.name) for column in unknown])}. {listing}?"
        for column in asker.ask(_several_columns_question(question, unknown, file.name)):
            assign_column(file, Quantity(column.plain_name, "angle"), column, asker)
            name = _ask_name(
                layout,
                f"What is the place called whose wrap angle is {shown(column.name)}?",
                _propose_name(column),
                asker,
            )
            layout.add_contact(name, {"column": column.plain_name})


def _is_wrap_angle(file: MeasuredFile, column: FileColumn, asker: Asker) -> bool:
    """Return whether a column holds the wrap angle of the bench, asked where its heading does not say so."""
    if [column.name for column in file.columns_for(Quantity(_WRAP_ANGLE, "angle"))] == [column.name]:
        return True
    reason = f"{file.name} does not say whether its column {shown(column.name)} is the wrap angle; name it {_WRAP_ANGLE}_deg."
    return asker.ask(
        yes_no_question(f"Is {column.words} in {file.name} the angle by which the cable was wrapped?", True, reason)
    )


def _add_single_contact(measured_files: Sequence[MeasuredFile], layout: CableLayout, asker: Asker) -> None:
    """Add the contact of a cable of which no table has any; every recording may have its own."""
    recorded = [file for file in measured_files if file.kind and file.kind.takes_channels]
    own_angles = [stated[0] for file in recorded if (stated := find_stated_angle(file.path))]
    apart = len(recorded) == len(own_angles) and len(set(own_angles)) > 1
    if apart or (
        len(recorded) > 1
        and not own_angles
        and not asker.ask(yes_no_question("Was the wrap angle the same in all recordings?", True))
    ):
        layout.add_contact("cable", {"column": _WRAP_ANGLE})
        return
    known = {stated[0] for file in measured_files if (stated := find_stated_angle(file.path))}
    default = next(iter(known)) if len(known) == 1 else None
    files = listed([file.name for file in measured_files])
    reason = f"no column of {files} is a wrap angle; add one, such as wrap_angle_deg."
    words = "By which angle was the cable wrapped on the bench, all bends together, with its unit?"
    value, unit = asker.ask(quantity_question(words, "angle", "180 deg", reason, default))
    layout.add_contact("cable", {"value": value, "unit": unit})


def _propose_name(column: FileColumn) -> str:
    """Return a name for a contact by the heading of its wrap angle."""
    return " ".join(_ANGLE_WORDS.sub(" ", column.plain_name.replace("_", " ")).split()) or "cable"


def _ask_name(layout: CableLayout, words: str, default: str | None, asker: Asker) -> str:
    """Return the name of a contact, as answered, which no other has."""
    return asker.ask(contact_name_question(words, default, {contact["name"] for contact in layout.contacts}))


def _ask_coefficients(layout: CableLayout, asker: Asker) -> None:
    """Ask for the friction coefficient of every contact; some may share one."""
    if len(layout.contacts) == 1:
        layout.contacts[0]["friction"] = "mu"
        return
    asker.say("Covariates of the same materials may share a coefficient of friction; they then have the same name here.")
    for i, contact in enumerate(layout.contacts, start=1):
        words = f"What is the coefficient of friction at {shown(contact['name'])} called?"
        contact["friction"] = asker.ask(coefficient_name_question(words, f"mu{i}", layout.columns))
