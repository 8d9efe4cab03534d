"""Values of a description as they are typed into a field, and as TOML has them."""

import re
import tomllib
from collections.abc import Collection, Mapping
from contextlib import suppress
from typing import Any

import tomlkit
from tomlkit.items import AoT

from bowdenfit.arguments import read_quantity
from bowdenfit.errors import UsageError
from bowdenfit.words import shown

MENU, YES_NO, NUMBER, WHOLE, TEXT, QUANTITY, TOML = "menu", "yes or no", "number", "whole number", "text", "quantity", "TOML"
PAIR, NUMBERS, TEXTS, CODES = "pair of numbers", "numbers", "texts", "numbers or words"
_DECIMAL_COMMA = re.compile(r"^([+-]?\d+),(\d+)")
_LIKE_THOUSANDS = re.compile(r"\d,\d{3}(?!\d)")
_PERCENT = re.compile(r"([+-]?\d+(?:\.\d+)?)\s*%")


def show_value(value: Any, kind: str = "") -> str:
    """Return a value as it is typed into a field.

    Args:
        value: As TOML has it.
        kind: How the field is typed.
    """
    if kind in (PAIR, NUMBERS, TEXTS, CODES) and isinstance(value, list | tuple) and all(map(_is_plain, value)):
        return (" " if kind in (PAIR, NUMBERS) else "; ").join(show_value(part) for part in value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return str(value)
    if isinstance(value, Mapping) and set(value) == {"value", "unit"} and isinstance(value["value"], int | float):
        return f"{value['value']:.12g} {value['unit']}"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_as_toml(part)}" for key, part in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_as_toml(part) for part in value) + "]"
    return str(value)


def new_entry(entries: Any) -> Any:
    """Return an empty entry for a list of tables: one with a heading of its own if the others have one."""
    return tomlkit.table() if isinstance(entries, AoT) else tomlkit.inline_table()


def _is_plain(value: Any) -> bool:
    """Whether a part of a list can stand in a line with others."""
    return isinstance(value, int | float) or (isinstance(value, str) and ";" not in value and value == value.strip() != "")


def _as_toml(value: Any) -> str:
    """Return a value inside of another as TOML."""
    if isinstance(value, str):
        return tomlkit.string(value).as_string()
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_as_toml(part)}" for key, part in value.items()) + " }"
    return show_value(value)


def read_value(label: str, kind: str, options: Collection[str], typed: str) -> Any:
    """Return what is typed into a field as a value of TOML; None for an empty one.

    Args:
        label: Label of the field.
        kind: How it is typed.
        options: Words that do in place of a quantity.
        typed: What is typed, without blanks around it.

    Raises:
        UsageError: It cannot be read as what the field holds.
    """
    if not typed:
        return None
    if kind in (TEXT, MENU) or (kind == QUANTITY and typed in options):
        return typed
    if kind in (PAIR, NUMBERS, TEXTS, CODES) and not typed.startswith("["):
        return tomlkit.item(_read_list(label, kind, typed))
    if kind in (NUMBER, QUANTITY):
        typed = _DECIMAL_COMMA.sub(r"\1.\2", typed)
    if kind == NUMBER and (share := _PERCENT.fullmatch(typed)):
        typed = f"{float(share[1]) / 100:.12g}"
    if kind == QUANTITY and not typed.startswith("{"):
        number, unit = read_quantity(typed, label, "0.5 N")
        return tomlkit.inline_table().append("value", int(number) if number.is_integer() else number).append("unit", unit)
    value = _read_toml(typed)
    expected = {NUMBER: (int, float), WHOLE: (int,), YES_NO: (bool,)}.get(kind, (object,))
    if not isinstance(value, expected) or (kind != YES_NO and isinstance(value, bool) and kind != TOML):
        raise UsageError(f"{label}: {typed!r} is not a {kind}; write one, or clear the field to leave the key out.")
    return tomlkit.item(value)


def _read_toml(typed: str) -> Any:
    """Return a value that is typed as TOML; as it is typed where it is none."""
    with suppress(tomllib.TOMLDecodeError, RecursionError):
        return tomllib.loads(f"value = {typed}")["value"]
    return typed


def _read_list(label: str, kind: str, typed: str) -> Any:
    """Return several values that are typed in one line; one text by itself.

    Raises:
        UsageError: They are not numbers, or not two of a pair.
    """
    if kind == TEXTS:
        texts = [part.strip() for part in typed.split(";") if part.strip()]
        return texts if len(texts) != 1 else texts[0]
    if kind == CODES:
        codes = [part.strip() for part in typed.split(";") if part.strip()]
        numbers = [_read_toml(_DECIMAL_COMMA.sub(r"\1.\2", code)) for code in codes]
        return [number if _is_number(number) else code for code, number in zip(codes, numbers, strict=True)]
    parts = typed.replace(";", " ").replace(", ", " ").split()
    values = [_read_toml(_DECIMAL_COMMA.sub(r"\1.\2", part)) for part in parts]
    wanted = "two numbers" if kind == PAIR else "numbers"
    if not all(map(_is_number, values)) or _LIKE_THOUSANDS.search(" ".join(parts)) or (kind == PAIR and len(values) != 2):
        raise UsageError(f"{label}: {shown(typed)}: write {wanted} separated by spaces, such as 430 530.")
    return values


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
