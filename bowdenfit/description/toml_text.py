"""Plain data as the text of a TOML file, in the layout in which a person would write a cable.toml."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_MAX_LINE = 100  # characters, beyond which a table gets a heading of its own; a judgement of what reads well


def format_toml(page: Mapping[str, Any], remarks: Mapping[str, str]) -> str:
    """Return a description as TOML: plain values, then tables, then lists of tables.

    Args:
        page: Plain data.
        remarks: Comment above a key, by key.
    """
    lines = list[str]()
    for key, value in page.items():
        is_list = isinstance(value, list) and bool(value) and isinstance(value[0], Mapping)
        if lines and (is_list or isinstance(value, Mapping)):
            lines.append("")
        lines += [f"# {line}" for line in remarks.get(key, "").splitlines()]
        if is_list:
            for i, entry in enumerate(value):
                lines += [""] * (i > 0) + [f"[[{_format_key(key)}]]", *map(_format_line, entry, entry.values())]
        elif isinstance(value, Mapping):
            lines += _format_section([key], value)
        else:
            lines.append(_format_line(key, value))
    return "\n".join(lines) + "\n"


def _format_section(path: Sequence[str], page: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a table under its heading; long tables in it follow under headings of their own."""
    long = {
        key: value
        for key, value in page.items()
        if isinstance(value, Mapping) and len(_format_line(key, value)) > _MAX_LINE
    }
    short = {key: value for key, value in page.items() if key not in long}
    if short:
        yield f"[{'.'.join(map(_format_key, path))}]"
        yield from map(_format_line, short, short.values())
    for i, (key, value) in enumerate(long.items()):
        if short or i:
            yield ""
        yield from _format_section([*path, key], value)


def _format_line(key: str, value: Any) -> str:
    """Format a key with its value."""
    return f"{_format_key(key)} = {_format_value(value)}"


def _format_key(name: str) -> str:
    """Format a key, quoted where TOML needs that."""
    return name if _BARE.fullmatch(name) else _format_value(name)


def _format_value(value: Any) -> str:
    """Format a value on one line, or a long list over several."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float | int):
        return f"{value:.12g}"
    if isinstance(value, Mapping):
        inside = ", ".join(map(_format_line, value, value.values()))
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, list):
        parts = [_format_value(entry) for entry in value]
        line = f"[{', '.join(parts)}]"
        return line if len(line) <= _MAX_LINE else "[\n" + "".join(f"    {part},\n" for part in parts) + "]"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
