"""A device through time: the plant under its controller and a hand, in one program for any number of runs."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.device.control import Controller, ControllerMemory, step_controller
from bowdenfit.device.plant import Motion, Plant, advance, rope_torques, settle_node
from bowdenfit.device.transmission import Numbers

STEP = 1e-4  # of the plant [s]


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
    """What was seen at every sample (first axis) of every run.

    Args:
        time: [s].
        motor_torque: T_m that the rope takes from the motor [N m].
        joint_torque: T_j that it gives the joint [N m].
        hand_torque: T_h [N m].
        command: What the motor gave [N m].
        speed: Of the joint [rad/s].
        angle: Of the joint [rad].
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
    """Runs of a device, those of all entries of its numbers at once.

    Args:
        plant, control, hand: Of which every number may be an array of runs.
        path: Angle and speed of the hand's path at every sample [rad], [rad/s].
        start: Where it is at first; at rest if omitted.
        sample: T_s [s].
        step: Of the plant, about; a sample is a whole number of them [s].
        noise: Of the torque sensor, one standard deviation [N m].
        seed: Of that noise.
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
    """The compiled program of so many steps a sample, over runs."""

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
    """A hand's path to and fro, from rest: angle [rad] and speed [rad/s] at every sample.

    Args:
        seconds, sample, period: [s].
        amplitude: Half of the way [rad].
    """
    frequency = 2 * np.pi / period
    phase = frequency * sample * np.arange(round(seconds / sample))
    return np.stack([amplitude * (1 - np.cos(phase)), amplitude * frequency * np.sin(phase)], axis=1)
