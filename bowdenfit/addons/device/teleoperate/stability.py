"""Transmitted torque and stiffness, and stability of contact, over draws; one contact simulated at their medians."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from bowdenfit.addons.device.description import ENCODER, Device, Known, missing_settings
from bowdenfit.addons.device.loop import LoopDraws, draw_loop, read_bends, read_device_with_ring_down
from bowdenfit.addons.device.mechanics.motion import Hand
from bowdenfit.addons.device.mechanics.plant import LoopTransmission, Plant, draw_device
from bowdenfit.addons.device.mechanics.teleoperation import (
    CouplingGains,
    MasterController,
    MasterSlave,
    Slave,
    TeleoperationRuns,
    free_motion_torque,
    is_stable,
    simulate_teleoperation,
    spectral_radius_in_contact,
    transmitted_stiffness,
)
from bowdenfit.addons.device.teleoperate.answer import CouplingScheme, SimulatedContact, Teleoperation
from bowdenfit.errors import DescriptionError
from bowdenfit.inference.interval import Interval
from bowdenfit.results.record import Record

# The simulated contact: a hand moves to and fro in the open, then pushes the slave into a wall. A scenario; judgements.
FREE_SECONDS, SECONDS = 2.0, 4.5  # s in the open, and in all
SWING = 0.15  # rad, half of the way in the open
WALL, PUSHED = 0.1, 0.5  # rad: where the wall is, and how far the hand wants to go
_PERIOD, _PUSHING, SETTLED = 1.0, 1.0, 1.2  # s: of the swing, until the hand is there, from the first touch on
_TRACE_STEP = 4  # every so many samples are kept
_LEAST_PRELOAD = 1e-6  # N m, of a loop that bending has made slack; far below any friction
DRAWS = 1000  # devices that are looked at; a probability of 95 % is then known to 0.7 %
WALLS = np.geomspace(1.0, 3000.0, 13)  # N m/rad, of the walls that are looked at; a judgement
LOCAL_GAINS = (0.5, 1.0)  # gains on the master's own torque that are looked at beside the stated one
_PAIR = (
    "rope.damping",
    "motor.inertia",
    "motor.damping",
    "joint.inertia",
    "joint.damping",
    "hand.inertia",
    "hand.damping",
    "hand.stiffness",
    "slave.inertia",
    "slave.damping",
)
_COUPLING = (
    "coupling.master_stiffness",
    "coupling.master_damping",
    "coupling.slave_stiffness",
    "coupling.slave_damping",
    "coupling.torque_to_master",
    "coupling.torque_to_slave",
    "coupling.local_gain",
)
_SCALES = ("coupling.position_to_slave", "coupling.position_to_master")
_ROUNDING = 1e-3  # that the product of the scales may be away from 1; a judgement
NEEDED = (
    *_PAIR,
    "wall.damping",
    "controller.sample_time",
    "controller.filter_time",
    "motor.friction",
    "slave.friction",
    "wall.stiffness",
    "motor.largest_torque",
    "slave.largest_torque",
    *_COUPLING,
    "coupling.delay",
)
Bends = str | tuple[tuple[float, str], tuple[float, str]] | None
Draws = Mapping[str, np.ndarray]


class ContactSimulator:
    """Simulates master and slave with median parameters and dry friction: in free motion, then against a wall.

    Args:
        device: The device.
        loop: Draws of the cable, with its stiffness.
        stated: Quantities of the device.
        delay: Samples that what is sent is late by.
        bend: Number of the wrap angle.
    """

    def __init__(self, device: Device, loop: LoopDraws, stated: Mapping[str, Known], delay: int, bend: int) -> None:
        assert loop.stiffness is not None
        values = self._values = {key: known.value for key, known in stated.items()}
        parts = (loop.stiffness, loop.preload, loop.exponent)
        stiffness, preload, exponent = (float(np.median(part[:, bend])) for part in parts)
        self._delay = delay
        self._plant = Plant(
            LoopTransmission(stiffness, max(preload, _LEAST_PRELOAD), exponent),
            values["motor.inertia"],
            values["motor.damping"],
            values["motor.friction"],
            values["joint.inertia"] + values["hand.inertia"],
            values["joint.damping"],
            values["rope.damping"],
        )
        largest = values["motor.largest_torque"]
        self._controller = MasterController(device.count, values["controller.filter_time"], largest)

    def run(self, gains: CouplingGains, walls: np.ndarray | float) -> TeleoperationRuns:
        """Return the signals of a contact with each of some walls.

        Args:
            gains: Gains of the signals that are sent.
            walls: Their stiffnesses [N m/rad].
        """
        values = self._values
        slave = Slave(
            values["slave.inertia"],
            values["slave.damping"],
            values["slave.friction"],
            values["slave.largest_torque"],
            WALL,
            walls,
            values["wall.damping"],
        )
        hand, sample = Hand(values["hand.stiffness"], values["hand.damping"]), values["controller.sample_time"]
        path = compute_hand_path(sample)
        return simulate_teleoperation(
            self._plant, hand, slave, self._controller, gains, path, delay=self._delay, sample=sample
        )

    def trace(self, gains: CouplingGains) -> SimulatedContact:
        """Return the contact with the stated wall through time."""
        wall = self._values["wall.stiffness"]
        runs, kept = self.run(gains, wall), slice(None, None, _TRACE_STEP)
        return SimulatedContact(
            runs.time[kept],
            runs.joint[kept],
            runs.slave[kept],
            runs.hand_torque[kept],
            runs.wall_torque[kept],
            wall,
            detect_bouncing(runs.time, runs.wall_torque),
        )

    def bounces(self, gains: CouplingGains) -> np.ndarray:
        """Return whether the slave still bounces at each of `WALLS`; False where friction holds it before it comes there."""
        runs = self.run(gains, WALLS)
        return np.array([bool(detect_bouncing(runs.time, torque)) for torque in runs.wall_torque.T])


def compute_hand_path(sample: float) -> np.ndarray:
    """Return the hand's path, to and fro in free motion and then into the wall: angle [rad] and speed [rad/s] by sample."""
    time = np.arange(round(SECONDS / sample)) * sample
    frequency, speed = 2 * np.pi / _PERIOD, PUSHED / _PUSHING
    pushed_angle = np.clip(speed * (time - FREE_SECONDS), 0.0, PUSHED)
    angle = np.where(time < FREE_SECONDS, SWING * (np.cos(frequency * time) - 1), pushed_angle)
    target_speed = np.where(
        time < FREE_SECONDS, -SWING * frequency * np.sin(frequency * time), np.where(pushed_angle < PUSHED, speed, 0.0)
    )
    return np.stack([angle, target_speed], axis=1)


