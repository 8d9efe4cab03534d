"""Signatures and docstrings as who calls a function reads them.

`Annotated[str, Option(...)]` is `str` to them: the rest is for the command line. A name such as angle@470 is nobody's address.
"""

import inspect
import re
from typing import Annotated, Any, get_args, get_origin

from sphinx.application import Sphinx

_AT = re.compile(r"(?<![\w`])[\w]+@[\w.,]+\w")


def plain(app: Sphinx) -> None:
    """Leave their types alone to the public functions, once the command line has read what it needs of them."""
    del app
    import bowdenfit
    import bowdenfit.cli

    assert bowdenfit.cli.bowdenfit.commands
    for name in bowdenfit.__all__:
        if inspect.isfunction(function := getattr(bowdenfit, name)):
            for key, annotation in function.__annotations__.items():
                if get_origin(annotation) is Annotated:
                    function.__annotations__[key] = get_args(annotation)[0]


def literal(app: Sphinx, what: str, name: str, documented: Any, options: Any, lines: list[str]) -> None:
    """Names with an @ as they are written."""
    del app, what, name, documented, options
    lines[:] = [_AT.sub(lambda match: f"``{match[0]}``", line) for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    """Take part whenever a signature or a docstring is shown."""
    app.connect("builder-inited", plain)
    app.connect("autodoc-process-docstring", literal)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
