"""Text that is safe inside comments and names of other programs."""

import textwrap
from collections.abc import Iterable
from importlib.resources import files
from string import Template

_WIDTH = 110  # characters of a line of a comment; a judgement


def format_comment(sentences: Iterable[str], before: str) -> str:
    """Return sentences as lines of a comment, ASCII alone, in which nothing ends the comment or goes on behind it.

    Args:
        sentences: A line or more each.
        before: Text that begins a line, such as " * ".
    """
    return "\n".join(before + line for line in wrap_comment(sentences))


def wrap_comment(sentences: Iterable[str]) -> list[str]:
    """Return sentences as lines of ASCII for a comment, a line or more each."""
    return [line for text in sentences for line in textwrap.wrap(ascii_text(text), _WIDTH) or [""]]


def ascii_text(text: str) -> str:
    """Return text as one line of ASCII without anything that begins or ends a comment, or that C reads as something else."""
    text_out = "".join(x if " " <= x <= "~" and x != "\\" else ascii(x)[1:-1].replace("\\", "~") for x in text)
    for bad in ("*/", "/*", "??", "--", "%{", "%}"):
        while bad in text_out:
            text_out = text_out.replace(bad, f"{bad[0]} {bad[1]}")
    return text_out


def fill_template(name: str, *, package: str = "bowdenfit.questions.export", **values: object) -> str:
    """Return a template with its places filled.

    Args:
        name: Name of the file.
        package: Package in whose folder `templates` it lies.
        values: By the name of the place.
    """
    text = files(package).joinpath("templates", name).read_text(encoding="utf-8")
    return Template(text).substitute(values)


def make_identifier(name: str) -> str:
    """Return a name as file systems and programs take one: letters of ASCII, digits and single underscores."""
    letters = "".join(x.lower() if x.isascii() and x.isalnum() else " " for x in name)
    word = "_".join(letters.split())[:40].strip("_")
    return word if word[:1].isalpha() else f"cable_{word}".strip("_")
