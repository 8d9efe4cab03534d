"""Tables as people write them: headings and cells of a file, strokes and angles of a design, and ranges in words."""

import math
from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np

from bowdenfit.description import Description
from bowdenfit.types import Vector
from bowdenfit.words import significant

Page = tuple[list[str], list[list[str]]]
"""Headings and rows."""

_DIGITS = 5
STROKE_NAMES = {1: "pull", -1: "return"}
Stroke = Literal["pull", "return"]
_SIGNS = {name: sign for sign, name in STROKE_NAMES.items()}


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


def signs(strokes: Sequence[Stroke]) -> list[int]:
    """+1 for each pull, -1 for each return."""
    return [_SIGNS[stroke] for stroke in strokes]


def radians(degrees: Sequence[float]) -> Vector:
    """Wrap angles as tables have them."""
    return np.deg2rad(np.array(degrees, dtype=float))
