"""Wrap angles of the curved contacts against the route variable."""

from dataclasses import dataclass
from typing import Literal

from bowdenfit.description import QuantityValue, Table
from bowdenfit.display import Part
from bowdenfit.kinds.rows import RowOrigin
from bowdenfit.types import Matrix, Vector


class AngleSettings(Table):
    """The table of wrap angles; how angles too small to detect enter the fit."""

    detection_limit: QuantityValue | None = None
    undetected: Literal["censored", "zero", "dropped"] = "censored"


@dataclass(frozen=True, repr=False)
class AngleTable(Part):
    """Wrap angle of each curved contact against the route variable.

    Args:
        route: Route variable, in the unit of the description.
        names: Column of each contact.
        angle: Measured wrap angle [rad]; NaN where it was not detected.
        limit: Detection limit where it was not detected [rad]; NaN elsewhere.
        origin: Where each row was read.
    """

    route: Vector
    names: tuple[str, ...]
    angle: Matrix
    limit: Matrix
    origin: RowOrigin

    def column(self, name: str) -> tuple[Vector, Vector]:
        """Angles and detection limits of one contact."""
        k = self.names.index(name)
        return self.angle[:, k], self.limit[:, k]
