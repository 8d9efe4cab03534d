"""What a hand feels of a device that it moves: how much, how it sticks when it turns, whether the motor chatters."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.device.motion import DeviceRuns

JUMP_SHARE = 0.1  # of the largest command, from which on a change from one sample to the next is a jump


@dataclass(frozen=True)
class TransmittedTorque:
    """Of every run.

    Args:
        mean: Torque at the joint against the motion, where it is faster than the dead zone [N m].
        peak: The largest, which is felt when the motion turns round [N m].
        correlation: Between the torques at the motor and at the joint [1]; 0 where one of them does not change.
        jumps: Of the motor's command in a second [1/s], beyond the two at each turn.
    """

    mean: np.ndarray
    peak: np.ndarray
    correlation: np.ndarray
    jumps: np.ndarray


def measure_transmitted_torque(runs: DeviceRuns, dead_zone: float, start: float = 0.0) -> TransmittedTorque:
    """What is felt of runs.

    Args:
        runs: The runs.
        dead_zone: Speed above which the mean is taken [rad/s].
        since: When to begin [s].
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
