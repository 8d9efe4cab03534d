"""Forces, or torques, at both ends of a pull-pull loop while it moves."""

from dataclasses import dataclass

from bowdenfit.display import Part
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.types import Labels, Vector


@dataclass(frozen=True, repr=False)
class LoopTable(Part):
    """Forces at both ends of a pull-pull loop while it moves.

    Args:
        route: Route variable; NaN where the cable has no route.
        input_force: Difference of the tensions at the motor side [N].
        output_force: Difference of the tensions at the load side [N].
        stroke: +1 moving forward, -1 moving back.
        preload: Preload measured with the row [N]; NaN where the cable's own counts.
        own: Wrap angles measured with the row.
        origin: Where each row was read.
    """

    route: Vector
    input_force: Vector
    output_force: Vector
    stroke: Labels
    preload: Vector
    own: OwnAngles
    origin: RowOrigin
