"""Units, at the border only: whatever a table is written in becomes N, mm, rad and s here and nowhere else."""

import math
import re
from functools import cache
from typing import TYPE_CHECKING, Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator

from bowdenfit.errors import DatasetError
from bowdenfit.words import shown

if TYPE_CHECKING:
    import pint

LARGEST = 1e15  # of anything measured, in internal units; beyond it sums of squares leave the range of numbers
INTERNAL_UNITS = {
    "force": "N",
    "length": "mm",
    "angle": "rad",
    "time": "s",
    "velocity": "mm/s",
    "angular_velocity": "rad/s",
    "torque": "N*mm",
    "current": "A",
    "torque_constant": "N*mm/A",
    "ratio": "1",
    "inertia": "kg*m^2",
    "angular_damping": "N*m*s/rad",
    "angular_stiffness": "N*m/rad",
    "stiffness": "N/mm",
    "rate": "1/s",
}
_EXAMPLES = {
    "force": "N, kN, lbf, kgf",
    "length": "mm, cm, m, inch",
    "angle": "deg, rad, turn",
    "time": "s, ms",
    "velocity": "mm/s, m/s",
    "angular_velocity": "r/min, rad/s, deg/s",
    "torque": "N*m, N*mm, lbf*inch",
    "current": "A, mA",
    "torque_constant": "N*m/A, mN*m/A",
    "ratio": "%, 1",
    "inertia": "kg*m^2, g*cm^2",
    "angular_damping": "N*m*s/rad, N*mm*s/rad",
    "angular_stiffness": "N*m/rad, N*m/deg",
    "stiffness": "N/mm, kN/m",
    "rate": "1/s, 1/min",
}
# What most tables are written in, with the factor to the internal unit: pint's registry takes a fifth of a second to make.
_COMMON_UNITS = {
    "N": ("force", 1.0),
    "kN": ("force", 1000.0),
    "mm": ("length", 1.0),
    "cm": ("length", 10.0),
    "m": ("length", 1000.0),
    "deg": ("angle", math.radians(1.0)),
    "rad": ("angle", 1.0),
    "s": ("time", 1.0),
    "ms": ("time", 0.001),
    "mm/s": ("velocity", 1.0),
    "m/s": ("velocity", 1000.0),
    "rad/s": ("angular_velocity", 1.0),
    "deg/s": ("angular_velocity", math.radians(1.0)),
    "r/min": ("angular_velocity", math.pi / 30),
    "rpm": ("angular_velocity", math.pi / 30),
    "N*mm": ("torque", 1.0),
    "N*m": ("torque", 1000.0),
    "%": ("ratio", 0.01),
    "1": ("ratio", 1.0),
    "kg*m^2": ("inertia", 1.0),
    "N*m*s/rad": ("angular_damping", 1.0),
    "N*m/rad": ("angular_stiffness", 1.0),
    "N/mm": ("stiffness", 1.0),
}
_WEIGHTS = {"kg": "kgf", "g": "gf", "lb": "lbf", "lbs": "lbf", "pound": "lbf", "pounds": "lbf", "oz": "ozf"}
_PINT_NAMES = {"r/min": "rpm", "rev/min": "rpm", "1/min": "rpm", "u/min": "rpm", "newton": "N", "newtons": "N",
               "sec": "s", "sek": "s", "msec": "ms"}  # fmt: skip
# As engineers write torques without a sign between; to pint Nm is a number of yarn.
_TORQUES = {"Nm": "N*m", "Nmm": "N*mm", "Ncm": "N*cm", "mNm": "mN*m", "kNm": "kN*m", "Nm/A": "N*m/A", "mNm/A": "mN*m/A"}
# Names with products, quotients and small powers. Pint would compute whatever else it is given, such as 9**9**9.
_UNIT_TEXT = re.compile(r"[\w°%‰/*^().·\s-]{1,40}")
_MULTIPLE = re.compile(r"[x×*]? ?(?P<factor>10+) ?[x×*]? ?(?P<unit>[^\W\d].*)")  # (x10 N), (100 N)
_DEGREE, _DEGREE_OR_GON = re.compile(r"\bGrad\b"), re.compile(r"\bgrad\b")  # the first is German, and giga-radians to pint
_NO_UNIT = re.compile(r"\d\d|%%|(?:\*\*|\^)[\s(-]*\d[\s)]*(?:\*\*|\^)")


