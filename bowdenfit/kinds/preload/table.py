"""Preload between fixed ends at wrap angles."""

from dataclasses import dataclass

from bowdenfit.description import Table
from bowdenfit.display import Part
from bowdenfit.kinds.rows import RowOrigin
from bowdenfit.types import Vector


class PreloadTableSettings(Table):
    """The table of preload, by which it follows the stretch of the rope unless the description says otherwise."""

    @property
    def tells_preload(self) -> bool:
        """It does."""
        return True


@dataclass(frozen=True, repr=False)
class PreloadTable(Part):
    """Preload between fixed ends at wrap angles.

    Args:
        wrap_angle: Total wrap angle of the cable [rad].
        preload: Tension at rest [N]; 0 where the rope is slack.
        origin: Where each row was read.
    """

    wrap_angle: Vector
    preload: Vector
    origin: RowOrigin
