"""What is wrong with the keys of a description, each in a sentence, and no fault twice."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from pydantic import BaseModel, ValidationError

from bowdenfit.description import SCHEMA, QuantityValue
from bowdenfit.errors import BowdenfitError, DescriptionError, combine_errors, suggest_name
from bowdenfit.words import shown

_INIT = "`bowdenfit init` writes a template that has it"
_MOST_UNKNOWN = 100  # unknown keys of a file for which a known one is looked for that is meant; no message names more
_FEWER = {
    "contact": "join contacts of the same coefficient, because their wrap angles add up",
    "choices": "name the lengths that can be bought, or leave them out and take the best length of all",
    "recording": "fit the recordings of each cable by themselves",
}
_TIMES = ("delay", "clock_shift", "block")
_LITERAL = "literal["  # as pydantic calls the words among the alternatives of a key
_ALIKE = 0.5  # judged: difflib's likeness from which an unknown key is taken for a misspelled one
_LONGEST_KEY = 80  # letters that are said of one
_LARGE = 1e15  # a number that nobody measures


def explain_validation_error(
    error: ValidationError,
    raw: Mapping[str, Any],
    model: type[BaseModel],
    file: str,
    remedy: str = _INIT,
    units: Mapping[str, str] | None = None,
) -> BowdenfitError:
    """Return all that is wrong with the keys of a file.

    Args:
        error: Error raised by the model.
        raw: The plain data.
        model: Model of the file.
        file: Its name.
        remedy: Fix for a missing key.
        units: Units of quantities by key, for examples of how to write one.
    """
    faults: list[BowdenfitError] = []
    for number, cause in enumerate(_causes(error, raw, model)):
        of = model if number < _MOST_UNKNOWN else BaseModel
        for message in cause["msg"].removeprefix("Value error, ").splitlines():
            fault = DescriptionError(_sentence({**cause, "msg": message}, of, file, remedy, units or {}))
            fault.key_path = tuple(cause["loc"])
            faults.append(fault)
    return combine_errors(faults)


def _causes(error: ValidationError, raw: Mapping[str, Any], model: type[BaseModel]) -> list[dict[str, Any]]:
    """Return the errors without what others bring about: what is misspelled is not missing too, and a value has one fault."""
    errors: list[dict[str, Any]] = [dict(fault) for fault in error.errors()]
    meant = set()
    unknown = [fault for fault in errors if fault["type"] == "extra_forbidden"]
    for fault in unknown[:_MOST_UNKNOWN]:
        *parents, name = fault["loc"]
        near = get_close_matches(str(name), _siblings(model, [*map(str, parents)]), n=1, cutoff=_ALIKE)
        meant |= {(*parents, key) for key in near}
    kept: dict[Any, dict[str, Any]] = {}
    for fault in errors:
        written = _written(fault["loc"], raw)
        lacking = fault["type"] == "missing" and len(fault["loc"]) == len(written) + 1
        if not (lacking and tuple(fault["loc"]) in meant):
            kept.setdefault(tuple(fault["loc"]) if lacking else written, fault)
    parents_of_others = {place[:length] for place in kept for length in range(len(place))}
    return [fault for place, fault in kept.items() if place not in parents_of_others]


def _written(place: Sequence[str | int], raw: Any) -> tuple[str | int, ...]:
    """As many of the keys that lead to an error as stand in the file; behind them are alternatives that a value may have."""
    keys: list[str | int] = []
    for key in place:
        inside = isinstance(key, int) and key < len(raw) if isinstance(raw, list) else isinstance(raw, dict) and key in raw
        if not inside:
            break
        keys.append(key)
        raw = raw[key]
    return tuple(keys)


def _sentence(error: Mapping[str, Any], model: type[BaseModel], file: str, remedy: str, units: Mapping[str, str]) -> str:
    """Return what is wrong with one key."""
    where = [str(part) for part in error["loc"]]
    is_alternative = bool(where) and where[-1].startswith(_LITERAL)  # words in place of a quantity
    where = where[:-1] if is_alternative else where
    parts = [part if len(part) <= _LONGEST_KEY else f"{part[:_LONGEST_KEY]}..." for part in where]
    place = f"{file}, {'.'.join(parts)}" if where else file
    if error["type"] == "extra_forbidden":
        return f"{file}: unknown key {shown('.'.join(where))}{suggest_name(where[-1][:80], _siblings(model, where[:-1]))}"
    if error["type"] == "missing" and where[-1] == "unit" and isinstance(error["input"], dict):
        return f"{place}: the unit is missing; write one, such as {_with_unit(error['input'].get('value'), where[:-1], units)}."
    if error["type"] == "missing" and "exclude" in where:
        return f"{place}: missing; say which rows are left out and why, {{ rows = [7], reason = \"the rope jumped\" }}."
    if error["type"] == "missing":
        return f"{file}: the key {'.'.join(where)!r} is missing; {remedy}."
    if error["type"] == "model_type":
        return f"{place}: {_written_as(error, where, units)}"
    if error["type"] == "too_long":
        most = error["ctx"]["max_length"]
        remedy = _FEWER.get(where[-1], "keep the entries that matter")
        return f"{place}: there are {len(error['input']):,} entries, and at most {most:,} are read; {remedy}."
    message = error["msg"]
    if where == ["schema"] and isinstance(error["input"], int) and error["input"] > SCHEMA:
        message = f"schema {shown(error['input'])} is newer than this program, which reads up to {SCHEMA}; update bowdenfit"
    value = f" (found {shown(error['input'])})" if not isinstance(error["input"], dict | list) and where else ""
    if is_alternative:
        message += f", or a number with its unit, such as {_with_unit(None, where, units)}"
    sentence = f"{place}: {message[:1].lower() + message[1:]}{value}"
    return sentence if sentence.endswith((".", "?")) else f"{sentence}."


def _written_as(error: Mapping[str, Any], where: Sequence[str], units: Mapping[str, str]) -> str:
    """Return how to write what must be a table of keys."""
    value = error["input"]
    if error.get("ctx", {}).get("class_name") == QuantityValue.__name__:
        return f"a number needs its unit (found {shown(value)}); write it as {_with_unit(value, where, units)}."
    how = f"under [{where[0]}]" if len(where) == 1 else "between braces, { key = ... }"
    return f"this holds keys of its own (found {shown(value)}); write them {how}."


def _with_unit(value: Any, where: Sequence[str], units: Mapping[str, str]) -> str:
    """Return a number with a unit that fits its place, as TOML."""
    number = value if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < _LARGE else 20
    key = ".".join(where)
    unit = units.get(key, "mm")
    unit = "ms" if where[-1] in _TIMES else unit
    unit = "deg" if "angle" in key else "N" if "force" in key or key == "preload.value" else unit
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
    """Return the first model inside an annotation such as `tuple[ContactSettings, ...]` or `Route | None`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        model = _models_in(argument)
        if model is not None:
            return model
    return None
