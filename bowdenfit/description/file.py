"""Reading `cable.toml`: settings from the command line on top, and errors that name the key and the nearest known one."""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from bowdenfit.description import SCHEMA, Description, ParameterSetting, QuantityValue, Route
from bowdenfit.description.elastic import check_elastic
from bowdenfit.errors import DatasetError, DescriptionError, nearest
from bowdenfit.inputs import read_toml_file
from bowdenfit.units import route_conversion_factor
from bowdenfit.words import shown

Stated = tuple[str, QuantityValue | None, str]
"""Where a quantity stands, the quantity, and what it must measure."""


def read_toml(path: Path, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Plain data of `cable.toml`.

    Args:
        path: The file.
        overrides: Settings from the command line, such as `friction.mu1.fixed=0.1`.

    Raises:
        DescriptionError: The file is missing or no TOML, or a setting leads nowhere.
    """
    remedy = "name a folder that holds a cable.toml, or write one with `bowdenfit init FOLDER`"
    return override(read_toml_file(path, remedy)[1], overrides)


def override(raw: dict[str, Any], overrides: Sequence[str]) -> dict[str, Any]:
    """Plain data of a description with settings from the command line put in.

    Raises:
        DescriptionError: A setting is not of the form key=value, or its key leads nowhere.
    """
    for override in overrides:
        _set(raw, override)
    return raw


def validate(raw: Mapping[str, Any], model: type[Description], file: str) -> Description:
    """A description from plain data, with errors that name the key; `kinds.settings` parses those with tables.

    Args:
        raw: The data.
        model: Description with a field for every kind of table.
        file: Its file, for errors.

    Raises:
        DescriptionError: A key is unknown, or a value is missing or impossible.
    """
    try:
        description = model.model_validate(dict(raw))
    except ValidationError as error:
        raise DescriptionError(explain(error, model, file)) from None
    check_quantities(_quantities(description), file)
    _check_route(description.route, file)
    check_elastic(description.preload, description.prior, file)
    return description


def _check_route(route: Route | None, file: str) -> None:
    if route is None:
        return
    try:
        route_conversion_factor(route.unit, route.unit)
    except DatasetError as error:
        raise DescriptionError(f"{file}, route, unit: {error}.") from None


def _quantities(description: Description) -> list[Stated]:
    """Quantities of the description but for its tables."""
    cable, preload, sensors = description.cable, description.preload, description.sensors
    return [
        *((f"contact {c.name!r}, wrap_angle", c.wrap_angle.constant, "angle") for c in description.contact),
        *((f"contact {c.name!r}, nominal", c.wrap_angle.nominal, "angle") for c in description.contact),
        ("sensors, force_noise", sensors.force_noise, "force"),
        ("sensors, input_force_noise", sensors.input_force_noise, "force"),
        ("sensors, offset_sd", sensors.offset_sd, "force"),
        ("reference_force", description.reference_force, "force"),
        *((f"cable, {name}", length, "length") for name, length in cable.lengths.items()),
        ("preload, wrap_angle", preload.wrap_angle, "angle"),
        ("preload, value", preload.value, "force"),
    ]


def check_quantities(quantities: Iterable[Stated], file: str) -> None:
    """Every quantity is in a unit of the right dimension, and possible.

    Raises:
        DescriptionError: One is not.
    """
    for where, quantity, dimension in quantities:
        if quantity is None:
            continue
        try:
            quantity.to(dimension)
        except DatasetError as error:
            raise DescriptionError(f"{file}, {where}: {error}.") from None
        if dimension == "length" and not (quantity.value > 0 or (where == "cable, backlash" and quantity.value == 0)):
            raise DescriptionError(
                f"{file}, {where}: {quantity.value:g} {quantity.unit} is not positive; write its size, or leave the key out."
            )
        if where == "preload, value" and quantity.value < 0:
            raise DescriptionError(
                f"{file}, {where}: {quantity.value:g} {quantity.unit} is negative; a rope cannot be pushed, so write 0 for a "
                "slack rope."
            )
        if dimension == "angle" and not 0 <= quantity.to("angle") <= 34.91:
            raise DescriptionError(
                f"{file}, {where}: {quantity.value:g} {quantity.unit} is not between 0 and 2000 deg."
            )


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
            if isinstance(node, list) and part.isdecimal() and int(part) < len(node)
            else (node.setdefault(part, {}) if isinstance(node, dict) else None)
        )
        if not isinstance(node, dict | list):
            raise DescriptionError(f"--set {override!r}: {'.'.join(parents[: depth + 1])} has no keys below it.")
    if parents[:1] in (["friction"], ["prior"]) and len(parents) == 2 and last in ParameterSetting.model_fields:
        node.clear()  # measured, prior and fixed exclude one another: the command line wins
    if isinstance(node, list):
        raise DescriptionError(f"--set {override!r}: {key} is a list; name an entry by its number, from 0.")
    node[last] = value


def explain(
    error: ValidationError,
    model: type[BaseModel],
    file: str,
    remedy: str = "`bowdenfit init` writes a template that has it",
) -> str:
    """The first thing that is wrong in a file, as a sentence; `remedy` is for a key that is missing."""
    first = next((e for e in error.errors() if e["type"] == "extra_forbidden"), error.errors()[0])
    where = [str(part) for part in first["loc"]]
    place = f"{file}, {'.'.join(where)}" if where else file
    if first["type"] == "extra_forbidden":
        return f"{file}: unknown key {'.'.join(where)!r}{nearest(where[-1], _siblings(model, where[:-1]))}"
    if first["type"] == "missing" and where[-1] == "unit" and isinstance(first["input"], dict):
        return (
            f"{place}: the unit is missing; write one, such as {_with_unit(first['input'].get('value'), where[:-1])}."
        )
    if first["type"] == "missing":
        return f"{file}: the key {'.'.join(where)!r} is missing; {remedy}."
    if first["type"] == "model_type":
        return f"{place}: {_written_as(first, where)}"
    message = first["msg"].removeprefix("Value error, ")
    if where == ["schema"]:
        message = f"schema {first['input']} is newer than this program, which reads up to {SCHEMA}; update bowdenfit"
    found = f" (found {shown(first['input'])})" if not isinstance(first["input"], dict | list) and where else ""
    sentence = f"{place}: {message[:1].lower() + message[1:]}{found}"
    return sentence if sentence.endswith((".", "?")) else f"{sentence}."


def _written_as(error: Mapping[str, Any], where: Sequence[str]) -> str:
    """How to write what must be a table of keys."""
    found = error["input"]
    if error.get("ctx", {}).get("class_name") == QuantityValue.__name__:
        return f"a number needs its unit (found {shown(found)}); write it as {_with_unit(found, where)}."
    how = f"under [{where[0]}]" if len(where) == 1 else "between braces, { key = ... }"
    return f"this holds keys of its own (found {shown(found)}); write them {how}."


def _with_unit(value: Any, where: Sequence[str]) -> str:
    """A number with a unit that fits its place, as TOML."""
    number = value if isinstance(value, int | float) and not isinstance(value, bool) else 20
    key = ".".join(where)
    unit = "deg" if "angle" in key else "N" if "force" in key or key == "preload.value" else "mm"
    return f'{{ value = {number}, unit = "{unit}" }}'


def _siblings(model: Any, path: Sequence[str]) -> list[str]:
    """Keys that are known at a place in the description."""
    for part in path:
        if isinstance(model, type) and issubclass(model, BaseModel) and part in model.model_fields:
            model = _models_in(model.model_fields[part].annotation)
    if not (isinstance(model, type) and issubclass(model, BaseModel)):
        return []
    return [field.alias or name for name, field in model.model_fields.items()]


def _models_in(annotation: Any) -> Any:
    """The first model inside an annotation such as `tuple[Contact, ...]` or `Route | None`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        found = _models_in(argument)
        if found is not None:
            return found
    return None
