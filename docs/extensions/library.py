"""The directives `verb-functions`, every function of the package, and `verb-answers`, the classes that they return.

Both are generated from the program, so that the page cannot fall behind it.
"""

import ast
import inspect
from importlib import import_module
from typing import Any, get_args, get_type_hints

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import bowdenfit
from bowdenfit.display import Display
from bowdenfit.verbs import VERBS


class VerbFunctions(SphinxDirective):
    """Directive that documents all functions: first those of verbs in the order of verbs, then the others."""

    def run(self) -> list[nodes.Node]:
        """Return the signature and the docstring of every function."""
        return _documented(self, [f".. autofunction:: bowdenfit.{name}" for name in functions()])


class VerbAnswers(SphinxDirective):
    """Directive that documents the classes that functions return, except those that the page shows itself."""

    option_spec = {"except": directives.unchanged}  # noqa: RUF012  (docutils has it so)

    def run(self) -> list[nodes.Node]:
        """Return the docstring of every class."""
        shown = self.options.get("except", "").split()
        found = {each.__name__: each for name in functions() for each in answers(getattr(bowdenfit, name))}
        classes = [each for name, each in sorted(found.items()) if name not in shown]
        return _documented(self, [f".. autoclass:: {each.__module__}.{each.__name__}" for each in classes])


def functions() -> list[str]:
    """Return the names of all functions of the package."""
    every = [name for name in dir(bowdenfit) if inspect.isroutine(getattr(bowdenfit, name))]
    of_verbs = [name for verb in VERBS for name in every if getattr(bowdenfit, name) is verb.function]
    return [*of_verbs, *(name for name in every if name not in of_verbs)]


def answers(function: Any) -> list[type]:
    """Return the classes of this package that a function returns."""
    module = inspect.getmodule(function)
    known = dict(vars(module))
    for node in ast.walk(ast.parse(inspect.getsource(module))):  # includes imports made only for type checkers
        if isinstance(node, ast.ImportFrom) and node.module:
            known |= {each.asname or each.name: getattr(import_module(node.module), each.name, None) for each in node.names}
    hint = get_type_hints(function, known)["return"]
    parts = (hint, *get_args(hint))
    return [part for part in parts if inspect.isclass(part) and issubclass(part, Display)]


def _documented(directive: SphinxDirective, lines: list[str]) -> list[nodes.Node]:
    return directive.parse_text_to_nodes("\n".join(["```{eval-rst}", *lines, "```"]))


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directives with Sphinx."""
    app.add_directive("verb-functions", VerbFunctions)
    app.add_directive("verb-answers", VerbAnswers)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
