"""Simulation of the compensated device: a hand moves it (figures 9 to 11 of the haptic paper), and a push tests for runaway."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import bowdenfit.addons.device.compensate.words  # noqa: F401  registers the text of the answer
from bowdenfit.addons.device.compensate.answer import (
    ACTIVE,
    KARNOPP,
    NONE,
    Compensation,
    DeviceSimulation,
    SimulatedLaw,
    TorqueTrace,
)
from bowdenfit.addons.device.compensate.limits import HAND, INTEGRAL, NEEDED, estimate_compensation, parse_risk
from bowdenfit.addons.device.description import ENCODER, Device, Known, missing_settings
from bowdenfit.addons.device.loop import LoopDraws, read_device_with_ring_down
from bowdenfit.addons.device.mechanics.limits import safe_shares
from bowdenfit.addons.device.mechanics.motion import (
    Controller,
    DeviceRuns,
    Hand,
    measure_transmitted_torque,
    oscillating_path,
    simulate_device,
)
from bowdenfit.addons.device.mechanics.plant import LoopTransmission, Motion, Plant, draw_device
from bowdenfit.arguments import Bends
from bowdenfit.inference.interval import Interval
from bowdenfit.results.record import Record

# The simulated movement and push: a scenario; judgements.
AMPLITUDE = 0.5  # of the hand's path [rad]
_PERIOD, _SECONDS, _SINCE = 1.25, 2.5, 0.625  # s: period and length of the movement to and fro, and since when it counts
_SPEED_FACTOR = 2.0  # times the dead zone, which a push and the movement reach at least
_PUSH = 3.0  # s, from a push to when the device should rest
_LAST_SAMPLES = 50  # samples at the end of a push, which tell whether it goes on
_TRACE_STEP = 4  # every so many samples are kept of a trace
_LEAST_SPEED = 0.05  # rad/s, where there is no dead zone
_LEAST_PRELOAD = 1e-6  # N m, of a loop that bending has made slack
DRAWS = 400  # devices that are simulated; a probability of 5 % is then known to 1 %
ACTIVE_ZONE = "controller.active_zone"
SIMULATION_KEYS = ("motor.largest_torque", "controller.filter_time", "controller.dead_zone", "controller.torque_noise")


@dataclass(frozen=True)
class SimulatedDevices:
    """Devices to simulate; every number is one for all or an array over devices.

    Args:
        plant: At the bend where friction is most, without a hand.
        hand: That moves it.
        hand_inertia: Which then counts with the joint [kg m^2].
        sample: T_s [s].
        noise: Noise of the torque sensor [N m].
        feed_forward: F_cst there [N m].
        gain: K_f.
        active_zone: Speed below which it acts; infinite for always [rad/s].
        control: Other settings of the controller.
        wrap_angle: Wrap angle of the bend [deg].
        seed: Seed of the noise.
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
    """Simulate every law while a hand moves the device to and fro; return also its largest speed [rad/s].

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
        results.append(SimulatedLaw(name, Interval.of(torque.mean), Interval.of(torque.peak), _pick_trace(runs, middle)))
    return tuple(results), 2 * np.pi * AMPLITUDE / period


def _pick_trace(runs: DeviceRuns, middle: int) -> TorqueTrace:
    return TorqueTrace(
        runs.time[::_TRACE_STEP],
        runs.motor_torque[::_TRACE_STEP, middle].copy(),
        runs.joint_torque[::_TRACE_STEP, middle].copy(),
    )


def find_runaways(plant: Plant, control: Controller, sample: float) -> np.ndarray:
    """Return whether each device keeps moving by itself after a push, with no hand on.

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


