"""Plain text as people read it: filled paragraphs, lists in words, aligned columns."""

import textwrap
from collections.abc import Collection, Sequence

from bowdenfit.results.answers import listed

__all__ = ["WIDTH", "filled", "listed", "table"]

WIDTH = 110


def filled(text: str, indent: str = "") -> str:
    """A paragraph in lines of at most `WIDTH` characters."""
    hanging = indent + ("  " if text.startswith("- ") else "")
    return textwrap.fill(text, WIDTH, initial_indent=indent, subsequent_indent=hanging)


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], left: Collection[str] = ("prior", "unit")) -> str:
    """Columns under a ruled heading, the first and those named in `left` aligned left, the others right."""
    widths = [max(len(str(row[i])) for row in [heads, *rows]) for i in range(len(heads))]
    at_left = {i for i, head in enumerate(heads) if i == 0 or head in left}
    lines = [
        "  ".join(
            f"{cell:<{w}}" if i in at_left else f"{cell:>{w}}"
            for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in [heads, *rows]
    ]
    return "\n".join([lines[0], "-" * len(lines[0]), *lines[1:]])
