"""The text of a description, in the order in which a person would write it."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_LINE = 100  # characters, beyond which a table gets a heading of its own


def toml_text(page: Mapping[str, Any], remarks: Mapping[str, str]) -> str:
    """A description as TOML: plain values, then tables, then lists of tables.

    Args:
        page: The plain data.
        remarks: What stands as a comment above a key.
    """
    lines = list[str]()
    for key, value in page.items():
        is_list = isinstance(value, list) and bool(value) and isinstance(value[0], Mapping)
        if lines and (is_list or isinstance(value, Mapping)):
            lines.append("")
        lines += [f"# {line}" for line in remarks.get(key, "").splitlines()]
        if is_list:
            for i, entry in enumerate(value):
                lines += [""] * (i > 0) + [f"[[{_key(key)}]]", *map(_line, entry, entry.values())]
        elif isinstance(value, Mapping):
            lines += _section([key], value)
        else:
            lines.append(_line(key, value))
    return "\n".join(lines) + "\n"


def _section(path: Sequence[str], page: Mapping[str, Any]) -> Iterator[str]:
    """A table under its heading; those in it that are long have headings of their own behind it."""
    long = {key: value for key, value in page.items() if isinstance(value, Mapping) and len(_line(key, value)) > _LINE}
    short = {key: value for key, value in page.items() if key not in long}
    if short:
        yield f"[{'.'.join(map(_key, path))}]"
        yield from map(_line, short, short.values())
    for i, (key, value) in enumerate(long.items()):
        if short or i:
            yield ""
        yield from _section([*path, key], value)


def _line(key: str, value: Any) -> str:
    return f"{_key(key)} = {_value(value)}"


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _value(name)


def _value(value: Any) -> str:
    """A value on one line, or a long list over several."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float | int):
        return f"{value:.12g}"
    if isinstance(value, Mapping):
        inside = ", ".join(map(_line, value, value.values()))
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, list):
        parts = [_value(each) for each in value]
        line = f"[{', '.join(parts)}]"
        return line if len(line) <= _LINE else "[\n" + "".join(f"    {part},\n" for part in parts) + "]"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
