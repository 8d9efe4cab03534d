r"""Master and slave as a sampled loop (haptic paper, figure 8): linear analysis over draws, and simulation with dry friction.

.. math:: \tau_m = k_m (C_4 q_s - q_p) + d_m (C_4 \dot q_s - \dot q_p) - C_2 T_e - K_f T_j, \qquad
          \tau_s = k_s (C_1 q_p - q_s) + d_s (C_1 \dot q_p - \dot q_s) - C_3 T_j

with the position q_p of the master at its motor: at the joint the same gains are unstable, because the rope lies between.
While everything slides dry friction is a constant and the loop is linear; that analysis uses NumPy alone.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.addons.device.mechanics.limits import matrix_exponential
from bowdenfit.addons.device.mechanics.motion import STEP, Hand
from bowdenfit.addons.device.mechanics.plant import (
    Motion,
    Numbers,
    Plant,
    advance,
    apply_dry_friction,
    rope_torques,
    settle_node,
)

Number = float | np.ndarray
_PLANT, _SIGNALS = 6, 6  # angles and speeds of motor, joint and slave; angle, speed and torque of either side
_ROUNDING = 1e-6  # of a spectral radius: the device, which nothing holds, is a double 1, which rounding moves by 1.5e-8


@dataclass(frozen=True)
class CouplingGains:
    """Gains of the coupling.

    Args:
        master_stiffness, master_damping: k_m [N m/rad] and d_m [N m s/rad].
        slave_stiffness, slave_damping: k_s and d_s.
        torque_to_master: C_2 [1].
        torque_to_slave: C_3 [1].
        local_gain: K_f [1].
        local_damping: Whether d_m damps the master by itself, as with two channels, of which no position comes back.
        position_to_slave, position_to_master: C_1 and C_4, of which one is 1 over the other [1].
    """

    master_stiffness: float
    master_damping: float
    slave_stiffness: float
    slave_damping: float
    torque_to_master: float
    torque_to_slave: float
    local_gain: float = 0.0
    local_damping: bool = False
    position_to_slave: float = 1.0
    position_to_master: float = 1.0

    def two_channels(self) -> "CouplingGains":
        """Return the two-channel coupling: the slave's torque back and the master's position on, with the same damping."""
        return replace(self, master_stiffness=0.0, torque_to_slave=0.0, local_gain=0.0, local_damping=True)

    def with_local_gain(self, gain: float) -> "CouplingGains":
        """Return the coupling with another gain on the master's own torque."""
        return replace(self, local_gain=gain)


@dataclass(frozen=True)
class MasterSlave:
    """Master, slave, hand and wall while everything slides; numbers or arrays over draws, in SI units.

    Args:
        stiffness, rope_damping: K and b_c of the loop.
        motor_inertia, motor_damping: J_m and b_m.
        joint_inertia, joint_damping: J_j and b_j, without the hand's.
        hand_inertia, hand_damping, hand_stiffness: Of the hand.
        slave_inertia, slave_damping: J_s and b_s.
        wall_stiffness, wall_damping: k_e and b_e; 0 in free motion.
        sample, filter_time: T_s, and the time constant of the filter of speeds [s].
    """

    stiffness: Number
    rope_damping: Number
    motor_inertia: Number
    motor_damping: Number
    joint_inertia: Number
    joint_damping: Number
    hand_inertia: Number
    hand_damping: Number
    hand_stiffness: Number
    slave_inertia: Number
    slave_damping: Number
    wall_stiffness: Number
    wall_damping: Number
    sample: Number
    filter_time: Number


def free_motion_torque(
    gains: CouplingGains, rope_friction: Number, motor_friction: Number, slave_friction: Number
) -> Number:
    r"""Return what a slow hand feels in free motion [N m].

    .. math:: T_h = \frac{T_f + F_m + C_4 (k_m/k_s) F_s}{1 + K_f + C_3 C_4 k_m/k_s}

    Four channels lower friction without any local control: the slave, pushed by what the hand gives, pulls the master along.

    Args:
        gains: The coupling.
        rope_friction, motor_friction, slave_friction: T_f, F_m and F_s [N m].
    """
    ratio = gains.position_to_master * gains.master_stiffness / gains.slave_stiffness
    return (rope_friction + motor_friction + ratio * slave_friction) / (
        1 + gains.local_gain + gains.torque_to_slave * ratio
    )


