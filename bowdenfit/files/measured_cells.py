"""Cells in which a unit or an error stands behind the number: `20 N`, `45°`, `2 lb 8 oz`, `10 ± 0.2`."""

import re
from dataclasses import dataclass
from functools import lru_cache

from bowdenfit.files.cells import is_plain_number
from bowdenfit.units import dimension_of, is_unit, weight_of

_NUMBER = r"[<≤=]*\s*[+\-\u2212]?[\d.,][\d.,'’ \u00a0\u2009\u202f/]*?(?:[eE][+-]?\d+)?"
_UNIT = r"(?:[^\W\d_]|[°º%])[\w°º·*/^.%-]{0,15}"
_MEASURED = re.compile(
    rf"(?P<open>\()?\s*(?P<number>{_NUMBER})\s*(?P<unit>{_UNIT})?"
    rf"(?:\s*(?:±|\+/?-|\+/\u2212)\s*(?P<error>{_NUMBER})\s*(?P<of_error>{_UNIT})?)?"
    r"\s*(?(open)\))\s*"
    rf"(?P<behind>{_UNIT})?",
)
_TWO_UNITS = re.compile(
    r"(?P<whole>\d+)\s*(?P<unit>lbs?|lbf|ft|°|deg)\s*(?P<part>\d+(?:[.,]\d+)?)\s*(?P<of_part>ozf?|in|inch|['’′])"
)
_PARTS = {("lb", "oz"): 16, ("lbf", "ozf"): 16, ("lbf", "oz"): 16, ("ft", "in"): 12, ("°", "'"): 60}
_SPELLINGS = {"lbs": "lb", "inch": "in", "deg": "°", "’": "'", "′": "'"}
_LONGEST = 60  # characters of a cell that is no sentence; a judgement
_SINGLE_LETTERS = frozenset("Nmshg°º")  # other letters behind a number make labels, such as runs 1a and 1c


@dataclass(frozen=True)
class MeasuredCell:
    """A number with what stands behind it.

    Args:
        number: As written, with its percent sign and its mark of a limit.
        unit: Unit of the number, and of its error; empty without one.
        error: Text after ±; empty without it.
    """

    number: str
    unit: str
    error: str


@lru_cache(1 << 14)  # many cells hold the same
def split_measured(text: str) -> MeasuredCell | None:
    """Return the parts of a cell that holds a number and its unit, or its error, or both; None for anything else."""
    plain = text.strip()
    if not plain or len(plain) > _LONGEST or (plain[-1].isdigit() and "±" not in plain and "+" not in plain[1:]):
        return None  # quickly, for the many cells that hold a number alone
    if both := _TWO_UNITS.fullmatch(plain):
        return _join_two_units(both)
    match = _MEASURED.fullmatch(plain)
    if match is None or not is_plain_number(match["number"].lstrip("<≤= ")):
        return None
    number, error = match["number"].strip(), (match["error"] or "").strip()
    units = {unit for unit in (match["unit"], match["behind"], match["of_error"]) if unit}
    if len(units) > 1 or not (units or error) or (error and not is_plain_number(error)):
        return None
    unit = next(iter(units), "")
    if unit != "%":
        return MeasuredCell(number, unit, error) if not unit or _is_usual(unit) else None
    # Without one at the number, 2 % may be a share of the number
    return MeasuredCell(f"{number} %", "", f"{error} %") if error and (match["unit"] or match["behind"]) else None


def is_reading(text: str) -> bool:
    """Return whether a cell holds a number with its unit or error."""
    return split_measured(text) is not None


@lru_cache(1 << 14)  # it is asked of every cell again and again, and many cells hold the same
def is_measured(text: str) -> bool:
    """Return whether a cell holds what a table measures: a number with or without a unit, a percentage, a limit such as <10."""
    return is_plain_number(text.strip().rstrip("%").lstrip("<≤=")) or is_reading(text)


def _is_usual(unit: str) -> bool:
    """Return whether tables measure something in a unit, so that "1 A" stays the label that it usually is."""
    if len(unit) == 1 and unit not in _SINGLE_LETTERS:
        return False
    return bool(weight_of(unit)) or (is_unit(unit) and dimension_of(unit) not in ("other", "ratio", "current"))


def _join_two_units(match: re.Match[str]) -> MeasuredCell | None:
    """Return a number in the larger of two units, such as pounds and ounces."""
    unit, of_part = (_SPELLINGS.get(match[name], match[name]) for name in ("unit", "of_part"))
    parts, part = _PARTS.get((unit, of_part)), float(match["part"].replace(",", "."))
    return MeasuredCell(repr(int(match["whole"]) + part / parts), unit, "") if parts and part < parts else None
