"""Ring-downs in words and in rows: what was read, what it cannot tell, how a file says it."""

import numpy as np

from bowdenfit.description import Description
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.pages import Page
from bowdenfit.kinds.ringdown.table import RingDownTable
from bowdenfit.words import counted


def describe(table: RingDownTable, description: Description) -> list[str]:
    """Runs with their half swings."""
    del description
    what, file = "torque" if table.is_torque else "angle", table.origin.files[0]
    lines = []
    for run in range(len(table.added)):
        n, half = table.half_swings(run)
        more = f", {table.added[run]:.4g} kg m^2 added" if table.added[run] else ""
        rows = counted(int(np.sum(table.run == run)), "reading")
        lines.append(f"{file}: {rows} of the {what} after a release, {n} half swings of {1000 * half:.3g} ms{more}")
    return lines


def check(table: RingDownTable, description: Description, measurements: Measurements) -> None:
    """Refuse ring-downs that tell no inertia, and so neither stiffness nor damping.

    Raises:
        DatasetError: The inertia is not stated, and not found by adding a known one.
    """
    del description, measurements
    if np.isnan(table.inertia) and len(np.unique(table.added)) < 2:
        raise DatasetError(
            f"{table.origin.files[0]}: a ring-down tells stiffness and damping in proportion to the inertia of what swings, "
            'which is not known. State it under [tables], ringdown = { file = "...", inertia = { value = 1.0e-3, sd = 5e-5, '
            'unit = "kg*m^2" } }, or record a second ring-down with a known inertia added to the joint (columns run and '
            "added_inertia)."
        )


def implausible(real: RingDownTable, made: RingDownTable) -> str:
    """A bar that hardly swings."""
    return "" if np.ptp(made.reading) > np.ptp(real.reading) / 5 else "the joint hardly swings"


def page(table: RingDownTable, description: Description) -> Page:
    """Headings and rows of its file."""
    del description
    what = "torque_N_m" if table.is_torque else "angle_deg"
    shown = table.reading if table.is_torque else np.rad2deg(table.reading)
    added = table.added[table.run]
    rows = zip(table.run, table.time, shown, added, strict=True)
    return (
        ["run", "time_s", what, "added_inertia (kg*m^2)"],
        [[str(run + 1), f"{time:.7g}", f"{reading:.7g}", f"{more:.7g}"] for run, time, reading, more in rows],
    )
