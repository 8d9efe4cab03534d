"""Symbols with names that people chose, whatever is in them.

A name stands behind its letter as plain text: in matplotlib's math notation every letter is placed by itself, for one font, and
falls apart in a reader with another.
"""

import re

_INDEX = re.compile(r"[a-zA-Z0-9]{1,2}")


def symbol_of(letter: str, name: str) -> str:
    """A letter with a name behind it, or below it where that is no longer than an index.

    Args:
        letter: In matplotlib's math notation.
        name: Underscores in it are spaces.
    """
    plain = name.strip("_ ").replace("_", " ") or name
    return rf"${letter}_\mathrm{{{plain}}}$" if _INDEX.fullmatch(plain) else f"${letter}$ " + plain.replace("$", r"\$")
