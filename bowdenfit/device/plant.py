"""Motor, loop and joint as a plant that is stepped through time: its states, and one step."""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp

from bowdenfit.device.transmission import LoopTransmission, Numbers


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
        """Nothing moves, and nothing is loaded."""
        zero = jnp.zeros_like(template)
        return cls(zero, zero, zero, zero, zero)


def settle_node(plant: Plant, motion: Motion) -> Motion:
    """The node put where it stands now; before torques are read, or they are those of a step ago."""
    return replace(motion, node=plant.loop.settled_node(motion.node, motion.motor, motion.joint))


def rope_torques(plant: Plant, motion: Motion) -> tuple[Numbers, Numbers]:
    """What the rope takes from the motor and gives the joint, damping included [N m]; of a motion that is settled."""
    at_motor, at_joint = plant.loop.torques(motion.node, motion.motor, motion.joint)
    damping = plant.rope_damping * (motion.motor_speed - motion.joint_speed)
    return at_motor + damping, at_joint + damping


def advance(plant: Plant, motion: Motion, motor_torque: Numbers, joint_torque: Numbers, step: float | Numbers) -> Motion:
    """One step of semi-implicit Euler; dry friction is a proximal step, so that it holds what it can hold.

    Args:
        plant: What moves.
        motion: Where it is; settled.
        motor_torque: Of the motor [N m].
        joint_torque: Of the hand [N m].
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
    """A speed less what dry friction takes of it in a step, which never turns it round."""
    return jnp.sign(speed) * jnp.maximum(jnp.abs(speed) - loss, 0.0)


def mechanical_energy(plant: Plant, motion: Motion) -> Numbers:
    """Kinetic and elastic energy [J]."""
    kinetic = plant.motor_inertia * motion.motor_speed**2 + plant.joint_inertia * motion.joint_speed**2
    loop = plant.loop
    return kinetic / 2 + loop.half_energy(motion.motor - motion.node) + loop.half_energy(motion.node - motion.joint)
