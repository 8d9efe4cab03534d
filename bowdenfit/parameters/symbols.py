"""Symbols with names that people chose, whatever is in them.

A name stands behind its letter as plain text: in matplotlib's math notation every letter is placed by itself, for one font, and
falls apart in a reader with another.
"""

import re

_GREEK = {"mu": "μ", "sigma": "σ", "tau": "τ", "theta": "θ", "delta": "δ", "Delta": "Δ", "nu": "ν", "Lambda": "Λ"}
_COMMAND = re.compile(r"\\([a-zA-Z]+) ?")
_INDEX = re.compile(r"[a-zA-Z0-9]{1,2}")


def make_symbol(letter: str, name: str) -> str:
    """A letter with a name behind it, or below it where that is no longer than an index.

    Args:
        letter: In matplotlib's math notation.
        name: Underscores in it are spaces.
    """
    plain = name.strip("_ ").replace("_", " ") or name
    return rf"${letter}_\mathrm{{{plain}}}$" if _INDEX.fullmatch(plain) else f"${letter}$ " + plain.replace("$", r"\$")


def to_plain_text(symbol: str) -> str:
    r"""A symbol as plain text can show it: 'μ1' of '$\mu_1$'."""
    formula = r"(?<!\\)\$(.*?)(?<!\\)\$"
    return re.sub(formula, lambda match: _strip_commands(match[1]), symbol).replace(r"\$", "$")


def _strip_commands(formula: str) -> str:
    letters = _COMMAND.sub(lambda match: _GREEK.get(match[1], ""), formula)
    return re.sub(r"[{}_]", "", letters)
