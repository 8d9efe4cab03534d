"""Tables on the way out: as the headings and rows of a file, and as a range in words."""

import numpy as np

from bowdenfit.description import Description

Page = tuple[list[str], list[list[str]]]
"""Headings and rows."""

STROKE_NAMES = {1: "pull", -1: "return"}


def route_heading(description: Description) -> list[str]:
    """Heading of the route variable's column in a file that is written; none without a route."""
    return [f"{description.route.variable}_{description.route.unit}"] if description.route else []


def route_cells(route: float, description: Description) -> list[str]:
    """A row's cell in that column."""
    return [f"{route:g}"] if description.route else []


def in_words(values: np.ndarray, unit: str) -> str:
    """The range of values, or their one value."""
    low, high = float(values.min()), float(values.max())
    return f"{low:.4g} {unit}" if low == high else f"{low:.4g} to {high:.4g} {unit}"
