"""Ring-down, in which the released joint swings against the rope: how it is checked and described."""

from typing import Any

import numpy as np
from typing_extensions import override

from bowdenfit.description import Description
from bowdenfit.description.file import Stated
from bowdenfit.errors import DatasetError
from bowdenfit.files.columns import Quantity
from bowdenfit.kinds.init_questions import InitQuestions, WantedColumn
from bowdenfit.kinds.kind import Kind, Readings, Source, TableFromFiles
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.pages import Page
from bowdenfit.kinds.ringdown.table import RingDownSettings, RingDownTable, read_ring_down
from bowdenfit.kinds.rows import RUN
from bowdenfit.words import counted


class RingDownKind(Kind[RingDownTable]):
    """The angle of a released joint, or the torque in its rope, against time."""

    name = "ringdown"
    table = RingDownTable
    settings = RingDownSettings
    readings = (
        Readings("ringdown", "ringdown", "readings of the ring-down", "the reading at {}", "Angle (rad) or torque (N m)"),
    )
    methods_sentence = (
        "The joint, released from rest with the motor held, was a mass on a spring with viscous damping and dry friction, "
        "whose free vibration was solved exactly from one reversal to the next."
    )
    init_questions = InitQuestions(
        "the angle of a released joint, or the torque in its rope, against time",
        (
            WantedColumn(Quantity("time", "time"), "the time"),
            WantedColumn(Quantity("angle", "angle"), "the angle of the joint", (Quantity("torque", "torque"),)),
            RUN,
        ),
        is_guessed=False,
    )

    @override
    def read(self, source: Source) -> TableFromFiles[RingDownTable]:
        return read_ring_down(source)

    @override
    def describe(self, table: RingDownTable, description: Description) -> list[str]:
        """Return the runs with their half swings."""
        what, file = "torque" if table.is_torque else "angle", table.origin.files[0]
        lines = []
        for run in range(len(table.added)):
            n, half = table.half_swings(run)
            more = f", {table.added[run]:.4g} kg m^2 added" if table.added[run] else ""
            rows = counted(int(np.sum(table.run == run)), "reading")
            lines.append(f"{file}: {rows} of the {what} after a release, {n} half swings of {1000 * half:.3g} ms{more}")
        return lines

    @override
    def count_readings(self, table: RingDownTable) -> str:
        return f"{counted(len(table.time), 'reading')} of a ring-down"

    @override
    def quantities(self, settings: Any, description: Description) -> list[Stated]:
        return [("tables, ringdown, inertia", settings.inertia, "inertia")]

    @override
    def check(self, table: RingDownTable, description: Description, measurements: Measurements) -> None:
        """Refuse ring-downs that tell no inertia, and so neither stiffness nor damping.

        Raises:
            DatasetError: The inertia is not stated, and not found by adding a known one.
        """
        if np.isnan(table.inertia) and len(np.unique(table.added)) < 2:
            raise DatasetError(
                f"{table.origin.files[0]}: a ring-down tells stiffness and damping in proportion to the inertia of what "
                'swings, which is not known. State it under [tables], ringdown = { file = "...", inertia = { value = 1.0e-3, '
                'sd = 5e-5, unit = "kg*m^2" } }, or record a second ring-down with a known inertia added to the joint (columns '
                "run and added_inertia)."
            )

    @override
    def why_implausible(self, measured: RingDownTable, simulated: RingDownTable) -> str:
        return "" if np.ptp(simulated.reading) > np.ptp(measured.reading) / 5 else "the joint hardly swings"

    @override
    def file_rows(self, table: RingDownTable, description: Description) -> Page:
        what = "torque_N_m" if table.is_torque else "angle_deg"
        shown = table.reading if table.is_torque else np.rad2deg(table.reading)
        added = table.added[table.run]
        rows = zip(table.run, table.time, shown, added, strict=True)
        return (
            ["run", "time_s", what, "added_inertia (kg*m^2)"],
            [[str(run + 1), f"{time:.7g}", f"{reading:.7g}", f"{more:.7g}"] for run, time, reading, more in rows],
        )
