"""Codes that stand where a reading is missing, once the user states them: such cells are blank, and it is said how many."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.recordings.recording import Recordings

TABLE = """wrap_angle_deg,run,velocity [mm/s],input_force_N,output_force_N
45,1,5,20,18.1
45,1,-9999,40,36
45,1,5,40,-9999.00
90,2,5,20,16.3
90,-9999,5,40,33
90,2,5,Err,48.5
"""
TOML = """schema = 1
name = "bench"
[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { column = "wrap_angle" }
[tables]
forces = { file = "t.csv", missing = [-9999, "Err"] }
"""


def read(tmp_path, text=TABLE, **keywords):
    (tmp_path / "t.csv").write_text(text)
    return bf.read(tmp_path / "t.csv", **keywords)


def assert_left_out(dataset):
    table = dataset.measurements.table(ForceTable)
    assert table.origin.row.tolist() == [2, 3, 5, 6]
    assert table.output_force.tolist() == [18.1, 36, 16.3, 33]
    assert np.isnan(table.velocity).tolist() == [False, True, False, False]
    assert "-9999" in table.run_names  # a label, and no number
    (account,) = dataset.accounts
    assert account.read == 4 and account.accounted == 7
    assert "t.csv, row 4: '-9999.00' is stated as a missing-value code; not used." in dataset.measurements.remarks
    assert "t.csv, row 7: 'Err' is stated as a missing-value code; not used." in dataset.measurements.remarks
    assert any("1 cell with a stated missing-value code" in remark for remark in dataset.measurements.remarks)


@pytest.mark.parametrize("codes", [["-9999", "err"], [-9999, "Err"]])
def test_rows_with_a_stated_code_in_a_force_are_left_out_and_others_are_blank(tmp_path, codes):
    assert_left_out(read(tmp_path, missing=codes))


def test_codes_may_be_stated_in_the_description(tmp_path):
    (tmp_path / "t.csv").write_text(TABLE)
    (tmp_path / "cable.toml").write_text(TOML)
    assert_left_out(bf.read(tmp_path))


def test_codes_of_the_command_line_are_added_to_those_of_the_description(tmp_path):
    (tmp_path / "t.csv").write_text(TABLE)
    (tmp_path / "cable.toml").write_text(TOML.replace('-9999, "Err"', '"Err"'))
    with pytest.raises(bf.DatasetError, match=r"is a code .* --missing -9999.00 \(in cable.toml missing = \[-9999.00\]"):
        bf.read(tmp_path)
    assert_left_out(bf.read(tmp_path, missing=["-9999"]))


def test_a_code_that_no_cell_holds_is_said(tmp_path):
    remarks = read(tmp_path, TABLE.replace("Err", "60"), missing=[-9999, -77]).measurements.remarks
    assert not any("no cell" in remark for remark in remarks)
    remarks = read(tmp_path, TABLE.replace("Err", "60").replace("-9999", "30"), missing=[-77]).measurements.remarks
    assert "t.csv: no cell of a number that is read holds the stated missing-value code '-77'." in remarks


@pytest.mark.parametrize(
    ("codes", "reason"), [(["45", "90"], "every row holds a stated missing-value code"), ([None], "a list")]
)
def test_a_code_that_every_row_holds_is_refused(tmp_path, codes, reason):
    with pytest.raises(bf.BowdenfitError, match=reason):
        read(tmp_path, missing=codes)


@pytest.mark.parametrize("code", ["true", "nan"])
def test_a_code_in_the_description_is_a_number_or_a_word(tmp_path, code):
    (tmp_path / "t.csv").write_text(TABLE)
    (tmp_path / "cable.toml").write_text(TOML.replace('"Err"', code))
    with pytest.raises(bf.DescriptionError, match="missing"):
        bf.read(tmp_path)


def test_check_says_how_many_and_its_command_repeats_the_code(tmp_path, run):
    (tmp_path / "t.csv").write_text(TABLE.replace("Err", "60"))
    code, out, _ = run("check", tmp_path / "t.csv", "--missing", "-9999")
    assert code == 0
    assert "Of 7 rows 5 hold readings" in out
    assert "Not used: row 4: '-9999.00' is stated as a missing-value code." in out
    assert "1 cell with a stated missing-value code ('-9999') count" in out
    assert "--missing -9999" in out.partition("To fit it:")[2]
    assert "-9999 " not in out.partition("First row")[0]  # lowest values are those of readings


def test_a_blank_angle_is_below_the_limit_but_a_code_says_nothing(tmp_path):
    (tmp_path / "a.csv").write_text("cable_length_mm,angle_deg\n440,-99\n450,<10\n460,20\n470,30\n480,20\n")
    (tmp_path / "e.csv").write_text("cable_length_mm,efficiency\n450,0.9\n470,0.8\n480,-99\n")
    (tmp_path / "cable.toml").write_text(
        'schema = 1\nname = "bench"\n[route]\nvariable = "cable_length"\nunit = "mm"\nrange = [430, 490]\n'
        '[[contact]]\nname = "sheath"\nfriction = "mu"\nwrap_angle = { curve = "gaussian", column = "angle" }\n'
        '[tables]\nangles = { file = "a.csv" }\nefficiencies = { file = "e.csv" }\n'
    )
    dataset = bf.read(tmp_path, missing=["-99"])
    assert [len(table.route) for table in dataset.measurements.tables] == [4, 2]


def recording(tmp_path):
    """A recording in pounds whose output misses three samples."""
    time, pounds = np.arange(2000) / 100, 40 + 20 * np.sin(2 * np.pi * np.arange(2000) / 500)
    moves = np.sign(np.gradient(pounds))
    noise = np.random.default_rng(1).normal(0, 0.05, (2, 2000))
    input_force, output_force = pounds * np.exp(0.2 * moves) + noise[0], pounds + noise[1]
    output_force[[100, 500, 501]] = -9999
    rows = np.column_stack([time, input_force, output_force])
    head = "time_s,input_force_lbf,output_force_lbf"
    np.savetxt(tmp_path / "r.csv", rows, delimiter=",", header=head, comments="", fmt="%.4f")
    return tmp_path / "r.csv"


def test_samples_with_a_stated_code_are_missing(tmp_path):
    path = recording(tmp_path)
    with pytest.raises(bf.DatasetError, match=r"3 samples of output_force are exactly .* --missing -9999"):
        bf.read(path, wrap_angle="180deg")
    dataset = bf.read(path, wrap_angle="180deg", missing=[-9999])
    assert any("3 samples of 'output_force_lbf' hold a stated missing-value code" in r for r in dataset.measurements.remarks)
    (item,) = dataset.measurements.table(Recordings).items
    assert item.account.remarks is not None and np.nanmin(item.blocks.output_force) > 50


def test_a_code_of_samples_is_a_number_and_leaves_the_clock_alone(tmp_path):
    path = recording(tmp_path)
    with pytest.raises(bf.DatasetError, match="'Err' is stated as a missing-value code, and samples"):
        bf.read(path, wrap_angle="180deg", missing=["Err", "-9999"])
    remarks = bf.read(path, wrap_angle="180deg", missing=["-9999", "0"]).measurements.remarks
    assert not any("time_s" in remark for remark in remarks if "missing-value" in remark)