class ColumnSource(BaseModel):
    """Where the user says a quantity stands: the heading as written in the file, and its unit."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    unit: str | None = None


class ChannelSource(ColumnSource):
    """The same of a channel, which may hold counts or volts: a quantity is gain x (what the file says - offset), in the unit.

    The gain is what one count is worth, the offset what the file says of no load, in counts; without a gain, in the unit.
    """

    gain: Annotated[float, Field(allow_inf_nan=False)] = 1.0
    offset: Annotated[float, Field(allow_inf_nan=False)] = 0.0

    @model_validator(mode="after")
    def _gain_has_a_unit(self) -> "ChannelSource":
        if self.gain == 0:
            raise ValueError("a gain of 0 makes nothing of every reading; write what one count is worth")
        if self.gain != 1 and self.unit is None:
            raise ValueError(
                f"gain = {self.gain:g} says what one count of {self.name} is worth, but not in which unit; write unit = \"N\" "
                "(or the unit it is in) next to it"
            )
        return self


@cache
def _registry() -> "pint.UnitRegistry":
    """Pint's registry, made at the first conversion (it takes a fifth of a second)."""
    import pint

    return pint.UnitRegistry(cache_folder=None)


def usual_units(dimension: str) -> list[str]:
    """Return the usual units of a dimension, the most usual first; none where there are none."""
    return _EXAMPLES[dimension].split(", ") if dimension in _EXAMPLES else []


def is_unit(text: str) -> bool:
    """Return whether `text` is a unit that pint reads."""
    if text in _COMMON_UNITS:
        return True
    try:
        _parsed(text)
    except DatasetError:
        return False
    return True


def measures(unit: str, dimension: str) -> bool:
    """Return whether `unit` is a unit of a kind of quantity, such as "force"."""
    return is_unit(unit) and dimension_of(unit) == dimension


def multiple_of(text: str) -> tuple[str, str] | None:
    """Return the factor and the unit of a multiple of ten in the place of a unit, such as "x10 N"; None for any other text."""
    match = _MULTIPLE.fullmatch(text.strip())
    return (match["factor"], match["unit"]) if match and is_unit(match["unit"]) else None


@cache
def dimension_of(unit: str) -> str:
    """Return which of the kinds of quantity in `INTERNAL_UNITS` a unit measures, or "other"."""
    if unit in _COMMON_UNITS:
        return _COMMON_UNITS[unit][0]
    parsed = _parsed(unit)
    for dimension, internal in INTERNAL_UNITS.items():
        if _same_kind(parsed, _parsed(internal)):
            return dimension
    return "other"


def weight_of(unit: str) -> str:
    """Return the unit of force that the weight of a unit of mass is; empty for any other unit."""
    return _WEIGHTS.get(unit.strip(), "")


def speed_dimension(unit: str) -> str:
    """Return whether a unit of speed is one of the motor ("angular_velocity") or of the rope ("velocity").

    Anything else counts as one of the rope, and is refused when it is converted.
    """
    return "angular_velocity" if measures(unit, "angular_velocity") else "velocity"


def conversion_factor(unit: str, dimension: str, to: str | None = None) -> float:
    """Return the factor from `unit` to the internal unit of `dimension` (or to another unit of the same kind).

    Args:
        unit: Unit as written by the user, anything pint reads.
        dimension: One of `INTERNAL_UNITS`.
        to: Target unit, the internal one if omitted.

    Raises:
        DatasetError: The unit is unknown, or measures something else.
    """
    of_usual, factor = _COMMON_UNITS.get(unit, ("", 0.0))
    if of_usual == dimension and to in (None, INTERNAL_UNITS[dimension]):
        return factor
    if (of_usual and of_usual != dimension) or not _same_kind(_parsed(unit), _parsed(to or INTERNAL_UNITS[dimension])):
        hint = f" ({unit} is a mass: for the weight of that mass write {weight_of(unit)})" if weight_of(unit) else ""
        raise DatasetError(
            f"the unit {shown(unit)} does not measure {'an' if dimension[0] in 'aeiou' else 'a'} "
            f"{dimension.replace('_', ' ')}{hint}; "
            f"use one such as {_EXAMPLES.get(dimension, to)}"
        )
    target = _parsed(to or INTERNAL_UNITS[dimension])
    return float(_registry().Quantity(1.0, _parsed(unit)).to(target).magnitude)


