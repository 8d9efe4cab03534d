"""Ring-down: the released joint swings against the rope, the motor held; how it is read, checked and described."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from typing_extensions import override

from bowdenfit.description import Description, Table
from bowdenfit.description.file import Stated
from bowdenfit.description.values import QuantityValue
from bowdenfit.errors import DatasetError
from bowdenfit.files.columns import Column, Quantity, require_column
from bowdenfit.files.row_account import RowAccount
from bowdenfit.files.tables import RawTable
from bowdenfit.kinds.kind import Kind, Readings
from bowdenfit.kinds.rows import FileRows, RowOrigin, number_names, origin_of_rows, read_labels
from bowdenfit.kinds.table_files import RUN, InitQuestions, Source, TableFromFiles, WantedColumn
from bowdenfit.kinds.tables import Measurements
from bowdenfit.types import Labels, Vector
from bowdenfit.words import counted

# Least rows of a run, half swings, and rows a half swing. Three half swings give the two equations that damping and friction
# need (`estimate_decay`); the numbers of rows are judgements.
_FEWEST_ROWS, _FEWEST_HALF_SWINGS, _FEWEST_A_HALF_SWING = 20, 3, 4
_STILL = 0.1  # share of the largest deflection below which crossings are taken for noise; a judgement
_UNUSED = ("position", "velocity")  # columns that such a table may have and that nothing reads


class RingDownSettings(Table):
    """The table of a ring-down, and the inertia of what swings where that is known."""

    inertia: QuantityValue | None = None


@dataclass(frozen=True)
class RingDownTable:
    """Ring-downs of a bar that swings against the rope, the motor held.

    Args:
        time: Since the first row of the run [s].
        reading: Angle [rad], or torque in the rope [N m].
        is_torque: Which of the two.
        run: Number of the run of each row.
        added: Inertia that was added to the bar in each run [kg m^2].
        inertia: That of the bar, as stated [kg m^2]; NaN where it is not.
        inertia_sd: Its standard deviation; NaN where it is not stated, or is none.
        origin: Where each row was read.
    """

    time: Vector
    reading: Vector
    is_torque: bool
    run: Labels
    added: Float[np.ndarray, " runs"]
    inertia: float
    inertia_sd: float
    origin: RowOrigin

    def measure_half_swings(self, run: int) -> tuple[int, float]:
        """Return the number of half swings of a run, and how long one takes [s]."""
        rows = self.run == run
        time, reading = self.time[rows], self.reading[rows]
        away = reading - np.median(reading[-max(len(reading) // 10, 3) :])
        large = np.abs(away) > _STILL * np.max(np.abs(away))
        at, left = time[large], away[large]
        turned = np.flatnonzero(np.diff(np.sign(left)) != 0)
        if len(turned) < 2:
            return len(turned), float("nan")
        share = left[turned] / (left[turned] - left[turned + 1])
        crossings = at[turned] + share * (at[turned + 1] - at[turned])
        first = crossings[: max(2, (len(crossings) + 1) // 2)]  # later ones are more by noise and friction
        return len(turned), float(np.polyfit(np.arange(len(first)), first, 1)[0])


def read_ring_down(source: Source) -> TableFromFiles[RingDownTable]:
    """Read a table of one ring-down, or of several by the column `run`; the first row of each is its release.

    Args:
        source: Where it is.

    Raises:
        DatasetError: See `read_table` and `find_columns`; or time does not grow, a run has several added inertias, or too
            little is seen of it.
    """
    path = source.file
    ends = Quantity("angle", "angle"), Quantity("torque", "torque")
    optional_columns = Quantity("run", "text"), Quantity("added_inertia", "inertia")
    table, columns = source.read_table(path, (Quantity("time", "time"), *ends, *optional_columns), _UNUSED)
    if ("angle" in columns) == ("torque" in columns):
        raise DatasetError(
            f"{table.file} needs the angle of the joint (angle_deg), or the torque in the rope (torque_N_m), and has "
            f"{'both; leave one of the two columns out' if 'angle' in columns else 'neither'}."
        )
    clock = require_column(table, columns, "time", "time_s")
    time = np.asarray(clock.numbers())
    is_torque = "torque" in columns
    reading = np.asarray(columns["torque" if is_torque else "angle"].numbers()) / (1000.0 if is_torque else 1.0)
    run, names = _read_runs(columns, len(table.rows))
    added = np.asarray(columns["added_inertia"].numbers()) if "added_inertia" in columns else np.zeros(len(time))
    table.faults.refuse()
    releases = [_find_release(clock, table.file, name, run == i, time, added) for i, name in enumerate(names)]
    starts = np.array([start for start, _ in releases])
    stated, inertia, sd = source.settings.inertia, np.nan, np.nan
    if stated is not None:
        inertia, sd = stated.to("inertia"), stated.sd_to("inertia") or np.nan
    more = np.array([more for _, more in releases])
    made = RingDownTable(time - starts[run], reading, is_torque, run, more, inertia, sd, origin_of_rows(table))
    for i, name in enumerate(names):
        _check_swings(table, name, made, i)
    return TableFromFiles(made, {path.name: path}, accounts=(_count_from_releases(table.account, made, starts),))


def _read_runs(columns: Mapping[str, Column], n: int) -> tuple[Labels, tuple[str, ...]]:
    if "run" not in columns:
        return np.zeros(n, dtype=int), ("",)
    return number_names(read_labels(columns["run"].cells, ""))


def _find_release(clock: Column, file: str, name: str, in_run: np.ndarray, time: Vector, added: Vector) -> tuple[float, float]:
    """Return the time of the release [s] and the added inertia of a run [kg m^2]."""
    called, rows = (f"{file}, run {name!r}" if name else file), np.flatnonzero(in_run)
    back = np.flatnonzero(np.diff(time[rows]) <= 0)
    if len(back):
        raise clock.cells[rows[back[0] + 1]].refuse(
            f"time does not grow here, {time[rows[back[0] + 1]]:g} s after {time[rows[back[0]]]:g} s; sort the rows by time, "
            "and give each ring-down a name of its own in a column run."
        )
    if np.ptp(added[in_run]) > 0:
        raise DatasetError(
            f"{called} has several added inertias; give each ring-down a name of its own in a column run."
        )
    if np.any(added[in_run] < 0):
        words = f"the added inertia {added[rows[0]]:g} kg m^2 is negative; write what was added to the joint"
        raise DatasetError(f"{called}: {words}.")
    return float(time[rows[0]]), float(added[rows[0]])


def _count_from_releases(account: RowAccount, table: RingDownTable, starts: Vector) -> RowAccount:
    """Return the account with the run of each reading that the user leaves out, its time since the release, and torque in N m.

    It is of the run of the row above; of that of the row below where time goes back to it, as at the start of a run.

    Args:
        account: Of the file.
        table: Its other readings.
        starts: When each run was released [s].
    """
    excluded, last = [], len(table.time) - 1
    for reading in account.excluded:
        values, below = dict(reading.values), int(np.searchsorted(table.origin.row, reading.row))
        run = table.run[max(below - 1, 0)]
        if "time" in values and values["time"] < starts[run] + table.time[max(below - 1, 0)]:
            run = table.run[min(below, last)]
        for name, start, unit in (("time", starts[run], 1.0), ("torque", 0.0, 1000.0)):
            if name in values:
                values[name] = float(values[name] - start) / unit
        excluded.append(replace(reading, values=values | {"run": float(run)}))
    return replace(account, excluded=tuple(excluded))


def _check_swings(table: RawTable, name: str, made: RingDownTable, run: int) -> None:
    """Refuse a run that shows too little to separate damping from friction."""
    called, rows = (f"{table.file}, run {name!r}" if name else table.file), int(np.sum(made.run == run))
    reading = made.reading[made.run == run]
    if rows < _FEWEST_ROWS or np.ptp(reading) == 0:
        seen = "nothing changes" if rows >= _FEWEST_ROWS else f"there are {rows}"
        raise DatasetError(
            f"{called}: a ring-down needs at least {_FEWEST_ROWS} rows in which the joint swings, and here {seen}; record "
            "from the release on, at 1 kHz or so."
        )
    seen_half_swings, half = made.measure_half_swings(run)
    if seen_half_swings < _FEWEST_HALF_SWINGS:
        raise DatasetError(
            f"{called}: the joint reverses {seen_half_swings} times before it stops; separating damping from "
            f"friction takes at least {_FEWEST_HALF_SWINGS}; pull it further before the release, or add inertia "
            "to it (column added_inertia)."
        )
    step = float(np.median(np.diff(made.time[made.run == run])))
    if half < _FEWEST_A_HALF_SWING * step:
        raise DatasetError(
            f"{called}: a half swing takes {1000 * half:.3g} ms, and rows are {1000 * step:.3g} ms apart; record at least "
            f"{_FEWEST_A_HALF_SWING} rows a half swing."
        )


class RingDownKind(Kind[RingDownTable]):
    """The angle of a released joint, or the torque in its rope, against time."""

    name = "ringdown"
    table = RingDownTable
    settings = RingDownSettings
    readings = (
        Readings(
            "ringdown", "ringdown", "readings of the ring-down", "the reading at {}", "Angle (rad) or torque (N m)"
        ),
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
        noun, file = "torque" if table.is_torque else "angle", table.origin.files[0]
        lines = []
        for run in range(len(table.added)):
            n, half = table.measure_half_swings(run)
            more = f", {table.added[run]:.4g} kg m^2 added" if table.added[run] else ""
            rows = counted(int(np.sum(table.run == run)), "reading")
            lines.append(f"{file}: {rows} of the {noun} after a release, {n} half swings of {1000 * half:.3g} ms{more}")
        return lines

    @override
    def count_readings(self, table: RingDownTable) -> str:
        return f"{counted(len(table.time), 'reading')} of a ring-down"

    @override
    def quantities(self, settings: Any, description: Description) -> list[Stated]:
        return [("tables, ringdown, inertia", settings.inertia, "inertia")]

    @override
    def check(self, table: RingDownTable, description: Description, measurements: Measurements) -> None:
        """Refuse ring-downs that leave the inertia unknown, and with it stiffness and damping.

        Raises:
            DatasetError: The inertia is not stated, and not found by adding a known one.
        """
        if np.isnan(table.inertia) and len(np.unique(table.added)) < 2:
            raise DatasetError(
                f"{table.origin.files[0]}: a ring-down determines stiffness and damping only in proportion to the inertia of "
                "what "
                'swings, which is not known. State it under [tables], ringdown = { file = "...", inertia = { value = 1.0e-3, '
                'sd = 5e-5, unit = "kg*m^2" } }, or record a second ring-down with a known inertia added to the joint (columns '
                "run and added_inertia)."
            )

    @override
    def why_implausible(self, measured: RingDownTable, simulated: RingDownTable) -> str:
        return "" if np.ptp(simulated.reading) > np.ptp(measured.reading) / 5 else "the joint barely swings"

    @override
    def file_rows(self, table: RingDownTable, description: Description) -> FileRows:
        what = "torque_N_m" if table.is_torque else "angle_deg"
        shown = table.reading if table.is_torque else np.rad2deg(table.reading)
        added = table.added[table.run]
        rows = zip(table.run, table.time, shown, added, strict=True)
        return (
            ["run", "time_s", what, "added_inertia (kg*m^2)"],
            [[str(run + 1), f"{time:.7g}", f"{reading:.7g}", f"{more:.7g}"] for run, time, reading, more in rows],
        )
