"""One device through time: the median of what is known, in the open and against the wall."""

from collections.abc import Mapping

import numpy as np

from bowdenfit.description.device import Device, Known
from bowdenfit.device.coupling import CouplingGains
from bowdenfit.device.motion import Hand
from bowdenfit.device.plant import Plant
from bowdenfit.device.teleoperation import MasterController, Slave, simulate_teleoperation
from bowdenfit.device.transmission import LoopTransmission
from bowdenfit.questions.bends.loop_draws import LoopDraws
from bowdenfit.questions.teleoperate.answer import SimulatedContact

FREE_SECONDS, SECONDS = 2.0, 4.5  # s in the open, and in all
SWING = 0.15  # rad, half of the way in the open
WALL, PUSHED = 0.1, 0.5  # rad: where the wall is, and how far the hand wants to go
_PERIOD, _PUSHING, SETTLED = 1.0, 1.0, 1.2  # s: of the swing, until the hand is there, from the first touch on
_TRACE_STEP = 4  # every so many samples are kept
_LEAST_PRELOAD = 1e-6  # N m


def simulate_contact(
    device: Device, loop: LoopDraws, stated: Mapping[str, Known], gains: CouplingGains, delay: int, bend: int
) -> SimulatedContact:
    """Master and slave of median numbers.

    Args:
        device: The device.
        loop: Draws of the cable, with its stiffness.
        stated: Quantities of the device.
        gains: What is sent.
        delay: Samples that it is late by.
        bend: Number of the wrap angle.
    """
    assert loop.stiffness is not None
    values = {key: known.value for key, known in stated.items()}
    stiffness, preload, exponent = (
        float(np.median(part[:, bend])) for part in (loop.stiffness, loop.preload, loop.exponent)
    )
    plant = Plant(
        LoopTransmission(stiffness, max(preload, _LEAST_PRELOAD), exponent),
        values["motor.inertia"],
        values["motor.damping"],
        values["motor.friction"],
        values["joint.inertia"] + values["hand.inertia"],
        values["joint.damping"],
        values["rope.damping"],
    )
    slave = Slave(
        values["slave.inertia"],
        values["slave.damping"],
        values["slave.friction"],
        values["slave.largest_torque"],
        WALL,
        values["wall.stiffness"],
        values["wall.damping"],
    )
    controller = MasterController(device.count, values["controller.filter_time"], values["motor.largest_torque"])
    sample = values["controller.sample_time"]
    runs = simulate_teleoperation(
        plant,
        Hand(values["hand.stiffness"], values["hand.damping"]),
        slave,
        controller,
        gains,
        hand_path(sample),
        delay=delay,
        sample=sample,
    )
    kept = slice(None, None, _TRACE_STEP)
    return SimulatedContact(
        runs.time[kept],
        runs.joint[kept],
        runs.slave[kept],
        runs.hand_torque[kept],
        runs.wall_torque[kept],
        values["wall.stiffness"],
        detect_bouncing(runs.time, runs.wall_torque),
    )


def hand_path(sample: float) -> np.ndarray:
    """Where the hand wants to be: to and fro in the open, then into the wall; angle [rad] and speed [rad/s] at every sample."""
    time = np.arange(round(SECONDS / sample)) * sample
    frequency, speed = 2 * np.pi / _PERIOD, PUSHED / _PUSHING
    pushed_angle = np.clip(speed * (time - FREE_SECONDS), 0.0, PUSHED)
    angle = np.where(time < FREE_SECONDS, SWING * (np.cos(frequency * time) - 1), pushed_angle)
    target_speed = np.where(
        time < FREE_SECONDS, -SWING * frequency * np.sin(frequency * time), np.where(pushed_angle < PUSHED, speed, 0.0)
    )
    return np.stack([angle, target_speed], axis=1)


def detect_bouncing(time: np.ndarray, wall_torque: np.ndarray) -> bool | None:
    """Whether the slave leaves the wall again once it should have settled; None where it never came.

    Args:
        time: [s].
        wall_torque: T_e [N m].
    """
    contact = np.flatnonzero((wall_torque > 0) & (time > FREE_SECONDS))
    if not len(contact):
        return None
    return bool(np.any(wall_torque[time > time[contact[0]] + SETTLED] == 0))
