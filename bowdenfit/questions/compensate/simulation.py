"""From an answer to devices that are simulated: some draws of cable and device, moved by a hand and pushed without one."""

from dataclasses import replace

import numpy as np

from bowdenfit.description.device import ENCODER, Device, asked_for
from bowdenfit.device.control import Controller
from bowdenfit.device.coulomb import shares
from bowdenfit.device.known import drawn
from bowdenfit.device.motion import Hand
from bowdenfit.device.plant import Plant
from bowdenfit.device.transmission import Transmission
from bowdenfit.questions.bends.loop_draws import LoopDraws
from bowdenfit.questions.compensate.answer import Compensation
from bowdenfit.questions.compensate.gain import HAND, INTEGRAL, NEEDED
from bowdenfit.questions.compensate.simulated import Devices, Simulated, goes_on, moved
from bowdenfit.results.record import Record

DRAWS = 400
ACTIVE_ZONE = "controller.active_zone"
SET = ("motor.largest_torque", "controller.filter_time", "controller.dead_zone", "controller.torque_noise")
_LEAST_PRELOAD = 1e-6  # N m, of a loop that bending has made slack


def simulated(
    fit: Record, device: Device, loop: LoopDraws, answer: Compensation, schedule: bool, draws: int = DRAWS
) -> Simulated:
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
    keys = (*NEEDED, *HAND, *SET)
    if missing := [
        *device.lacking(*keys, *needs_stiffness),
        *([ENCODER] if device.controller.encoder_counts is None else []),
    ]:
        raise asked_for("a simulation", missing)
    assert loop.stiffness is not None
    n = len(loop.friction)
    stated = device.known(*keys)
    at = np.unique(np.linspace(0, n - 1, min(n, draws)).round().astype(int))
    known = {name: values[at] for name, values in drawn(stated, n, fit.provenance.seed).items()}
    sample = stated["controller.sample_time"].value
    chosen_to = {key: known.value for key, known in device.known(INTEGRAL, ACTIVE_ZONE).items()}
    control = Controller(
        0.0, stated["controller.dead_zone"].value, float(device.controller.linear_dead_zone), 0.0,
        chosen_to.get(INTEGRAL, 0.0), 0.0, device.count, stated["controller.filter_time"].value,
        stated["motor.largest_torque"].value,
    )  # fmt: skip
    most = int(np.argmax([bend.friction.median for bend in answer.by_bend]))
    chosen = answer.scheduled if schedule else answer.fixed
    middle = int(np.argsort(loop.friction[at, most])[len(at) // 2])
    laws, speed = moved(
        Devices(
            _plant(loop, known, at, np.full(len(at), most)), Hand(known["hand.stiffness"], known["hand.damping"]),
            known["hand.inertia"], sample, stated["controller.torque_noise"].value, None if chosen is None else chosen.torque,
            None if answer.gain is None else answer.gain.safe, chosen_to.get(ACTIVE_ZONE, np.inf), control,
            answer.by_bend[most].wrap_angle, fit.provenance.seed,
        ),
        middle,
    )  # fmt: skip
    went_on = None
    if chosen is not None:
        fed = np.array([bend.scheduled if schedule else chosen.torque for bend in answer.by_bend])
        margin = loop.friction + helping(fit, device, n)[:, None]
        worst = np.argmin(shares(margin, fed), axis=1)[at]
        pushed = goes_on(_plant(loop, known, at, worst), replace(control, coulomb=fed[worst]), sample)
        went_on = float(np.mean(pushed))
    return Simulated(len(at), answer.by_bend[most].wrap_angle, laws, went_on, speed)


def helping(fit: Record, device: Device, n: int) -> np.ndarray:
    """F_m + b dv [N m], which each device bears besides the friction of its loop."""
    stated = device.known("motor.friction", "motor.damping", "joint.damping", "controller.dead_zone")
    dry, motor, joint, zone = drawn(stated, n, fit.provenance.seed).values()
    return dry + (motor + joint) * zone


def _plant(loop: LoopDraws, known: dict[str, np.ndarray], at: np.ndarray, bends: np.ndarray) -> Plant:
    """The plant of some draws, each at a bend of its own."""
    assert loop.stiffness is not None
    cable = Transmission(
        loop.stiffness[at, bends], np.maximum(loop.preload[at, bends], _LEAST_PRELOAD), loop.exponent[at, bends]
    )
    return Plant(
        cable, known["motor.inertia"], known["motor.damping"], known["motor.friction"], known["joint.inertia"],
        known["joint.damping"], known["rope.damping"],
    )  # fmt: skip
