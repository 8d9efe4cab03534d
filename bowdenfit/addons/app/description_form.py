"""Everything that a cable.toml can say, as fields of a form that its JSON schema describes."""

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

import tomlkit
from tomlkit.exceptions import TOMLKitError

from bowdenfit.arguments import read_quantity
from bowdenfit.errors import UsageError
from bowdenfit.questions.schema.schemas import make_schema

Path: TypeAlias = tuple[str | int, ...]
Schema: TypeAlias = Mapping[str, Any]
MENU, YES_NO, NUMBER, WHOLE, TEXT, QUANTITY, TOML = "menu", "yes or no", "number", "whole number", "text", "quantity", "TOML"
_WHOLE_TOPICS = ("schema",)  # which nobody changes by hand
_TITLES = {
    "route": "Route: what the design question varies", "contact": "Contact", "friction": "Friction coefficient",
    "prior": "Prior of", "cable": "Kind of cable", "stretch": "Stretch", "preload": "Preload", "tables": "Table of",
    "recording": "Recording",
    "sensors": "Load cells", "errors": "Errors of the bench that no reading shows", "sampler": "Sampler",
}  # fmt: skip
_DECIMAL_COMMA = re.compile(r"^([+-]?\d+),(\d+)")
_PERCENT = re.compile(r"([+-]?\d+(?:\.\d+)?)\s*%")
_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
_EXAMPLES = {
    "columns": '{ input_force = { name = "F1", unit = "N" } }',
    "prior": "{ normal = { mean = 0.1, sd = 0.05 } }",
    "measured": "{ value = 0.10, sd = 0.02 }",
    "range": "[430, 530]",
}
_QUANTITIES = {"delay": "10 ms", "clock_shift": "10 ms", "block": "50 ms", "length": "500 mm"}


@dataclass(frozen=True)
class FormField:
    """One key of a description.

    Args:
        path: Keys and numbers that lead to it.
        label: Its key, with those above it in its group.
        kind: How it is typed.
        value: As it is typed; empty where the description leaves it out.
        hint: What it does, how it is written, and what holds where it is left out.
        options: Of a menu, or the words that do in place of a quantity.
        needed: Whether it may not be left out.
    """

    path: Path
    label: str
    kind: str
    value: str
    hint: str
    options: tuple[str, ...] = ()
    needed: bool = False

    @property
    def key(self) -> str:
        """By which the page names its control."""
        return "key-" + "-".join(re.sub(r"\W", "_", str(part)) for part in self.path)


@dataclass(frozen=True)
class FormGroup:
    """Keys that belong together.

    Args:
        path: Keys and numbers that lead to it; empty for those that are in none.
        title: Heading of the group.
        fields: The keys.
        is_stated: Whether the description says any of them.
    """

    path: Path
    title: str
    fields: tuple[FormField, ...]
    is_stated: bool


def list_groups(raw: Mapping[str, Any]) -> list[FormGroup]:
    """Return the groups of the form of a description.

    Args:
        raw: The description as plain data, which may be wrong anywhere.
    """
    page = _schema()
    properties = {key: schema for key, schema in page["properties"].items() if key not in _WHOLE_TOPICS}
    plain = {key: schema for key, schema in properties.items() if key not in _TITLES}
    groups = [FormGroup((), "The cable", tuple(_list_fields({"properties": plain, **_needed(page)}, raw, ())), True)]
    for key in (key for key in _TITLES if key in properties):
        groups += _list_topic(key, properties[key], raw.get(key))
    return groups


def _list_topic(key: str, schema: Schema, stated: Any) -> Iterator[FormGroup]:
    """Yield the groups of one top-level key: one for each entry where it has several."""
    target, title = _resolve(schema), _TITLES[key]
    if target.get("type") == "array":
        for number, entry in enumerate(stated if isinstance(stated, list) else ()):
            values = entry if isinstance(entry, Mapping) else {}
            name = values.get("name") or values.get("file") or number + 1
            path = key, number
            yield FormGroup(path, f"{title} {name}", tuple(_list_fields(_resolve(target["items"]), values, path)), True)
        return
    values = stated if isinstance(stated, Mapping) else {}
    if "additionalProperties" in target and isinstance(target["additionalProperties"], Mapping):
        for name, entry in values.items():
            of_name = entry if isinstance(entry, Mapping) else {}
            fields = _list_fields(_resolve(target["additionalProperties"]), of_name, (key, name))
            yield FormGroup((key, name), f"{title} {name}", tuple(fields), True)
        return
    if key == "tables":
        for name, entry in values.items():
            if name in target["properties"] and isinstance(entry, Mapping):
                fields = _list_fields(_resolve(target["properties"][name]), entry, (key, name))
                yield FormGroup((key, name), f"{title} {name}", tuple(fields), True)
        return
    yield FormGroup((key,), title, tuple(_list_fields(target, values, (key,))), bool(values))


