"""Help texts with lists of words and what they mean, as wide as the terminal."""

import inspect
import re

import click

_LIST = "\b\n"  # begins a paragraph whose lines are a word, two spaces or more, and what it means


class Explained(click.Command):
    """A command whose help text may hold such lists; click would print them as they stand, however wide."""

    def format_help_text(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write paragraphs as text and lists in two columns."""
        for paragraph in inspect.cleandoc(self.help or "").split("\n\n"):
            formatter.write_paragraph()
            with formatter.indentation():
                if paragraph.startswith(_LIST):
                    formatter.write_dl(_rows(paragraph.removeprefix(_LIST)))
                else:
                    formatter.write_text(paragraph)


def _rows(text: str) -> list[tuple[str, str]]:
    """Words and meanings; a line that is indented goes on with the meaning above."""
    joined = re.sub(r"\n\s+", " ", text)
    return [(word, meaning) for word, meaning in (re.split(r" {2,}", line, maxsplit=1) for line in joined.splitlines())]
