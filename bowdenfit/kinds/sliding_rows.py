"""Readings taken while the rope slides, whatever table they came from."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bowdenfit.types import Labels, Vector

ROW_ARRAYS = ("route", "own", "is_own", "known_variance", "noisy", "group")


@dataclass(frozen=True)
class SlidingRows:
    """Readings taken while the rope slides, in the order of the table.

    Args:
        input_force, output_force: Forces, those of tables as `expected_forces` has them [N].
        log_ratio: s log(F_in/F_out) of the readings, without what noise adds to it [1].
        stroke: +1 pulling, -1 return.
        run: Number of the run.
        velocity: Velocity; NaN where it is not known.
        drift: s d(log F_out)/dt, by which a delay of the output channel shifts the log ratio [1/s]; 0 without a clock.
        worth: How many independent readings each counts for [1].
        angles: `ROW_ARRAYS` of every row.
        tells: How much one reading as each tells of its log ratio at unit noise of the output cell [N^2]; by the forces if
            omitted.
    """

    input_force: Vector
    output_force: Vector
    log_ratio: Vector
    stroke: Labels
    run: Labels
    velocity: Vector
    drift: Vector
    worth: Vector
    angles: Mapping[str, np.ndarray]
    tells: Vector | None = None

    def weight(self, noise_ratio: float) -> Vector:
        """Information on the log ratio at unit noise of the output cell [N^2].

        Args:
            noise_ratio: Noise of the input cell over that of the output cell [1].
        """
        if self.tells is not None:
            return self.worth * self.tells
        return np.asarray(self.worth / (noise_ratio**2 / self.input_force**2 + 1 / self.output_force**2))