def simulate_devices(
    fit: Record, device: Device, loop: LoopDraws, answer: Compensation, schedule: bool, draws: int = DRAWS
) -> DeviceSimulation:
    """Simulate devices under every law, and after a push.

    Args:
        fit: The fit.
        device: The device.
        loop: Draws of the cable.
        answer: Torques that may be fed forward, and gain that may be fed back.
        schedule: Whether what is fed forward is scheduled by bend.
        draws: How many devices.

    Raises:
        DescriptionError: Something that a simulation needs is not stated.
    """
    needs_stiffness = ("rope.stiffness",) if loop.stiffness is None else ()
    keys = (*NEEDED, *HAND, *SIMULATION_KEYS)
    if missing := [
        *device.lacking(*keys, *needs_stiffness),
        *([ENCODER] if device.controller.encoder_counts is None else []),
    ]:
        raise missing_settings("a simulation", missing)
    assert loop.stiffness is not None
    n = len(loop.friction)
    stated = device.known(*keys)
    picked = np.unique(np.linspace(0, n - 1, min(n, draws)).round().astype(int))
    draws_by_key = {name: values[picked] for name, values in draw_device(stated, n, fit.provenance.seed).items()}
    sample = stated["controller.sample_time"].value
    optional = {key: quantity.value for key, quantity in device.known(INTEGRAL, ACTIVE_ZONE).items()}
    control = _build_controller(device, stated, optional)
    most = int(np.argmax([bend.friction.median for bend in answer.by_bend]))
    feed_forward = answer.scheduled if schedule else answer.fixed
    middle = int(np.argsort(loop.friction[picked, most])[len(picked) // 2])
    laws, speed = simulate_hand_motion(
        SimulatedDevices(
            _build_plant(loop, draws_by_key, picked, np.full(len(picked), most)),
            Hand(draws_by_key["hand.stiffness"], draws_by_key["hand.damping"]),
            draws_by_key["hand.inertia"],
            sample,
            stated["controller.torque_noise"].value,
            None if feed_forward is None else feed_forward.torque,
            None if answer.gain is None else answer.gain.safe,
            optional.get(ACTIVE_ZONE, np.inf),
            control,
            answer.by_bend[most].wrap_angle,
            fit.provenance.seed,
        ),
        middle,
    )
    runaway_share = None
    if feed_forward is not None:
        torque = np.array([bend.scheduled if schedule else feed_forward.torque for bend in answer.by_bend])
        margin = loop.friction + draw_friction_margin(fit, device, n)[:, None]
        worst = np.argmin(safe_shares(margin, torque), axis=1)[picked]
        runaways = find_runaways(
            _build_plant(loop, draws_by_key, picked, worst), replace(control, coulomb=torque[worst]), sample
        )
        runaway_share = float(np.mean(runaways))
    return DeviceSimulation(len(picked), answer.by_bend[most].wrap_angle, laws, runaway_share, speed)


def _build_controller(device: Device, stated: Mapping[str, Known], optional: Mapping[str, float]) -> Controller:
    """Build the controller without any compensation; `simulate_hand_motion` adds that of each law."""
    return Controller(
        coulomb=0.0,
        dead_zone=stated["controller.dead_zone"].value,
        linear=float(device.controller.linear_dead_zone),
        gain=0.0,
        integral_gain=optional.get(INTEGRAL, 0.0),
        active_zone=0.0,
        count=device.count,
        filter_time=stated["controller.filter_time"].value,
        largest_torque=stated["motor.largest_torque"].value,
    )


def draw_friction_margin(fit: Record, device: Device, n: int) -> np.ndarray:
    """Draw F_m + b dv [N m], the feed-forward torque that a device tolerates beyond the friction of its loop."""
    stated = device.known("motor.friction", "motor.damping", "joint.damping", "controller.dead_zone")
    dry, motor, joint, zone = draw_device(stated, n, fit.provenance.seed).values()
    return dry + (motor + joint) * zone


def _build_plant(loop: LoopDraws, known: dict[str, np.ndarray], picked: np.ndarray, bends: np.ndarray) -> Plant:
    """Build the plant of some draws, each at its own bend."""
    assert loop.stiffness is not None
    cable = LoopTransmission(
        loop.stiffness[picked, bends],
        np.maximum(loop.preload[picked, bends], _LEAST_PRELOAD),
        loop.exponent[picked, bends],
    )
    return Plant(
        cable,
        known["motor.inertia"],
        known["motor.damping"],
        known["motor.friction"],
        known["joint.inertia"],
        known["joint.damping"],
        known["rope.damping"],
    )


def answer_compensation(
    fit: Record,
    device: Path | None,
    bends: Bends,
    law: str | None,
    risk: tuple[float, str] | None,
    schedule: bool,
    simulate: bool,
) -> Compensation:
    """Estimate how much friction may be compensated, and simulate the compensated device where that is wanted.

    Args:
        fit: The fit.
        device: A device.toml; None where nothing is stated of the device.
        bends: Range of wrap angles; None for that of the measurements.
        law: "karnopp", "active", or None for both.
        risk: Accepted probability of moving by itself, and its unit.
        schedule: Whether the simulated feed-forward torque is scheduled by bend.
        simulate: Whether devices are simulated.

    Raises:
        UsageError, DescriptionError: The fit does not provide it, or something that it needs is not stated.
    """
    description = None if device is None else read_device_with_ring_down(fit, device)
    answer, loop = estimate_compensation(fit, description, bends, law, parse_risk(risk))
    if not simulate:
        return answer
    if description is None:
        raise missing_settings("a simulation", NEEDED)
    return replace(answer, simulated=simulate_devices(fit, description, loop, answer, schedule))
