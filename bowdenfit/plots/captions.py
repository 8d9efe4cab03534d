"""Phrases that the captions of several figures share: what lines and bands are, and how many items are shown."""

from collections.abc import Iterable

import numpy as np

from bowdenfit.parameters.symbols import to_plain_text
from bowdenfit.words import counted

WITH_BENCH_ERRORS = "measurements, priors and bench errors"


def describe_curve(has_draws: bool, quantity: str = "", sources: str = "measurements and priors") -> str:
    """Return the sentence that explains a line with a 90 % band.

    Args:
        has_draws: Whether there are draws; else the line is the least-squares estimate.
        quantity: The quantity shown, such as "the output force".
        sources: What the band follows from.
    """
    of = f" of {quantity}" if quantity else ""
    if not has_draws:
        return f"Line: least-squares estimate{of}; without sampling there is no band."
    return f"Line: median{of}; band: 90 % credible interval, from {sources}."


def describe_strip(unit_words: str) -> str:
    """Return the sentence that explains a strip of residuals."""
    return f"Strip below: residuals, reading minus line, {unit_words}; if the model fits, they scatter evenly about zero."


def describe_left_out(points: np.ndarray) -> str:
    """Return the sentence that explains readings which the user leaves out, x in the first row; empty without any."""
    count = points.shape[-1]
    return f"Gray circles: {counted(count, 'reading')} left out by the user." if count else ""


def count_shown(shown: int, total: int, noun: str, several: str = "") -> str:
    """Return '3 recordings', or '8 of 12 recordings, evenly chosen'."""
    counting = counted(total, noun, several)
    return counting if shown >= total else f"{shown} of {counting}, evenly chosen"


def explain_symbols(symbols: Iterable[tuple[str, str]]) -> str:
    """Return a sentence on what symbols stand for, with a space after it; empty if no symbol has a meaning.

    Args:
        symbols: Pairs of a symbol in matplotlib's math notation and its meaning; those with an empty meaning are left out.
    """
    meanings = "; ".join(f"{to_plain_text(symbol)}: {meaning}" for symbol, meaning in symbols if meaning)
    return f"Symbols: {meanings}. " if meanings else ""
