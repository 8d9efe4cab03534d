"""Numbers with their unit or error in the cell: read in that unit, or refused where heading and cells contradict each other."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.files.measured_cells import split_measured
from bowdenfit.kinds.efficiencies.kind import EfficiencyTable
from bowdenfit.kinds.forces.table import ForceTable


@pytest.mark.parametrize(
    ("text", "number", "unit", "error"),
    [
        ("20 N", "20", "N", ""),
        ("20N", "20", "N", ""),
        ("−1.5e2 kN", "−1.5e2", "kN", ""),
        ("45°", "45", "°", ""),
        ("<10 deg", "<10", "deg", ""),
        ("2 1/4 turns", "2 1/4", "turns", ""),
        ("2 lb 8 oz", "2.5", "lb", ""),
        ("5 ft 3 in", "5.25", "ft", ""),
        ("45° 30'", "45.5", "°", ""),
        ("10 ± 0.2", "10", "", "0.2"),
        ("10,5 +/- 0,2 N", "10,5", "N", "0,2"),
        ("(10 +- 0.2) N", "10", "N", "0.2"),
        ("10 N ± 0.2 N", "10", "N", "0.2"),
        ("78 % ± 2 %", "78 %", "", "2 %"),
    ],
)
def test_a_number_is_divided_from_its_unit_and_error(text, number, unit, error):
    parts = split_measured(text)
    assert parts is not None and (parts.number, parts.unit, parts.error) == (number, unit, error)


@pytest.mark.parametrize(
    "text",
    ["20", "78 %", "78.5%", "1 A", "1a", "2c", "3 B", "N", "rope 3", "3 ropes", "20 ± 2 %", "10 N ± 2 mm", "12:30",
     "2024-03-01", "2 lb 18 oz", "10 ±", "± 2", "1.2.3 N", "20 degC", "", "1st", "10 - 20 N"],
)  # fmt: skip
def test_anything_else_is_left_as_it_is(text):
    assert split_measured(text) is None


def forces(path, **more):
    return bf.read(path, **more).measurements.table(ForceTable)


def write(tmp_path, *rows):
    (tmp_path / "t.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    return tmp_path / "t.csv"


def test_units_in_cells_do_where_headings_have_none(tmp_path):
    rows = "90°,0.02 kN,17 N,", "180°,0.04 kN,28.5 N,rope hot", "180 deg,0.03 kN,21.5 N,"
    path = write(tmp_path, "wrap_angle,Input force,Output force,note", *rows)
    table = forces(path)
    assert np.allclose(table.input_force, [20, 40, 30]) and np.allclose(table.output_force, [17, 28.5, 21.5])
    assert np.allclose(table.own.angle[:, 0], [np.pi / 2, np.pi, np.pi])


def test_a_column_of_units_alone_is_a_table(tmp_path):
    table = forces(write(tmp_path, "Input force,Output force", "20 N,15 N", "", "40 N,30 N", "60 N,45 N"), wrap_angle="180deg")
    assert table.input_force.tolist() == [20, 40, 60]


@pytest.mark.parametrize(
    ("rows", "case"),
    [
        (("input_force_N,output_force_N", "20 N,3.2 lbf", "40 N,6.4 lbf"), "'3.2 lbf' is in .* than its column, which is in N"),
        (("input_force_N,output_force", "20,15 N", "40,6.4 lbf"), "row 3, .*'6.4 lbf' is in another unit than its column"),
        (("input_force_N,output_force", "20,15 N", "40,31"), "'31' has no unit, and others of the column are in N"),
        (("input_force,output_force", "2 kg,1.5 kg", "4 kg,3 kg"), "write kgf.*: --column input_force=input_force:kgf"),
        (("input_force_N,output_force_N", "20,15 mm", "40,31 mm"), "'15 mm' is in another unit"),
    ],
)
def test_cells_that_contradict_their_column_are_refused(tmp_path, rows, case):
    with pytest.raises(bf.DatasetError, match=case):
        forces(write(tmp_path, *rows), wrap_angle="180deg")


def test_cells_may_have_the_unit_of_their_heading_or_none(tmp_path):
    table = forces(write(tmp_path, "input_force_N,output_force_N", "20,15 N", "40,31", "60 N,44.2 N"), wrap_angle="180deg")
    assert table.output_force.tolist() == [15, 31, 44.2]


def test_a_weight_is_read_once_it_is_said_to_be_one(tmp_path):
    path = write(tmp_path, "input_force,output_force", "2 lb 8 oz,2 lb", "5 lb,3 lb 12 oz", "7 lb 8 oz,6 lb")
    table = forces(path, wrap_angle="180deg", columns=["input_force=input_force:lbf", "output_force=output_force:lbf"])
    assert np.allclose(table.input_force, 4.4482216 * np.array([2.5, 5, 7.5]))
    assert np.allclose(table.output_force, 4.4482216 * np.array([2, 3.75, 6]))


def test_an_error_behind_a_wrap_angle_or_an_efficiency_is_its_standard_deviation(tmp_path):
    path = write(tmp_path, "wrap_angle;Wirkungsgrad", "45 ± 2°;92,5 % ± 1 %", "90 ± 2°;85,5 %", "180 ± 3 °;(73 ± 2) %")
    data = bf.read(path)
    table = data.measurements.table(EfficiencyTable)
    assert np.allclose(table.efficiency, [0.925, 0.855, 0.73]) and np.allclose(table.sd, [0.01, 0, 0.02])
    assert np.allclose(np.rad2deg(table.own.sd[:, 0]), [2, 2, 3])
    assert any("is taken for one standard deviation" in remark for remark in data.measurements.remarks)


def test_errors_of_one_force_alone_are_said_not_to_be_used(tmp_path):
    in_cells = write(tmp_path, "input_force_N,output_force_N", "20,15 ± 0.2", "40,31 ± 0.2", "60,44 ± 0.3")
    remarks = bf.read(in_cells, wrap_angle="180deg").measurements.remarks
    assert any("'output_force_N ±' are not used" in remark for remark in remarks)
    in_a_column = write(tmp_path, "input_force_N,output_force_N,output_force_sd_N", "20,15,0.2", "40,31,0.2", "60,44,0.3")
    remarks = bf.read(in_a_column, wrap_angle="180deg").measurements.remarks
    assert any("'output_force_sd_N' are not used" in remark for remark in remarks)


def test_an_error_is_refused_where_nothing_reads_it_or_it_stands_twice(tmp_path):
    twice = write(tmp_path, "wrap_angle_deg,wrap_angle_sd_deg,efficiency", "45 ± 2,2,0.92", "90 ± 2,2,0.86")
    with pytest.raises(bf.DatasetError, match="the column 'wrap_angle_sd_deg' has it too"):
        bf.read(twice)
    unread = write(tmp_path, "velocity [mm/s],input_force_N,output_force_N", "1.0 ± 0.1,20,15", "2.0 ± 0.1,20,15")
    with pytest.raises(bf.DatasetError, match=r"'1\.0 ± 0\.1' has an error behind the number, which nothing reads there"):
        forces(unread, wrap_angle="180deg")


def test_headings_may_hold_angles_and_labels_may_look_like_units(tmp_path):
    path = write(tmp_path, "run,input_force_N,output_force_N", "1a,20,15", "1b,20,15.5", "2 A,40,31", "45 deg,40,30")
    assert forces(path, wrap_angle="180deg").run_names == ("1a", "1b", "2 A", "45 deg")
