"""Transmission efficiencies: output force over input force while pulling."""

from dataclasses import dataclass

from bowdenfit.display import Part
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.types import Vector


@dataclass(frozen=True, repr=False)
class EfficiencyTable(Part):
    """Measured transmission efficiencies.

    Args:
        route: Route variable; NaN where the cable has no route.
        efficiency: Output force over input force while pulling [1].
        sd: Standard deviation where given [1], else 0.
        own: Wrap angles measured with the row.
        origin: Where each row was read.
    """

    route: Vector
    efficiency: Vector
    sd: Vector
    own: OwnAngles
    origin: RowOrigin