def _list_fields(target: Schema, values: Mapping[str, Any], path: Path, above: str = "") -> Iterator[FormField]:
    """Yield the fields of an object; parts of it that are objects themselves are taken apart."""
    for key, schema in target.get("properties", {}).items():
        part, value = _resolve(schema), values.get(key)
        here = (*path, key)
        if "properties" in part and "unit" not in part["properties"] and _is_single(schema):
            yield from _list_fields(part, value if isinstance(value, Mapping) else {}, here, f"{above}{key}.")
            continue
        if "curve" in part.get("properties", {}):  # a wrap angle, key by key
            yield from _list_fields(part, value if isinstance(value, Mapping) else {}, here, f"{above}{key}.")
            continue
        kind, options = _kind_of(schema)
        hint = _hint(key, schema, kind, options)
        yield FormField(
            here, f"{above}{key}", kind, "" if value is None else show_value(value), hint, options,
            key in target.get("required", ()),
        )  # fmt: skip


def _kind_of(schema: Schema) -> tuple[str, tuple[str, ...]]:
    """Return how a key is typed, and its options."""
    if "enum" in schema:
        return MENU, tuple(str(option) for option in schema["enum"] if option is not None)
    parts = [_resolve(part) for part in schema.get("anyOf", [schema]) if part.get("type") != "null"]
    words = [option for part in parts for option in part.get("enum", [part["const"]] if "const" in part else [])]
    if words and any("value" in part.get("properties", {}) for part in parts):
        return QUANTITY, tuple(words)
    if len(parts) != 1:
        return TOML, ()
    (part,) = parts
    if "enum" in part or "const" in part:
        return MENU, tuple(part.get("enum", [part.get("const")]))
    if "value" in part.get("properties", {}):
        return QUANTITY, ()
    kinds = {"boolean": YES_NO, "number": NUMBER, "integer": WHOLE, "string": TEXT}
    return kinds.get(part.get("type", ""), TOML), ()


def _hint(key: str, schema: Schema, kind: str, options: Sequence[str]) -> str:
    """Return what a key does, how it is written, and what holds where it is left out."""
    words = [_LINK.sub(r"\1", schema.get("description", ""))]
    if kind == QUANTITY:
        others = f"As {', '.join(options)}, or as a" if options else "A"
        words.append(f"{others} number with its unit, such as {_QUANTITIES.get(key, '0.5 N or 45 deg')}.")
    words += [f"As in TOML{_example(key)}."] if kind == TOML else []
    default = schema.get("default")
    if default not in (None, "", [], {}) and not isinstance(default, Mapping):
        words.append(f"If left out: {show_value(default)}.")
    return " ".join(word for word in words if word)


def _example(key: str) -> str:
    return f", such as {_EXAMPLES[key]}" if key in _EXAMPLES else ""


def show_value(value: Any) -> str:
    """Return a value as it is typed into a field."""
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


def _as_toml(value: Any) -> str:
    """Return a value inside of another as TOML."""
    if isinstance(value, str):
        return tomlkit.string(value).as_string()
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_as_toml(part)}" for key, part in value.items()) + " }"
    return show_value(value)


def set_field(text: str, field: FormField, typed: str) -> str:
    """Return the text of a description with a field as it is typed; comments and order stay.

    Args:
        text: The text.
        field: Which.
        typed: What is typed; empty to leave the key out.

    Raises:
        UsageError: It cannot be read as what the field holds, or the text is no TOML.
    """
    value = _read_value(field, typed.strip())
    document = _parse(text)
    *parents, last = field.path
    try:
        node: Any = document
        for depth, part in enumerate(parents):
            if isinstance(part, str) and part not in node:
                if value is None:
                    return text
                node[part] = tomlkit.table() if depth == 0 else tomlkit.inline_table()
            node = node[part]
        if value is None:
            node.pop(last, None)
        else:
            node[last] = value
        if not node and len(parents) in (1, 2) and isinstance(parents[-1], str) and parents[0] not in ("tables", "contact"):
            _remove(document, parents)
    except (TOMLKitError, KeyError, IndexError, TypeError, AttributeError):
        raise UsageError(f"{field.label} cannot be changed here, as cable.toml says it otherwise; edit the text.") from None
    return tomlkit.dumps(document)


