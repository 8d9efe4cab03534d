"""Ring-down: the joint is released against the rope, and swings until damping and friction have stopped it."""

from bowdenfit.files.columns import Quantity
from bowdenfit.kinds.asked import Asked, Wanted
from bowdenfit.kinds.kind import Kind
from bowdenfit.kinds.readings import Readings
from bowdenfit.kinds.ringdown.table import RingDownSettings, RingDownTable, read_ring_down
from bowdenfit.kinds.ringdown.words import check, describe, implausible, page
from bowdenfit.kinds.rows import RUN
from bowdenfit.words import counted

RINGDOWN = Kind(
    name="ringdown",
    table=RingDownTable,
    readings=(
        Readings("ringdown", "ringdown", "readings of the ring-down", "the reading at {}", "Angle (rad) or torque (N m)"),
    ),
    read=read_ring_down,
    settings=RingDownSettings,
    quantities=lambda said, _: [("tables, ringdown, inertia", said.inertia, "inertia")],
    describe=describe,
    check=check,
    method=(
        "The joint, released from rest with the motor held, was a mass on a spring with viscous damping and dry friction, "
        "whose free vibration was solved exactly from one reversal to the next."
    ),
    implausible=implausible,
    page=page,
    asked=Asked(
        "the angle of a released joint, or the torque in its rope, against time",
        (
            Wanted(Quantity("time", "time"), "the time"),
            Wanted(Quantity("angle", "angle"), "the angle of the joint", (Quantity("torque", "torque"),)),
            RUN,
        ),
        is_guessed=False,
    ),
    count=lambda table: f"{counted(len(table.time), 'reading')} of a ring-down",
)
