"""Layouts that laboratories have sent, each beside a twin that must be read, or refused, as before."""

import h5py
import numpy as np
import openpyxl
import pytest
import scipy.io

import bowdenfit as bf
from bowdenfit.files import read_channels
from bowdenfit.files.cells import parse_number
from bowdenfit.files.serial_log import is_serial_log, split_line
from bowdenfit.files.tables import read_table

pytestmark = pytest.mark.extended

TIME = np.arange(0, 16, 0.05)
INPUT = 40 + 20 * np.sin(2 * np.pi * TIME / 8)
OUTPUT = np.empty_like(INPUT)
state = INPUT[0] / 1.4
for row, force in enumerate(INPUT):
    OUTPUT[row] = state = min(max(state, force / 1.4), force * 1.4)
TABLE = "input_force_N,output_force_N\n20,14.1\n40,28.0\n60,42.2\n"


def write(folder, text, name="log.csv"):
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder / name


@pytest.mark.parametrize(
    ("text", "decimal", "number"),
    [
        ("1 003,6", ",", 1003.6),
        ("1\u202f003,6", ",", 1003.6),
        ("1,002.84", ".", 1002.84),
        ("1.002,84", ",", 1002.84),
        ("-12'002", ".", -12002.0),
        ("1,002", ".", None),  # 1.002 or 1002
        ("1.002", ",", None),
        ("1,02.84", ".", None),
        ("1,002.84", ",", None),
    ],
)
def test_thousands_of_recordings_are_read_where_their_separator_is_no_decimal_mark(text, decimal, number):
    assert parse_number(text, decimal) == number


def test_nul_bytes_behind_the_last_row_are_left_out_and_reported_and_refused_anywhere_else(tmp_path):
    path = write(tmp_path, TABLE.encode() + bytes(70_000))
    assert len(read_table(path).rows) == 3
    data = bf.read(path, wrap_angle="180deg")
    assert "70000 NUL bytes behind the last row" in " ".join(data.measurements.remarks)
    for text in (TABLE.encode() + bytes(16) + b"80,56.1\n", bytes(300), b"\x00" + TABLE.encode()):
        with pytest.raises(bf.DatasetError, match=r"not a text file|not in UTF-8|empty"):
            read_table(write(tmp_path, text))
    wide = write(tmp_path, TABLE.encode("utf-16"))
    assert len(read_table(wide).rows) == 3


def test_a_recording_ends_before_its_nul_bytes(tmp_path):
    rows = [f"{t:.2f},{a:.3f},{b:.3f}\n" for t, a, b in zip(TIME, INPUT, OUTPUT, strict=True)]
    text = "time_s,input_force_N,output_force_N\n" + "".join(rows)
    file = read_channels(write(tmp_path, text.encode() + bytes(100_000)))
    assert [len(channel.values) for channel in file.channels] == [len(TIME)] * 3
    assert file.account.rows == len(TIME) + 1 and "100000 NUL bytes" in " ".join(file.remarks)


def test_names_units_and_ends_in_three_rows_are_headings_and_other_rows_above_are_not(tmp_path):
    body = "".join(f"{t:.2f};{a:.2f};{b:.2f}\n" for t, a, b in zip(TIME, INPUT, OUTPUT, strict=True))
    for top in ("Time;Force;Force\ns;N;N\n;input;output\n", "Time;Force;Force\n;input;output\ns;N;N\n"):
        channels = read_channels(write(tmp_path, top + body)).channels
        assert [(c.name, c.unit) for c in channels] == [("Time", "s"), ("Force input", "N"), ("Force output", "N")]
    other = "Bench;Old;New\nTime (s);F_in (N);F_out (N)\n"
    assert [c.name for c in read_channels(write(tmp_path, other + body)).channels] == ["Time", "F_in", "F_out"]


