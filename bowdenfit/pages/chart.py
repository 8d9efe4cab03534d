"""What can be zoomed into, as plain data that the page's script draws; the same lines and colors as in the figures."""

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from bowdenfit.words import printable

Look: TypeAlias = Literal["line", "dashed", "low", "high", "points", "hollow"]
_DIGITS, _OF_PLACES = 5, 8  # significant ones of a number; no screen tells more, but places may start far from zero


@dataclass(frozen=True)
class Series:
    """Values that belong together.

    Args:
        label: In the key; the edges of a band have the same.
        look: "low" and "high", one after the other, are the edges of a band.
        color: One of the page's colors, such as "blue".
        values: At the places of their group; not finite where there are none.
    """

    label: str
    look: Look
    color: str
    values: np.ndarray


@dataclass(frozen=True)
class Group:
    """Series at the same places.

    Args:
        x: The places, ascending.
        series: The series.
    """

    x: np.ndarray
    series: tuple[Series, ...]


@dataclass(frozen=True)
class Span:
    """A stretch of the axis across which something holds.

    Args:
        label: In the key.
        color: One of the page's colors.
        start: From where.
        stop: To where.
    """

    label: str
    color: str
    start: float
    stop: float


@dataclass(frozen=True)
class Chart:
    """One chart.

    Args:
        name: By which it is chosen among others.
        x_label: With unit.
        y_label: With unit.
        groups: What is drawn.
        spans: What is shaded behind.
    """

    name: str
    x_label: str
    y_label: str
    groups: tuple[Group, ...]
    spans: tuple[Span, ...] = ()

    def plain(self) -> dict[str, Any]:
        """For the page's script."""
        return {
            "name": printable(self.name),
            "x": printable(self.x_label),
            "y": printable(self.y_label),
            "groups": [
                {
                    "x": _numbers(group.x, _OF_PLACES),
                    "series": [vars(one) | {"values": _numbers(one.values)} for one in group.series],
                }
                for group in self.groups
            ],
            "spans": [vars(span) for span in self.spans],
        }


def _numbers(values: np.ndarray, digits: int = _DIGITS) -> list[float | None]:
    return [
        float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in np.asarray(values, float).tolist()
    ]
