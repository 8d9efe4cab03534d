"""A wrap angle that stands somewhere in a file or in its name, proposed to the user and never taken silently."""

import re
from pathlib import Path

from bowdenfit.errors import DatasetError
from bowdenfit.files.contents import TEXT
from bowdenfit.files.spellings import without_accents
from bowdenfit.files.text_file import first_bytes, first_lines

_FIRST_BYTES = 1 << 15
_UNIT = r"(?P<{}>degrees|degree|deg|°|º|grad|rad)"
_NUMBER = r"(?P<{}>\d+(?:[.,]\d+)?)"
_WORD = r"(?:wrap\w*|bend\w*|umschling\w*|umlenk\w*|biegewinkel|winkel|enroulement|abraz\w*|avvolgimento|ang[lou]\w*)"
_GAP = r"[^\d\n]{0,24}?"
_IN_TEXT = re.compile(
    rf"\b{_WORD}\b{_GAP}(?:{_NUMBER.format('a')}[\s;,\"]{{0,3}}{_UNIT.format('b')}"
    rf"|[(\[]{_UNIT.format('c')}[)\]][\s:=;,\"]{{0,4}}{_NUMBER.format('d')})",
    re.IGNORECASE,
)
_IN_NAME = re.compile(rf"(?<![\d.]){_NUMBER.format('a')}[\s_-]?{_UNIT.format('b')}(?![a-z])", re.IGNORECASE)


def stated_angle(path: Path) -> tuple[str, str] | None:
    """The wrap angle that a file states, such as "90deg", and where; None if it states none, or several.

    Args:
        path: The file; only the first lines of a text are looked at.
    """
    found = {_angle(match): "a line of the file" for line in _lines(path) for match in _IN_TEXT.finditer(line)}
    found = found or {_angle(match): "its name" for match in _IN_NAME.finditer(path.stem)}
    return next(iter(found.items())) if len(found) == 1 else None


def _angle(match: re.Match[str]) -> str:
    said = match.groupdict()
    number, unit = said["a"] or said.get("d") or "", said["b"] or said.get("c") or ""
    return number.replace(",", ".") + ("rad" if unit.lower() == "rad" else "deg")


def _lines(path: Path) -> list[str]:
    """The first lines of a text without accents; none of another file."""
    if path.suffix.lower() not in TEXT:
        return []
    try:
        _, lines = first_lines(first_bytes(path, _FIRST_BYTES), path.name, whole=False)
    except DatasetError:
        return []
    return [without_accents(line.text) for line in lines]