def test_a_unit_in_each_row_converts_its_number_and_one_that_measures_something_else_is_refused(tmp_path):
    text = "Fin,Unit,Fout,Unit\n200.0,N,140.1,N\n1.0021,kN,702.5,N\n0.4,kN,281.2,N\n"
    table = read_table(write(tmp_path, text))
    assert (table.header, table.units) == (("Fin", "Fout"), ("N", "N"))
    assert [row[0].number() for row in table.rows] == pytest.approx([200.0, 1002.1, 400.0])
    assert bf.read(write(tmp_path, text), wrap_angle="180deg").measurements.tables
    for wrong, message in (("0.4,mm", "another unit"), ("0.4,", "has no unit")):
        with pytest.raises(bf.DatasetError, match=message):
            bf.read(write(tmp_path, text.replace("0.4,kN", wrong)), wrap_angle="180deg")
    with pytest.raises(bf.DatasetError, match="appears twice"):
        read_table(write(tmp_path, "Fin (N),Note,Fout (N),Note\n20,a,14,b\n40,a,28,b\n"))


@pytest.mark.parametrize(
    ("text", "doubtful"),
    [
        ("Fin (N);Fout (N)\n2.000;1.284\n5.000;3.342\n", 2),
        ("Fin (N);Fout (N)\n2.000;1.284\n5.000;3.34\n", 0),
        ("Fin (N);Fout (N);angle (deg)\n2.000;1.284;180.5\n5.000;3.342;180.5\n", 0),
        ("Fin (N);Fout (N)\n2,000;1,284\n5,000;3,342\n", 0),
        ("Fin (N),Fout (N)\n2.000,1.284\n5.000,3.342\n", 0),
    ],
)
def test_three_digits_behind_every_point_are_reported_where_they_may_be_thousands(tmp_path, text, doubtful):
    table = read_table(write(tmp_path, text))
    assert sum(remark.count("'F") for remark in table.remarks if "if these are thousands" in remark) == doubtful


def rows_of_joined_clocks(blank_share=1.0):
    """Return a table in which every row holds the force of one clock; of some rows both."""
    rows = ["time_s,input_force_N,output_force_N"]
    for i, (t, a) in enumerate(zip(TIME, INPUT, strict=True)):
        later = OUTPUT[i]
        if i < blank_share * len(TIME):
            rows += [f"{t:.3f},{a:.3f},", f"{t + 0.02:.3f},,{later:.3f}"]
        else:
            rows += [f"{t:.3f},{a:.3f},{later:.3f}", f"{t + 0.02:.3f},{a:.3f},{later:.3f}"]
    return "\n".join(rows) + "\n"


def test_two_clocks_joined_in_one_table_are_taken_apart_and_dropouts_are_not(tmp_path):
    data = bf.read(write(tmp_path, rows_of_joined_clocks()), wrap_angle="180deg")
    assert "two clocks joined in one table" in " ".join(data.measurements.remarks)
    assert data.measurements.tables[0].items[0].account.samples == len(TIME)
    data = bf.read(write(tmp_path, rows_of_joined_clocks(0.1)), wrap_angle="180deg")
    assert "two clocks joined" not in " ".join(data.measurements.remarks)
    assert data.measurements.tables[0].items[0].account.samples == 2 * len(TIME)


ANGLES = {
    "45,,,90,,": [45, 45, 45, 90, 90, 90],
    "45,45,45,90,90,90": [45, 45, 45, 90, 90, 90],
    "45,,45,90,,90": None,  # a filled row follows no blank one: cells are missing
    ",45,,90,,": None,
    "45,,,,,": None,  # one block only
    "45,45,,90,90,90": None,
}


@pytest.mark.parametrize(("cells", "angles"), ANGLES.items())
def test_merged_angles_are_filled_down_and_missing_ones_refused(tmp_path, cells, angles):
    rows = [f"{angle},{20 + i},{15 + i}" for i, angle in enumerate(cells.split(","))]
    path = write(tmp_path, "\n".join(["wrap_angle_deg,input_force_N,output_force_N", *rows]) + "\n")
    if angles is None:
        with pytest.raises(bf.DatasetError, match="the cell is blank"):
            bf.read(path)
        return
    data = bf.read(path)
    np.testing.assert_allclose(np.rad2deg(data.measurements.tables[0].own.angle[:, 0]), angles)
    assert ("merged" in " ".join(data.measurements.remarks)) == (",," in cells)


