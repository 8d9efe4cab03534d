"""The directive `verb-help`: the output of --help for every command."""

import io
from contextlib import redirect_stdout

from docutils import nodes
from rich.console import Console
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

WIDTH = 80


class VerbHelp(SphinxDirective):
    """Directive that writes a section for the program and for each of its commands."""

    def run(self) -> list[nodes.Node]:
        """Return all sections."""
        from bowdenfit.cli.commands import COMMANDS

        return [_section("bowdenfit"), *(_section("bowdenfit", verb.name[0]) for verb in COMMANDS)]


def _section(*words: str) -> nodes.section:
    """Return a section with a heading and the help text, 80 columns wide."""
    from bowdenfit.cli import bowdenfit

    with redirect_stdout(io.StringIO()) as printed:
        bowdenfit.help_print(list(words[1:]), console=Console(width=WIDTH))
    path, text = " ".join(words), "\n".join(line.rstrip() for line in printed.getvalue().splitlines())
    section = nodes.section(ids=[nodes.make_id(path)], names=[path])
    section += [nodes.title(path, path), nodes.literal_block(text, text, language="text")]
    return section


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive with Sphinx."""
    app.add_directive("verb-help", VerbHelp)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
