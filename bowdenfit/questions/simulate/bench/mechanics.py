"""Motor, rope, friction and spring: from the motion of the motor to the true forces on both sides of the cable."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from bowdenfit.description import Finite, NonNegative, Positive
from bowdenfit.errors import UsageError
from bowdenfit.recordings.preparation.hysteresis import play_between
from bowdenfit.recordings.recording import SWITCH
from bowdenfit.types import Labels, Vector

_MAX_NEWTON_STEPS = 60  # a guard; the iteration ends when a step changes nothing in 14 digits


@dataclass(frozen=True)
class MotorProfile:
    """Profile of the motor: `cycles` times pull, pause, return, pause, at one speed with even acceleration.

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
        """Return position [mm] and velocity [mm/s]."""
        i = np.searchsorted(self.start, time, side="right") - 1
        since = time - self.start[i]
        velocity = self.velocity[i] + self.acceleration[i] * since
        return self.position[i] + (self.velocity[i] + self.acceleration[i] * since / 2) * since, velocity


def plan_motion(profile: MotorProfile) -> MotorMotion:
    """Return all moves of the profile, one after the other."""
    clock, where = profile.lead_in, 0.0
    rows, turns, reversals, heading = [(0.0, 0.0, 0.0, 0.0)], [], [], 0.0
    for ends_of_stroke in (_list_waypoints(profile, cycle) for cycle in range(2 * profile.cycles)):
        for target in ends_of_stroke:
            direction = float(np.sign(target - where))
            if direction == 0:
                continue
            if direction == -heading:
                reversals.append(clock)
            heading = direction
            rows += _make_move(profile, clock, where, target)
            clock, where = rows[-1][0], target
            turns.append(clock)
        clock += profile.pause
    start, position, velocity, acceleration = (np.array(column) for column in zip(*rows, strict=True))
    return MotorMotion(start, position, velocity, acceleration, np.array(turns), tuple(reversals))


def _list_waypoints(profile: MotorProfile, number: int) -> list[float]:
    """Return where the motor turns within one stroke [mm]; even strokes pull, odd ones return."""
    along = [point for where, back in profile.partial_reversals for point in (where, where - back)]
    along.append(profile.stroke)
    return along if number % 2 == 0 else [profile.stroke - point for point in along]


def _make_move(profile: MotorProfile, clock: float, start: float, end: float) -> list[tuple[float, float, float, float]]:
    """Return one trapezoidal move, or a triangular one where the way is too short for the full speed, and the rest after it."""
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


@dataclass(frozen=True)
class BenchSettings:
    """The mechanics around the cable, and the sampling.

    Args:
        rate: Samples a second [1/s].
        preload: Force of the load's spring at rest, on both sides [N].
        load_stiffness: Stiffness of the load's spring [N/mm].
        rope_stiffness: Stiffness of the rope between motor and load [N/mm].
    """

    rate: Positive = 100.0
    preload: Positive = 20.0
    load_stiffness: Positive = 1.5
    rope_stiffness: Positive = 20.0