@pytest.mark.parametrize(
    ("line", "headings", "numbers"),
    [
        ("1203\tF1:39.84\tF2:27.17", ("", "F1", "F2"), ["1203", "39.84", "27.17"]),
        ("10:01:20.000 -> t=1203 F1=39.96 F2=27.49", ("t", "F1", "F2"), ["1203", "39.96", "27.49"]),
        ("10:01:20.000 -> F1:39.96,F2:-1.5e-3", ("Time", "F1", "F2"), ["10:01:20.000", "39.96", "-1.5e-3"]),
        ("F1: 39.84 N, F2: 27.17 N", ("F1 (N)", "F2 (N)"), ["39.84", "27.17"]),
        ("F1: nan F2: 27.17", ("F1", "F2"), ["nan", "27.17"]),
        ("WARN: HX711 timeout", (), []),
        ("rst:0x1 (POWERON_RESET),boot:0x13", (), []),
        ("1203,39.84,27.17", (), []),
        ("10:01:20;39.84;27.17", (), []),
        ("F1:39.84 F2:", (), []),
        ("F1:39.84 F2:27.1x7", (), []),
    ],
)
def test_a_line_of_a_serial_log_has_nothing_but_numbers_with_keys(line, headings, numbers):
    assert split_line(line) == (headings, numbers)


def test_a_log_with_keys_is_a_recording_and_a_table_under_lines_with_keys_is_none(run, tmp_path):
    rows = [f"t={1000 * t:.0f} F1={a:.2f} F2={b:.2f}" for t, a, b in zip(TIME, INPUT, OUTPUT, strict=True)]
    rows[100] = "tare"
    rows[200] = rows[200][:-9]  # of which a part was lost
    path = write(tmp_path, "\n".join(["boot ok", *rows]) + "\n")
    file = read_channels(path)
    assert [len(channel.values) for channel in file.channels] == [len(TIME) - 2] * 3
    assert file.account.accounted == file.account.rows == len(TIME) + 1
    assert "'tare' in row 102" in " ".join(file.remarks)
    code, out, _ = run("check", path)
    assert code == 2 and "input_force=F1:N" in out and "time=t:ms" in out
    above = "Rate: 20\nGain: 3\n" + TABLE
    assert not is_serial_log(write(tmp_path, above)) and len(read_table(tmp_path / "log.csv").rows) == 3


def test_sheets_that_are_not_read_are_named_and_a_workbook_of_one_says_nothing(tmp_path):
    book = openpyxl.Workbook()
    book.active.title = "Kraft"
    for row in (["Fin (N)", "Fout (N)"], [20, 14.1], [40, 28.0]):
        book.active.append(row)
    book.create_sheet("leer")
    book.save(tmp_path / "one.xlsx")
    assert read_table(tmp_path / "one.xlsx").lines.note == ""
    for row in (["Länge [mm]", "Winkel [deg]"], [300, 80], [400, 90]):
        book["leer"].append(row)
    book.save(tmp_path / "two.xlsx")
    assert read_table(tmp_path / "two.xlsx").lines.note == "of its sheets only 'Kraft' is read, and 'leer' is not"


def test_the_page_of_a_fit_states_that_numbers_that_may_be_thousands_were_read_with_decimals(run, tmp_path):
    rows = [f"{load:.3f};{load * 0.68 + 0.001 * i:.3f}" for i, load in enumerate(np.linspace(2, 5, 9))]
    path = write(tmp_path, "\n".join(["Kraft Eingang [N];Kraft Ausgang [N]", *rows]) + "\n")
    sentence = "under 'Kraft Eingang [N]' and 'Kraft Ausgang [N]' has three digits behind its mark, as in '2.000', and is read"
    options = "--wrap-angle", "180deg", "--no-mcmc", "--no-figures", "--seed", "1"
    _, out, _ = run("fit", path, *options, "-o", tmp_path / "fit")
    assert sentence in " ".join(out.split()) and len(out.splitlines()) <= 25
    _, out, _ = run("summary", tmp_path / "fit")
    assert sentence in " ".join(out.split())
    for decided in (";".join(["10.25", "7.1"]), ";".join(["0.250", "0.171"]), ";".join(["1002.500", "681.700"])):
        write(tmp_path, "\n".join(["Kraft Eingang [N];Kraft Ausgang [N]", *rows, decided]) + "\n")
        assert not [remark for remark in read_table(path).remarks if "three digits" in remark]


