"""Master and slave through time: the plant with its cable, a slave with dry friction, a wall, and what is sent between them."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.device.coupling import Gains
from bowdenfit.device.motion import STEP, Hand
from bowdenfit.device.plant import Motion, Plant, advance, rope_torques, settle, slowed
from bowdenfit.device.transmission import Each


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Slave:
    """The slave behind its gearbox, and the wall.

    Args:
        inertia, damping, friction: J_s [kg m^2], b_s [N m s/rad], F_s [N m].
        largest_torque: Of its motor [N m].
        wall, wall_stiffness, wall_damping: Where the wall begins [rad], k_e [N m/rad], b_e [N m s/rad].
    """

    inertia: Each
    damping: Each
    friction: Each
    largest_torque: Each
    wall: Each
    wall_stiffness: Each
    wall_damping: Each


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Sampled:
    """What samples and drives the master.

    Args:
        count: Angle of one count of the encoders [rad].
        filter_time: Of the filter of speeds [s].
        largest_torque: Of the master's motor [N m].
    """

    count: Each
    filter_time: Each
    largest_torque: Each


@dataclass(frozen=True)
class Together:
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


def touch(slave: Slave, angle: Each, speed: Each) -> Each:
    """T_e, what the wall gives the slave: it pushes and never pulls [N m]."""
    depth = angle - slave.wall
    pushed = jnp.maximum(slave.wall_stiffness * depth + slave.wall_damping * speed, 0.0)
    return jnp.where(depth > 0, pushed, 0.0)


def teleoperated(
    plant: Plant,
    hand: Hand,
    slave: Slave,
    sampled: Sampled,
    gains: Gains,
    path: np.ndarray,
    *,
    delay: int = 0,
    sample: float = 1e-3,
    step: float = STEP,
) -> Together:
    """Runs of master and slave from rest, those of all entries of their numbers at once.

    Args:
        plant, hand, slave, sampled: Of which every number may be an array of runs.
        gains: What is sent; its numbers may be arrays of runs, too.
        path: Angle and speed of the hand's path at every sample [rad], [rad/s].
        delay: Samples that all that is sent is late by.
        sample: T_s [s].
        step: Of the plant, about; a sample is a whole number of them [s].
    """
    sent = {name: value for name, value in vars(gains).items() if name != "damps_alone"}
    sent["comes_back"] = 0.0 if gains.damps_alone else gains.master_damping
    with jax.enable_x64(True):
        given = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=float), (plant, hand, slave, sampled, sent))
        shape = jnp.broadcast_shapes(*(leaf.shape for leaf in jax.tree.leaves(given)))
        each = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, shape).reshape(-1), given)
        seen = _program(max(1, round(sample / step)), delay)(*each, jnp.asarray(path), sample)
        every = {name: np.asarray(value).reshape(len(path), *shape) for name, value in seen.items()}
    return Together(np.arange(len(path)) * sample, **every)


@lru_cache
def _program(steps: int, delay: int) -> Callable[..., dict[str, Any]]:
    """The compiled program of so many steps a sample, over runs."""

    def run(plant: Plant, hand: Hand, slave: Slave, sampled: Sampled, sent: Any, path: Any, sample: Any) -> Any:
        step, share = sample / steps, 1 - jnp.exp(-sample / sampled.filter_time)
        limits = jnp.stack([sampled.largest_torque, slave.largest_torque])

        def pulled(motion: Motion, at: Each, speed: Each) -> Each:
            return hand.stiffness * (at - motion.joint) + hand.damping * (speed - motion.joint_speed)

        def one(carry: Any, now: Any) -> Any:
            (motion, angle, speed, before, speeds, commands, on_the_way), (at, its_speed) = carry, now
            at_joint, at_wall = rope_torques(plant, motion)[1], touch(slave, angle, speed)
            counted = jnp.floor(jnp.stack([motion.motor, angle]) / sampled.count) * sampled.count
            speeds = speeds + share * ((counted - before) / sample - speeds)
            signals = jnp.stack([counted[0], speeds[0], at_joint, counted[1], speeds[1], at_wall])
            late = on_the_way[-1] if delay else signals
            wanted = _commands(sent, signals, late)
            seen = {
                "joint": motion.joint, "slave": angle, "hand_torque": pulled(motion, at, its_speed), "wall_torque": at_wall,
            }  # fmt: skip

            def inside(i: Any, state: Any) -> Any:
                motion, angle, speed = state
                motion = advance(plant, motion, commands[0], pulled(motion, at + i * step * its_speed, its_speed), step)
                drive = commands[1] - touch(slave, angle, speed) - slave.damping * speed
                speed = slowed(speed + step * drive / slave.inertia, step * slave.friction / slave.inertia)
                return motion, angle + step * speed, speed

            motion, angle, speed = jax.lax.fori_loop(0, steps, inside, (motion, angle, speed))
            on_the_way = jnp.concatenate([signals[None], on_the_way[:-1]]) if delay else on_the_way
            return (motion, angle, speed, counted, speeds, jnp.clip(wanted, -limits, limits), on_the_way), seen

        zero, two = jnp.zeros(()), jnp.zeros(2)
        first = (settle(plant, Motion.at_rest(zero)), zero, zero, two, two, two, jnp.zeros((max(delay, 1), 6)))
        return jax.lax.scan(one, first, path)[1]

    return jax.jit(jax.vmap(run, in_axes=(0, 0, 0, 0, 0, None, None), out_axes=1))


def _commands(sent: Any, own: Each, late: Each) -> Each:
    """Torques of master and slave, of what each side sees itself and of what came late from the other [N m]."""
    k_m, d_m, k_s, d_s = (sent[f"{side}_{what}"] for side in ("master", "slave") for what in ("stiffness", "damping"))
    c_1, c_4 = sent["position_to_slave"], sent["position_to_master"]
    master = k_m * (c_4 * late[3] - own[0]) + sent["comes_back"] * c_4 * late[4] - d_m * own[1]
    slave = k_s * (c_1 * late[0] - own[3]) + d_s * (c_1 * late[1] - own[4])
    return jnp.stack(
        [
            master - sent["torque_to_master"] * late[5] - sent["local_gain"] * own[2],
            slave - sent["torque_to_slave"] * late[2],
        ]
    )
