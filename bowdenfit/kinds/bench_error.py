"""Systematic errors of a whole bench, as its tables would show them: what no reading of that bench can tell by itself."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from bowdenfit.kinds.rows import OwnAngles
from bowdenfit.types import Labels, Vector


@dataclass(frozen=True)
class BenchError:
    """An error that all readings of a bench share.

    Args:
        gain: Relative error of the output's load cell against that of the input [1].
        hysteresis: By how much the output's cell reads higher while its force falls than while it rises, relative to the
            force [1]: half of it is taken off while pulling, and half is added while returning.
        angle_scale: Relative error of all wrap angles [1].
        angle_offset: Error that all wrap angles share [rad].
    """

    gain: float = 0.0
    hysteresis: float = 0.0
    angle_scale: float = 0.0
    angle_offset: float = 0.0

    def apply_to_force(self, output_force: Vector, stroke: Vector | Labels | float = 1.0) -> Vector:
        """Return output forces [N], or efficiencies, as the bench would read them.

        Args:
            output_force: As they were read.
            stroke: +1 pulling, -1 returning, 0 neither.
        """
        return output_force * (1 + self.gain) * (1 - self.hysteresis * np.asarray(stroke) / 2)

    def apply_to_angles(self, angle: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """Return wrap angles [rad] as the bench would read them; an angle of 0, and one that is not known, stays."""
        return np.where(angle > 0, angle * (1 + self.angle_scale) + self.angle_offset, angle)

    def apply_to_rows(self, own: OwnAngles) -> OwnAngles:
        """Return wrap angles measured with rows; one with a standard deviation stays, because its error is in the fit."""
        return replace(own, angle=np.where(np.isnan(own.sd), self.apply_to_angles(own.angle), own.angle))
