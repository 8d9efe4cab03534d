"""From an answer to devices that are simulated: some draws of cable and device, moved by a hand and pushed without one."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bowdenfit.description.device import ENCODER, Device, Known, asked_for
from bowdenfit.device.control import Controller
from bowdenfit.device.coulomb import safe_shares
from bowdenfit.device.known import draw_device
from bowdenfit.device.motion import Hand
from bowdenfit.device.plant import Plant
from bowdenfit.device.transmission import LoopTransmission
from bowdenfit.questions.bends.loop_draws import LoopDraws
from bowdenfit.questions.compensate.answer import Compensation
from bowdenfit.questions.compensate.gain import HAND, INTEGRAL, NEEDED
from bowdenfit.questions.compensate.simulated import (
    DeviceSimulation,
    SimulatedDevices,
    find_runaways,
    simulate_hand_motion,
)
from bowdenfit.results.record import Record

DRAWS = 400
ACTIVE_ZONE = "controller.active_zone"
SIMULATION_KEYS = ("motor.largest_torque", "controller.filter_time", "controller.dead_zone", "controller.torque_noise")
_LEAST_PRELOAD = 1e-6  # N m, of a loop that bending has made slack


def simulate_devices(
    fit: Record, device: Device, loop: LoopDraws, answer: Compensation, schedule: bool, draws: int = DRAWS
) -> DeviceSimulation:
    """The device through time.

    Args:
        fit: The fit.
        device: The device.
        loop: Draws of the cable.
        answer: What may be fed forward and fed back.
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
        raise asked_for("a simulation", missing)
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
    """F_m + b dv [N m], which each device bears besides the friction of its loop."""
    stated = device.known("motor.friction", "motor.damping", "joint.damping", "controller.dead_zone")
    dry, motor, joint, zone = draw_device(stated, n, fit.provenance.seed).values()
    return dry + (motor + joint) * zone


def _build_plant(loop: LoopDraws, known: dict[str, np.ndarray], picked: np.ndarray, bends: np.ndarray) -> Plant:
    """The plant of some draws, each at a bend of its own."""
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
