"""What may be said of each quantity of a device: what it measures, how it is written, whether its sd is needed."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Key:
    """What may be said of a quantity of a device.

    Args:
        dimension: One of `units.INTERNAL_UNITS`.
        example: As it is written, with its unit, and with its sd where answers are probabilities over it.
        meaning: In words.
        is_measured: Whether it is known by measuring, so that an answer needs its sd; others are set.
        may_be_zero: Whether 0 is possible.
        remedy: Other source of the quantity, as the end of a sentence.
    """

    dimension: str
    example: str
    meaning: str
    is_measured: bool = True
    may_be_zero: bool = True
    remedy: str = ""


def _set(dimension: str, example: str, meaning: str, *, may_be_zero: bool = False) -> Key:
    return Key(dimension, example, meaning, False, may_be_zero)


def _of(
    dimension: str, unit: str, value: float, meaning: str, *, may_be_zero: bool = True, remedy: str = ""
) -> Key:
    example = f'{{ value = {value:g}, unit = "{unit}", sd = {value / 10:.2g} }}'
    return Key(dimension, example, meaning, True, may_be_zero, remedy)


INERTIA, DAMPING, STIFFNESS = ("inertia", "kg*m^2"), ("angular_damping", "N*m*s/rad"), ("angular_stiffness", "N*m/rad")
TORQUE, TIME = ("torque", "N*m"), ("time", "ms")
KEYS: Mapping[str, Key] = MappingProxyType(
    {
        "motor.inertia": _of(*INERTIA, 7e-4, "inertia of motor and reducer, behind the reducer", may_be_zero=False),
        "motor.damping": _of(*DAMPING, 1e-3, "viscous damping of motor and reducer"),
        "motor.friction": _of(*TORQUE, 0.01, "dry friction of motor and reducer"),
        "motor.largest_torque": _set("torque", '{ value = 2.5, unit = "N*m" }', "largest torque of the motor"),
        "joint.inertia": _of(*INERTIA, 1e-3, "inertia of the joint and what is fixed to it", may_be_zero=False),
        "joint.damping": _of(*DAMPING, 1e-3, "viscous damping of the joint"),
        "joint.pulley_radius": _set("length", '{ value = 20, unit = "mm" }', "radius of the pulley at the joint"),
        "rope.damping": _of(
            *DAMPING, 0.02, "damping of the rope while it is stretched, between motor and joint",
            remedy=', or ringdown = "..." with the results of a fit that has a table ringdown: the joint released, and left to '
            "swing until it stands still",
        ),
        "rope.stiffness": _of(*STIFFNESS, 20, "stiffness at the joint with the motor held", may_be_zero=False),
        "rope.mounting_scatter": _set(
            "ratio", '{ value = 0.01, unit = "1" }',
            "scatter of the friction exponent from one mounting to the next, one standard deviation", may_be_zero=True,
        ),
        "rope.spring": _of("stiffness", "N/mm", 5, "stiffness of the springs of the preload", may_be_zero=False),
        "controller.sample_time": _of(*TIME, 1, "time from one sample to the next", may_be_zero=False),
        "controller.filter_time": _set("time", '{ value = 6, unit = "ms" }', "time constant of the filter of the speed"),
        "controller.dead_zone": _set(
            "angular_velocity", '{ value = 0.8, unit = "rad/s" }', "speed below which nothing is fed forward"
        ),
        "controller.torque_noise": _set(
            "torque", '{ value = 1, unit = "N*mm" }', "noise of the torque sensor, one standard deviation", may_be_zero=True
        ),
        "controller.integral_gain": _set(
            "rate", '{ value = 2, unit = "1/s" }', "K_i, gain on the integral of the torque at the joint", may_be_zero=True
        ),
        "controller.active_zone": _set(
            "angular_velocity", '{ value = 0.8, unit = "rad/s" }', "speed below which torque is fed back", may_be_zero=True
        ),
        "hand.inertia": _of(*INERTIA, 1e-3, "inertia of the hand"),
        "hand.damping": _of(*DAMPING, 0.1, "damping of the hand"),
        "hand.stiffness": _of(*STIFFNESS, 5, "stiffness of the hand"),
        "slave.inertia": _of(*INERTIA, 1e-3, "inertia of the slave behind its gearbox", may_be_zero=False),
        "slave.damping": _of(*DAMPING, 5e-3, "viscous damping of the slave"),
        "slave.friction": _of(*TORQUE, 0.03, "dry friction of the slave"),
        "slave.largest_torque": _set("torque", '{ value = 2.5, unit = "N*m" }', "largest torque of the slave's motor"),
        "wall.stiffness": _set("angular_stiffness", '{ value = 100, unit = "N*m/rad" }', "stiffness of the wall"),
        "wall.damping": _of(*DAMPING, 0.02, "damping of the wall"),
        "coupling.master_stiffness": _set("angular_stiffness", '{ value = 10, unit = "N*m/rad" }', "k_m, of the master"),
        "coupling.master_damping": _set(
            "angular_damping", '{ value = 0.05, unit = "N*m*s/rad" }', "d_m, of the master", may_be_zero=True
        ),
        "coupling.slave_stiffness": _set("angular_stiffness", '{ value = 10, unit = "N*m/rad" }', "k_s, of the slave"),
        "coupling.slave_damping": _set(
            "angular_damping", '{ value = 0.05, unit = "N*m*s/rad" }', "d_s, of the slave", may_be_zero=True
        ),
        "coupling.torque_to_master": _set(
            "ratio", '{ value = 1, unit = "1" }', "C_2, share of the slave's torque that is sent back", may_be_zero=True
        ),
        "coupling.torque_to_slave": _set(
            "ratio", '{ value = 1, unit = "1" }', "C_3, share of the master's torque that is sent on", may_be_zero=True
        ),
        "coupling.local_gain": _set(
            "ratio", '{ value = 0, unit = "1" }', "K_f, gain on the master's own torque", may_be_zero=True
        ),
        "coupling.position_to_slave": _set(
            "ratio", '{ value = 1, unit = "1" }', "C_1, scale of the master's position that the slave follows"
        ),
        "coupling.position_to_master": _set(
            "ratio", '{ value = 1, unit = "1" }', "C_4, scale of the slave's position that the master follows"
        ),
        "coupling.delay": _set(
            "time", '{ value = 0, unit = "ms" }', "delay of what is sent from side to side", may_be_zero=True
        ),
    }
)  # fmt: skip
