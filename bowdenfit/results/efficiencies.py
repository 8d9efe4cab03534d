"""Efficiencies with their intervals, one a length: a list that shows itself as `predict` does."""

from collections.abc import Iterable
from typing import Any

from bowdenfit.description import Route
from bowdenfit.display import Display, Rows
from bowdenfit.inference.interval import Interval


class Efficiencies(Display, list[Interval]):
    """Efficiencies [1] at values of the route variable.

    Args:
        found: One a length.
        route: The route; None without one.
        lengths: Route values.
    """

    def __init__(self, intervals: Iterable[Interval], route: Route | None, lengths: Iterable[float]) -> None:
        super().__init__(intervals)
        at = [float(length) for length in lengths]
        self._at = [{} if route is None else {f"{route.variable}_{route.unit}": length} for length in at]
        self._outside = ["" if route is None else route.outside(length) for length in at]

    @property
    def rows(self) -> list[dict[str, Any]]:
        """As `predict` gives them."""
        return [
            at
            | {"efficiency": interval.median}
            | {k: v for k, v in vars(interval).items() if k != "median"}
            | ({"in_range": not outside} if at else {})
            | {"note": outside}
            for at, interval, outside in zip(self._at, self, self._outside, strict=True)
        ]

    def _table(self) -> Rows:
        rows = self.rows
        numbers = [name for row in rows[:1] for name, value in row.items() if isinstance(value, float)]
        return rows, {name: name.rpartition("_")[2] if name in self._at[0] else "1" for name in numbers}