@dataclass(frozen=True)
class BenchFriction:
    r"""Dependence of friction on load and on speed.

    Sliding shifts the force by the exponent on a scale g: `g(F_in) - g(F_out) = s Lambda(v)`, with

    .. math::
        g(F) = \frac{((F + D)/F_\text{ref})^p - 1}{p}, \quad g_0(F) = \log\frac{F + D}{F_\text{ref}}, \quad
        \Lambda(v) = \Lambda\,(1 + a\,e^{-(v/v_s)^2} + c\,|v|)

    Args:
        load_exponent: p [1]; 0 is the capstan equation, 1 a constant friction force.
        reference_force: F_ref [N].
        drag: D [N].
        stribeck: a [1].
        stribeck_speed: v_s [mm/s or rad/s].
        viscous: c [s/mm or s/rad].
        speed: Whether v is the speed of the rope [mm/s] or of the motor [rad/s].
    """

    load_exponent: Annotated[float, Field(ge=0, le=1)] = 0.0
    reference_force: Positive = 50.0
    drag: NonNegative = 0.0
    stribeck: NonNegative = 0.0
    stribeck_speed: Positive = 10.0
    viscous: Finite = 0.0
    speed: Literal["rope", "motor"] = "rope"

    def scale(self, force: Vector) -> Vector:
        """Return g(F)."""
        p, relative = self.load_exponent, (force + self.drag) / self.reference_force
        return (relative**p - 1) / p if p > 0 else np.log(relative)

    def force(self, scale: Vector) -> Vector:
        """Return the force at a place on the scale; where friction takes all of it, a slack rope."""
        p = self.load_exponent
        relative = np.maximum(1 + p * scale, 0.0) ** (1 / p) if p > 0 else np.exp(scale)
        return self.reference_force * relative - self.drag

    def rate_factor(self, velocity: Vector) -> Vector:
        """Return Lambda(v)/Lambda."""
        a, v_s, c = self.stribeck, self.stribeck_speed, self.viscous
        return 1 + a * np.exp(-((velocity / v_s) ** 2)) + c * np.abs(velocity)


@dataclass(frozen=True)
class Mechanics:
    """Rope, friction and spring under a given motion of the motor."""

    exponent: float
    run_effect: float
    friction: BenchFriction
    profile: MotorProfile
    bench: BenchSettings
    motion: MotorMotion

    def forces_at(self, time: Vector) -> tuple[Labels, Vector, Vector]:
        """Return contact state, input force and output force [N]; before the start everything is at rest."""
        clock = np.union1d(np.maximum(time, 0.0), self.motion.turns)
        sampled = np.searchsorted(clock, np.maximum(time, 0.0))
        position, velocity = self.motion.state_at(clock)
        exponent = self._compute_exponent(velocity)
        x, _ = play_between(self._find_boundary(position, exponent), self._find_boundary(position, -exponent), 0.0)
        stroke = np.sign(np.diff(x, prepend=0.0)).astype(int)
        bench, loaded = self.bench, np.maximum(time, 0.0) >= self.profile.unloaded
        input_force = bench.rope_stiffness * (position - x) + bench.preload
        output_force = bench.preload + bench.load_stiffness * x
        return (
            np.where(loaded, stroke[sampled], SWITCH),
            np.where(loaded, input_force[sampled], 0.0),
            np.where(loaded, output_force[sampled], 0.0),
        )

    def _compute_exponent(self, velocity: Vector) -> Vector:
        """Return Lambda(v) + m."""
        speed = velocity if self.friction.speed == "rope" else velocity / self.profile.drum_radius
        exponent = self.exponent * self.friction.rate_factor(speed) + self.run_effect
        if not np.all(exponent > 0):
            raise UsageError(
                f"the friction exponent comes out at {np.min(exponent):.4g}, but friction cannot push: raise the friction "
                "coefficients or wrap angles, or lower the scatter between runs (tau) or the viscous term."
            )
        return exponent

    def _find_boundary(self, position: Vector, shift: Vector) -> Vector:
        """Return the displacement x >= 0 of the load at which `g(F_in) = g(F_out) + shift`, for each motor position [mm].

        Newton's method from the side on which the curve bends away from zero, so that it cannot overshoot.
        """
        K, k, P, law = self.bench.rope_stiffness, self.bench.load_stiffness, self.bench.preload, self.friction
        x = np.zeros_like(position) if shift[0] > 0 else position + P / K
        for _ in range(_MAX_NEWTON_STEPS):
            load = P + k * x
            needed = law.force(law.scale(load) + shift)
            slope = ((needed + law.drag) / (load + law.drag)) ** (1 - law.load_exponent)
            step = (K * (position - x) + P - needed) / (K + k * slope)
            x = np.maximum(x + step, 0.0)
            if np.all(np.abs(step) <= 1e-14 * (1 + position) + (x == 0) * np.abs(step)):
                break
        return x
