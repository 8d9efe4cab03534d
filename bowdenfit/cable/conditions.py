"""Loads and speeds at which a cable was measured, and those for which its coefficients are stated."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError
from bowdenfit.parameters.space import Scale
from bowdenfit.units import speed_dimension

LEAST_SHARE = 1e-5  # of the loads, which an offset leaves of a rope's reading at least; a judgement


@dataclass(frozen=True)
class Conditions:
    """At what loads and speeds the cable was measured.

    Args:
        reference_force: Force at which friction coefficients have their stated values [N].
        reference_speed: Speed that predictions are made for [mm/s or rad/s].
        speeds: Lowest and highest speed measured at; NaN without any.
        velocity_unit: "mm/s" or "rad/s"; empty without velocities.
        shows_loads: Whether any table shows the forces, and not their ratio alone.
        median_load: Median of all loads measured at [N]; None where no table shows any.
        groups: Groups of its readings; empty without any.
        shows_turns: Whether there are recordings of a single rope, which show what happens when the motion turns.
    """

    reference_force: float
    reference_speed: float
    speeds: tuple[float, float]
    velocity_unit: str
    shows_loads: bool = True
    median_load: float | None = None
    groups: tuple[str, ...] = ()
    shows_turns: bool = False

    @property
    def load(self) -> Scale:
        """What priors of forces are in proportion to."""
        if self.median_load is None:
            return Scale(self.reference_force, "reference force", "N")
        return Scale(self.median_load, "median load", "N")

    @property
    def least_force(self) -> float:
        """The least that an offset or a drag may leave of a force [N]."""
        return LEAST_SHARE * self.load.value

    def needs_loads(self, option: str) -> None:
        """Refuse an option that efficiencies alone say nothing of.

        Raises:
            DescriptionError: No table shows the forces.
        """
        if not self.shows_loads:
            raise DescriptionError(
                f'friction_model has "{option}", but no force table or recording shows at which loads it was measured; '
                "efficiencies alone say nothing about it: leave it out, or add forces."
            )


def make_conditions(
    description: Description,
    forces: Float[np.ndarray, " forces"],
    tensions: Float[np.ndarray, " tensions"],
    speeds: Float[np.ndarray, " speeds"],
    velocity_unit: str,
    groups: tuple[str, ...] = (),
    shows_turns: bool = False,
) -> Conditions:
    """Return the reference force and speed as stated, or from the middle of the measurements.

    Args:
        description: Parsed cable.toml.
        forces: Forces of both ends, wherever they are positive [N].
        tensions: Tensions of the rope that tables without these show, wherever they are positive [N].
        speeds: Speeds while the rope slides [mm/s or rad/s].
        velocity_unit: Which of the two; empty without velocities.
        groups: Groups of readings.
        shows_turns: Whether there are recordings of a single rope.
    """
    stated = description.reference_force
    force = stated.to("force") if stated else _rounded(np.exp(np.mean(np.log(forces)))) if len(forces) else 1.0
    speed = _rounded(float(np.median(speeds))) if len(speeds) else 0.0
    if description.reference_velocity is not None:
        speed = description.reference_velocity.to(speed_dimension(velocity_unit or "mm/s"))
    ends = (float(speeds.min()), float(speeds.max())) if len(speeds) else (float("nan"), float("nan"))
    loads = forces if len(forces) else tensions
    typical = float(np.median(loads)) if len(loads) else None
    return Conditions(float(force), float(speed), ends, velocity_unit, len(forces) > 0, typical, groups, shows_turns)


def _rounded(value: float) -> float:
    """Return a value to two digits: a reference is a convention, and should look like one."""
    return float(f"{value:.2g}")