def detect_bouncing(time: np.ndarray, wall_torque: np.ndarray) -> bool | None:
    """Return whether the slave leaves the wall again after it should have settled; None if it never touches it.

    Args:
        time: [s].
        wall_torque: T_e [N m].
    """
    contact = np.flatnonzero((wall_torque > 0) & (time > FREE_SECONDS))
    if not len(contact):
        return None
    return bool(np.any(wall_torque[time > time[contact[0]] + SETTLED] == 0))


def assess_teleoperation(fit: Record, path: Path, bends: Bends, probability: float) -> Teleoperation:
    """Assess transmitted torque, stiffness and stability of all coupling schemes.

    Args:
        fit: The fit.
        path: A device.toml that describes master, slave, hand, wall and coupling.
        bends: Range of wrap angles.
        probability: With which contact must be stable.

    Raises:
        UsageError, DescriptionError: The fit does not tell it, or something that it needs is not stated.
    """
    device = read_device_with_ring_down(fit, path)
    angles = read_bends(fit, bends)
    loop = draw_loop(fit, angles, device, np.ones(1))
    _refuse_missing(device, loop)
    assert loop.stiffness is not None
    stated = device.needed("teleoperation", *NEEDED)
    n = len(loop.friction)
    picked = np.unique(np.linspace(0, n - 1, min(n, DRAWS)).round().astype(int))
    draws = {name: values[picked] for name, values in draw_device(stated, n, fit.provenance.seed).items()}
    bend = np.random.default_rng([fit.provenance.seed, 43]).integers(len(angles), size=len(picked))
    stiffness = loop.stiffness[picked, bend]
    gains = _scale_coupling_gains({key: stated[key].value for key in _COUPLING}, _read_position_scales(device))
    delay = round(stated["coupling.delay"].value / stated["controller.sample_time"].value)
    most = int(np.argmax(np.median(loop.friction, axis=0)))
    frictions = {
        "rope": loop.friction[picked, most],
        "motor": draws["motor.friction"],
        "slave": draws["slave.friction"],
    }
    gains_by_name = {"as stated": gains, "two channels": gains.two_channels()}
    gains_by_name |= {
        f"local feedback {gain:g}": gains.with_local_gain(gain) for gain in LOCAL_GAINS if gain > gains.local_gain
    }
    wall = stated["wall.stiffness"].value
    simulator = ContactSimulator(device, loop, stated, delay, most)
    schemes = tuple(
        _assess_scheme(
            name, scheme_gains, draws, stiffness, delay, frictions, wall, probability, simulator.bounces(scheme_gains)
        )
        for name, scheme_gains in gains_by_name.items()
    )
    stable_at_wall = float(
        np.mean(is_stable(spectral_radius_in_contact(_build_master_and_slave(draws, stiffness, wall), gains, delay)))
    )
    return Teleoperation(
        fit.name,
        device.name,
        (float(np.rad2deg(angles[0])), float(np.rad2deg(angles[-1]))),
        probability,
        len(picked),
        WALLS,
        wall,
        stable_at_wall,
        schemes,
        simulator.trace(gains),
    )


