"""A wall touch that was measured: what it shows, and what is refused; `test_devices.py` compares it with a fit."""

import numpy as np
import pytest
from measured_touches import HEADS, touch, write_touch

from bowdenfit.addons.device.teleoperate.measured import MeasuredValue, read_measured_contact
from bowdenfit.errors import DatasetError
from bowdenfit.inference.interval import Interval


def test_torque_in_free_motion_and_both_stiffnesses_are_found(tmp_path):
    seen = read_measured_contact(write_touch(tmp_path / "touch.csv", *touch()))
    assert (seen.file, seen.rows) == ("touch.csv", 600)
    assert seen.free_torque.value == pytest.approx(0.1, rel=1e-6)
    assert seen.stiffness.value == pytest.approx(12, rel=1e-6)
    assert seen.wall.value == pytest.approx(95, rel=1e-6)
    assert seen.left_wall == 1  # it was let go


def test_units_are_converted_and_noise_gives_an_error(tmp_path):
    time, master, hand, slave, wall = touch(noise=0.02)
    heads = ("time (ms)", "master angle [deg]", "master torque [N*mm]", "slave angle [deg]", "slave torque [N*mm]")
    columns = (1000 * time, np.degrees(master), 1000 * hand, np.degrees(slave), 1000 * wall)
    seen = read_measured_contact(write_touch(tmp_path / "touch.csv", *columns, heads=heads))
    assert abs(seen.stiffness.value - 12) < 4 * seen.stiffness.error
    assert 0.005 < seen.stiffness.error < 0.5


def test_the_verdict_follows_from_the_interval_and_the_error():
    interval = Interval.of(np.random.default_rng(1).normal(10, 1, 4000))
    assert MeasuredValue(10.5, 0.1).compare(interval) == "agrees"
    assert MeasuredValue(14.0, 0.5).compare(interval) == "above"
    assert MeasuredValue(14.0, 3.0).compare(interval) == "agrees"
    assert MeasuredValue(5.0, 0.5).compare(interval) == "below"


TIME, MASTER, HAND, SLAVE, WALL = touch()
BAD = {
    "a column is missing": ((TIME, MASTER, HAND, SLAVE, WALL), (*HEADS[:4], "force_N"), "has no column slave_torque"),
    "no unit": ((TIME, MASTER, HAND, SLAVE, WALL), (*HEADS[:4], "slave_torque"), "unit"),
    "another unit": ((TIME, MASTER, HAND, SLAVE, WALL), (*HEADS[:4], "slave_torque_N"), "does not measure a torque"),
    "no touch": ((TIME, MASTER, HAND, SLAVE, 0 * WALL), HEADS, "has 0 rows in which the slave presses on the wall"),
    "no motion": (
        (TIME, 0 * MASTER, HAND, SLAVE, WALL),
        HEADS,
        "column master_angle: it is 0 rad in every row in contact",
    ),
    "time goes back": ((TIME[::-1], MASTER, HAND, SLAVE, WALL), HEADS, "touch.csv, row 3, column 'time_s'"),
    "not a number": (
        (TIME, MASTER, np.where(TIME == 1, np.nan, HAND), SLAVE, WALL),
        HEADS,
        "column 'master_torque_N*m'",
    ),
}


@pytest.mark.parametrize("fault", BAD)
def test_what_cannot_be_compared_is_refused_in_a_sentence(fault, tmp_path):
    columns, heads, says = BAD[fault]
    with pytest.raises(DatasetError) as error:
        read_measured_contact(write_touch(tmp_path / "touch.csv", *columns, heads=heads))
    assert says in " ".join(str(error.value).split())
