"""Force at the motor against the displacement of the motor: one load cell and one position, as at catheters and endoscopes."""

from dataclasses import dataclass
from typing import Literal

from bowdenfit.description import QuantityValue, Table
from bowdenfit.display import Part
from bowdenfit.kinds.displacement.turns import Motion
from bowdenfit.kinds.rows import OwnAngles, RowOrigin
from bowdenfit.types import Flags, Labels, Vector

ZERO = "displacement_zero"  # parameter: where the displacement of a run begins


class DisplacementSettings(Table):
    """The table of force against displacement; what is at the far end, and how the rows were taken.

    Rows are readings in the order in which they were taken, or, with a column stroke, readings of a rope that slides.
    """

    end: Literal["spring", "stop"] = "spring"
    stop: QuantityValue | None = None
    rows: Literal["in order", "sliding"] | None = None


@dataclass(frozen=True, repr=False)
class DisplacementTable(Part):
    """Force at the motor against displacement.

    Args:
        route: Route variable; NaN where the cable has no route.
        force: Force at the motor [N].
        displacement: Displacement of the rope at the motor, growing as it pulls [mm].
        motion: How the motor moved.
        run: Number of the run (one mounting at one bend) of each row.
        run_names: Name of each run.
        used: Which rows are readings of what lies at the far end.
        own: Wrap angles measured with the row.
        origin: Where each row was read.
        sliding: Whether rows are known to be taken while all of the rope slides.
    """

    route: Vector
    force: Vector
    displacement: Vector
    motion: Motion
    run: Labels
    run_names: tuple[str, ...]
    used: Flags
    own: OwnAngles
    origin: RowOrigin
    sliding: bool

    @property
    def pulls(self) -> Flags:
        """Which of the readings were taken while the motor pulled."""
        return self.used & (self.motion.stroke > 0)

    @property
    def shared(self) -> tuple[float, float]:
        """The displacements that pulling and returning readings have in common [mm]; the second is smaller without any."""
        x, back = self.displacement, self.used & (self.motion.stroke < 0)
        if not (self.pulls.any() and back.any()):
            return 0.0, -1.0
        return max(x[self.pulls].min(), x[back].min()), min(x[self.pulls].max(), x[back].max())
