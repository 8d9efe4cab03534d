"""Names that people chose, set in matplotlib's math notation, whatever is in them."""

import re

# What stands for itself between dollar signs; of the rest, what a backslash helps, and what looks like it.
_PLAIN = re.compile(r"[a-zA-Z0-9+\-*/<>=:,.;!?&'@()\[\]|\u0080-\U0001ffff]")
_ESCAPED = "%${}_"
_ALIKE = {" ": r"\ ", "\\": r"\backslash", "^": r"\wedge", "~": r"\sim", "#": "♯", '"': "”", "`": "‘"}


def upright(name: str) -> str:
    """A name in upright letters, such as a subscript; underscores are spaces."""
    return rf"\mathrm{{{''.join(_set(letter) for letter in name.strip('_ ').replace('_', ' ') or name)}}}"


def symbol_of(letter: str, name: str) -> str:
    """A letter with a name for its subscript."""
    return rf"${letter}_{upright(name)}$"


def _set(letter: str) -> str:
    if letter in _ALIKE:
        alike = _ALIKE[letter]
        return f"{{{alike}}}" if alike.startswith("\\") and alike != r"\ " else alike
    if letter in _ESCAPED:
        return f"\\{letter}"
    return letter if _PLAIN.match(letter) else "?"