def _remove(document: Any, path: Sequence[str | int]) -> None:
    """Remove a part of a document that says nothing any more."""
    *parents, last = path
    node = document
    for part in parents:
        node = node[part]
    node.pop(last, None)


def add_part(text: str, topic: str, name: str) -> str:
    """Return the text with one more contact, coefficient, prior or table, with what it needs.

    Args:
        text: The text.
        topic: "contact", "friction", "prior" or "tables".
        name: Its name, or the kind of the table.

    Raises:
        UsageError: The name is empty or there already, or the text is no TOML.
    """
    name = name.strip()
    document = _parse(text)
    entries = document.get(topic) or ()
    names = [entry.get("name") for entry in entries] if topic == "contact" else list(entries)
    if not name or name in names:
        raise UsageError(f"write a name that is not in use yet{': ' + ', '.join(map(str, names)) if names else ''}.")
    new = tomlkit.table()
    if topic == "contact":
        new.update({"name": name, "friction": "mu"})
        new["wrap_angle"] = tomlkit.inline_table().append("value", 90).append("unit", "deg")
        contacts = document.setdefault("contact", tomlkit.aot())
        contacts.append(new)
        return tomlkit.dumps(document)
    new.update({"file": f"{name}.csv"} if topic == "tables" else {"prior": {"normal": {"mean": 0.1, "sd": 0.1}}})
    document.setdefault(topic, tomlkit.table())[name] = new
    return tomlkit.dumps(document)


def table_kinds() -> list[str]:
    """Kinds of tables that a description can name."""
    return list(_resolve(_schema()["properties"]["tables"])["properties"])


def _read_value(field: FormField, typed: str) -> Any:
    """Return what is typed into a field as a value of TOML; None for an empty one."""
    if not typed:
        return None
    if field.kind in (TEXT, MENU) or (field.kind == QUANTITY and typed in field.options):
        return typed
    if field.kind in (NUMBER, QUANTITY):
        typed = _DECIMAL_COMMA.sub(r"\1.\2", typed)
    if field.kind == NUMBER and (share := _PERCENT.fullmatch(typed)):
        typed = f"{float(share[1]) / 100:.12g}"
    if field.kind == QUANTITY and not typed.startswith("{"):
        number, unit = read_quantity(typed, field.label, "0.5 N")
        return tomlkit.inline_table().append("value", int(number) if number.is_integer() else number).append("unit", unit)
    try:
        value: Any = tomllib.loads(f"value = {typed}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        value = typed
    expected = {NUMBER: (int, float), WHOLE: (int,), YES_NO: (bool,)}.get(field.kind, (object,))
    if not isinstance(value, expected) or (field.kind != YES_NO and isinstance(value, bool) and field.kind != TOML):
        raise UsageError(f"{field.label}: {typed!r} is not a {field.kind}; write one, or clear the field to leave the key out.")
    return tomlkit.item(value)


def _parse(text: str) -> Any:
    try:
        return tomlkit.parse(text)
    except (TOMLKitError, RecursionError) as error:
        raise UsageError(f"the text is no TOML: {error}; correct it first.") from None


def _is_single(schema: Schema) -> bool:
    """Whether a key holds one kind of object, or nothing."""
    return sum(part.get("type") != "null" for part in schema.get("anyOf", [schema])) == 1


def _resolve(schema: Schema) -> Schema:
    """Return what a schema refers to, of an optional key what it is where it is stated."""
    parts = [part for part in schema.get("anyOf", ()) if part.get("type") != "null"]
    target: Schema = parts[0] if len(parts) == 1 else schema
    if "$ref" in target:
        target = _schema()["$defs"][target["$ref"].rpartition("/")[2]]
    return target


def _needed(page: Schema) -> dict[str, Any]:
    return {"required": page.get("required", [])}


@cache
def _schema() -> dict[str, Any]:
    return make_schema("cable")
