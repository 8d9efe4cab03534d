"""The directive `keys`: a list of the keys of one part of cable.toml, from the class that reads it.

    ```{keys} bowdenfit.description.cable_parts:Route
    variable: what it says, in words
    ```

Permitted values and defaults come from the class; with the option `:values:`, only defaults are shown. The descriptions are
in `bowdenfit/questions/schema/keys.toml`, which the JSON schema says too, or on the page; or, for a dataclass or for keywords,
in its docstring. A key without a description, or a description without a
key, causes a warning, so that the page cannot fall behind the program.
"""

import dataclasses
import types
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints, is_typeddict

from docstring_parser.google import parse
from docutils import nodes
from docutils.parsers.rst import directives
from docutils.statemachine import StringList
from pydantic import BaseModel
from pydantic_core import PydanticUndefined
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.logging import getLogger

from bowdenfit.arguments import NumberWithUnit
from bowdenfit.questions.schema.schemas import load_key_descriptions

_LOG = getLogger(__name__)
_PLAIN = {str: "text", float: "number", int: "whole number", bool: "`true` or `false`"}
_NEEDED = "**needed**"
_NAMED = {  # parts that are written between braces
    "QuantityValue": "quantity",
    "WrapAngle": "see [where a wrap angle comes from](#where-a-wrap-angle-comes-from)",
    "FrictionSetting": "see [parameters](#parameters)",
    "ParameterSetting": "see [parameters](#parameters)",
    "Preparation": "see [preparation](#preparation)",
}


class Keys(SphinxDirective):
    """Directive that lists the keys of one class with their descriptions."""

    required_arguments = 1
    has_content = True
    option_spec = {"values": directives.flag}  # noqa: RUF012  (docutils has it so)

    def run(self) -> list[nodes.Node]:
        """Return the list as nodes."""
        module, _, name = self.arguments[0].partition(":")
        model = getattr(import_module(module), name)
        words, known = {**load_key_descriptions().get(name, {}), **_words(self.content)}, keys_of(model)
        if not issubclass(model, BaseModel):
            words = keywords_in(model)
        for key in words.keys() ^ known.keys():
            what = "has no description" if key in known else f"is not a key of {name}"
            _LOG.warning(f"the key {key!r} {what}", location=self.get_location())
        shown = "values" not in self.options
        lines = []
        for key, (kind, left_out) in known.items():
            otherwise = left_out if left_out in {"", _NEEDED} or not shown else f"otherwise {left_out}"
            about = ", ".join(filter(None, (written(kind) if shown else "", otherwise)))
            lines += [f"**`{key}`**{' · ' if about else ''}{about}", f": {words.get(key, '')}", ""]
        return self.parse_text_to_nodes("\n".join(lines))


def keys_of(model: Any) -> dict[str, tuple[Any, str]]:
    """Return the type of every key, and its default in words."""
    if is_typeddict(model):
        return {key: (kind, "") for key, kind in get_type_hints(model).items()}
    if issubclass(model, BaseModel):
        fields = {field.alias or key: field for key, field in model.model_fields.items()}
        return {key: (f.annotation, _NEEDED if f.is_required() else default(f.default)) for key, f in fields.items()}
    hints = get_type_hints(model)
    needed = dataclasses.MISSING
    return {
        f.name: (hints[f.name], _NEEDED if f.default is needed else default(f.default)) for f in dataclasses.fields(model)
    }


def keywords_in(documented: Any) -> dict[str, str]:
    """Return the description of every argument in a docstring, including arguments documented together."""
    said = parse(documented.__doc__ or "").params
    return {key.strip(): " ".join((each.description or "").split()) for each in said for key in each.arg_name.split(",")}


def _words(content: StringList) -> dict[str, str]:
    """Return the description of every key; indented lines continue the line before."""
    words: dict[str, str] = {}
    key = ""
    for line in content:
        if line.startswith(" "):
            words[key] += f" {line.strip()}"
        elif line:
            key, _, said = line.partition(": ")
            words[key] = said
    return words


def written(annotation: Any) -> str:
    """Return the permitted values of a key in words."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return written(arguments[0])
    if origin in {Union, types.UnionType}:
        return " or ".join(dict.fromkeys(written(each) for each in arguments if each is not type(None)))
    if origin is Literal:
        return ", ".join(f'`"{each}"`' for each in arguments)
    if annotation == NumberWithUnit:
        return '`(number, "unit")`'
    if origin is tuple:
        fixed = f"`[{', '.join('…' for _ in arguments)}]`"
        return f"list of {_plural(written(arguments[0]))}" if arguments[1:] == (...,) else fixed
    if origin is Sequence:
        return f"list of {_plural(written(arguments[0]))}"
    if origin is dict:
        return f"a key for each: {written(arguments[1])}"
    return _PLAIN.get(annotation) or _NAMED.get(annotation.__name__) or "keys of its own"


def _plural(words: str) -> str:
    return {"number": "numbers", "text": "texts"}.get(words, words)


def default(value: Any) -> str:
    """Return the default of a key in words."""
    if value is None or value is PydanticUndefined or value in ((), ""):
        return ""
    if isinstance(value, BaseModel):
        stated = {key: part for key, part in value.model_dump().items() if part is not None}
        return f"`{_toml(stated)}`" if {"value", "unit"} <= stated.keys() or "median" in stated else ""
    return f"`{_toml(value)}`"


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(each)}" for key, each in value.items()) + " }"
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else f"{value:g}" if isinstance(value, float) else str(value)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive with Sphinx."""
    app.add_directive("keys", Keys)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