def write_mat73(path, labelled=True):
    """As MATLAB does with -v7.3: a structure with time, whose signals are lists of references."""
    with h5py.File(path, "w", userblock_size=512) as file:
        refs, out = file.create_group("#refs#"), file.create_group("out")
        out.attrs["MATLAB_class"] = np.bytes_("struct")
        out["time"] = TIME[None, :]
        signals = out.create_group("signals")
        for key, values in (("values", (INPUT, OUTPUT)), ("label", ("F_in", "F_out"))):
            if key == "values" or labelled:
                stored = signals.create_dataset(key, (2, 1), dtype=h5py.ref_dtype)
                for i, value in enumerate(values):
                    numbers = value[None, :] if key == "values" else np.frombuffer(value.encode("utf-16-le"), "<u2")[:, None]
                    refs[f"{key}{i}"] = numbers
                    if key == "label":
                        refs[f"{key}{i}"].attrs["MATLAB_class"] = np.bytes_("char")
                    stored[i, 0] = refs[f"{key}{i}"].ref
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    return path


def write_dspace(path):
    signals = np.zeros((1, 2), dtype=[("Name", object), ("Data", object)])
    signals[0, 0], signals[0, 1] = ("F_in", INPUT), ("F_out", OUTPUT)
    scipy.io.savemat(path, {"rec": {"X": {"Name": "", "Data": TIME}, "Y": signals, "RTProgram": "bench"}})
    return path


@pytest.mark.parametrize(("make", "group"), [(write_mat73, "out"), (write_dspace, "rec")])
def test_signals_of_simulink_and_dspace_have_their_labels_and_the_common_time(tmp_path, make, group):
    file = read_channels(make(tmp_path / "log.mat"))
    channels = {channel.name: channel for channel in file.channels}
    assert set(channels) == {f"{group}.F_in", f"{group}.F_out", f"{group}.time"}
    np.testing.assert_allclose(channels[f"{group}.F_out"].values, OUTPUT)
    np.testing.assert_allclose(channels[f"{group}.F_in"].time, TIME)


def test_signals_without_labels_are_numbered(tmp_path):
    names = [channel.name for channel in read_channels(write_mat73(tmp_path / "log.mat", labelled=False)).channels]
    assert names[:2] == ["out.signals(1).values", "out.signals(2).values"]


@pytest.mark.parametrize("as_column", [False, True])
def test_units_behind_the_numbers_of_a_recording_are_read_and_must_be_the_same_in_every_row(tmp_path, as_column):
    behind = ",N" if as_column else " N"
    heads = "time (s),F_in,Unit,F_out,Unit" if as_column else "time (s),F_in,F_out"
    rows = [f"{t:.2f},{a:.3f}{behind},{b:.3f}{behind}" for t, a, b in zip(TIME, INPUT, OUTPUT, strict=True)] * 12
    rows = [f"{0.05 * i:.2f},{row.partition(',')[2]}" for i, row in enumerate(rows)]
    file = read_channels(write(tmp_path, "\n".join([heads, *rows]) + "\n"))
    assert [(channel.name, channel.unit) for channel in file.channels] == [("time", "s"), ("F_in", "N"), ("F_out", "N")]
    np.testing.assert_allclose(file.channels[1].values[: len(INPUT)], INPUT, atol=1e-3)
    rows[2000] = rows[2000].replace("N", "mN")
    with pytest.raises(bf.DatasetError, match=r"row 2002"):
        read_channels(write(tmp_path, "\n".join([heads, *rows]) + "\n"))
    contradicting = heads.replace("F_in", "F_in (kN)")
    with pytest.raises(bf.DatasetError, match="kN"):
        read_channels(write(tmp_path, "\n".join([contradicting, *rows[:100]]) + "\n"))


@pytest.mark.parametrize(("heading", "start"), [("stamp", 1_700_000_000_000_000_000), ("stamp", 0), ("timestamp", 0)])
def test_stamps_in_nanoseconds_are_read_or_asked_about_with_the_right_unit(run, tmp_path, heading, start):
    rows = [f"{start + round(t * 1e9)},{a:.3f},{b:.3f}" for t, a, b in zip(TIME, INPUT, OUTPUT, strict=True)]
    path = write(tmp_path, "\n".join([f"{heading},input_force_N,output_force_N", *rows]) + "\n")
    code, out, _ = run("check", path)
    assert "NAME" not in out
    if start:
        assert code == 0
    else:
        assert code == 2 and f"--channel time={heading}:ns" in out and "in nanoseconds 15.95 s" in " ".join(out.split())
        assert run("check", path, "--channel", f"time={heading}:ns")[0] == 0
