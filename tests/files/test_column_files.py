"""Recordings in CSV files: every habit of those who write them."""

import csv
import io
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from three_columns import INPUT, OUTPUT, TIME, check

from bowdenfit.errors import DatasetError
from bowdenfit.files import channels, csv_recording, excel, parquet, read_channels
from bowdenfit.files.channels import Channel
from bowdenfit.files.clocks import assign_clocks

OF_LABORATORIES = sorted(p for p in (Path(__file__).parent / "corpus").iterdir() if p.suffix in {".csv", ".tsv", ".txt"})


def rows_of(separator=",", decimal=".", end="\n"):
    return end.join(
        separator.join(f"{value}".replace(".", decimal) for value in row)
        for row in zip(TIME, INPUT, OUTPUT, strict=True)
    )


def read_text(folder, text, name="run.csv", encoding="utf-8"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return csv_recording.read(path)


HEADER = "time [s],input_force [N],output_force [N]\n"
HABITS = {
    "plain": HEADER + rows_of() + "\n",
    "no end of the last line": HEADER + rows_of(),
    "CRLF": (HEADER + rows_of() + "\n").replace("\n", "\r\n"),
    "CR only": (HEADER + rows_of() + "\n").replace("\n", "\r"),
    "semicolon and decimal comma": HEADER.replace(",", ";") + rows_of(";", ",") + "\n",
    "tab": HEADER.replace(",", "\t") + rows_of("\t") + "\n",
    "tab and decimal comma": HEADER.replace(",", "\t") + rows_of("\t", ",") + "\n",
    "bar": HEADER.replace(",", "|") + rows_of("|") + "\n",
    "blanks": "time[s]  input_force[N]  output_force[N]\n" + "\n".join("  " + r for r in rows_of("   ").split("\n")) + "\n",
    "lines of blanks": HEADER.replace(",", "  ").replace(" [", "[") + rows_of("  ").replace("\n", "\n   \n", 2) + "\n",
    "blank after the comma": '"time (s)", "input_force (N)", "output_force (N)"\n' + rows_of(", ") + "\n",
    "blank before the comma": HEADER + rows_of(" , ") + "\n",
    "trailing separators": HEADER.replace("\n", ",\n") + rows_of().replace("\n", ",\n") + ",\n",
    "trailing separators in the data only": HEADER + rows_of().replace("\n", ",\n") + ",\n",
    "sep line": "sep=;\n" + HEADER.replace(",", ";") + rows_of(";", ",") + "\n",
    "comments": "# bench 2\n% made by hand\n" + HEADER + rows_of() + "\n# end\n",
    "comment between the rows": HEADER + rows_of().replace("\n", "\n# cable slipped\n", 1) + "\n",
    "headings in a comment": "# time [s],input_force [N],output_force [N]\n" + rows_of() + "\n",
    "units line": "time;input_force;output_force\ns;N;N\n" + rows_of(";") + "\n",
    "units line in brackets": "time;input_force;output_force\n[s];[N];[N]\n" + rows_of(";") + "\n",
    "metadata": "Device: DAQ 6009\nSampling rate: 100 Hz\nOperator,Eve\nChannels,2\n\n" + HEADER + rows_of() + "\n",
    "metadata with as many cells": "Name,Cable,7\nRate,100,Hz\n\n" + HEADER + rows_of() + "\n",
    "heading over two lines": '"time\n[s]","input_force\n[N]","output_force\n[N]"\n' + rows_of() + "\n",
    "blank lines": HEADER + "\n" + rows_of().replace("\n", "\n\n") + "\n\n\n",
    "rows of separators below": HEADER + rows_of() + "\n,,\n,,\n,,\n",
    "quoted decimal commas": HEADER + "\n".join(
        ",".join(f'"{cell}"' for cell in row.split(";")) for row in rows_of(";", ",").split("\n")
    ) + "\n",
}  # fmt: skip


@pytest.mark.parametrize("habit", HABITS)
def test_every_habit_of_csv_writers_gives_the_same_channels(habit, tmp_path):
    check(read_text(tmp_path, HABITS[habit]))


SLOW_HABIT = "comment between the rows"


@pytest.fixture
def as_if_long(monkeypatch):
    """Read all but the last lines as those of long files are, and return how many columns each such reading gave."""
    widths, read_plain = [], csv_recording._read_plain

    def watched(*arguments):
        columns = read_plain(*arguments)
        widths.append(columns and len(columns))
        return columns

    monkeypatch.setattr(csv_recording, "_LAST_BYTES", 30)
    monkeypatch.setattr(csv_recording, "_FEW_BYTES", 0)
    monkeypatch.setattr(csv_recording, "_read_plain", watched)
    return widths


@pytest.mark.parametrize("habit", sorted(HABITS.keys() - {SLOW_HABIT}))
def test_usual_habits_do_not_need_the_slow_way(habit, tmp_path, as_if_long):
    check(read_text(tmp_path, HABITS[habit]))
    assert as_if_long[0] >= 3


def check_read_alike_as_if_long(path, monkeypatch):
    """A file gives the same channels whether it is read cell by cell or, but for its last lines, by pandas."""
    short = csv_recording.read(path)
    monkeypatch.setattr(csv_recording, "_LAST_BYTES", 30)
    monkeypatch.setattr(csv_recording, "_FEW_BYTES", 0)
    for few, long in zip(short.channels, csv_recording.read(path).channels, strict=True):
        assert (few.name, few.unit, few.clock, few.start) == (long.name, long.unit, long.clock, long.start)
        np.testing.assert_array_equal(few.values, long.values, strict=True)


@pytest.mark.parametrize("habit", HABITS)
def test_few_rows_are_read_as_many_are(habit, tmp_path, monkeypatch):
    (tmp_path / "run.csv").write_text(HABITS[habit], encoding="utf-8", newline="")
    check_read_alike_as_if_long(tmp_path / "run.csv", monkeypatch)


@pytest.mark.parametrize("path", OF_LABORATORIES, ids=lambda path: path.name)
def test_few_rows_of_a_laboratory_are_read_as_many_are(path, monkeypatch):
    try:
        csv_recording.read(path)
    except DatasetError:  # it is no recording
        return
    check_read_alike_as_if_long(path, monkeypatch)


def test_a_comment_between_the_rows_of_a_long_file_is_read_the_slow_way(tmp_path, as_if_long):
    check(read_text(tmp_path, HABITS[SLOW_HABIT]))
    assert as_if_long == [None]


def test_pieces_of_a_long_file_are_joined(tmp_path, monkeypatch, as_if_long):
    monkeypatch.setattr(csv_recording, "_ROWS_AT_ONCE", 2)
    check(read_text(tmp_path, HABITS["plain"]))
    assert as_if_long == [3]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_every_encoding_gives_the_same_channels(encoding, tmp_path):
    text = "Prüfstand §7\n" + HEADER.replace("input", "Zugkraft_für_input") + rows_of() + "\n"
    check(read_text(tmp_path, text, encoding=encoding), ("time", "Zugkraft_für_input_force", "output_force"))


def test_utf_16_big_endian_is_read(tmp_path):
    check(read_text(tmp_path, b"\xfe\xff" + HABITS["plain"].encode("utf-16-be")))


def test_a_unit_behind_the_name_leaves_the_name_whole(tmp_path):
    file = read_text(tmp_path, "time_s,F_in_N,F_out\n" + rows_of() + "\n")
    assert [(c.name, c.unit) for c in file.channels] == [("time_s", "s"), ("F_in_N", "N"), ("F_out", "")]


def test_headings_that_could_be_units_are_headings_under_a_line_with_a_number(tmp_path):
    file = read_text(tmp_path, "Rate;100\nt;F\n0;1\n0.1;2\n0.2;4\n")
    assert [channel.name for channel in file.channels][:2] == ["t", "F"]


def test_a_heading_that_ends_in_in_is_no_length(tmp_path):
    file = read_text(tmp_path, "t,F_in,F_out\n" + rows_of() + "\n")
    assert [(c.name, c.unit) for c in file.channels] == [("t", ""), ("F_in", ""), ("F_out", "")]
    np.testing.assert_array_equal(file.channels[1].time, TIME)


@pytest.mark.parametrize(
    "line", ["Sampling rate: 100 Hz", "Sample interval [ms]: 10 ms", "Abtastrate;0,1 kHz", "# fs = 100"]
)
def test_a_stated_rate_serves_as_clock_where_there_is_no_time(line, tmp_path):
    rows = "\n".join(row.partition(";")[2] for row in rows_of(";").split("\n"))
    file = read_text(tmp_path, f"Device: 7\n{line}\ninput_force [N];output_force [N]\n{rows}\n")
    np.testing.assert_allclose(file.channels[0].time, TIME, rtol=1e-15)
    assert any("100 samples a second" in remark for remark in file.remarks)


def test_without_headings_the_columns_are_called_by_their_place(tmp_path):
    file = read_text(tmp_path, rows_of() + "\n")
    assert [channel.name for channel in file.channels] == ["column1", "column2", "column3"]
    assert any("column1" in remark for remark in file.remarks)


SUMMARIES = {
    "labels in the time column": "\nMIN,6.5,5\nMAX,6.8,5.5\nHALF RANGE,0.1,0.2\n",
    "after a blank line": "\n\nMIN,6.5,5\nMAX,6.8,5.5\nAVG,6.6,5.2\n",
    "an average and a mark of the end": "\nAverage,6.6,5.2\nEnd of data\n",
}


@pytest.mark.parametrize("below", SUMMARIES)
def test_statistics_below_the_data_are_left_out(below, tmp_path):
    file = read_text(tmp_path, HEADER + rows_of() + SUMMARIES[below])
    check(file)
    first, last = (7, 9) if below == "labels in the time column" else (8, 10) if "blank" in below else (7, 8)
    assert f"Rows {first} to {last} were left out" in file.remarks[0]


@pytest.mark.parametrize(
    "header",
    ["45,,90,", ",45,,90", "45,45,90,90"],
    ids=["over the pair", "over the force", "over both"],
)
def test_pairs_of_columns_with_only_an_angle_over_them_keep_their_own_clocks(header, tmp_path):
    lines = [f"{0.02 * i:.2f},{1 + 0.1 * (i % 2)},{0.04 * i:.2f},{2 - 0.1 * (i % 3)}" for i in range(8)]
    lines[6:] = [line.rpartition(",")[0].rpartition(",")[0] + ",," for line in lines[6:]]
    file = read_text(tmp_path, "\n".join([header, *lines]) + "\n")
    assert [channel.name for channel in file.channels] == ["time of 45", "45", "time of 90", "90"]
    np.testing.assert_allclose(file.channels[1].time, 0.02 * np.arange(8), atol=1e-12)
    np.testing.assert_allclose(file.channels[3].time, 0.04 * np.arange(6), atol=1e-12)
    np.testing.assert_allclose(file.channels[3].values, 2 - 0.1 * (np.arange(6) % 3))


def test_columns_of_one_name_are_told_apart_by_numbers(tmp_path):
    file = read_text(tmp_path, "time,45,45,45\n0,1,2,3\n0.1,1,2,3\n0.2,1,2,4\n")
    assert [channel.name for channel in file.channels] == ["time", "45", "45 (2)", "45 (3)"]


@pytest.mark.parametrize("mark", ["", "NaN", "n/a", "-", "#N/A", "OVERFLOW", "inf", "Overflow", "-INF"])
def test_marks_of_missing_samples_become_nan(mark, tmp_path):
    file = read_text(tmp_path, HABITS["plain"].replace("6.63", mark))
    np.testing.assert_array_equal(file.channels[1].values, [6.61, 6.72, np.nan, 6.54, 6.65])


def test_a_row_that_begins_with_an_excel_error_is_no_comment(tmp_path):
    file = read_text(tmp_path, "input_force,output_force\n1,2\n#N/A,2\n3,4\n")
    np.testing.assert_array_equal(file.channels[0].values, [1, np.nan, 3])


def test_text_among_numbers_is_refused_with_its_place(tmp_path):
    lines = [f"{i},{i % 7}.5" for i in range(3000)]
    lines[2000] = "2000,slip"
    with pytest.raises(DatasetError, match=r"run\.csv, row 2002, column 'input_force': 'slip' is not a number"):
        read_text(tmp_path, "\n".join(["sample,input_force", *lines]) + "\n")


def test_a_number_with_the_other_decimal_mark_is_refused(tmp_path):
    with pytest.raises(DatasetError, match=r"row 4, column 'input_force': '6.63' is not a number like the others"):
        read_text(tmp_path, HEADER.replace(",", ";") + rows_of(";", ",").replace("6,63", "6.63") + "\n")


def test_decimal_commas_in_a_file_separated_by_commas_are_refused(tmp_path):
    with pytest.raises(DatasetError, match="decimal comma"):
        read_text(tmp_path, "time,force\n0,01,6,61\n0,02,6,62\n0,03,6,63\n")


def test_a_row_with_too_many_cells_is_refused(tmp_path):
    lines = [f"{i},{i % 7}.5" for i in range(3000)]
    lines[2000] += ",9"
    with pytest.raises(DatasetError, match="row 2002: 3 cells where"):
        read_text(tmp_path, "\n".join(["sample,input_force", *lines]) + "\n")


def test_a_column_of_words_is_left_out_with_a_remark(tmp_path):
    file = read_text(tmp_path, "time [s],state,input_force [N]\n0,up,1\n0.1,up,2\n0.2,down,3\n")
    assert [channel.name for channel in file.channels] == ["time", "input_force"]
    assert file.remarks == ("The column 'state' holds text and was left out.",)


def test_an_index_without_heading_is_left_out(tmp_path):
    file = read_text(
        tmp_path,
        ",time,input_force\n" + "".join(f"{i},{t},{f}\n" for i, (t, f) in enumerate(zip(TIME, INPUT, strict=True))),
    )
    assert [channel.name for channel in file.channels] == ["time", "input_force"]
    assert "only counts the rows" in file.remarks[0]


@pytest.mark.parametrize("cut", ["0.05,6.", "0.05,6.66", "0.05,6.6,5", "0.0"])
def test_a_line_that_breaks_off_is_left_out_with_a_remark(cut, tmp_path):
    text = HEADER + rows_of().replace("5.1", "5.10").replace("5.2", "5.20").replace("5.4", "5.40").replace(
        "5.5", "5.50"
    )
    file = read_text(tmp_path, text + "0\n" * text.endswith("5.5") + "\n" + cut)
    check(file)
    assert "breaks off in row 7" in file.remarks[0]


@pytest.mark.parametrize(
    ("data", "case"),
    [
        (b"", "is empty"),
        (b"\x89HDF\r\n\x1a\n\x00\x00\x00", "not a text file"),
        (b"time,force\n", "no rows of numbers"),
        (b"hello\nworld\n", "no rows of numbers"),
        (b"\n\n", "no rows of numbers"),
        (b"time,force\n0.1", "breaks off|no rows|no column|empty"),
    ],
)
def test_files_without_numbers_are_refused(data, case, tmp_path):
    with pytest.raises(DatasetError, match=case):
        read_text(tmp_path, data)


def test_a_missing_file_and_a_huge_one_are_refused(tmp_path, monkeypatch):
    for name in ("none.csv", "none.xlsx", "none.parquet"):
        with pytest.raises(DatasetError, match=f"{name} does not exist"):
            read_channels(tmp_path / name)
    monkeypatch.setattr(csv_recording, "LARGEST_BYTES", 10)
    with pytest.raises(DatasetError, match="Parquet"):
        read_text(tmp_path, HABITS["plain"])


def test_a_text_file_of_too_many_numbers_is_refused_before_they_are_read(tmp_path, monkeypatch):
    lines = [f"{i / 1000},{i % 7}" for i in range(30_000)]
    monkeypatch.setattr(channels, "LARGEST_BYTES", 100_000)
    with pytest.raises(DatasetError, match=r"GiB of numbers, more than .* that are read at once"):
        read_text(tmp_path, "\n".join(["time,input_force", *lines, ""]))


def test_statistics_below_many_rows_are_named_by_their_rows_in_the_file(tmp_path):
    lines = [f"{i / 1000},{i % 7}.5" for i in range(30_000)]
    file = read_text(tmp_path, "\n".join(["time,input_force", *lines, "", "MAX,6.5", ""]))
    assert len(file.channels[0].values) == 30_000
    assert "Row 30003 was left out" in file.remarks[0]


@pytest.mark.parametrize(
    "stamps",
    [
        [f"2021-02-04 14:52:00.{i}20" for i in range(5)],
        [f"2021-02-04T14:52:00.{i}20Z" for i in range(5)],
        [f"04.02.2021 14:52:00,{i}20" for i in range(5)],
        [f"14:52:00.{i}20" for i in range(5)],
        ["23:59:59.920", "00:00:00.020", "00:00:00.120", "00:00:00.220", "00:00:00.320"],
        [f"16124503201{i}0" for i in range(5)],
        [f"1612450320.{i}20" for i in range(5)],
    ],
)
def test_dates_are_clocks_in_seconds_from_the_first(stamps, tmp_path):
    rows = "".join(f"{stamp};{force}\n" for stamp, force in zip(stamps, INPUT, strict=True))
    file = read_text(tmp_path, "timestamp;input_force [N]\n" + rows)
    step = 0.01 if stamps[1].startswith("16124503201") else 0.1
    np.testing.assert_allclose(file.channels[1].time, step * np.arange(5), atol=1e-6)


def test_each_channel_takes_the_nearest_clock_to_its_left_of_its_length():
    def channel(name, length, unit=""):
        return Channel(name, unit, np.arange(length, dtype=float))

    given_ = [
        channel("time", 3, "ms"),
        channel("a", 3),
        channel("t", 4),
        channel("b", 4),
        channel("c", 3),
        channel("d", 5),
    ]
    timed = assign_clocks(given_)
    assert [c.clock for c in timed] == ["", "time", "", "t", "time", ""]
    np.testing.assert_array_equal(timed[1].time, [0, 0.001, 0.002])
    assert assign_clocks(timed) == timed


@pytest.mark.parametrize(
    ("name", "unit", "is_clock"),
    [("Zeit", "ms", True), ("elapsed time", "", True), ("X_Value", "", True), ("ai0", "s", True), ("force at time", "N", False),
     ("temperature", "", False), ("T", "", True), ("trial", "", False), ("time", "samples", False)],
)  # fmt: skip
def test_clocks_are_known_by_name_or_unit(name, unit, is_clock):
    timed = assign_clocks([Channel(name, unit, np.arange(3.0)), Channel("force", "N", np.ones(3))])
    assert (timed[1].time is not None) == is_clock


@pytest.mark.parametrize(("module", "reader"), [("openpyxl", excel), ("pyarrow", parquet), ("pandas", csv_recording)])
def test_a_missing_library_is_named_with_how_to_install_it(module, reader, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    for limit in ("_LAST_BYTES", "_FEW_BYTES"):
        monkeypatch.setattr(csv_recording, limit, 1)
    (tmp_path / "run").write_text(HABITS["plain"])
    with pytest.raises(DatasetError, match=rf"needs {module}, which is not installed.*bowdenfit\[lab\]"):
        reader.read(tmp_path / "run")


def test_a_library_that_is_installed_and_broken_is_not_called_missing(tmp_path, monkeypatch):
    (tmp_path / "openpyxl.py").write_text("raise ImportError('DLL load failed')")
    monkeypatch.delitem(sys.modules, "openpyxl", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(DatasetError, match=r"needs openpyxl, which is installed but cannot be loaded \(DLL load failed\)"):
        excel.read(tmp_path / "run")


FLOATS = st.floats(allow_nan=False, allow_infinity=False, width=64)


@settings(deadline=None, max_examples=60)
@given(
    table=st.integers(1, 4).flatmap(
        lambda n: st.lists(st.lists(FLOATS, min_size=n, max_size=n), min_size=1, max_size=30)
    ),
    habit=st.sampled_from(
        [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), ("|", ","), (" ", "."), (" ", ",")]
    ),
    end=st.sampled_from(["\n", "\r\n"]),
)
@example(table=[[0.0, 1.7976931348623157e308], [0.0, -9.9792015476736e291]], habit=(",", "."), end="\n")
@example(table=[[0.0], [-2.0000000000000004e16], [-1.0], [0.0]], habit=(";", ","), end="\n")  # else two columns, one a clock
@example(table=[[0.0, 1e-05, 0.0]], habit=(" ", ","), end="\n")  # else separated at the commas, with a text between
def test_any_numbers_written_as_csv_come_back_to_the_last_bit(table, habit, end):
    separator, decimal = habit
    text = io.StringIO()
    writer = csv.writer(text, delimiter=separator, lineterminator=end)
    writer.writerow([f"channel_{i}" for i in range(len(table[0]))])
    writer.writerows([[repr(value).replace(".", decimal) for value in row] for row in table])
    with tempfile.TemporaryDirectory() as folder:
        file = read_text(Path(folder), text.getvalue())
    np.testing.assert_array_equal(np.column_stack([channel.values for channel in file.channels]), np.array(table))
