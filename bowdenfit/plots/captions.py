"""Words that captions share: what lines and bands are, and how many of what are drawn."""

from collections.abc import Iterable

from bowdenfit.parameters.symbols import to_plain_text
from bowdenfit.words import counted


def curve_words(drawn: bool, what: str = "") -> str:
    """What a line with a band of 90 % is, in a sentence.

    Args:
        drawn: Whether there are draws; else the line is the least-squares estimate.
        what: That it is of, such as "the output force".
    """
    of = f" of {what}" if what else ""
    if not drawn:
        return f"Line: least-squares estimate{of}; without sampling there is no band."
    return f"Line: median{of}; band: the interval that holds it with 90 % probability, measurements and priors considered."


def strip_words(what: str) -> str:
    """What a strip of residuals is, in a sentence."""
    return f"Below: each reading less the line, {what}; without misfit they scatter evenly about zero."


def shown_words(shown: int, every: int, noun: str, several: str = "") -> str:
    """'3 recordings', or '8 of 12 recordings', evenly chosen."""
    counting = counted(every, noun, several)
    return counting if shown >= every else f"{shown} of {counting}, evenly chosen"


def symbol_words(symbols: Iterable[tuple[str, str]]) -> str:
    """What symbols stand for, in a sentence with a space behind it; empty where nothing is said of any.

    Args:
        symbols: Each in matplotlib's math notation, and what it stands for; those that nothing is said of are left out.
    """
    said = "; ".join(f"{to_plain_text(symbol)}: {what}" for symbol, what in symbols if what)
    return f"Symbols: {said}. " if said else ""
