"""One device through time: the median of what is known, in the open and against the wall."""

from collections.abc import Mapping

import numpy as np

from bowdenfit.description.device import Device, Known
from bowdenfit.device.coupling import Gains
from bowdenfit.device.motion import Hand
from bowdenfit.device.plant import Plant
from bowdenfit.device.teleoperation import Sampled, Slave, teleoperated
from bowdenfit.device.transmission import Transmission
from bowdenfit.questions.bends.loop_draws import LoopDraws
from bowdenfit.questions.teleoperate.answer import Contact

OPEN, SECONDS = 2.0, 4.5  # s in the open, and in all
SWING = 0.15  # rad, half of the way in the open
WALL, PUSHED = 0.1, 0.5  # rad: where the wall is, and how far the hand wants to go
_PERIOD, _PUSHING, SETTLED = 1.0, 1.0, 1.2  # s: of the swing, until the hand is there, from the first touch on
_KEPT = 4  # every so many samples are kept
_LEAST_PRELOAD = 1e-6  # N m


def through_time(
    device: Device, loop: LoopDraws, stated: Mapping[str, Known], gains: Gains, delay: int, bend: int
) -> Contact:
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
    of = {key: known.value for key, known in stated.items()}
    stiffness, preload, exponent = (
        float(np.median(part[:, bend])) for part in (loop.stiffness, loop.preload, loop.exponent)
    )
    plant = Plant(
        Transmission(stiffness, max(preload, _LEAST_PRELOAD), exponent), of["motor.inertia"], of["motor.damping"],
        of["motor.friction"], of["joint.inertia"] + of["hand.inertia"], of["joint.damping"], of["rope.damping"],
    )  # fmt: skip
    slave = Slave(
        of["slave.inertia"], of["slave.damping"], of["slave.friction"], of["slave.largest_torque"], WALL, of["wall.stiffness"],
        of["wall.damping"],
    )  # fmt: skip
    sampled = Sampled(device.count, of["controller.filter_time"], of["motor.largest_torque"])
    sample = of["controller.sample_time"]
    runs = teleoperated(
        plant,
        Hand(of["hand.stiffness"], of["hand.damping"]),
        slave,
        sampled,
        gains,
        path(sample),
        delay=delay,
        sample=sample,
    )
    kept = slice(None, None, _KEPT)
    return Contact(
        runs.time[kept], runs.joint[kept], runs.slave[kept], runs.hand_torque[kept], runs.wall_torque[kept],
        of["wall.stiffness"], bounces(runs.time, runs.wall_torque),
    )  # fmt: skip


def path(sample: float) -> np.ndarray:
    """Where the hand wants to be: to and fro in the open, then into the wall; angle [rad] and speed [rad/s] at every sample."""
    time = np.arange(round(SECONDS / sample)) * sample
    turned, speed = 2 * np.pi / _PERIOD, PUSHED / _PUSHING
    pushed = np.clip(speed * (time - OPEN), 0.0, PUSHED)
    at = np.where(time < OPEN, SWING * (np.cos(turned * time) - 1), pushed)
    moving = np.where(time < OPEN, -SWING * turned * np.sin(turned * time), np.where(pushed < PUSHED, speed, 0.0))
    return np.stack([at, moving], axis=1)


def bounces(time: np.ndarray, wall_torque: np.ndarray) -> bool | None:
    """Whether the slave leaves the wall again once it should have settled; None where it never came.

    Args:
        time: [s].
        wall_torque: T_e [N m].
    """
    came = np.flatnonzero((wall_torque > 0) & (time > OPEN))
    if not len(came):
        return None
    return bool(np.any(wall_torque[time > time[came[0]] + SETTLED] == 0))