def differing_units(one: str, other: str) -> str:
    """Return in words how two units differ; empty where they are the same."""
    if one == other or weight_of(one) == other or weight_of(other) == one:
        return ""
    if not _same_kind(_parsed(one), _parsed(other)):
        return "which measures something else"
    ratio = float(_registry().Quantity(1.0, _parsed(one)).to(_parsed(other)).magnitude)
    return "" if math.isclose(ratio, 1.0) else f"and 1 {one} is {ratio:.4g} {other}"


def contradiction(stated: str | None, written: str | None) -> str:
    """Return in words that a stated unit is another than the one written over the numbers; empty where they agree."""
    stated = (stated or "").strip().lstrip("-\u2212")
    if not stated or not written or not (is_unit(stated) and is_unit(written)):
        return ""
    if not _same_kind(_parsed(stated), _parsed(written)):  # which is refused where it is converted
        return ""
    if math.isclose(float(_registry().Quantity(1.0, _parsed(stated)).to(_parsed(written)).magnitude), 1.0):
        return ""
    return (
        f"its heading says {written} and the option, or cable.toml, says {stated}; correct the one that is wrong, or leave the "
        "unit out of the option"
    )


def route_conversion_factor(unit: str, to: str) -> float:
    """Return the factor between two units of the route variable, whatever it measures.

    Raises:
        DatasetError: A unit is unknown, or the two measure different things.
    """
    if unit == to and unit in _COMMON_UNITS:
        return 1.0
    parsed, target = _parsed(unit), _parsed(to)
    if not _same_kind(parsed, target):
        raise DatasetError(f"the unit {shown(unit)} cannot be converted to {to!r}, the unit of [route] in cable.toml")
    return float(_registry().Quantity(1.0, parsed).to(target).magnitude)


@cache
def _parsed(unit: str) -> "pint.Unit":
    text = unit.strip().replace("º", "°")  # the ordinal sign of Spanish and Italian keyboards
    unknown = f"the unit {shown(unit)} is not known; use one such as N, lbf, mm, inch, deg, rad, %"
    if text in {"1", "-", ""}:
        text = "dimensionless"
    text = _DEGREE.sub("deg", _PINT_NAMES.get(text.lower(), _TORQUES.get(text, text)))
    if _DEGREE_OR_GON.search(text):
        raise DatasetError(
            f"the unit {shown(unit)} is a degree in German and a hundredth of a right angle elsewhere; write deg, or gradian"
        )
    if multiple := multiple_of(text):
        factor, single = multiple
        raise DatasetError(
            f"the unit {shown(unit)} is a multiple, which is not read; multiply the numbers by {factor} and write {single}"
        )
    if not _UNIT_TEXT.fullmatch(text) or _NO_UNIT.search(text):
        raise DatasetError(unknown)
    try:
        parsed = _registry().parse_units(text)
        zero = _registry().Quantity(0.0, parsed).to_root_units().magnitude
    except Exception as error:  # pint raises many kinds: tokenizer, attribute, value and assertion errors
        raise DatasetError(unknown) from error
    if zero != 0:
        raise DatasetError(f"the unit {shown(unit)} does not count from zero (dB and degC do not); use one that does")
    return parsed


def _same_kind(a: "pint.Unit", b: "pint.Unit") -> bool:
    """Same dimension; and an angle is not a ratio, although both are without dimension."""
    root_a, root_b = (_registry().Quantity(1.0, unit).to_root_units().units for unit in (a, b))
    return bool(root_a == root_b)
