"""The directive `verb-help`: what every verb of the command line says with --help."""

import io
from contextlib import redirect_stdout

from docutils import nodes
from rich.console import Console
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

WIDTH = 80


class VerbHelp(SphinxDirective):
    """A section for the program and for each of its verbs."""

    def run(self) -> list[nodes.Node]:
        """All sections."""
        from bowdenfit.cli.commands import COMMANDS

        return [_section("bowdenfit"), *(_section("bowdenfit", verb.name[0]) for verb in COMMANDS)]


def _section(*words: str) -> nodes.section:
    """Heading, and the help as it is printed 80 columns wide."""
    from bowdenfit.cli import bowdenfit

    with redirect_stdout(io.StringIO()) as printed:
        bowdenfit.help_print(list(words[1:]), console=Console(width=WIDTH))
    path, text = " ".join(words), "\n".join(line.rstrip() for line in printed.getvalue().splitlines())
    section = nodes.section(ids=[nodes.make_id(path)], names=[path])
    section += [nodes.title(path, path), nodes.literal_block(text, text, language="text")]
    return section


def setup(app: Sphinx) -> dict[str, bool]:
    """Offer the directive."""
    app.add_directive("verb-help", VerbHelp)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