def transmitted_stiffness(gains: CouplingGains, stiffness: Number, wall: Number) -> Number:
    r"""Stiffness that a slow hand feels in contact [N m/rad], from the balance of torques at motor and slave.

    With equal stiffnesses, C_2 = C_3 = 1 and without local feedback it is :math:`1/(1/K + 1/k_e)`.

    Args:
        gains: The coupling.
        stiffness: K of the loop with its springs [N m/rad].
        wall: k_e [N m/rad].
    """
    k_m, k_s, c_1, c_4 = (
        gains.master_stiffness, gains.slave_stiffness, gains.position_to_slave, gains.position_to_master,
    )  # fmt: skip
    # per unit of T_h: k_s (C_1 q_p - q_s) + C_3 = k_e q_s and k_m (C_4 q_s - q_p) - C_2 k_e q_s + 1 + K_f = 0
    pulled = (k_m * c_4 - gains.torque_to_master * wall) / (wall + k_s)
    master = (1 + gains.local_gain + pulled * gains.torque_to_slave) / (k_m - pulled * k_s * c_1)
    return 1 / (master + 1 / stiffness)


def spectral_radius_in_contact(system: MasterSlave, gains: CouplingGains, delay: int) -> np.ndarray:
    """Return the spectral radius of the sampled loop with the wall, or in free motion without one.

    Args:
        system: The moving parts.
        gains: The coupling; its commands act a sample late.
        delay: Samples that all that is sent from side to side is late by.
    """
    radius: np.ndarray = np.max(np.abs(np.linalg.eigvals(closed_loop(system, gains, delay))), axis=1)
    return radius


def is_stable(radius: np.ndarray) -> np.ndarray:
    """Return whether every oscillation decays."""
    return np.asarray(radius <= 1 + _ROUNDING)


def closed_loop(system: MasterSlave, gains: CouplingGains, delay: int) -> np.ndarray:
    """Return the transition matrix: plant, previous angles, filtered speeds, commands, and signals under way."""
    a, b, torques = _discretize_plant(system)
    n, size = len(a), _PLANT + 6 + _SIGNALS * delay
    previous, speeds, commands, queue = slice(6, 8), slice(8, 10), slice(10, 12), slice(12, size)
    sample, filter_time = (np.broadcast_to(x, n) for x in (system.sample, system.filter_time))
    share = 1 - np.exp(-sample / filter_time)
    matrix = np.zeros((n, size, size))
    matrix[:, :_PLANT, :_PLANT], matrix[:, :_PLANT, commands] = a, b
    signals = np.zeros((n, _SIGNALS, size))  # angle, speed, torque of the master, then of the slave
    for side, angle in enumerate((0, 4)):
        matrix[:, previous.start + side, angle] = 1
        row = matrix[:, speeds.start + side]
        row[:, angle], row[:, previous.start + side] = share / sample, -share / sample
        row[:, speeds.start + side] = 1 - share
        signals[:, 3 * side, angle], signals[:, 3 * side + 1] = 1, row
        signals[:, 3 * side + 2, :_PLANT] = torques[:, side]
    received = signals if delay == 0 else matrix[:, :0]
    if delay:
        matrix[:, queue.start : queue.start + _SIGNALS] = signals
        for k in range(1, delay):
            at = queue.start + _SIGNALS * k
            matrix[:, at : at + _SIGNALS, at - _SIGNALS : at] = np.eye(_SIGNALS)
        received = np.zeros((n, _SIGNALS, size))
        received[:, :, size - _SIGNALS :] = np.eye(_SIGNALS)
    k_m, d_m, k_s, d_s = (
        gains.master_stiffness, gains.master_damping, gains.slave_stiffness, gains.slave_damping,
    )  # fmt: skip
    returned_damping = 0.0 if gains.local_damping else d_m
    c_1, c_4 = gains.position_to_slave, gains.position_to_master
    matrix[:, commands.start] = np.einsum(
        "i,nij->nj", np.array([-k_m, -d_m, -gains.local_gain, 0, 0, 0]), signals
    ) + np.einsum(
        "i,nij->nj", np.array([0, 0, 0, c_4 * k_m, c_4 * returned_damping, -gains.torque_to_master]), received
    )
    matrix[:, commands.start + 1] = np.einsum("i,nij->nj", np.array([0, 0, 0, -k_s, -d_s, 0]), signals) + np.einsum(
        "i,nij->nj", np.array([c_1 * k_s, c_1 * d_s, -gains.torque_to_slave, 0, 0, 0]), received
    )
    return matrix


