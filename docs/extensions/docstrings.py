"""Docstrings as who calls a function reads them: a name such as angle@470 is nobody's address."""

import re
from typing import Any

from sphinx.application import Sphinx

_AT = re.compile(r"(?<![\w`])[\w]+@[\w.,]+\w")


def literal(app: Sphinx, what: str, name: str, documented: Any, options: Any, lines: list[str]) -> None:
    """Names with an @ as they are written."""
    del app, what, name, documented, options
    lines[:] = [_AT.sub(lambda match: f"``{match[0]}``", line) for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    """Take part whenever a docstring is shown."""
    app.connect("autodoc-process-docstring", literal)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
