"""Master and slave through time: the plant with its cable, a slave with dry friction, a wall, and what is sent between them."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.device.coupling import CouplingGains
from bowdenfit.device.motion import STEP, Hand
from bowdenfit.device.plant import Motion, Plant, advance, apply_dry_friction, rope_torques, settle_node
from bowdenfit.device.transmission import Numbers


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Slave:
    """The slave behind its gearbox, and the wall.

    Args:
        inertia, damping, friction: J_s [kg m^2], b_s [N m s/rad], F_s [N m].
        largest_torque: Of its motor [N m].
        wall, wall_stiffness, wall_damping: Where the wall begins [rad], k_e [N m/rad], b_e [N m s/rad].
    """

    inertia: Numbers
    damping: Numbers
    friction: Numbers
    largest_torque: Numbers
    wall: Numbers
    wall_stiffness: Numbers
    wall_damping: Numbers


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MasterController:
    """What samples and drives the master.

    Args:
        count: Angle of one count of the encoders [rad].
        filter_time: Of the filter of speeds [s].
        largest_torque: Of the master's motor [N m].
    """

    count: Numbers
    filter_time: Numbers
    largest_torque: Numbers


@dataclass(frozen=True)
class TeleoperationRuns:
    """What was seen at every sample (first axis) of every run.

    Args:
        time: [s].
        joint, slave: Angles of the master's joint and of the slave [rad].
        hand_torque: What the hand gives [N m].
        wall_torque: T_e [N m].
    """

    time: np.ndarray
    joint: np.ndarray
    slave: np.ndarray
    hand_torque: np.ndarray
    wall_torque: np.ndarray


def contact_torque(slave: Slave, angle: Numbers, speed: Numbers) -> Numbers:
    """T_e, what the wall gives the slave: it pushes and never pulls [N m]."""
    depth = angle - slave.wall
    torque = jnp.maximum(slave.wall_stiffness * depth + slave.wall_damping * speed, 0.0)
    return jnp.where(depth > 0, torque, 0.0)


def simulate_teleoperation(
    plant: Plant,
    hand: Hand,
    slave: Slave,
    controller: MasterController,
    gains: CouplingGains,
    path: np.ndarray,
    *,
    delay: int = 0,
    sample: float = 1e-3,
    step: float = STEP,
) -> TeleoperationRuns:
    """Runs of master and slave from rest, those of all entries of their numbers at once.

    Args:
        plant, hand, slave, sampled: Of which every number may be an array of runs.
        gains: What is sent; its numbers may be arrays of runs, too.
        path: Angle and speed of the hand's path at every sample [rad], [rad/s].
        delay: Samples that all that is sent is late by.
        sample: T_s [s].
        step: Of the plant, about; a sample is a whole number of them [s].
    """
    coupling = {name: value for name, value in vars(gains).items() if name != "local_damping"}
    coupling["returned_damping"] = 0.0 if gains.local_damping else gains.master_damping
    with jax.enable_x64(True):
        inputs = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=float), (plant, hand, slave, controller, coupling))
        shape = jnp.broadcast_shapes(*(leaf.shape for leaf in jax.tree.leaves(inputs)))
        runs = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, shape).reshape(-1), inputs)
        samples = _compile_teleoperation(max(1, round(sample / step)), delay)(*runs, jnp.asarray(path), sample)
        traces = {name: np.asarray(value).reshape(len(path), *shape) for name, value in samples.items()}
    return TeleoperationRuns(np.arange(len(path)) * sample, **traces)


@lru_cache
def _compile_teleoperation(steps: int, delay: int) -> Callable[..., dict[str, Any]]:
    """The compiled program of so many steps a sample, over runs."""

    def run(
        plant: Plant, hand: Hand, slave: Slave, controller: MasterController, coupling: Any, path: Any, sample: Any
    ) -> Any:
        step, share = sample / steps, 1 - jnp.exp(-sample / controller.filter_time)
        limits = jnp.stack([controller.largest_torque, slave.largest_torque])

        def hand_torque(motion: Motion, target: Numbers, speed: Numbers) -> Numbers:
            return hand.stiffness * (target - motion.joint) + hand.damping * (speed - motion.joint_speed)

        def sample_step(carry: Any, now: Any) -> Any:
            (motion, angle, speed, previous, speeds, commands, queue), (target, target_speed) = carry, now
            at_joint, at_wall = rope_torques(plant, motion)[1], contact_torque(slave, angle, speed)
            counted = jnp.floor(jnp.stack([motion.motor, angle]) / controller.count) * controller.count
            speeds = speeds + share * ((counted - previous) / sample - speeds)
            signals = jnp.stack([counted[0], speeds[0], at_joint, counted[1], speeds[1], at_wall])
            received = queue[-1] if delay else signals
            commanded = _commands(coupling, signals, received)
            observed = {
                "joint": motion.joint,
                "slave": angle,
                "hand_torque": hand_torque(motion, target, target_speed),
                "wall_torque": at_wall,
            }

            def plant_step(i: Any, state: Any) -> Any:
                motion, angle, speed = state
                motion = advance(
                    plant,
                    motion,
                    commands[0],
                    hand_torque(motion, target + i * step * target_speed, target_speed),
                    step,
                )
                drive = commands[1] - contact_torque(slave, angle, speed) - slave.damping * speed
                speed = apply_dry_friction(speed + step * drive / slave.inertia, step * slave.friction / slave.inertia)
                return motion, angle + step * speed, speed

            motion, angle, speed = jax.lax.fori_loop(0, steps, plant_step, (motion, angle, speed))
            queue = jnp.concatenate([signals[None], queue[:-1]]) if delay else queue
            return (motion, angle, speed, counted, speeds, jnp.clip(commanded, -limits, limits), queue), observed

        zero, two = jnp.zeros(()), jnp.zeros(2)
        first = (settle_node(plant, Motion.at_rest(zero)), zero, zero, two, two, two, jnp.zeros((max(delay, 1), 6)))
        return jax.lax.scan(sample_step, first, path)[1]

    return jax.jit(jax.vmap(run, in_axes=(0, 0, 0, 0, 0, None, None), out_axes=1))


def _commands(coupling: Any, own: Numbers, received: Numbers) -> Numbers:
    """Torques of master and slave, of what each side sees itself and of what came late from the other [N m]."""
    k_m, d_m, k_s, d_s = (
        coupling[f"{side}_{what}"] for side in ("master", "slave") for what in ("stiffness", "damping")
    )
    c_1, c_4 = coupling["position_to_slave"], coupling["position_to_master"]
    master = k_m * (c_4 * received[3] - own[0]) + coupling["returned_damping"] * c_4 * received[4] - d_m * own[1]
    slave = k_s * (c_1 * received[0] - own[3]) + d_s * (c_1 * received[1] - own[4])
    return jnp.stack(
        [
            master - coupling["torque_to_master"] * received[5] - coupling["local_gain"] * own[2],
            slave - coupling["torque_to_slave"] * received[2],
        ]
    )
