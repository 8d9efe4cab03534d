"""The text of a description, in the order in which a person would write it."""

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_LINE = 100  # characters, beyond which a list is written over several lines


def toml_text(page: Mapping[str, Any], remarks: Mapping[str, str]) -> str:
    """A description as TOML: plain values, then tables, then lists of tables.

    Args:
        page: The plain data.
        remarks: What stands as a comment above a key.
    """
    lines = list[str]()
    for key, value in page.items():
        if lines and lines[-1] and isinstance(value, Mapping | list):
            lines.append("")
        lines += [f"# {line}" for line in remarks.get(key, "").splitlines()]
        if isinstance(value, Mapping):
            lines += [f"[{_key(key)}]", *(f"{_key(name)} = {_value(said)}" for name, said in value.items()), ""]
        elif isinstance(value, Sequence) and not isinstance(value, str) and value and isinstance(value[0], Mapping):
            for each in value:
                lines += [f"[[{_key(key)}]]", *(f"{_key(name)} = {_value(said)}" for name, said in each.items()), ""]
        else:
            lines.append(f"{_key(key)} = {_value(value)}")
    return "\n".join(lines).rstrip() + "\n"


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _value(name)


def _value(value: Any) -> str:
    """A value on one line, or a long list over several."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float | int):
        return f"{value:.12g}"
    if isinstance(value, Mapping):
        inside = ", ".join(f"{_key(name)} = {_value(said)}" for name, said in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        parts = [_value(each) for each in value]
        line = f"[{', '.join(parts)}]"
        return line if len(line) <= _LINE else "[\n" + "".join(f"    {part},\n" for part in parts) + "]"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
