"""Headings of recordings: the name of each column and the unit that stands with it."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from bowdenfit.files.clocks import names_time
from bowdenfit.units import is_unit

_BRACKETED = re.compile(r"^(?P<name>.*?)[\s_]*[\[(](?P<unit>[^\])]*)[\])]\s*$")
_LONGEST = 200
_NUMBER = re.compile(r"[+-]?\d+(?:[.,]\d+)?")
# `F_in` is no force in inches, nor `cell_A` one in ampere: behind a name only what cannot be a word counts as unit.
_SUFFIXES = (
    "N kN mN lbf kgf gf ozf newton Nm Nmm mNm N*m N*mm V mV uV mV/V V/V mA Pa kPa MPa bar psi kg mm cm m um inch mm/s m/s "
    "cm/s rad deg degree degrees rad/s deg/s rpm s ms us ns min h sec seconds Hz"
)
_FORCES = {"N", "kN", "mN", "lbf", "kgf"}


@dataclass(frozen=True)
class Heading:
    """Name and unit of a column; both empty where the file says nothing."""

    name: str
    unit: str = ""


def heading_of(text: str, unit: str = "") -> Heading:
    """Name and unit in one heading: "Force (N)" is "Force" in N; `force_N` keeps its name and is in N as well.

    Args:
        text: Heading as written.
        unit: Unit from a line of its own under the heading; empty if there is none.
    """
    plain = " ".join(text.split())
    if unit := without_brackets(unit):
        return Heading(plain, unit)
    name, unit = split_brackets(plain)
    if name and unit not in {"", "-", "1"} and is_unit(unit):
        return Heading(name, unit)
    return Heading(plain, _unit_behind(plain))


def split_brackets(heading: str) -> tuple[str, str]:
    """The name and what stands in brackets behind it; all of the heading where nothing does."""
    match = _BRACKETED.match(heading[:_LONGEST])
    return (match["name"], match["unit"].strip()) if match else (heading, "")


def without_brackets(unit: str) -> str:
    """A unit without the brackets around it."""
    return unit.strip().strip("[]()").strip()


def is_units_row(cells: Sequence[str]) -> bool:
    """Whether a row holds nothing but units, as "s;N;N" or "[s],[N]"; LVM and others leave some blank."""
    written = [without_brackets(cell) for cell in cells if cell.strip()]
    return bool(written) and all(is_unit(unit) for unit in written) and not all(map(names_time, written))


def is_number(text: str) -> bool:
    """Whether a heading is only a number, as the wrap angle over the columns of a run."""
    return bool(_NUMBER.fullmatch(text.strip()))


def without_label(cells: Sequence[str]) -> list[str]:
    """A row of numbers over columns ("Angle", 45, 45, 90) without the word before it that says what they are."""
    filled = [i for i, cell in enumerate(cells) if cell.strip()]
    labeled = len(filled) > 1 and not is_number(cells[filled[0]]) and all(is_number(cells[i]) for i in filled[1:])
    if labeled and not names_time(cells[filled[0]]):
        return ["" if i == filled[0] else cell for i, cell in enumerate(cells)]
    return list(cells)


def pair_clocks(headings: Sequence[Heading], rising: Sequence[bool], numeric: Sequence[bool]) -> tuple[Heading, ...]:
    """Names for the nameless clocks of sheets that have one heading for each pair of time and force.

    The heading stands over the force, over the time (as a merged cell does), or over both.

    Args:
        headings: One for each column.
        rising: Whether the values of the column rise in even steps.
    """
    named = list(headings)
    for i in range(len(named) - 1):
        here, right = named[i], named[i + 1]
        if not rising[i] or rising[i + 1] or not numeric[i + 1] or names_time(here.name):
            continue
        if not here.name and right.name and not names_time(right.name):
            named[i] = Heading(f"time of {right.name}", here.unit)
        elif here.name and (not right.name or (right.name == here.name and is_number(here.name))):
            named[i], named[i + 1] = Heading(f"time of {here.name}"), replace(here, unit=right.unit or here.unit)
    return tuple(named)


def _unit_behind(heading: str) -> str:
    """Unit in `input_force_N`, `velocity_mm_per_s`, "Force N" or `force_N_45deg_trial1`."""
    words = re.split(r"[\s_]+", heading)
    for start in range(1, len(words)):
        candidate = "_".join(words[start:]).replace("_per_", "/")
        if candidate in _SUFFIXES.split():
            return candidate
    return next((word for word in words[1:] if word in _FORCES), "")
