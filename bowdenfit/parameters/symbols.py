"""Symbols of parameters whose names users chose.

A long name stands behind its letter as plain text, because matplotlib's math notation places every letter by itself, for one
font, and the letters drift apart in a viewer with another font.
"""

import re

_GREEK = {"mu": "μ", "sigma": "σ", "tau": "τ", "theta": "θ", "delta": "δ", "Delta": "Δ", "nu": "ν", "Lambda": "Λ"}
_COMMAND = re.compile(r"\\([a-zA-Z]+) ?")
_INDEX = re.compile(r"[a-zA-Z0-9]{1,2}")


def make_symbol(letter: str, name: str) -> str:
    """Return a letter with a name behind it, or below it as an index if the name is short.

    Args:
        letter: Letter in matplotlib's math notation.
        name: Name; underscores become spaces.
    """
    plain = name.strip("_ ").replace("_", " ") or name
    return rf"${letter}_\mathrm{{{plain}}}$" if _INDEX.fullmatch(plain) else f"${letter}$ " + plain.replace("$", r"\$")


def to_plain_text(symbol: str) -> str:
    r"""Return a symbol as plain text: 'μ1' for '$\mu_1$'."""
    formula = r"(?<!\\)\$(.*?)(?<!\\)\$"
    return re.sub(formula, lambda match: _strip_commands(match[1]), symbol).replace(r"\$", "$")


def _strip_commands(formula: str) -> str:
    letters = _COMMAND.sub(lambda match: _GREEK.get(match[1], ""), formula)
    return re.sub(r"[{}_]", "", letters)
