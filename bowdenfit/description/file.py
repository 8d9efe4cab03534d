"""Reading `cable.toml`: settings from the command line on top, and errors that name the key and the nearest known one.

A description in which the template's placeholders still stand is refused by `find_placeholders`.
"""

import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from bowdenfit.description import Description, ParameterSetting, QuantityValue, Route
from bowdenfit.description.stated_parameters import check_elastic, check_shares
from bowdenfit.description.wrong_keys import explain_validation_error
from bowdenfit.errors import DatasetError, DescriptionError, Faults
from bowdenfit.inputs import read_toml_file
from bowdenfit.units import route_conversion_factor
from bowdenfit.verb import load_added_verbs
from bowdenfit.words import shown

Stated = tuple[str, QuantityValue | None, str]
"""Where a quantity stands, the quantity, and what it must measure."""

_OF_MOTORS = {
    "torque_constant": "torque_constant",
    "gear_ratio": "ratio",
    "gear_efficiency": "ratio",
    "gear_friction": "torque",
}

PLACEHOLDERS = {
    "NAME OF THE CABLE": "what the cable is called",
    "WHO MEASURED IT, WHEN, ON WHICH BENCH": "where the numbers come from, or delete the line",
    "SHORTEST": "the shortest length at which the angles were measured, a number",
    "LONGEST": "the longest length at which the angles were measured, a number",
    "WRAP ANGLE": "the angle, a number in the unit next to it",
}
"""By what is to be written in their place."""

Place = tuple[str | int, ...]
"""The keys that lead to a value."""


def read_toml(path: Path, overrides: Sequence[str] = ()) -> tuple[str, dict[str, Any]]:
    """Return text and plain data of `cable.toml`.

    Args:
        path: The file.
        overrides: Settings from the command line, such as `friction.mu1.fixed=0.1`.

    Raises:
        DescriptionError: The file is missing or no TOML, or a setting leads nowhere.
    """
    text, raw = read_toml_file(path, _suggest_remedy(path))
    return text, override(raw, overrides)


def _suggest_remedy(path: Path) -> str:
    """Return what to do where there is no cable.toml; a verb of an add-on may read the folder."""
    if not path.exists():
        for verb in load_added_verbs():
            if verb.referral and (path.parent / verb.reads).is_file():
                return verb.referral.format(folder=path.parent)
    return "name a folder that holds a cable.toml, or write one with `bowdenfit init FOLDER`"


def override(raw: dict[str, Any], overrides: Sequence[str]) -> dict[str, Any]:
    """Return plain data of a description with settings from the command line put in.

    Raises:
        DescriptionError: A setting is not of the form key=value, or its key leads nowhere.
    """
    for override in overrides:
        _set(raw, override)
    return raw


def validate(raw: Mapping[str, Any], model: type[Description], file: str) -> Description:
    """Return a description from plain data, with errors that name the key; `kinds.settings` parses those with tables.

    Args:
        raw: The data.
        model: Description with a field for every kind of table.
        file: Its file, for errors.

    Raises:
        DescriptionError: Keys are unknown, or values are missing or impossible; says all of them.
    """
    for key, value in raw.items():
        if _holds_large(value):
            raise DescriptionError(f"{file}: {shown(key)} holds a whole number of more than 19 digits, which no setting has.")
    try:
        description = model.model_validate(dict(raw))
    except ValidationError as error:
        raise explain_validation_error(error, raw, model, file) from None
    faults = Faults()
    with faults.collect():
        check_quantities(_quantities(description), file)
    with faults.collect(key_path=("route",)):
        _check_route(description.route, file)
    with faults.collect(key_path=("prior",)):
        check_elastic(description.preload, description.prior, file)
        check_shares(description.prior, file)
    faults.refuse()
    return description


def _holds_large(value: Any) -> bool:
    """Return whether a whole number beyond what TOML allows stands in a value, which Python reads all the same."""
    if isinstance(value, dict | list):
        return any(_holds_large(part) for part in (value.values() if isinstance(value, dict) else value))
    return isinstance(value, int) and not -(2**63) <= value < 2**63


def _check_route(route: Route | None, file: str) -> None:
    if route is None:
        return
    try:
        route_conversion_factor(route.unit, route.unit)
    except DatasetError as error:
        raise DescriptionError(f"{file}, route, unit: {error}.") from None


