"""Contacts of a cable, and the source of their wrap angles: a curve along the route, the rows, or a constant."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from bowdenfit.cable.registry import CURVES
from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.files.matching import Quantity
from bowdenfit.files.spellings import without_accents
from bowdenfit.kinds.file_kind import stated_angle
from bowdenfit.questions.start.columns import ask_unit, assign_column, unknown_columns_of
from bowdenfit.questions.start.names import ask_coefficient_name, ask_contact_name
from bowdenfit.questions.start.question import Asker, Question, choose, numbers, one_of, quantity, yes_or_no
from bowdenfit.questions.start.sheet import FileColumn, MeasuredFile
from bowdenfit.words import listed, quoted, shown

_WRAP_ANGLE, _LENGTH = "wrap_angle", "cable_length"
_LENGTHS = re.compile(r"length|lange|laenge|longueur|longitud|lunghezza")
_CURVE = "gaussian"  # what a joint makes of a cable beside it
_ANGLE_WORDS = re.compile(
    r"\b(?:wrap|bend|angles?|winkel|umschlingungswinkel|biegewinkel|angulo|angolo)\b|_", re.IGNORECASE
)


@dataclass
class CableLayout:
    """The route and the contacts.

    Args:
        route: Plain data of [route]; empty without one.
        contacts: Plain data of every [[contact]].
        columns: Columns of wrap angles that rows may carry.
    """

    route: dict[str, Any] = field(default_factory=dict)
    contacts: list[dict[str, Any]] = field(default_factory=list)
    columns: list[str] = field(default_factory=list)

    def add_contact(self, name: str, angle: dict[str, Any]) -> None:
        """A contact with its wrap angle."""
        self.contacts.append({"name": name, "friction": "", "wrap_angle": angle})
        if "column" in angle:
            self.columns.append(angle["column"])

    @property
    def length_quantity(self) -> Quantity:
        """The route variable as tables have it."""
        return Quantity(self.route["variable"], "route", self.route["unit"])


def find_layout(sheets: Sequence[MeasuredFile], ask: Asker) -> CableLayout:
    """Find the route and the contacts of a cable from its files and from answers.

    Args:
        sheets: All files; their columns of lengths and of wrap angles are named.
        ask: Whom to ask.

    Raises:
        DatasetError: A file has not the columns that it needs.
    """
    layout = CableLayout()
    for sheet in sheets:
        if sheet.kind and sheet.kind.init_questions and sheet.kind.init_questions.by_length:
            _add_route(sheet, layout, ask)
    rows = [
        sheet
        for sheet in sheets
        if sheet.kind and sheet.kind.init_questions and sheet.kind.init_questions.has_own_angles
    ]
    if layout.route:
        for sheet in rows:
            _assign_length(sheet, layout, ask)
    for sheet in rows:
        _assign_angles(sheet, layout, ask)
    if not layout.contacts:
        _add_single_contact(sheets, layout, ask)
    while ask.ask(yes_or_no("Does the rope rub at another place, with a wrap angle that never changes?", False)):
        name = _ask_name(layout, "What is that place called?", None, ask)
        value, unit = ask.ask(quantity(f"What is the wrap angle at {shown(name)}, with its unit?", "angle", "45 deg"))
        layout.add_contact(name, {"value": value, "unit": unit})
    _ask_coefficients(layout, ask)
    return layout


def _add_route(sheet: MeasuredFile, layout: CableLayout, ask: Asker) -> None:
    """The route and the curved contacts, by a table of wrap angles at several lengths."""
    lengths = unknown_columns_of(sheet, "length")
    if not lengths:
        raise DatasetError(
            f"{sheet.file} has no column of lengths beside the wrap angles; add one, such as cable_length_mm."
        )
    why = f"{sheet.file} does not say which of its columns is the length; name that column cable_length_mm."
    sure = len(lengths) == 1 and bool(lengths[0].dimension)
    column = ask_unit(sheet, "length", lengths[0] if sure else _ask_length_column(sheet, lengths, why, ask), ask)
    ends = ask.ask(_ask_range(column))
    named = column.plain_name if column.plain_name.isascii() and column.plain_name.endswith("length") else _LENGTH
    layout.route = {"variable": named, "unit": column.unit, "range": list(ends)}
    if bought := ask.ask(_ask_choices(ends, column.unit)):
        layout.route["choices"] = list(bought)
    assign_column(sheet, layout.length_quantity, column, ask)
    _add_curved_contacts(sheet, layout, ask)


def _ask_range(column: FileColumn) -> Question[tuple[float, ...]]:
    """Which lengths may be the best: some of those between which angles were measured."""
    words = f"Between which lengths, in {column.unit}, may the best one lie? The curves of the wrap angles are fitted there."
    question = numbers(words, f"{column.low:.12g} {column.high:.12g}", exactly=2)

    def read(typed: str) -> tuple[float, ...]:
        range_ends = question.read(typed)
        if range_ends[0] < column.low or range_ends[1] > column.high:
            raise UsageError(
                f"{shown(typed)}: angles were measured from {column.low:g} to {column.high:g} {column.unit} only; stay between."
            )
        return range_ends

    return Question(words, read, question.default)


def _ask_choices(ends: Sequence[float], unit: str) -> Question[tuple[float, ...]]:
    """Which lengths there are; any without an answer."""
    question = numbers(f"Which lengths can be bought, in {unit}? (- for any)", "-")

    def read(typed: str) -> tuple[float, ...]:
        lengths = () if typed.strip() in {"-", "any"} else question.read(typed)
        if outside := [each for each in lengths if not ends[0] <= each <= ends[1]]:
            raise UsageError(
                f"{outside[0]:g} is not between {ends[0]:g} and {ends[1]:g}; leave it out, or write - for any."
            )
        return lengths

    return Question(question.words, read, "-")


def _add_curved_contacts(sheet: MeasuredFile, layout: CableLayout, ask: Asker) -> None:
    """A contact for each column of wrap angles along the route."""
    angles = unknown_columns_of(sheet, "angle")
    if not angles:
        raise DatasetError(
            f"{sheet.file} has no column of wrap angles; it has {quoted(tuple(c.name for c in sheet.columns))}."
        )
    if not angles[0].dimension and len(angles) > 1:
        angles = ask.ask(_choose_several(f"Which columns of {sheet.file} are wrap angles?", angles, sheet.file))
    blanks = False
    for column in angles:
        column = ask_unit(sheet, "angle", column, ask)
        name = _ask_name(
            layout, f"What is the place called whose wrap angle is {shown(column.name)}?", _propose_name(column), ask
        )
        shape = (
            "How does that angle follow the length: gaussian (a bell, largest at some length), line (a straight line) or "
            "logistic (from 0 to a plateau)? Whether another fits better, bowdenfit compare tells."
        )
        curve = ask.ask(one_of(shape, sorted(CURVES), _CURVE))
        assign_column(sheet, Quantity(column.plain_name, "angle"), column, ask)
        layout.add_contact(name, {"curve": curve, "column": column.plain_name})
        blanks = blanks or column.blanks > 0
    if blanks:
        why = f"{sheet.file} has blank cells, and does not say below which angle nothing could be read; write <10 in them."
        words = (
            f"{sheet.file} has blank cells, which are read as angles too small to be measured; where nothing was measured at "
            "all, delete the row instead. Below which angle could nothing be measured?"
        )
        value, unit = ask.ask(quantity(words, "angle", "10 deg", why))
        sheet.settings["detection_limit"] = {"value": value, "unit": unit}


def _choose_several(words: str, columns: Sequence[FileColumn], file: str) -> Question[list[FileColumn]]:
    """A question after some of several columns."""

    def read(typed: str) -> list[FileColumn]:
        numbers_typed = typed.replace(",", " ").split()
        if not numbers_typed or not all(each.isdecimal() and 1 <= int(each) <= len(columns) for each in numbers_typed):
            raise UsageError(f"{shown(typed)} are none of them; write their numbers with blanks between, such as 1 2.")
        return [columns[i - 1] for i in sorted({int(each) for each in numbers_typed})]

    why = f"{file} does not say which of its columns are wrap angles; write their unit into their headings."
    options = tuple(each.words for each in columns)
    return Question(f"{words} Write their numbers with blanks between.", read, None, why, "1", options)


def _assign_length(sheet: MeasuredFile, layout: CableLayout, ask: Asker) -> None:
    """The column of lengths of a table whose rows were read at several."""
    options = sheet.columns_for(layout.length_quantity) or unknown_columns_of(sheet, "length")
    if not options:
        raise DatasetError(
            f"{sheet.file} has no column of lengths, and the wrap angles depend on the length; add one, named as in the table "
            f"of wrap angles, {layout.route['variable']}_{layout.route['unit']}."
        )
    why = f"{sheet.file} does not say which of its columns is the length; name it as in the table of wrap angles."
    matching = sheet.columns_for(layout.length_quantity) or [
        each for each in options if _LENGTHS.search(without_accents(each.name).lower())
    ]
    assign_column(
        sheet,
        layout.length_quantity,
        matching[0] if len(matching) == 1 else _ask_length_column(sheet, options, why, ask),
        ask,
    )


def _ask_length_column(sheet: MeasuredFile, lengths: Sequence[FileColumn], why: str, ask: Asker) -> FileColumn:
    """The column of lengths."""
    options = [(each.words, each) for each in lengths]
    proposed = 1 if len(lengths) == 1 else None
    return ask.ask(choose(f"Which column of {sheet.file} is the length of the cable?", options, proposed, why))


def _assign_angles(sheet: MeasuredFile, layout: CableLayout, ask: Asker) -> None:
    """Wrap angles that rows carry themselves: of contacts that are known, or of another."""
    for name in layout.columns:
        matching = sheet.columns_for(Quantity(name, "angle"))
        if len(matching) == 1:
            assign_column(sheet, Quantity(name, "angle"), matching[0], ask)
    unknown = [each for each in sheet.unknown_columns if each.dimension == "angle"]
    missing = [name for name in layout.columns if name not in sheet.assigned]
    if not layout.route and len(missing) == len(unknown) == 1:
        if _is_wrap_angle(sheet, unknown[0], ask):
            assign_column(sheet, Quantity(missing[0], "angle"), unknown[0], ask)
    elif not layout.contacts and len(unknown) == 1:
        if _is_wrap_angle(sheet, unknown[0], ask):
            assign_column(sheet, Quantity(_WRAP_ANGLE, "angle"), unknown[0], ask)
            layout.add_contact("cable", {"column": _WRAP_ANGLE})
    elif unknown and not (layout.columns and not layout.route):
        listing = "Which of these were measured at places where the rope rubs"
        question = f"{sheet.file} has {listed([shown(each.name) for each in unknown])}. {listing}?"
        for column in ask.ask(_choose_several(question, unknown, sheet.file)):
            assign_column(sheet, Quantity(column.plain_name, "angle"), column, ask)
            name = _ask_name(
                layout,
                f"What is the place called whose wrap angle is {shown(column.name)}?",
                _propose_name(column),
                ask,
            )
            layout.add_contact(name, {"column": column.plain_name})


def _is_wrap_angle(sheet: MeasuredFile, column: FileColumn, ask: Asker) -> bool:
    """Whether a column of angles is that of the bench, asked where its heading does not say so."""
    if [each.name for each in sheet.columns_for(Quantity(_WRAP_ANGLE, "angle"))] == [column.name]:
        return True
    why = f"{sheet.file} does not say whether its column {shown(column.name)} is the wrap angle; name it {_WRAP_ANGLE}_deg."
    return ask.ask(yes_or_no(f"Is {column.words} in {sheet.file} the angle by which the cable was wrapped?", True, why))


def _add_single_contact(sheets: Sequence[MeasuredFile], layout: CableLayout, ask: Asker) -> None:
    """The wrap angle of a cable of which no table has any; recordings may each have their own."""
    recorded = [sheet for sheet in sheets if sheet.kind and sheet.kind.takes_channels]
    own_angles = [stated[0] for sheet in recorded if (stated := stated_angle(sheet.path))]
    apart = len(recorded) == len(own_angles) and len(set(own_angles)) > 1
    if apart or (
        len(recorded) > 1
        and not own_angles
        and not ask.ask(yes_or_no("Was the wrap angle the same in all recordings?", True))
    ):
        layout.add_contact("cable", {"column": _WRAP_ANGLE})
        return
    known = {stated[0] for sheet in sheets if (stated := stated_angle(sheet.path))}
    default = next(iter(known)) if len(known) == 1 else None
    files = listed([sheet.file for sheet in sheets])
    why = f"no column of {files} is a wrap angle; add one, such as wrap_angle_deg."
    words = "By which angle was the cable wrapped on the bench, all bends together, with its unit?"
    value, unit = ask.ask(quantity(words, "angle", "180 deg", why, default))
    layout.add_contact("cable", {"value": value, "unit": unit})


def _propose_name(column: FileColumn) -> str:
    """What a place may be called, by the heading of its wrap angle."""
    return " ".join(_ANGLE_WORDS.sub(" ", column.plain_name.replace("_", " ")).split()) or "cable"


def _ask_name(layout: CableLayout, words: str, default: str | None, ask: Asker) -> str:
    """The name of a contact, which no other has."""
    return ask.ask(ask_contact_name(words, default, {each["name"] for each in layout.contacts}))


def _ask_coefficients(layout: CableLayout, ask: Asker) -> None:
    """The friction coefficient of every contact; some may share one."""
    if len(layout.contacts) == 1:
        layout.contacts[0]["friction"] = "mu"
        return
    ask.say("Places of the same materials may share a coefficient of friction; they then have the same name here.")
    for i, contact in enumerate(layout.contacts, start=1):
        words = f"What is the coefficient of friction at {shown(contact['name'])} called?"
        contact["friction"] = ask.ask(ask_coefficient_name(words, f"mu{i}", layout.columns))
