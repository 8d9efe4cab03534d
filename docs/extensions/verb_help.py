"""The directive `verb-help`: what every verb of the command line says with --help."""

import click
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

WIDTH = 80


class VerbHelp(SphinxDirective):
    """A section for the program and for each of its verbs."""

    def run(self) -> list[nodes.Node]:
        """All sections."""
        from bowdenfit.cli import bowdenfit

        verbs = bowdenfit.list_commands(click.Context(bowdenfit))
        return [_section(bowdenfit, "bowdenfit", None), *(_section(bowdenfit.commands[v], f"bowdenfit {v}", v) for v in verbs)]


def _section(command: click.Command, path: str, verb: str | None) -> nodes.section:
    """Heading, and the help as it is printed 80 columns wide."""
    parent = click.Context(click.Group("bowdenfit"), info_name="bowdenfit", terminal_width=WIDTH) if verb else None
    context = click.Context(command, parent, info_name=verb or path, terminal_width=WIDTH)
    context.help_option_names = ["-h", "--help"]
    text = command.get_help(context)
    section = nodes.section(ids=[nodes.make_id(path)], names=[path])
    section += [nodes.title(path, path), nodes.literal_block(text, text, language="text")]
    return section


def setup(app: Sphinx) -> dict[str, bool]:
    """Offer the directive."""
    app.add_directive("verb-help", VerbHelp)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