def _quantities(description: Description) -> list[Stated]:
    """Quantities of the description but for its tables."""
    cable, preload, sensors, motor = description.cable, description.preload, description.sensors, description.motor
    return [
        *((f"contact {c.name!r}, wrap_angle", c.wrap_angle.constant, "angle") for c in description.contact),
        *((f"contact {c.name!r}, nominal", c.wrap_angle.nominal, "angle") for c in description.contact),
        *((f"contact {c.name!r}, error", c.wrap_angle.error, "length") for c in description.contact),
        *((f"contact {c.name!r}, length", c.length, "length") for c in description.contact if c.length != "route"),
        ("sensors, force_noise", sensors.force_noise, "force"),
        ("sensors, input_force_noise", sensors.input_force_noise, "force"),
        ("sensors, offset_sd", sensors.offset_sd, "force"),
        ("errors, angle", description.errors.angle, "angle"),
        ("reference_force", description.reference_force, "force"),
        *((f"cable, {name}", length, "length") for name, length in cable.lengths.items()),
        ("preload, wrap_angle", preload.wrap_angle, "angle"),
        ("preload, value", preload.value, "force"),
        *(
            (f"motor, {name}", getattr(motor, name), dimension)
            for name, dimension in _OF_MOTORS.items()
            if motor is not None
        ),
    ]


def check_quantities(quantities: Iterable[Stated], file: str) -> None:
    """Refuse quantities that are impossible, or in a unit of another dimension.

    Raises:
        DescriptionError: Some are not.
    """
    faults = Faults()
    for where, quantity, dimension in quantities:
        topic, *keys = where.split(", ")
        key, *names = topic.split()  # of a contact or recording its name is known here, not its number
        with faults.collect(key_path=(key,) if names else (key, *keys)):
            if quantity is not None:
                _check_quantity(f"{file}, {where}", where, quantity, dimension)
    faults.refuse()


def _check_quantity(place: str, where: str, quantity: QuantityValue, dimension: str) -> None:
    written = f"{quantity.value:g} {quantity.unit}"
    try:
        quantity.to(dimension)
    except DatasetError as error:
        raise DescriptionError(f"{place}: {error}.") from None
    if dimension == "length" and not (quantity.value > 0 or (where == "cable, backlash" and quantity.value == 0)):
        raise DescriptionError(f"{place}: {written} is not positive; write its size, or leave the key out.")
    if where == "preload, value" and quantity.value < 0:
        raise DescriptionError(f"{place}: {written} is negative; a rope cannot be pushed, so write 0 for a slack rope.")
    if dimension == "angle" and not 0 <= quantity.to("angle") <= 34.91:
        raise DescriptionError(f"{place}: {written} is not between 0 and 2000 deg.")


def _set(raw: dict[str, Any], override: str) -> None:
    key, separator, text = override.partition("=")
    if not separator or not key.strip():
        raise DescriptionError(f"--set {override!r} is not of the form key=value, such as friction.mu1.fixed=0.1.")
    try:
        value = tomllib.loads(f"value = {text.strip()}")["value"]
    except (ValueError, RecursionError):  # a name without quotes, mostly
        value = text.strip()
    node: Any = raw
    *parents, last = key.strip().split(".")
    for depth, part in enumerate(parents):
        node = (
            node[int(part)]
            if isinstance(node, list) and part.isdecimal() and len(part) < 6 and int(part) < len(node)
            else (node.setdefault(part, {}) if isinstance(node, dict) else None)
        )
        if not isinstance(node, dict | list):
            raise DescriptionError(f"--set {override!r}: {'.'.join(parents[: depth + 1])} has no keys below it.")
    if parents[:1] in (["friction"], ["prior"]) and len(parents) == 2 and last in ParameterSetting.model_fields:
        node.clear()  # measured, prior and fixed exclude one another: the command line wins
    if isinstance(node, list):
        raise DescriptionError(f"--set {override!r}: {key} is a list; name an entry by its number, from 0.")
    node[last] = value


def find_placeholders(raw: Mapping[str, Any], text: str, file: str) -> dict[Place, DescriptionError]:
    """Return the placeholders of the template that were left in a description, by where they stand.

    Args:
        raw: Its plain data.
        text: Its text, in which the lines are looked up.
        file: Its file.
    """
    faults = {}
    for place, value in _strings(raw):
        if value in PLACEHOLDERS:
            lines = [i for i, line in enumerate(text.splitlines(), start=1) if value in line.partition("#")[0]]
            location = f"{file}, line {lines[0]}" if lines else f"{file}, {'.'.join(map(str, place))}"
            what = f"{location}: {shown(value)} is left from the template; write {PLACEHOLDERS[value]}."
            faults[place] = DescriptionError(what)
            faults[place].key_path = place
    return faults


def _strings(raw: Any, place: Place = ()) -> Iterator[tuple[Place, str]]:
    """Yield every text in plain data, with the keys that lead to it."""
    if isinstance(raw, str):
        yield place, " ".join(raw.split())
    elif isinstance(raw, dict | list):
        for key, value in raw.items() if isinstance(raw, dict) else enumerate(raw):
            yield from _strings(value, (*place, key))
