"""Docstrings and signatures as who calls a function reads them: a name such as angle@470 is nobody's address."""

import re
from typing import Any

from sphinx.application import Sphinx

_FUNCTION = re.compile(r"<(?:built-in )?function (\w+)[^>]*>")
_AT = re.compile(r"(?<![\w`])[\w]+@[\w.,]+\w")


def literal(app: Sphinx, what: str, name: str, documented: Any, options: Any, lines: list[str]) -> None:
    """Names with an @ as they are written."""
    del app, what, name, documented, options
    lines[:] = [_AT.sub(lambda match: f"``{match[0]}``", line) for line in lines]


def readable(app: Sphinx, what: str, name: str, documented: Any, options: Any, signature: str | None, back: str | None) -> Any:
    """A function that is the default of a keyword by its name; as Python shows it, no signature could be read."""
    del app, what, name, documented, options
    return (_FUNCTION.sub(r"\1", signature), back) if signature else None


def setup(app: Sphinx) -> dict[str, bool]:
    """Take part whenever a docstring is shown."""
    app.connect("autodoc-process-docstring", literal)
    app.connect("autodoc-process-signature", readable)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
