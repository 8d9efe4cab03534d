"""A wall touch that was measured, torque and position of both ends, next to what the fit says of it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bowdenfit.errors import DatasetError
from bowdenfit.files.columns import Column, find_columns
from bowdenfit.files.headings import Quantity
from bowdenfit.files.tables import read_table
from bowdenfit.inference.interval import NORMAL_90, Interval

COLUMNS = ("time", "master_angle", "master_torque", "slave_angle", "slave_torque")
_QUANTITIES = tuple(
    Quantity(name, dimension, to)
    for name, dimension, to in zip(
        COLUMNS, ("time", "angle", "torque", "angle", "torque"), ("s", "rad", "N*m", "rad", "N*m"), strict=True
    )
)
_IN_CONTACT = 0.1  # of the largest torque of the slave, from which it counts as in contact; a judgement
_LEAST_ROWS = 20  # in contact, and in free motion; a judgement
_BLOCKS = 8  # of successive rows, whose slopes tell the error; a judgement


@dataclass(frozen=True)
class MeasuredValue:
    """What a measured wall touch shows of one quantity.

    Args:
        value: The value.
        error: Its standard error, from blocks of successive rows.
    """

    value: float
    error: float

    def compare(self, interval: Interval) -> str:
        """Return whether it agrees with the 90 % interval of a fit: "agrees", "above" or "below"."""
        if self.value - NORMAL_90 * self.error > interval.q95:
            return "above"
        return "below" if self.value + NORMAL_90 * self.error < interval.q05 else "agrees"


@dataclass(frozen=True)
class MeasuredContact:
    """A wall touch that was measured.

    Args:
        file: Its file.
        rows: How many there are.
        in_contact: Of these, how many in contact.
        free_torque: Median torque of the hand in free motion, without its sign [N m]; None where it touches all the time.
        stiffness: Slope of the master's torque against its angle in contact [N m/rad].
        wall: The same of the slave, which is that of the wall [N m/rad].
        left_wall: How many times the slave left the wall again.
    """

    file: str
    rows: int
    in_contact: int
    free_torque: MeasuredValue | None
    stiffness: MeasuredValue
    wall: MeasuredValue
    left_wall: int


def read_measured_contact(path: Path) -> MeasuredContact:
    """Read a table with a row for each moment, and return what it shows.

    Args:
        path: A table with the columns `COLUMNS` and their units; time may be missing, rows are in its order.

    Raises:
        DatasetError: A column is missing, a cell is no number, or nothing is touched.
    """
    table = read_table(path)
    columns = find_columns(table, _QUANTITIES)
    missing = [name for name in COLUMNS[1:] if name not in columns]
    if missing:
        raise DatasetError(
            f"{table.file} has no column {missing[0]}; a measured wall touch has the headings master_angle_rad, "
            "master_torque_N*m, slave_angle_rad and slave_torque_N*m, in these or other units, and perhaps time_s."
        )
    values = {name: _read(column) for name, column in columns.items()}
    _ = table.account  # which refuses what is wrong with the file
    time = values.get("time")
    if time is not None and np.any(np.diff(time) < 0):
        cell = columns["time"].cells[int(np.argmax(np.diff(time) < 0)) + 1]
        raise cell.refuse(f"the time {cell.shown} is before that of the row above; sort the rows by time.")
    return _evaluate(table.file, *(values[name] for name in COLUMNS[1:]))


def _read(column: Column) -> np.ndarray:
    return np.array(column.read_cells(column.value, np.nan))


def _evaluate(
    file: str, master: np.ndarray, hand_torque: np.ndarray, slave: np.ndarray, wall_torque: np.ndarray
) -> MeasuredContact:
    """Return what a wall touch shows; angles [rad], torques [N m], by row."""
    largest = float(np.max(np.abs(wall_torque), initial=0.0))
    touches = np.abs(wall_torque) > _IN_CONTACT * largest
    if np.count_nonzero(touches) < _LEAST_ROWS:
        raise DatasetError(
            f"{file} has {np.count_nonzero(touches)} rows in which the slave presses on the wall, with more than "
            f"{100 * _IN_CONTACT:.0f} % of its largest torque, and {_LEAST_ROWS} are needed; record a longer touch, and check "
            "that slave_torque is the torque on the wall."
        )
    for name, angle in (("master_angle", master), ("slave_angle", slave)):
        if not np.ptp(angle[touches]) > 0:
            raise DatasetError(
                f"{file}, column {name}: it is {angle[touches][0]:g} rad in every row in contact, so no stiffness follows; "
                "record while the hand presses and lets go."
            )
    free = ~touches
    torque = np.abs(hand_torque[free])
    left = int(np.count_nonzero(np.diff(touches.astype(int)) < 0))
    return MeasuredContact(
        file, len(master), int(np.count_nonzero(touches)),
        _by_blocks(np.median, torque) if len(torque) >= _LEAST_ROWS else None,
        _by_blocks(_slope, master[touches], hand_torque[touches]),
        _by_blocks(_slope, slave[touches], wall_torque[touches]), left,
    )  # fmt: skip


def _slope(angle: np.ndarray, torque: np.ndarray) -> float:
    """Return the slope of a straight line by least squares, without its sign [N m/rad]."""
    turned = angle - angle.mean()
    squares = float(turned @ turned)
    return abs(float(turned @ torque)) / squares if squares > 0 else np.nan


def _by_blocks(statistic: Callable[..., float], *columns: np.ndarray) -> MeasuredValue:
    """Return a statistic with its jackknife error over blocks of successive rows, which are not independent singly.

    Blocks without which nothing moves are left out.
    """
    blocks = np.array_split(np.arange(len(columns[0])), _BLOCKS)
    without = np.array([float(statistic(*(np.delete(column, block) for column in columns))) for block in blocks])
    without = without[np.isfinite(without)]
    value = float(statistic(*columns))
    if len(without) < _BLOCKS / 2:  # it moves in so few that these determine it
        return MeasuredValue(value, abs(value))
    return MeasuredValue(value, float(np.sqrt((_BLOCKS - 1) / _BLOCKS * np.sum((without - without.mean()) ** 2))))
