"""Docstrings and signatures made readable for callers: a name such as angle@470 is not turned into an e-mail address."""

import re
from typing import Any

from sphinx.application import Sphinx

_FUNCTION = re.compile(r"<(?:built-in )?function (\w+)[^>]*>")
_AT = re.compile(r"(?<![\w`])[\w]+@[\w.,]+\w")


def literal(app: Sphinx, what: str, name: str, documented: Any, options: Any, lines: list[str]) -> None:
    """Mark names with an @ as literals."""
    del app, what, name, documented, options
    lines[:] = [_AT.sub(lambda match: f"``{match[0]}``", line) for line in lines]


def readable(app: Sphinx, what: str, name: str, documented: Any, options: Any, signature: str | None, back: str | None) -> Any:
    """Show a function that is the default of a keyword by its name, since Sphinx cannot parse its `repr`."""
    del app, what, name, documented, options
    return (_FUNCTION.sub(r"\1", signature), back) if signature else None


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the functions with autodoc."""
    app.connect("autodoc-process-docstring", literal)
    app.connect("autodoc-process-signature", readable)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
