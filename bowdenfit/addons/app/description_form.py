"""Everything that a cable.toml can say, as fields of a form that its JSON schema describes."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any, TypeAlias

import tomlkit
from tomlkit.exceptions import TOMLKitError

from bowdenfit.addons.app.description_values import (
    CODES,
    MENU,
    NUMBER,
    NUMBERS,
    PAIR,
    QUANTITY,
    TEXT,
    TEXTS,
    TOML,
    WHOLE,
    YES_NO,
    new_entry,
    read_value,
    show_value,
)
from bowdenfit.errors import UsageError
from bowdenfit.kinds import KINDS
from bowdenfit.questions.schema.schemas import make_schema
from bowdenfit.recordings.named_channels import INSTEAD_OF_FORCES, OUTPUT_CLOCK, WANTED
from bowdenfit.words import capitalized

Path: TypeAlias = tuple[str | int, ...]
Schema: TypeAlias = Mapping[str, Any]
_WHOLE_TOPICS = ("schema",)  # which nobody changes by hand
_TITLES = {
    "route": "Route: what the design question varies", "contact": "Contact", "friction": "Friction coefficient",
    "prior": "Prior of", "cable": "Kind of cable", "stretch": "Stretch", "preload": "Preload", "tables": "Table of",
    "recording": "Recording",
    "sensors": "Load cells", "errors": "Errors of the bench that no reading shows", "sampler": "Sampler",
}  # fmt: skip
_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
_IN_TOML = re.compile(  # what a form does otherwise
    r"(?:,? such as|:)? \[-?\d[^\]]*\]|:? ?\[ ?\{.*?\} ?\]| On the command line [^.]*\."
)
_EXAMPLES = {  # of what is typed
    "missing": "-9999; n.d.", "quiet": "0 2.5", "rows": "7 9", "choices": "430 450 470", "sheet": "Pull",
    "where": "{ run = 3 }",
}  # fmt: skip
_EXAMPLES_OF_KINDS = {PAIR: "430 530", NUMBERS: "430 450", TEXTS: "a.csv; b.csv", TOML: "{ key = 1 }"}
_HOW_TYPED = {
    PAIR: "Two numbers separated by a space.", NUMBERS: "Numbers separated by spaces.",
    TEXTS: "Several separated by semicolons.", CODES: "Several separated by semicolons.", TOML: "As in TOML.",
}  # fmt: skip
_QUANTITIES = {
    "delay": "10 ms", "clock_shift": "10 ms", "block": "50 ms", "length": "500 mm", "velocity": "10 mm/s",
    "reference_velocity": "10 mm/s", "inertia": "1e-3 kg*m^2",
}  # fmt: skip
KnownNames: TypeAlias = Callable[[str, Path], Sequence[str]]
"""Names that a table of names may have, by its key and the keys that lead to it."""


@dataclass(frozen=True)
class FormField:
    """One key of a description.

    Args:
        path: Keys and numbers that lead to it.
        label: Its key, with those above it in its group or entry.
        kind: How it is typed.
        value: As it is typed; empty where the description leaves it out.
        hint: What it does, how it is written, and what holds where it is left out.
        options: Of a menu, or the words that do in place of a quantity.
        needed: Whether it may not be left out.
        example: How it may be typed; empty where its hint says so.
        part: Key of the list or table of names that it is in; empty for any other.
        part_hint: What that does.
        entry: Of which entry of that it is one of several fields; empty for any other.
    """

    path: Path
    label: str
    kind: str
    value: str
    hint: str
    options: tuple[str, ...] = ()
    needed: bool = False
    example: str = ""
    part: str = ""
    part_hint: str = ""
    entry: str = ""

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
    page, names_of = _schema(), partial(_list_known_names, raw)
    properties = {key: schema for key, schema in page["properties"].items() if key not in _WHOLE_TOPICS}
    plain = {key: schema for key, schema in properties.items() if key not in _TITLES}
    groups = [FormGroup((), "The cable", tuple(_list_fields({"properties": plain, **_needed(page)}, raw, (), names_of)), True)]
    for key in (key for key in _TITLES if key in properties):
        groups += _list_topic(key, properties[key], raw.get(key), names_of)
    return groups


def _list_topic(key: str, schema: Schema, written: Any, names_of: KnownNames) -> Iterator[FormGroup]:
    """Yield the groups of one top-level key: one for each entry where it has several."""
    target, title = _resolve(schema), _TITLES[key]
    entries: list[tuple[str | int, Any, Schema]] = []
    if target.get("type") == "array":
        written = written if isinstance(written, list) else ()
        entries = [(number, entry, target["items"]) for number, entry in enumerate(written)]
    elif isinstance(target.get("additionalProperties"), Mapping) or key == "tables":
        kinds, written = target.get("properties", {}), written if isinstance(written, Mapping) else {}
        named = [name for name, entry in written.items() if key != "tables" or (name in kinds and isinstance(entry, Mapping))]
        entries = [(name, written[name], kinds[name] if key == "tables" else target["additionalProperties"]) for name in named]
    else:
        values = written if isinstance(written, Mapping) else {}
        yield FormGroup((key,), title, tuple(_list_fields(target, values, (key,), names_of)), bool(values))
    for name, entry, of_entry in entries:
        values = entry if isinstance(entry, Mapping) else {}
        called = name if isinstance(name, str) else values.get("name") or values.get("file") or name + 1
        fields = _list_fields(_resolve(of_entry), values, (key, name), names_of)
        yield FormGroup((key, name), f"{title} {called}", tuple(fields), True)


def _list_fields(
    target: Schema, values: Mapping[str, Any], path: Path, names_of: KnownNames, above: str = "", is_optional: bool = False
) -> Iterator[FormField]:
    """Yield the fields of an object; parts of it that are objects or lists of them are taken apart."""
    for key, schema in target.get("properties", {}).items():
        part, value, key_path = _resolve(schema), values.get(key), (*path, key)
        keys, of_names = part.get("properties", {}), part.get("additionalProperties")
        if _is_single(schema) and keys and ("curve" in keys or not {"value", "unit"} <= {*keys}):
            inside = value if isinstance(value, Mapping) else {}
            yield from _list_fields(part, inside, key_path, names_of, f"{above}{key}.", key not in target.get("required", ()))
        elif _is_single(schema) and isinstance(of_names, Mapping) and "properties" in _resolve(of_names):
            yield from _list_named(key, schema, value, key_path, names_of)
        elif _is_single(schema) and "properties" in _resolve(part.get("items", {})):
            yield from _list_entries(key, schema, value, key_path, names_of)
        else:
            needed = key in target.get("required", ()) and (bool(values) or not is_optional)
            yield _make_field(key_path, f"{above}{key}", schema, value, needed)


def _make_field(path: Path, label: str, schema: Schema, value: Any, needed: bool = False) -> FormField:
    """Return the field of one key."""
    (kind, options), key = _kind_of(schema), str(path[-1])
    typed, hint = "" if value is None else show_value(value, kind), _hint(key, schema, kind, options)
    example = _EXAMPLES.get(key, _EXAMPLES_OF_KINDS.get(kind, "")) if kind in _HOW_TYPED else ""
    return FormField(path, label, kind, typed, hint, options, needed, example)


def _list_named(key: str, schema: Schema, written: Any, path: Path, names_of: KnownNames) -> Iterator[FormField]:
    """Yield the fields of a table of names, of those that it may have and those that it has."""
    entries = written if isinstance(written, Mapping) else {}
    of_name = _resolve(_resolve(schema)["additionalProperties"])
    is_quantity, hint = {"value", "unit"} <= {*of_name["properties"]}, _hint(key, schema, "", ())
    for name in dict.fromkeys([*names_of(key, path), *entries]):
        entry = entries.get(name)
        fields: Iterable[FormField] = [_make_field((*path, name), name, of_name, entry)]
        if not is_quantity:
            inside = entry if isinstance(entry, Mapping) else {}
            fields = _list_fields(of_name, inside, (*path, name), names_of, is_optional=True)
            fields = (replace(field, entry=name) for field in fields)
        yield from (replace(field, part=key, part_hint=hint) for field in fields)


def _list_entries(key: str, schema: Schema, written: Any, path: Path, names_of: KnownNames) -> Iterator[FormField]:
    """Yield the fields of a list, and of one more entry."""
    entries, of_entry = written if isinstance(written, list) else [], _resolve(_resolve(schema)["items"])
    hint = _hint(key, schema, "", ())
    for number, entry in enumerate([*entries, {}]):
        inside, is_new = entry if isinstance(entry, Mapping) else {}, number == len(entries)
        fields, called = _list_fields(of_entry, inside, (*path, number), names_of, is_optional=is_new), f"Entry {number + 1}"
        yield from (replace(field, part=key, part_hint=hint, entry="One more" if is_new else called) for field in fields)


def _list_known_names(raw: Mapping[str, Any], key: str, path: Path) -> list[str]:
    """Return the names that a table of names may have in a description."""
    contacts, route = raw.get("contact"), raw.get("route")
    contacts = [contact for contact in contacts if isinstance(contact, Mapping)] if isinstance(contacts, list) else []
    columns = [angle.get("column") for contact in contacts if isinstance(angle := contact.get("wrap_angle"), Mapping)]
    of_cable = [*columns, route.get("variable", "cable_length")] if isinstance(route, Mapping) else columns
    names = [name for name in (columns if key == "wrap_angles" else of_cable) if isinstance(name, str)]
    if key == "channels":
        names += [*(quantity.name for quantity in (*WANTED, *INSTEAD_OF_FORCES)), OUTPUT_CLOCK]
    kind = KINDS.get(str(path[1])) if key == "columns" else None
    for wanted in kind.init_questions.columns if kind is not None and kind.init_questions is not None else ():
        names += [quantity.name for quantity in (wanted.quantity, *wanted.also)]
    return names


def _kind_of(schema: Schema) -> tuple[str, tuple[str, ...]]:
    """Return how a key is typed, and its options."""
    if "enum" in schema:
        return MENU, tuple(str(option) for option in schema["enum"] if option is not None)
    parts = [_resolve(part) for part in schema.get("anyOf", [schema]) if part.get("type") != "null"]
    words = [option for part in parts for option in part.get("enum", [part["const"]] if "const" in part else [])]
    if words and any("value" in part.get("properties", {}) for part in parts):
        return QUANTITY, tuple(words)
    if lists := [part for part in parts if part.get("type") == "array"]:
        return _kind_of_list(lists[0]), ()
    if len(parts) != 1:
        return TOML, ()
    (part,) = parts
    if "enum" in part or "const" in part:
        return MENU, tuple(part.get("enum", [part.get("const")]))
    if "value" in part.get("properties", {}):
        return QUANTITY, ()
    kinds = {"boolean": YES_NO, "number": NUMBER, "integer": WHOLE, "string": TEXT}
    return kinds.get(part.get("type", ""), TOML), ()


def _kind_of_list(schema: Schema) -> str:
    """Return how a list is typed."""
    items = schema.get("prefixItems") or [schema.get("items", {})]
    types = {_resolve(part).get("type") for item in items for part in item.get("anyOf", [item])}
    if types <= {"number", "integer"}:
        return PAIR if "prefixItems" in schema else NUMBERS
    return TEXTS if types == {"string"} else CODES if types == {"string", "number"} else TOML


def _hint(key: str, schema: Schema, kind: str, options: Sequence[str]) -> str:
    """Return what a key does, how it is written, and what holds where it is left out."""
    words = [capitalized(_IN_TOML.sub("", _LINK.sub(r"\1", schema.get("description", ""))).lstrip(" ,"))]
    if kind == QUANTITY:
        others = f"As {', '.join(options)}, or as a" if options else "A"
        words.append(f"{others} number with its unit, such as {_QUANTITIES.get(key, '0.5 N or 45 deg')}.")
    words += [_HOW_TYPED[kind]] if kind in _HOW_TYPED else []
    default = schema.get("default")
    if default not in (None, "", [], {}) and not isinstance(default, Mapping):
        words.append(f"If left out: {show_value(default)}.")
    return " ".join(word for word in words if word)


def set_field(text: str, field: FormField, typed: str) -> str:
    """Return the text of a description with a field as it is typed; comments and order stay.

    Args:
        text: The text.
        field: Which.
        typed: What is typed; empty to leave the key out.

    Raises:
        UsageError: It cannot be read as what the field holds, or the text is no TOML.
    """
    value = read_value(": ".join(filter(None, (field.entry, field.label))), field.kind, field.options, typed.strip())
    document = _parse(text)
    *parents, last = field.path
    try:
        node: Any = document
        for depth, part in enumerate(parents):
            if part >= len(node) if isinstance(part, int) else part not in node:
                if value is None:
                    return text
                is_list = isinstance(field.path[depth + 1], int)
                new = tomlkit.array() if is_list else tomlkit.table() if depth == 0 else new_entry(node)
                if isinstance(part, int):
                    node.append(new)
                else:
                    node[part] = new
            node = node[part]
        if value is None:
            node.pop(last, None)
            _remove_empty(document, parents)
        else:
            node[last] = value
    except (TOMLKitError, LookupError, TypeError, ValueError, AttributeError):
        raise UsageError(f"{field.label} cannot be changed here, as cable.toml says it otherwise; edit the text.") from None
    return tomlkit.dumps(document)


def _remove_empty(document: Any, path: Sequence[str | int]) -> None:
    """Remove what leads to a key and says nothing any more; a contact, a recording or a table stays."""
    while path and not (path[0] in ("tables", "contact", "recording") and len(path) <= 2):
        *parents, last = path
        above = document
        for part in parents:
            above = above[part]
        if len(above[last]):
            return
        del above[last]
        path = parents


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
