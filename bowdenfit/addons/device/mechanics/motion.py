"""Simulation of a device under a sampled controller and a hand, and the torque that it transmits.

The controller has an encoder, a speed filter, a delay of one sample, sensor noise and a torque limit. Its laws are equation 3
of the haptic paper, whose second case must read V < -dv, its variant that is linear inside the dead zone, and the active one,
which feeds back the torque measured at the joint.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.addons.device.mechanics.plant import Motion, Numbers, Plant, advance, rope_torques, settle_node


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Controller:
    """What the controller does at every sample; sampling itself belongs to the run.

    Args:
        coulomb: F_cst, fed forward outside the dead zone [N m]; 0 for none.
        dead_zone: dv [rad/s].
        linear: 1 if F_cst grows linearly inside the dead zone, else 0.
        gain: K_f, on the torque at the joint [1]; 0 for none.
        integral_gain: K_i, on its integral [1/s].
        active_zone: Speed below which the gains act, and F_cst does not [rad/s]; infinite for always, 0 for never.
        count: Angle of one count of the encoder [rad].
        filter_time: Time constant of the filter of the speed [s].
        largest_torque: Largest torque of the motor [N m].
    """

    coulomb: Numbers
    dead_zone: Numbers
    linear: Numbers
    gain: Numbers
    integral_gain: Numbers
    active_zone: Numbers
    count: Numbers
    filter_time: Numbers
    largest_torque: Numbers


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ControllerMemory:
    """State of a controller from one sample to the next.

    Args:
        counted: Angle that the encoder showed [rad].
        speed: Filtered [rad/s].
        integral: Integral of the torque at the joint [N m s].
        command: Torque for the motor, which acts a sample later [N m].
    """

    counted: Numbers
    speed: Numbers
    integral: Numbers
    command: Numbers

    @classmethod
    def empty(cls, template: Numbers) -> "ControllerMemory":
        """Return the state before the first sample."""
        zero = jnp.zeros_like(template)
        return cls(zero, zero, zero, zero)


def step_controller(
    control: Controller, memory: ControllerMemory, angle: Numbers, torque: Numbers, sample: float
) -> ControllerMemory:
    """Advance the controller by one sample, from angle [rad] and torque [N m] at the joint.

    Args:
        control: The controller.
        memory: State from the sample before.
        angle: Angle of the joint.
        torque: T_j as its sensor shows it.
        sample: T_s [s].
    """
    counted = jnp.floor(angle / control.count) * control.count
    raw = (counted - memory.counted) / sample
    speed = memory.speed + (raw - memory.speed) * (1 - jnp.exp(-sample / control.filter_time))
    is_active = jnp.abs(speed) < control.active_zone
    integral = jnp.where(is_active, memory.integral + sample * torque, 0.0)
    fed_back = -control.gain * torque - control.integral_gain * integral
    command = jnp.where(is_active, fed_back, karnopp_torque(control, speed))
    command = jnp.clip(command, -control.largest_torque, control.largest_torque)
    return replace(memory, counted=counted, speed=speed, integral=integral, command=command)


def karnopp_torque(control: Controller, speed: Numbers) -> Numbers:
    """Return F_cst in the direction of motion outside the dead zone; inside it 0, or a linear share [N m]."""
    inside = control.linear * control.coulomb * speed / jnp.maximum(control.dead_zone, 1e-12)
    return jnp.where(jnp.abs(speed) > control.dead_zone, control.coulomb * jnp.sign(speed), inside)


STEP = 1e-4  # of the plant [s]; a judgement: ten steps in a sample of a controller at 1 kHz


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Hand:
    """A hand that follows a path: b_h and k_h toward it; both 0 of one that is off.

    Args:
        stiffness: k_h [N m/rad].
        damping: b_h [N m s/rad].
    """

    stiffness: Numbers | float
    damping: Numbers | float


@dataclass(frozen=True)
class DeviceRuns:
    """Signals at every sample (first axis) of every run.

    Args:
        time: [s].
        motor_torque: T_m that the rope takes from the motor [N m].
        joint_torque: T_j that it gives the joint [N m].
        hand_torque: T_h [N m].
        command: Torque of the motor [N m].
        speed: Speed of the joint [rad/s].
        angle: Angle of the joint [rad].
    """

    time: np.ndarray
    motor_torque: np.ndarray
    joint_torque: np.ndarray
    hand_torque: np.ndarray
    command: np.ndarray
    speed: np.ndarray
    angle: np.ndarray


def simulate_device(
    plant: Plant,
    control: Controller,
    hand: Hand,
    path: np.ndarray,
    *,
    start: Motion | None = None,
    sample: float = 1e-3,
    step: float = STEP,
    noise: float = 0.0,
    seed: int = 0,
) -> DeviceRuns:
    """Simulate a device for all runs at once.

    Args:
        plant, control, hand: Of which every number may be an array of runs.
        path: Angle and speed of the hand's path at every sample [rad], [rad/s].
        start: Where it is at first; at rest if omitted.
        sample: T_s [s].
        step: Step of the plant, about; a sample is a whole number of them [s].
        noise: Noise of the torque sensor, one standard deviation [N m].
        seed: Seed of that noise.
    """
    with jax.enable_x64(True):
        first = start or Motion.at_rest(jnp.zeros(()))
        inputs = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=float), (plant, control, hand, first))
        shape = jnp.broadcast_shapes(*(leaf.shape for leaf in jax.tree.leaves(inputs)))
        runs = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, shape).reshape(-1), inputs)
        sensor_noise = noise * np.random.default_rng(seed).standard_normal(len(path))
        samples = _compile_runs(max(1, round(sample / step)))(
            *runs, jnp.asarray(path), jnp.asarray(sensor_noise), sample
        )
        traces = {name: np.asarray(value).reshape(len(path), *shape) for name, value in samples.items()}
    return DeviceRuns(np.arange(len(path)) * sample, **traces)


@lru_cache
def _compile_runs(steps: int) -> Callable[..., dict[str, Any]]:
    """Compile the program for a number of plant steps per sample, over runs."""

    def run(
        plant: Plant, control: Controller, hand: Hand, first: Motion, path: Any, sensor_noise: Any, sample: Any
    ) -> Any:
        step = sample / steps

        def hand_torque(motion: Motion, target: Numbers, target_speed: Numbers) -> Numbers:
            return hand.stiffness * (target - motion.joint) + hand.damping * (target_speed - motion.joint_speed)

        def sample_step(
            carry: tuple[Motion, ControllerMemory], now: tuple[Any, Any]
        ) -> tuple[tuple[Motion, ControllerMemory], dict[str, Numbers]]:
            (motion, memory), ((target, target_speed), error) = carry, now
            acting = memory.command  # which was worked out a sample ago
            at_motor, at_joint = rope_torques(plant, motion)  # of a node that is settled
            memory = step_controller(control, memory, motion.joint, at_joint + error, sample)
            observed = {
                "motor_torque": at_motor, "joint_torque": at_joint, "hand_torque": hand_torque(motion, target, target_speed),
                "command": acting, "speed": motion.joint_speed, "angle": motion.joint,
            }  # fmt: skip

            def plant_step(i: Any, motion: Motion) -> Motion:
                return advance(
                    plant, motion, acting, hand_torque(motion, target + i * step * target_speed, target_speed), step
                )

            return (jax.lax.fori_loop(0, steps, plant_step, motion), memory), observed

        counted = jnp.floor(first.joint / control.count) * control.count
        memory = replace(ControllerMemory.empty(first.joint), counted=counted, speed=first.joint_speed)
        return jax.lax.scan(sample_step, (settle_node(plant, first), memory), (path, sensor_noise))[1]

    return jax.jit(jax.vmap(run, in_axes=(0, 0, 0, 0, None, None, None), out_axes=1))


def oscillating_path(seconds: float, sample: float, amplitude: float, period: float) -> np.ndarray:
    """Return a hand's path to and fro, from rest: angle [rad] and speed [rad/s] at every sample.

    Args:
        seconds, sample, period: [s].
        amplitude: Half of the way [rad].
    """
    frequency = 2 * np.pi / period
    phase = frequency * sample * np.arange(round(seconds / sample))
    return np.stack([amplitude * (1 - np.cos(phase)), amplitude * frequency * np.sin(phase)], axis=1)


JUMP_SHARE = 0.1  # of the largest command, from which on a change from one sample to the next is a jump; a judgement


@dataclass(frozen=True)
class TransmittedTorque:
    """Torque that a hand feels, by run.

    Args:
        mean: Torque at the joint against the motion, where it is faster than the dead zone [N m].
        peak: The largest, which is felt when the motion turns round [N m].
        correlation: Between the torques at the motor and at the joint [1]; 0 where one of them does not change.
        jumps: Jumps of the motor's command in a second [1/s], beyond the two at each turn.
    """

    mean: np.ndarray
    peak: np.ndarray
    correlation: np.ndarray
    jumps: np.ndarray


def measure_transmitted_torque(runs: DeviceRuns, dead_zone: float, start: float = 0.0) -> TransmittedTorque:
    """Measure the torque that a hand feels.

    Args:
        runs: The runs.
        dead_zone: Speed above which the mean is taken [rad/s].
        start: When to begin [s].
    """
    selected = runs.time >= start
    at_joint, at_motor, speed = runs.joint_torque[selected], runs.motor_torque[selected], runs.speed[selected]
    moving = np.abs(speed) > dead_zone
    resisting = -at_joint * np.sign(speed)
    mean = np.sum(resisting * moving, axis=0) / np.maximum(moving.sum(axis=0), 1)
    centered = at_motor - at_motor.mean(axis=0), at_joint - at_joint.mean(axis=0)
    scale = np.sqrt(np.mean(centered[0] ** 2, axis=0) * np.mean(centered[1] ** 2, axis=0))
    covariance = np.mean(centered[0] * centered[1], axis=0)
    correlation = np.where(scale > 1e-12, covariance / np.where(scale > 1e-12, scale, 1.0), 0.0)
    command = runs.command[selected]
    jumps = np.abs(np.diff(command, axis=0)) > JUMP_SHARE * np.maximum(np.abs(command).max(axis=0), 1e-9)
    turns = np.sum(np.diff(np.sign(speed), axis=0) != 0, axis=0)
    seconds = runs.time[selected][-1] - runs.time[selected][0]
    return TransmittedTorque(
        mean, np.abs(at_joint).max(axis=0), correlation, np.maximum(jumps.sum(axis=0) - 2 * turns, 0) / seconds
    )
