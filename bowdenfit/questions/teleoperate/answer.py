"""What a hand feels through a cable, and which walls it may touch."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.display import Display, Part, Rows
from bowdenfit.inference.interval import Interval


@dataclass(frozen=True, repr=False)
class CouplingScheme(Part):
    """One way to couple master and slave.

    Args:
        name: In words.
        free: What is felt in slow free motion, where the cable's friction is most [N m].
        stiffness: What is felt of the stated wall [N m/rad]; None where no position comes back, so that none is defined.
        in_the_open: Probability that it is stable in free motion.
        stable: Probability that contact is stable, by wall stiffness.
        hardest: Hardest wall up to which every softer one is stable with the probability asked for [N m/rad]; 0 where free
            motion is not, None where no wall looked at is too hard.
        radius: Median of the largest spectral radius in free motion; above 1 oscillations grow.
    """

    name: str
    free_torque: Interval
    stiffness: Interval | None
    free_motion_stable: float
    stable: np.ndarray
    hardest: float | None
    radius: float

    JSON: ClassVar = (
        "name",
        ("free", "free_torque"),
        "stiffness",
        ("in_the_open", "free_motion_stable"),
        "stable",
        "hardest",
        "radius",
    )


@dataclass(frozen=True, repr=False)
class SimulatedContact(Part):
    """One device through time: in the open for 2 s, then against the wall; as figures 12 to 14 of the haptic paper.

    Args:
        time: [s].
        master, slave: Angles of the master's joint and of the slave [rad].
        hand_torque, wall_torque: What the hand gives and the wall takes [N m].
        wall_stiffness: Of the wall [N m/rad].
        bounces: Whether the slave leaves the wall again 1.2 s after it came; None where it never came.
    """

    time: np.ndarray
    master: np.ndarray
    slave: np.ndarray
    hand_torque: np.ndarray
    wall_torque: np.ndarray
    wall_stiffness: float
    bounces: bool | None


@dataclass(frozen=True, repr=False)
class Teleoperation(Display):
    """What a hand feels through a cable, and which walls it may touch.

    Args:
        cable, device: Their names.
        bends: Lowest and highest wrap angle [deg].
        probability: With which contact must be stable.
        draws: Devices looked at, each at a bend of its own.
        walls: Stiffnesses of walls looked at [N m/rad].
        wall: The stated one [N m/rad].
        at_wall: Probability that contact with that one is stable, with the coupling as stated.
        schemes: The coupling as stated, with two channels, and with local feedback.
        contact: One device through time.
    """

    cable: str
    device: str
    bends: tuple[float, float]
    probability: float
    draws: int
    walls: np.ndarray
    wall: float
    at_wall: float
    schemes: tuple[CouplingScheme, ...]
    contact: SimulatedContact

    @property
    def stated(self) -> CouplingScheme:
        """The coupling as stated."""
        return self.schemes[0]

    def _table(self) -> Rows:
        rows = [
            {"coupling": scheme.name, "wall_stiffness": float(wall), "stable": float(scheme.stable[i])}
            for scheme in self.schemes
            for i, wall in enumerate(self.walls)
        ]
        return rows, {"wall_stiffness": "N*m/rad"}
