"""Readings of a motor in the place of a load cell: what of them can be told apart, and how they are written to files."""

import numpy as np

from bowdenfit.description import Description
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.rows import ForceRows
from bowdenfit.types import Labels, Vector

_ALIKE = 0.05  # relative range of loads that count as one; a judgement


def check_gear(description: Description, rows: ForceRows, stroke: Labels, loads: Vector, file: str) -> None:
    """Refuse readings in which the losses of a gear and of the cable are one number, whatever is measured.

    At one bend, what a gear loses of the torque cannot be separated from what the cable loses of the force, nor at one load its
    friction; at several bends, or without the cable, they can.

    Args:
        description: The description, with or without a motor.
        rows: Lengths and wrap angles of the readings.
        stroke: +1 pulling, -1 returning, 0 held, of each force.
        loads: Input forces [N].
        file: What holds them.

    Raises:
        DatasetError: Says what is to be stated or measured.
    """
    motor = description.motor
    if motor is None:
        return
    if np.any(stroke == 0):  # held
        raise DatasetError(
            f"{file}: some readings are held, and while nothing moves, friction of the gear may take any part of the torque; "
            "leave held readings out where a [motor] takes the place of a load cell."
        )
    bends = np.unique(np.nan_to_num(np.column_stack([rows.route, rows.own.angle])), axis=0)
    if len(bends) > 1:
        return
    remedy = (
        "add readings at other wrap angles, or without the cable (the rope straight from the pulley to the load): rows of a "
        "run of their own whose wrap angles are 0"
    )
    if motor.gear_efficiency is None:
        raise DatasetError(
            f"{file}: all readings have the same wrap angles and gear_efficiency is not stated, so that what the gear of the "
            "motor loses cannot be separated from what the cable loses. State it under [motor] with its error, such as "
            f'gear_efficiency = {{ value = 0.8, unit = "1", sd = 0.05 }}, or {remedy}.'
        )
    ranges = [np.ptp(loads[stroke == way]) / np.max(loads) for way in np.unique(stroke)]
    if motor.gear_friction is None and max(ranges, default=0.0) < _ALIKE:
        raise DatasetError(
            f"{file}: all readings have the same wrap angles and one load, and gear_friction is not stated, so that friction "
            "of the gear cannot be separated from that of the cable. State it under [motor] with its error, as gear_friction = "
            f'{{ value = 0.1, unit = "N*m", sd = 0.02 }}, add readings at other loads, or {remedy}.'
        )


def convert_to_motor_readings(forces: Vector, description: Description) -> tuple[str, Vector]:
    """Return the heading and the numbers of the column that holds the input of a table: forces, torques or currents.

    Args:
        forces: Input forces [N], as `Pulleys.forces` gives them.
        description: The description, with or without a motor.
    """
    motor, radius = description.motor, description.pulleys.input_radius
    if motor is None or radius is None:
        return "input_force_N", forces
    torques = forces * radius / motor.gear_ratio.to("ratio")  # N mm
    if motor.torque_constant is None:
        return "input_torque_N_m", torques / 1000
    return "input_current_A", torques / motor.torque_constant.to("torque_constant")