def _scale_coupling_gains(stated: Mapping[str, float], scales: tuple[float, float]) -> CouplingGains:
    k_m, d_m, k_s, d_s, c_2, c_3, k_f = (stated[key] for key in _COUPLING)
    return CouplingGains(k_m, d_m, k_s, d_s, c_2, c_3, k_f, False, *scales)


def _read_position_scales(device: Device) -> tuple[float, float]:
    """Return C_1 and C_4; 1 where neither is stated, and one from the other."""
    known = device.known(*_SCALES)
    to_slave, to_master = (known[key].value if key in known else None for key in _SCALES)
    if to_slave is None or to_master is None:
        to_slave = to_slave or (1 / to_master if to_master else 1.0)
        return to_slave, to_master or 1 / to_slave
    if abs(to_slave * to_master - 1) > _ROUNDING:
        raise DescriptionError(
            f"device.toml, {_SCALES[1]}: {to_master:g} is not 1 over {_SCALES[0]}, {to_slave:g}: in free motion the two sides "
            f"would pull each other to zero, or away from it; write {1 / to_slave:.6g}, or leave one of the two out."
        )
    return to_slave, to_master


def _refuse_missing(device: Device, loop: LoopDraws) -> None:
    needs_stiffness = ("rope.stiffness",) if loop.stiffness is None else ()
    count = [ENCODER] if device.controller.encoder_counts is None else []
    if missing := [*device.lacking(*NEEDED, *needs_stiffness), *count]:
        raise missing_settings("teleoperation", missing)


def _build_master_and_slave(draws: Draws, stiffness: np.ndarray, wall: float) -> MasterSlave:
    """Return all devices with a wall of one stiffness, or in free motion."""
    damping = draws["wall.damping"] if wall > 0 else np.zeros_like(stiffness)
    rope, j_m, b_m, j_j, b_j, j_h, b_h, k_h, j_s, b_s = (draws[key] for key in _PAIR)
    sample, filter_time = draws["controller.sample_time"], draws["controller.filter_time"]
    walls = np.full_like(stiffness, wall)
    return MasterSlave(
        stiffness, rope, j_m, b_m, j_j, b_j, j_h, b_h, k_h, j_s, b_s, walls, damping, sample, filter_time
    )


def _assess_scheme(
    name: str,
    gains: CouplingGains,
    draws: Draws,
    stiffness: np.ndarray,
    delay: int,
    frictions: Draws,
    wall: float,
    probability: float,
    bounces: np.ndarray,
) -> CouplingScheme:
    """Assess one coupling: what is felt, and which walls are stable."""
    radius = spectral_radius_in_contact(_build_master_and_slave(draws, stiffness, 0.0), gains, delay)
    stable = np.array(
        [
            np.mean(is_stable(spectral_radius_in_contact(_build_master_and_slave(draws, stiffness, k), gains, delay)))
            for k in WALLS
        ]
    )
    transmitted = (
        None if gains.local_damping else Interval.of(np.asarray(transmitted_stiffness(gains, stiffness, wall)))
    )
    free = Interval.of(np.asarray(free_motion_torque(gains, frictions["rope"], frictions["motor"], frictions["slave"])))
    free_motion_stable = float(np.mean(is_stable(radius)))
    hardest = 0.0 if free_motion_stable < probability else find_hardest_wall(WALLS, stable, probability)
    return CouplingScheme(name, free, transmitted, free_motion_stable, stable, hardest, float(np.median(radius)), bounces)


def find_hardest_wall(walls: np.ndarray, stable: np.ndarray, probability: float) -> float | None:
    """Return the hardest wall up to which contact is stable with a probability; None if all tested walls are.

    Args:
        walls: Stiffnesses from the softest to the hardest [N m/rad].
        stable: Probability that contact with each is stable.
        probability: Such as 0.95.
    """
    too_hard = stable < probability
    if not too_hard.any():
        return None
    first = int(np.argmax(too_hard))
    if first == 0:
        return 0.0
    share = (stable[first - 1] - probability) / (stable[first - 1] - stable[first])
    return float(walls[first - 1] * (walls[first] / walls[first - 1]) ** share)