def _discretize_plant(system: MasterSlave) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the sampled plant, and T_j and T_e of its states."""
    k, c, j_m, b_m, j_j, b_j, j_h, b_h, k_h, j_s, b_s, k_e, b_e, sample, _ = (
        np.atleast_1d(part) for part in np.broadcast_arrays(*vars(system).values())
    )
    zero, one, j = np.zeros_like(k), np.ones_like(k), j_j + j_h
    rows = [
        [zero, one, zero, zero, zero, zero, zero, zero],
        [-k / j_m, -(c + b_m) / j_m, k / j_m, c / j_m, zero, zero, 1 / j_m, zero],
        [zero, zero, zero, one, zero, zero, zero, zero],
        [k / j, c / j, -(k + k_h) / j, -(c + b_j + b_h) / j, zero, zero, zero, zero],
        [zero, zero, zero, zero, zero, one, zero, zero],
        [zero, zero, zero, zero, -k_e / j_s, -(b_e + b_s) / j_s, zero, 1 / j_s],
        *([zero] * 8 for _ in range(2)),
    ]
    rates = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    moved = matrix_exponential(rates * sample[:, None, None])
    at_joint = np.stack([k, c, -k, -c, zero, zero], axis=-1)
    at_wall = np.stack([zero, zero, zero, zero, k_e, b_e], axis=-1)
    return moved[:, :_PLANT, :_PLANT], moved[:, :_PLANT, _PLANT:], np.stack([at_joint, at_wall], axis=1)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Slave:
    """The slave behind its gearbox, and the wall.

    Args:
        inertia, damping, friction: J_s [kg m^2], b_s [N m s/rad], F_s [N m].
        largest_torque: Largest torque of its motor [N m].
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
    """Sampling and limits of the master.

    Args:
        count: Angle of one count of the encoders [rad].
        filter_time: Time constant of the filter of speeds [s].
        largest_torque: Largest torque of the master's motor [N m].
    """

    count: Numbers
    filter_time: Numbers
    largest_torque: Numbers


@dataclass(frozen=True)
class TeleoperationRuns:
    """Signals at every sample (first axis) of every run.

    Args:
        time: [s].
        joint, slave: Angles of the master's joint and of the slave [rad].
        hand_torque: Torque of the hand [N m].
        wall_torque: T_e [N m].
    """

    time: np.ndarray
    joint: np.ndarray
    slave: np.ndarray
    hand_torque: np.ndarray
    wall_torque: np.ndarray


def contact_torque(slave: Slave, angle: Numbers, speed: Numbers) -> Numbers:
    """Return T_e, which the wall gives the slave: it pushes and never pulls [N m]."""
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
    """Simulate master and slave from rest, for all runs at once.

    Args:
        plant, hand, slave, controller: Of which every number may be an array of runs.
        gains: What is sent; its numbers may be arrays of runs, too.
        path: Angle and speed of the hand's path at every sample [rad], [rad/s].
        delay: Samples that all that is sent is late by.
        sample: T_s [s].
        step: Step of the plant, about; a sample is a whole number of them [s].
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
    """Compile the program for a number of plant steps per sample, over runs."""

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
    """Return torques of master and slave, from what each side measures and what it received from the other [N m]."""
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
