"""What the template of `bowdenfit init` leaves open: nobody's cable is called that, and no angle is in capitals."""

from collections.abc import Iterator, Mapping
from typing import Any

from bowdenfit.errors import DescriptionError
from bowdenfit.words import shown

PLACEHOLDERS = {
    "NAME OF THE CABLE": "what the cable is called",
    "WHO MEASURED IT, WHEN, ON WHICH BENCH": "where the numbers come from, or delete the line",
    "SHORTEST": "the shortest length at which the angles were measured, a number",
    "LONGEST": "the longest length at which the angles were measured, a number",
    "WRAP ANGLE": "the angle, a number in the unit beside it",
}
"""By what is to be written in their place."""

Place = tuple[str | int, ...]
"""The keys that lead to a value."""


def find_placeholders(raw: Mapping[str, Any], text: str, file: str) -> dict[Place, DescriptionError]:
    """The placeholders of the template that were left in a description, by where they stand.

    Args:
        raw: Its plain data.
        text: Its text, in which the lines are looked up.
        file: Its file.
    """
    faults = {}
    for place, value in _strings(raw):
        if value in PLACEHOLDERS:
            lines = [i for i, line in enumerate(text.splitlines(), start=1) if value in line.partition("#")[0]]
            where = f"{file}, line {lines[0]}" if lines else f"{file}, {'.'.join(map(str, place))}"
            what = f"{where}: {shown(value)} is left from the template; write {PLACEHOLDERS[value]}."
            faults[place] = DescriptionError(what)
            faults[place].key_path = place
    return faults


def _strings(raw: Any, place: Place = ()) -> Iterator[tuple[Place, str]]:
    """Every text in plain data, with the keys that lead to it."""
    if isinstance(raw, str):
        yield place, " ".join(raw.split())
    elif isinstance(raw, dict | list):
        for key, value in raw.items() if isinstance(raw, dict) else enumerate(raw):
            yield from _strings(value, (*place, key))
