r"""A pull-pull loop between motor and joint as a plant stepped through time, all friction in a node between two springs.

Each half passes :math:`S(d) = K d + \text{clip}(K d, \pm P r)` for a twist d: twice the stiffness of the loop while both
sides are taut, and half of that once the return side is slack. The node holds still while the torque at the joint lies
inside the band of the loop, and slides along its limits otherwise: the loop's play operator, whatever moves. The quantities of
a device are drawn from what is known of them (`draw_device`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.addons.device.description import Known
from bowdenfit.physics.stretch import mean_tension

Numbers: TypeAlias = Any  # an array over runs, of JAX or NumPy, or one number for all of them
_MAX_REDRAWS = 200  # each leaves at most half of the draws below 0, as no stated value is


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LoopTransmission:
    """A loop at one bend, or in many runs at once.

    Args:
        stiffness: K, of the whole loop at the joint with the motor held [N m/rad].
        preload: P r, preload times the pulley's radius [N m].
        exponent: Lambda, friction exponent of one side [1].
    """

    stiffness: Numbers
    preload: Numbers
    exponent: Numbers

    @property
    def friction(self) -> Numbers:
        """T_f = 2 r P Lambda, what moving it takes while both sides are taut [N m]."""
        return 2 * self.preload * self.exponent

    def half_torque(self, twist: Numbers) -> Numbers:
        """Return S, the torque that half of the loop transmits at a twist [rad]."""
        force = self.stiffness * twist
        return force + jnp.clip(force, -self.preload, self.preload)

    def twist(self, torque: Numbers) -> Numbers:
        """Return the twist of a half that passes a torque [N m]: the inverse of `passed`."""
        return (
            jnp.where(jnp.abs(torque) < 2 * self.preload, torque / 2, torque - jnp.sign(torque) * self.preload)
            / self.stiffness
        )

    def half_energy(self, twist: Numbers) -> Numbers:
        """Return the elastic energy of a half at a twist [J]."""
        force = self.stiffness * twist
        soft = jnp.clip(force, -self.preload, self.preload)
        return (force**2 / 2 + soft * force - soft**2 / 2) / self.stiffness

    def lower_joint_torque(self, torque: Numbers) -> Numbers:
        """Return f_-, the joint torque in forward motion, from that at the motor [N m]; see `loop_output_force`."""
        growth = jnp.where(torque > 0, jnp.exp(-self.exponent), jnp.exp(self.exponent))
        return jnp.minimum(torque - self.friction, torque * growth)

    def settled_node(self, node: Numbers, motor: Numbers, joint: Numbers) -> Numbers:
        """Return the angle of the node between motor and joint, from where it was [rad]."""
        return jnp.clip(node, self._lowest_node(motor, joint), -self._lowest_node(-motor, -joint))

    def torques(self, node: Numbers, motor: Numbers, joint: Numbers) -> tuple[Numbers, Numbers]:
        """Return T_m and T_j, which the loop takes from the motor and gives the joint [N m]."""
        return self.half_torque(motor - node), self.half_torque(node - joint)

    def _lowest_node(self, motor: Numbers, joint: Numbers) -> Numbers:
        """x_-, the least place of the node: the root of S(x - q_j) = f_-(S(q_m - x)), between the kinks of either side."""
        one = jnp.ones_like(self.exponent)
        slack = self.preload / self.stiffness
        by_load = self.twist(2 * self.preload / mean_tension(one, self.exponent))
        by_return = self.twist(2 * self.preload / mean_tension(one, -self.exponent))
        kinks = jnp.stack(
            [joint - slack, joint + slack, motor - slack, motor + slack, motor - by_load, motor + by_return]
        )
        excess = self.half_torque(kinks - joint) - self.lower_joint_torque(
            self.half_torque(motor - kinks)
        )  # grows with the place
        before, behind = excess <= 0, excess > 0
        left, left_excess = (jnp.max(jnp.where(before, value, -jnp.inf), axis=0) for value in (kinks, excess))
        right, right_excess = (jnp.min(jnp.where(behind, value, jnp.inf), axis=0) for value in (kinks, excess))
        first, last = jnp.isinf(left), jnp.isinf(right)
        slope_before = self.stiffness * (1 + jnp.exp(-self.exponent))
        slope_behind = self.stiffness * (1 + jnp.exp(self.exponent))
        slope = jnp.where(
            first,
            slope_before,
            jnp.where(last, slope_behind, (right_excess - left_excess) / jnp.where(first | last, 1.0, right - left)),
        )
        return jnp.where(first, right - right_excess / slope, left - left_excess / slope)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Plant:
    """What moves; inertias and losses of the motor are behind its reducer, those of the hand count with the joint.

    Args:
        loop: The cable.
        motor_inertia, joint_inertia: J_m and J_j [kg m^2].
        motor_damping, joint_damping: b_m and b_j [N m s/rad].
        motor_friction: F_m, dry friction of motor and gearbox [N m].
        rope_damping: b_c, beside the loop [N m s/rad].
    """

    loop: LoopTransmission
    motor_inertia: Numbers
    motor_damping: Numbers
    motor_friction: Numbers
    joint_inertia: Numbers
    joint_damping: Numbers
    rope_damping: Numbers


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Motion:
    """Angles [rad] and speeds [rad/s] of motor and joint, and the place of the friction node [rad]."""

    motor: Numbers
    motor_speed: Numbers
    joint: Numbers
    joint_speed: Numbers
    node: Numbers

    @classmethod
    def at_rest(cls, template: Numbers) -> "Motion":
        """Return an unloaded motion at rest."""
        zero = jnp.zeros_like(template)
        return cls(zero, zero, zero, zero, zero)


def settle_node(plant: Plant, motion: Motion) -> Motion:
    """Return the motion with its node settled; needed before torques are read, which else are one step old."""
    return replace(motion, node=plant.loop.settled_node(motion.node, motion.motor, motion.joint))


def rope_torques(plant: Plant, motion: Motion) -> tuple[Numbers, Numbers]:
    """Return the torques that the rope takes from the motor and gives the joint, with damping [N m]; of a settled motion."""
    at_motor, at_joint = plant.loop.torques(motion.node, motion.motor, motion.joint)
    damping = plant.rope_damping * (motion.motor_speed - motion.joint_speed)
    return at_motor + damping, at_joint + damping


def advance(plant: Plant, motion: Motion, motor_torque: Numbers, joint_torque: Numbers, step: float | Numbers) -> Motion:
    """Advance by one step of semi-implicit Euler; dry friction is a proximal step, so that it can hold the device still.

    Args:
        plant: The moving parts.
        motion: Where it is; settled.
        motor_torque: Torque of the motor [N m].
        joint_torque: Torque of the hand [N m].
        step: h [s].
    """
    at_motor, at_joint = rope_torques(plant, motion)
    motor_speed = apply_dry_friction(
        motion.motor_speed
        + step * (motor_torque - at_motor - plant.motor_damping * motion.motor_speed) / plant.motor_inertia,
        step * plant.motor_friction / plant.motor_inertia,
    )
    joint_speed = (
        motion.joint_speed
        + step * (joint_torque + at_joint - plant.joint_damping * motion.joint_speed) / plant.joint_inertia
    )
    moved = Motion(
        motion.motor + step * motor_speed, motor_speed, motion.joint + step * joint_speed, joint_speed, motion.node
    )
    return settle_node(plant, moved)


def apply_dry_friction(speed: Numbers, loss: Numbers) -> Numbers:
    """Reduce a speed by what dry friction takes of it in a step, without reversing it."""
    return jnp.sign(speed) * jnp.maximum(jnp.abs(speed) - loss, 0.0)


def mechanical_energy(plant: Plant, motion: Motion) -> Numbers:
    """Return kinetic and elastic energy [J]."""
    kinetic = plant.motor_inertia * motion.motor_speed**2 + plant.joint_inertia * motion.joint_speed**2
    loop = plant.loop
    return kinetic / 2 + loop.half_energy(motion.motor - motion.node) + loop.half_energy(motion.node - motion.joint)


def draw_device(known: Mapping[str, Known], n: int, seed: int) -> dict[str, np.ndarray]:
    """Draw every quantity `n` times; a quantity that is set is constant.

    Draws of a fit are picked alike for all quantities that it tells, and what they hold besides is taken from them.

    Args:
        known: Quantities by key.
        n: Number of draws.
        seed: Seed of the fit.
    """
    draws = {
        key: _draw_truncated_normal(quantity, np.random.default_rng([seed, 41, *key.encode()]), n)
        for key, quantity in known.items()
    }
    for key, quantity in known.items():
        if quantity.draws:
            picked = np.array(quantity.draws)[np.random.default_rng([seed, 47]).integers(len(quantity.draws), size=n)]
            draws[key] = np.maximum(picked - draws.get(quantity.beside, 0.0), 0.0)
    return draws


def _draw_truncated_normal(known: Known, generator: np.random.Generator, n: int) -> np.ndarray:
    draws = known.value + known.sd * generator.standard_normal(n)
    for _ in range(_MAX_REDRAWS):
        below = draws < 0
        if not below.any():
            break
        draws[below] = known.value + known.sd * generator.standard_normal(int(below.sum()))
    return np.maximum(draws, 0.0)
