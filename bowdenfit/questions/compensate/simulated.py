"""The device through time: what its sensors show, as figures 9 to 11 of the haptic paper, and whether it moves by itself."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bowdenfit.device.control import Controller
from bowdenfit.device.felt import measure_transmitted_torque
from bowdenfit.device.motion import DeviceRuns, Hand, oscillating_path, simulate_device
from bowdenfit.device.plant import Motion, Plant
from bowdenfit.display import Part
from bowdenfit.inference.interval import Interval

NONE, KARNOPP, ACTIVE = "none", "karnopp", "active"
AMPLITUDE = 0.5  # of the hand's path [rad]
_PERIOD, _SECONDS, _SINCE = 1.25, 2.5, 0.625  # of the movement to and fro [s]
_SPEED_FACTOR = 2.0  # times the dead zone, which a push and the movement reach at least
_PUSH = 3.0  # s
_LAST_SAMPLES = 50  # samples at the end of a push, which tell whether it goes on
_TRACE_STEP = 4  # every so many samples are kept of a trace
_LEAST_SPEED = 0.05  # rad/s, where there is no dead zone


@dataclass(frozen=True, repr=False)
class TorqueTrace(Part):
    """The torques of one device, that of the middle friction, while a hand moves it to and fro.

    Args:
        time: [s].
        motor, joint: What the rope takes from the motor and gives the joint [N m].
    """

    time: np.ndarray
    motor: np.ndarray
    joint: np.ndarray


@dataclass(frozen=True, repr=False)
class SimulatedLaw(Part):
    """One law, in every simulated device.

    Args:
        name: "none", "karnopp" or "active".
        felt: Mean torque at the joint against the motion [N m].
        peak: The largest, where the motion turns round [N m].
        trace: Of one device.
    """

    name: str
    mean_torque: Interval
    peak_torque: Interval
    trace: TorqueTrace

    JSON: ClassVar = ("name", ("felt", "mean_torque"), ("peak", "peak_torque"), "trace")


@dataclass(frozen=True, repr=False)
class DeviceSimulation(Part):
    """The device through time.

    Args:
        draws: Devices that were simulated.
        wrap_angle: At which the hand moved them [deg].
        laws: Each law.
        went_on: Share of the devices that went on by themselves after a push with no hand on, each at the bend where it bears
            least; None without feeding forward.
        speed: Largest of the hand [rad/s].
    """

    draws: int
    wrap_angle: float
    laws: tuple[SimulatedLaw, ...]
    runaway_share: float | None
    speed: float

    JSON: ClassVar = ("draws", "wrap_angle", "laws", ("went_on", "runaway_share"), "speed")


@dataclass(frozen=True)
class SimulatedDevices:
    """Devices that are simulated, a number each, or one for all.

    Args:
        plant: At the bend where friction is most, without a hand.
        hand: That moves it.
        hand_inertia: Which then counts with the joint [kg m^2].
        sample: T_s [s].
        noise: Of the torque sensor [N m].
        fed_forward: F_cst there [N m].
        gain: K_f.
        active_zone: Speed below which it acts; infinite for always [rad/s].
        control: What the controller is besides.
        wrap_angle: Of the bend [deg].
        seed: Of the noise.
    """

    plant: Plant
    hand: Hand
    hand_inertia: np.ndarray
    sample: float
    noise: float
    feed_forward: float | None
    gain: float | None
    active_zone: float
    control: Controller
    wrap_angle: float
    seed: int


def simulate_hand_motion(devices: SimulatedDevices, middle: int) -> tuple[tuple[SimulatedLaw, ...], float]:
    """Every law while a hand moves the device to and fro, and the hand's largest speed [rad/s].

    Args:
        devices: The devices.
        middle: Number of the one of which traces are kept.
    """
    period = min(_PERIOD, 2 * np.pi * AMPLITUDE / (_SPEED_FACTOR * max(float(devices.control.dead_zone), 1e-9)))
    path = oscillating_path(2 * period, devices.sample, AMPLITUDE, period)
    plant = replace(devices.plant, joint_inertia=devices.plant.joint_inertia + devices.hand_inertia)
    laws = {NONE: devices.control}
    if devices.feed_forward is not None:
        laws[KARNOPP] = replace(devices.control, coulomb=devices.feed_forward)
    if devices.gain is not None:
        laws[ACTIVE] = replace(devices.control, gain=devices.gain, active_zone=devices.active_zone)
    results = []
    for name, control in laws.items():
        runs = simulate_device(
            plant, control, devices.hand, path, sample=devices.sample, noise=devices.noise, seed=devices.seed
        )
        torque = measure_transmitted_torque(
            runs, max(float(devices.control.dead_zone), _LEAST_SPEED), start=_SINCE * period / _PERIOD
        )
        results.append(SimulatedLaw(name, Interval.of(torque.mean), Interval.of(torque.peak), _trace(runs, middle)))
    return tuple(results), 2 * np.pi * AMPLITUDE / period


def _trace(runs: DeviceRuns, middle: int) -> TorqueTrace:
    return TorqueTrace(
        runs.time[::_TRACE_STEP],
        runs.motor_torque[::_TRACE_STEP, middle].copy(),
        runs.joint_torque[::_TRACE_STEP, middle].copy(),
    )


def find_runaways(plant: Plant, control: Controller, sample: float) -> np.ndarray:
    """Whether each device goes on by itself after a push, with no hand on.

    Args:
        plant: Of every device at its own bend.
        control: Which feeds forward.
        sample: T_s [s].
    """
    zone = np.maximum(np.asarray(control.dead_zone), _LEAST_SPEED)
    initial_speed = np.broadcast_to(_SPEED_FACTOR * zone, np.shape(plant.loop.preload))
    start = replace(
        Motion.at_rest(np.zeros(np.shape(initial_speed))), motor_speed=initial_speed, joint_speed=initial_speed
    )
    path = np.zeros((round(_PUSH / sample), 2))
    runs = simulate_device(plant, control, Hand(0.0, 0.0), path, start=start, sample=sample)
    still_moving: np.ndarray = np.abs(runs.speed[-_LAST_SAMPLES:]).max(axis=0) > zone / 2
    return still_moving
