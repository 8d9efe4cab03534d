"""Tables on the way out: as the headings and rows of a file, and as a range in words."""

import math
from collections.abc import Iterable

import numpy as np

from bowdenfit.description import Description
from bowdenfit.words import significant

Page = tuple[list[str], list[list[str]]]
"""Headings and rows."""

_DIGITS = 5
STROKE_NAMES = {1: "pull", -1: "return"}


def route_heading(description: Description) -> list[str]:
    """Heading of the route variable's column in a file that is written; none without a route."""
    return [f"{description.route.variable}_{description.route.unit}"] if description.route else []


def route_cells(route: float, description: Description) -> list[str]:
    """A row's cell in that column."""
    return [f"{route:g}"] if description.route else []


def fixed(values: Iterable[float], decimals: int) -> list[str]:
    """Cells of a column: so many decimals, and more where its largest value would else have fewer than five digits."""
    column = np.array(list(values), dtype=float)
    largest = float(np.max(np.abs(column[np.isfinite(column)]), initial=0.0))
    enough = _DIGITS - 1 - math.floor(math.log10(largest)) if largest else 0
    return [f"{value:.{max(decimals, enough)}f}" for value in column]


def in_words(values: np.ndarray, unit: str) -> str:
    """The range of values, or their one value."""
    low, high = float(values.min()), float(values.max())
    least, most = significant(low, 4), significant(high, 4)
    return f"{least} {unit}" if low == high else f"{least} to {most} {unit}"
