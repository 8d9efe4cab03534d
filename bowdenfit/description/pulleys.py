"""The pulleys at a cable's ends, which turn torques into forces."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.errors import DatasetError


@dataclass(frozen=True)
class Pulleys:
    """Radii of the pulleys at the motor and at the load side [mm]; None if not stated."""

    input_radius: float | None = None
    output_radius: float | None = None

    def forces(self, torques: np.ndarray, end: str, file: str) -> np.ndarray:
        """Forces [N] from torques [N mm] at one end, "input" or "output", of a file.

        Raises:
            DatasetError: The radius of that pulley is not known.
        """
        radius = self.input_radius if end == "input" else self.output_radius
        if radius is None:
            raise DatasetError(
                f"{file} gives {end}_torque, but the radius of that pulley is not known; add it to cable.toml: [cable] "
                f'{end}_pulley_radius = {{ value = 15, unit = "mm" }}.'
            )
        return torques / radius
