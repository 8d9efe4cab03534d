"""What the motor does: pulls and returns with pauses between them, as stretches of constant acceleration."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

from bowdenfit.description import NonNegative, Positive
from bowdenfit.types import Vector


@dataclass(frozen=True)
class MotorProfile:
    """What the motor does: `cycles` times pull, pause, return, pause, at one speed with even acceleration.

    Args:
        speed: Motor speed [rad/s].
        stroke: Rope pulled in by a stroke [mm].
        drum_radius: Radius of the drum on the motor [mm].
        acceleration_time: Time to reach the speed, and to stop [s]; 0 for a speed that jumps.
        pause: Rest after each stroke [s].
        cycles: Number of strokes each way.
        partial_reversals: Short ways back inside each stroke, as pairs (where, how far back) along the stroke [mm]; a
            return stroke has them at the same distances from its own start. They may lie inside one another.
        lead_in: Rest under preload before the first stroke [s].
        unloaded: Time at the very start, inside the lead-in, in which the cells carry nothing [s], for taring.
    """

    speed: Positive
    stroke: Positive = 50.0
    drum_radius: Positive = 20.0
    acceleration_time: NonNegative = 0.1
    pause: NonNegative = 0.3
    cycles: Annotated[int, Field(ge=1)] = 3
    partial_reversals: tuple[tuple[Positive, Positive], ...] = ()
    lead_in: NonNegative = 0.0
    unloaded: NonNegative = 0.0


@dataclass(frozen=True)
class MotorMotion:
    """Motor position as stretches of constant acceleration [s, mm, mm/s, mm/s^2]; the last one is a rest."""

    start: Vector
    position: Vector
    velocity: Vector
    acceleration: Vector
    turns: Float[np.ndarray, " turns"]
    reversals: tuple[float, ...]

    def state_at(self, time: Vector) -> tuple[Vector, Vector]:
        """Position [mm] and velocity [mm/s]."""
        i = np.searchsorted(self.start, time, side="right") - 1
        since = time - self.start[i]
        velocity = self.velocity[i] + self.acceleration[i] * since
        return self.position[i] + (self.velocity[i] + self.acceleration[i] * since / 2) * since, velocity


def plan_motion(profile: MotorProfile) -> MotorMotion:
    """All moves of the profile, one after the other."""
    clock, where = profile.lead_in, 0.0
    rows, turns, reversals, heading = [(0.0, 0.0, 0.0, 0.0)], [], [], 0.0
    for ends_of_stroke in (_waypoints(profile, cycle) for cycle in range(2 * profile.cycles)):
        for target in ends_of_stroke:
            direction = float(np.sign(target - where))
            if direction == 0:
                continue
            if direction == -heading:
                reversals.append(clock)
            heading = direction
            rows += _move(profile, clock, where, target)
            clock, where = rows[-1][0], target
            turns.append(clock)
        clock += profile.pause
    start, position, velocity, acceleration = (np.array(column) for column in zip(*rows, strict=True))
    return MotorMotion(start, position, velocity, acceleration, np.array(turns), tuple(reversals))


def _waypoints(profile: MotorProfile, number: int) -> list[float]:
    """Where the motor turns within one stroke [mm]; even strokes pull, odd ones return."""
    along = [point for where, back in profile.partial_reversals for point in (where, where - back)]
    along.append(profile.stroke)
    return along if number % 2 == 0 else [profile.stroke - point for point in along]


def _move(profile: MotorProfile, clock: float, start: float, end: float) -> list[tuple[float, float, float, float]]:
    """One trapezoidal move, or a triangular one where the way is too short for the full speed, and the rest after it."""
    distance, speed, ramp = abs(end - start), profile.speed * profile.drum_radius, profile.acceleration_time
    if speed * ramp > distance:
        speed, ramp = float(np.sqrt(distance * speed / ramp)), float(np.sqrt(distance * ramp / speed))
    cruise = max(distance / speed - ramp, 0.0)
    sign = float(np.sign(end - start))
    steps = [(0.0, start, sign * speed, 0.0)]
    if ramp > 0:
        acceleration, on_the_ramp = sign * speed / ramp, sign * speed * ramp / 2
        steps = [
            (0.0, start, 0.0, acceleration),
            (ramp, start + on_the_ramp, sign * speed, 0.0),
            (ramp + cruise, end - on_the_ramp, sign * speed, -acceleration),
        ]
    steps.append((2 * ramp + cruise, end, 0.0, 0.0))
    return [(clock + after, q, v, a) for after, q, v, a in steps]
