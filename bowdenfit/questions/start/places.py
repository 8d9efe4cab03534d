"""Where rope rubs, and where the wrap angles come from: a curve along the route, the rows themselves, or a constant."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from bowdenfit.cable.registry import CURVES
from bowdenfit.errors import DatasetError, UsageError
from bowdenfit.files.matching import Quantity
from bowdenfit.files.spellings import without_accents
from bowdenfit.kinds.file_kind import stated_angle
from bowdenfit.questions.start.columns import of_dimension, take, with_unit
from bowdenfit.questions.start.names import coefficient_name, place_name
from bowdenfit.questions.start.question import Asker, Question, agree, choose, numbers, one_of, quantity
from bowdenfit.questions.start.sheet import SeenColumn, Sheet
from bowdenfit.words import listed, quoted, shown

_WRAP_ANGLE, _LENGTH = "wrap_angle", "cable_length"
_LENGTHS = re.compile(r"length|lange|laenge|longueur|longitud|lunghezza")
_CURVE = "gaussian"  # what a joint makes of a cable beside it
_ANGLE_WORDS = re.compile(r"\b(?:wrap|bend|angles?|winkel|umschlingungswinkel|biegewinkel|angulo|angolo)\b|_", re.IGNORECASE)


@dataclass
class Places:
    """The route and the contacts.

    Args:
        route: Plain data of [route]; empty without one.
        contacts: Plain data of every [[contact]].
        columns: Columns of wrap angles that rows may carry.
    """

    route: dict[str, Any] = field(default_factory=dict)
    contacts: list[dict[str, Any]] = field(default_factory=list)
    columns: list[str] = field(default_factory=list)

    def add(self, name: str, angle: dict[str, Any]) -> None:
        """A contact with its wrap angle."""
        self.contacts.append({"name": name, "friction": "", "wrap_angle": angle})
        if "column" in angle:
            self.columns.append(angle["column"])

    @property
    def length(self) -> Quantity:
        """The route variable as tables have it."""
        return Quantity(self.route["variable"], "route", self.route["unit"])


def find_places(sheets: Sequence[Sheet], ask: Asker) -> Places:
    """The route and the contacts of a cable, by its files and by what is asked.

    Args:
        sheets: All files; their columns of lengths and of wrap angles are named.
        ask: Whom to ask.

    Raises:
        DatasetError: A file has not the columns that it needs.
    """
    places = Places()
    for sheet in sheets:
        if sheet.kind and sheet.kind.init_questions and sheet.kind.init_questions.by_length:
            _along_route(sheet, places, ask)
    rows = [
        sheet
        for sheet in sheets
        if sheet.kind and sheet.kind.init_questions and sheet.kind.init_questions.has_own_angles
    ]
    if places.route:
        for sheet in rows:
            _length_of_rows(sheet, places, ask)
    for sheet in rows:
        _angles_of_rows(sheet, places, ask)
    if not places.contacts:
        _one_angle(sheets, places, ask)
    while ask.ask(agree("Does the rope rub at another place, with a wrap angle that never changes?", False)):
        name = _name(places, "What is that place called?", None, ask)
        value, unit = ask.ask(quantity(f"What is the wrap angle at {shown(name)}, with its unit?", "angle", "45 deg"))
        places.add(name, {"value": value, "unit": unit})
    _coefficients(places, ask)
    return places


def _along_route(sheet: Sheet, places: Places, ask: Asker) -> None:
    """The route and the curved contacts, by a table of wrap angles at several lengths."""
    lengths = of_dimension(sheet, "length")
    if not lengths:
        raise DatasetError(f"{sheet.file} has no column of lengths beside the wrap angles; add one, such as cable_length_mm.")
    why = f"{sheet.file} does not say which of its columns is the length; name that column cable_length_mm."
    sure = len(lengths) == 1 and bool(lengths[0].dimension)
    column = with_unit(sheet, "length", lengths[0] if sure else _chosen(sheet, lengths, why, ask), ask)
    ends = ask.ask(_ends(column))
    named = column.plain if column.plain.isascii() and column.plain.endswith("length") else _LENGTH
    places.route = {"variable": named, "unit": column.unit, "range": list(ends)}
    if bought := ask.ask(_choices(ends, column.unit)):
        places.route["choices"] = list(bought)
    take(sheet, places.length, column, ask)
    _curved(sheet, places, ask)


def _ends(column: SeenColumn) -> Question[tuple[float, ...]]:
    """Which lengths may be the best: some of those between which angles were measured."""
    words = f"Between which lengths, in {column.unit}, may the best one lie? The curves of the wrap angles are fitted there."
    asked = numbers(words, f"{column.low:.12g} {column.high:.12g}", exactly=2)

    def read(typed: str) -> tuple[float, ...]:
        found = asked.read(typed)
        if found[0] < column.low or found[1] > column.high:
            raise UsageError(
                f"{shown(typed)}: angles were measured from {column.low:g} to {column.high:g} {column.unit} only; stay between."
            )
        return found

    return Question(words, read, asked.default)


def _choices(ends: Sequence[float], unit: str) -> Question[tuple[float, ...]]:
    """Which lengths there are; any without an answer."""
    asked = numbers(f"Which lengths can be bought, in {unit}? (- for any)", "-")

    def read(typed: str) -> tuple[float, ...]:
        found = () if typed.strip() in {"-", "any"} else asked.read(typed)
        if outside := [each for each in found if not ends[0] <= each <= ends[1]]:
            raise UsageError(f"{outside[0]:g} is not between {ends[0]:g} and {ends[1]:g}; leave it out, or write - for any.")
        return found

    return Question(asked.words, read, "-")


def _curved(sheet: Sheet, places: Places, ask: Asker) -> None:
    """A contact for each column of wrap angles along the route."""
    angles = of_dimension(sheet, "angle")
    if not angles:
        raise DatasetError(f"{sheet.file} has no column of wrap angles; it has {quoted(tuple(c.name for c in sheet.columns))}.")
    if not angles[0].dimension and len(angles) > 1:
        angles = ask.ask(_several(f"Which columns of {sheet.file} are wrap angles?", angles, sheet.file))
    blanks = False
    for column in angles:
        column = with_unit(sheet, "angle", column, ask)
        name = _name(places, f"What is the place called whose wrap angle is {shown(column.name)}?", _place(column), ask)
        shape = (
            "How does that angle follow the length: gaussian (a bell, largest at some length), line (a straight line) or "
            "logistic (from 0 to a plateau)? Whether another fits better, bowdenfit compare tells."
        )
        curve = ask.ask(one_of(shape, sorted(CURVES), _CURVE))
        take(sheet, Quantity(column.plain, "angle"), column, ask)
        places.add(name, {"curve": curve, "column": column.plain})
        blanks = blanks or column.blanks > 0
    if blanks:
        why = f"{sheet.file} has blank cells, and does not say below which angle nothing could be read; write <10 in them."
        words = (
            f"{sheet.file} has blank cells, which are read as angles too small to be measured; where nothing was measured at "
            "all, delete the row instead. Below which angle could nothing be measured?"
        )
        value, unit = ask.ask(quantity(words, "angle", "10 deg", why))
        sheet.settings["detection_limit"] = {"value": value, "unit": unit}


def _several(words: str, columns: Sequence[SeenColumn], file: str) -> Question[list[SeenColumn]]:
    """A question after some of several columns."""

    def read(typed: str) -> list[SeenColumn]:
        said = typed.replace(",", " ").split()
        if not said or not all(each.isdecimal() and 1 <= int(each) <= len(columns) for each in said):
            raise UsageError(f"{shown(typed)} are none of them; write their numbers with blanks between, such as 1 2.")
        return [columns[i - 1] for i in sorted({int(each) for each in said})]

    why = f"{file} does not say which of its columns are wrap angles; write their unit into their headings."
    options = tuple(each.words for each in columns)
    return Question(f"{words} Write their numbers with blanks between.", read, None, why, "1", options)


def _length_of_rows(sheet: Sheet, places: Places, ask: Asker) -> None:
    """The column of lengths of a table whose rows were read at several."""
    found = sheet.can_be(places.length) or of_dimension(sheet, "length")
    if not found:
        raise DatasetError(
            f"{sheet.file} has no column of lengths, and the wrap angles depend on the length; add one, named as in the table "
            f"of wrap angles, {places.route['variable']}_{places.route['unit']}."
        )
    why = f"{sheet.file} does not say which of its columns is the length; name it as in the table of wrap angles."
    said = sheet.can_be(places.length) or [each for each in found if _LENGTHS.search(without_accents(each.name).lower())]
    take(sheet, places.length, said[0] if len(said) == 1 else _chosen(sheet, found, why, ask), ask)


def _chosen(sheet: Sheet, lengths: Sequence[SeenColumn], why: str, ask: Asker) -> SeenColumn:
    """The column of lengths."""
    options = [(each.words, each) for each in lengths]
    proposed = 1 if len(lengths) == 1 else None
    return ask.ask(choose(f"Which column of {sheet.file} is the length of the cable?", options, proposed, why))


def _angles_of_rows(sheet: Sheet, places: Places, ask: Asker) -> None:
    """Wrap angles that rows carry themselves: of contacts that are known, or of another."""
    for name in places.columns:
        found = sheet.can_be(Quantity(name, "angle"))
        if len(found) == 1:
            take(sheet, Quantity(name, "angle"), found[0], ask)
    left = [each for each in sheet.left if each.dimension == "angle"]
    missing = [name for name in places.columns if name not in sheet.taken]
    if not places.route and len(missing) == len(left) == 1:
        if _is_wrap_angle(sheet, left[0], ask):
            take(sheet, Quantity(missing[0], "angle"), left[0], ask)
    elif not places.contacts and len(left) == 1:
        if _is_wrap_angle(sheet, left[0], ask):
            take(sheet, Quantity(_WRAP_ANGLE, "angle"), left[0], ask)
            places.add("cable", {"column": _WRAP_ANGLE})
    elif left and not (places.columns and not places.route):
        listing = "Which of these were measured at places where the rope rubs"
        question = f"{sheet.file} has {listed([shown(each.name) for each in left])}. {listing}?"
        for column in ask.ask(_several(question, left, sheet.file)):
            take(sheet, Quantity(column.plain, "angle"), column, ask)
            name = _name(places, f"What is the place called whose wrap angle is {shown(column.name)}?", _place(column), ask)
            places.add(name, {"column": column.plain})


def _is_wrap_angle(sheet: Sheet, column: SeenColumn, ask: Asker) -> bool:
    """Whether a column of angles is that of the bench, asked where its heading does not say so."""
    if [each.name for each in sheet.can_be(Quantity(_WRAP_ANGLE, "angle"))] == [column.name]:
        return True
    why = f"{sheet.file} does not say whether its column {shown(column.name)} is the wrap angle; name it {_WRAP_ANGLE}_deg."
    return ask.ask(agree(f"Is {column.words} in {sheet.file} the angle by which the cable was wrapped?", True, why))


def _one_angle(sheets: Sequence[Sheet], places: Places, ask: Asker) -> None:
    """The wrap angle of a cable of which no table has any; recordings may each have their own."""
    recorded = [sheet for sheet in sheets if sheet.kind and sheet.kind.takes_channels]
    own = [said[0] for sheet in recorded if (said := stated_angle(sheet.path))]
    apart = len(recorded) == len(own) and len(set(own)) > 1
    if apart or (len(recorded) > 1 and not own and not ask.ask(agree("Was the wrap angle the same in all recordings?", True))):
        places.add("cable", {"column": _WRAP_ANGLE})
        return
    known = {said[0] for sheet in sheets if (said := stated_angle(sheet.path))}
    default = next(iter(known)) if len(known) == 1 else None
    files = listed([sheet.file for sheet in sheets])
    why = f"no column of {files} is a wrap angle; add one, such as wrap_angle_deg."
    words = "By which angle was the cable wrapped on the bench, all bends together, with its unit?"
    value, unit = ask.ask(quantity(words, "angle", "180 deg", why, default))
    places.add("cable", {"value": value, "unit": unit})


def _place(column: SeenColumn) -> str:
    """What a place may be called, by the heading of its wrap angle."""
    return " ".join(_ANGLE_WORDS.sub(" ", column.plain.replace("_", " ")).split()) or "cable"


def _name(places: Places, words: str, default: str | None, ask: Asker) -> str:
    """The name of a contact, which no other has."""
    return ask.ask(place_name(words, default, {each["name"] for each in places.contacts}))


def _coefficients(places: Places, ask: Asker) -> None:
    """The friction coefficient of every contact; some may share one."""
    if len(places.contacts) == 1:
        places.contacts[0]["friction"] = "mu"
        return
    ask.say("Places of the same materials may share a coefficient of friction; they then have the same name here.")
    for i, contact in enumerate(places.contacts, start=1):
        words = f"What is the coefficient of friction at {shown(contact['name'])} called?"
        contact["friction"] = ask.ask(coefficient_name(words, f"mu{i}", places.columns))
