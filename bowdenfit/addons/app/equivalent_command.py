"""The command that does what a page does, written from the request that the page itself makes."""

import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from bowdenfit.addons.app.elements import block, markup, text
from bowdenfit.arguments import Declared, parameters_of
from bowdenfit.verb import Verb
from bowdenfit.words import printable


def write_command(verb: Verb, request: Mapping[str, Any], folder: Path) -> str:
    """Return the command that asks a verb what a page asks its function, as it can be pasted into a shell.

    Args:
        verb: The verb.
        request: Keywords of its function, as the page hands them over, with the folders of fits in place of the fits.
        folder: Folder in which the command is run, from which paths are seen.
    """
    parameters = parameters_of(verb.function)
    arguments, options = list[str](), list[str]()
    for name, value in request.items():
        declared = parameters[name]
        is_default = value == declared.plain.default and not declared.option.required
        if declared.option.parse is False or is_default:
            continue
        if declared.written_name.isupper():
            arguments += _write_values(value, folder)
        else:
            options += _write_option(declared, value, folder)
    return shlex.join(["bowdenfit", verb.command_name, *arguments, *options])


def _write_option(declared: Declared, value: Any, folder: Path) -> Iterator[str]:
    """Yield an option, once for each of its values; a flag alone."""
    if isinstance(value, bool):
        yield declared.written_name if value else next(iter(declared.option.negative or ()))
        return
    for written in _write_values(value, folder):
        yield from (declared.written_name, written)


def _write_values(value: Any, folder: Path) -> Iterator[str]:
    """Yield the values of an argument as they are typed."""
    if isinstance(value, Mapping):
        for name, part in value.items():
            for written in _write_values(part, folder):
                yield written if isinstance(part, Path) else f"{name}={written}"
    elif isinstance(value, Path):
        seen = (value.relative_to(folder) if value.is_relative_to(folder) else value).as_posix()
        yield f"./{seen}" if seen.startswith("-") else seen
    elif isinstance(value, float):
        yield f"{value:.12g}"
    elif isinstance(value, Iterable) and not isinstance(value, str):
        for part in value:
            yield from _write_values(part, folder)
    else:
        yield str(value)


class EquivalentCommand:
    """What does the same without the page, ready to be copied, behind a heading that opens it.

    Args:
        lines: Commands, or lines of cable.toml.
        place: Where they are run, or go.
        prints: What the first prints; not shown if empty.
        key: By which the page names the lines.
    """

    def __init__(self, lines: Sequence[str], place: str, prints: str = "", key: str = "") -> None:
        with block("details", "equivalent"):
            text("Equivalent command", "summary")
            text(place, classes="hint")
            with block("div", "row"):
                self._lines = markup("", "pre", "command", tabindex="0", **({"id": key} if key else {}))
                copy = text("Copy", "button", type="button", data_key=f"copy {key or lines[0]}")
                copy.on("click", js_handler="event => copyText(event.target)")
            if prints:
                text("It prints:")
                text(prints, "pre", tabindex="0", id="printed")
        self.show(*lines)

    def show(self, *lines: str) -> None:
        """Show other commands."""
        self._lines.set_content(escape(printable("\n".join(lines))))


def show_command(verb: Verb, request: Mapping[str, Any], folder: Path, prints: str = "", key: str = "") -> EquivalentCommand:
    """Show the command of a request; see `write_command` and `EquivalentCommand`."""
    return EquivalentCommand([write_command(verb, request, folder)], f"In {folder}:", prints, key)
