"""Layouts that laboratories have sent, each beside a twin that must be read, or refused, as before."""

import numpy as np
import pytest

import bowdenfit as bf
from bowdenfit.files import read_channels
from bowdenfit.files.cells import parse_number
from bowdenfit.files.tables import read_table

pytestmark = pytest.mark.extended

TIME = np.arange(0, 16, 0.05)
INPUT = 40 + 20 * np.sin(2 * np.pi * TIME / 8)
OUTPUT = 0.75 * INPUT
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
