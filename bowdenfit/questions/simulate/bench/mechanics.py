"""Rope, friction and spring: from the motion of the motor to the true forces on both sides of the cable."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from bowdenfit.description import Finite, NonNegative, Positive
from bowdenfit.errors import UsageError
from bowdenfit.questions.simulate.bench.profile import MotorMotion, MotorProfile
from bowdenfit.recordings.preparation.play import play_between
from bowdenfit.recordings.recording import SWITCH
from bowdenfit.types import Labels, Vector

_MAX_NEWTON_STEPS = 60


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
    r"""How friction depends on load and on speed.

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
        """g(F)"""
        p, relative = self.load_exponent, (force + self.drag) / self.reference_force
        return (relative**p - 1) / p if p > 0 else np.log(relative)

    def force(self, scale: Vector) -> Vector:
        """The force at a place on the scale; where friction takes all of it, a slack rope."""
        p = self.load_exponent
        relative = np.maximum(1 + p * scale, 0.0) ** (1 / p) if p > 0 else np.exp(scale)
        return self.reference_force * relative - self.drag

    def rate_factor(self, velocity: Vector) -> Vector:
        """Lambda(v)/Lambda"""
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
        """Contact state, input force and output force [N]; before the start everything is at rest."""
        clock = np.union1d(np.maximum(time, 0.0), self.motion.turns)
        sampled = np.searchsorted(clock, np.maximum(time, 0.0))
        position, velocity = self.motion.state_at(clock)
        exponent = self._exponent(velocity)
        x, _ = play_between(self._boundary(position, exponent), self._boundary(position, -exponent), 0.0)
        stroke = np.sign(np.diff(x, prepend=0.0)).astype(int)
        bench, loaded = self.bench, np.maximum(time, 0.0) >= self.profile.unloaded
        input_force = bench.rope_stiffness * (position - x) + bench.preload
        output_force = bench.preload + bench.load_stiffness * x
        return (
            np.where(loaded, stroke[sampled], SWITCH),
            np.where(loaded, input_force[sampled], 0.0),
            np.where(loaded, output_force[sampled], 0.0),
        )

    def _exponent(self, velocity: Vector) -> Vector:
        """Lambda(v) + m"""
        speed = velocity if self.friction.speed == "rope" else velocity / self.profile.drum_radius
        exponent = self.exponent * self.friction.rate_factor(speed) + self.run_effect
        if not np.all(exponent > 0):
            raise UsageError(
                f"the friction exponent comes out at {np.min(exponent):.4g}, but friction cannot push: raise the friction "
                "coefficients or wrap angles, or lower the scatter between runs (tau) or the viscous term."
            )
        return exponent

    def _boundary(self, position: Vector, shift: Vector) -> Vector:
        """Displacement x >= 0 of the load at which `g(F_in) = g(F_out) + shift`, for each motor position [mm].

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
