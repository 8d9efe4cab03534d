"""One language of CSV for tables and recordings, and a registry to which a format is added in one line."""

import subprocess
import sys

import numpy as np
import openpyxl
import pytest

from bowdenfit.errors import DatasetError
from bowdenfit.files import FORMATS, read_channels
from bowdenfit.files.channels import Channel, ChannelFile
from bowdenfit.files.tables import read_csv

ROWS = [(0.0, 6.5, 5.25), (0.5, 6.75, 5.5), (1.0, 7.25, 5.75), (1.5, 7.0, -6.0)]
HEADINGS = ("time (s)", "input_force (N)", "output_force (N)")


def text_of(separator, decimal, minus="-", end="\n"):
    cells = [[f"{value}".replace(".", decimal).replace("-", minus) for value in row] for row in ROWS]
    return end.join(separator.join(row) for row in [HEADINGS, *cells]) + end


def both(folder, data):
    """The numbers of one file as a table and as a recording."""
    path = folder / "run.csv"
    path.write_bytes(data)
    table, file = read_csv(path), read_channels(path)
    assert table.header == HEADINGS
    return [[cell.number() for cell in row] for row in table.rows], np.column_stack([c.values for c in file.channels])


@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), *((separator, decimal) for separator in ";\t|" for decimal in ".,")]
)
def test_tables_and_recordings_share_separators_and_decimal_marks(tmp_path, separator, decimal):
    for computed in both(tmp_path, text_of(separator, decimal).encode()):
        np.testing.assert_array_equal(computed, ROWS)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_tables_and_recordings_share_encodings_and_ends_of_lines(tmp_path, encoding, end):
    text = f"# Prüfstand{end}sep=;{end}" + text_of(";", ",", end=end)
    for computed in both(tmp_path, text.encode(encoding)):
        np.testing.assert_array_equal(computed, ROWS)


def test_a_typographers_minus_is_a_minus_in_both(tmp_path):
    for computed in both(tmp_path, text_of(";", ",", minus="\u2212").encode()):
        np.testing.assert_array_equal(computed, ROWS)


@pytest.mark.parametrize("mark", ["n/a", "nan", "#N/A", "---", "overflow", "∞"])
def test_a_missing_sample_of_a_recording_is_refused_in_a_table_by_its_cell(tmp_path, mark):
    path = tmp_path / "run.csv"
    path.write_text(text_of(";", ".").replace("6.75", mark), encoding="utf-8")
    assert np.isnan(read_channels(path).channels[1].values[1])
    with pytest.raises(DatasetError, match=r"run\.csv, row 3, column 'input_force \(N\)': .*(blank|not a finite)"):
        read_csv(path).rows[1][1].number()


@pytest.mark.parametrize("read", [read_csv, read_channels])
@pytest.mark.parametrize(
    ("start", "says"),
    [
        (b"sep=:\na:b\n1:2\n", "row 1: 'sep=:' names no column separator"),
        (b"\x89HDF\r\n\x1a\n", "an HDF5 file"),
        (b"a,b\x00\n1,2\n", "not a text file"),
        (b"", "is empty"),
    ],
)
def test_tables_and_recordings_refuse_the_same_files(tmp_path, read, start, says):
    (tmp_path / "run.csv").write_bytes(start)
    with pytest.raises(DatasetError, match=rf"run\.csv.*{says}"):
        read(tmp_path / "run.csv")


@pytest.mark.parametrize("read", [read_csv, read_channels])
def test_too_many_cells_are_refused_in_one_sentence(tmp_path, read):
    (tmp_path / "run.csv").write_text(text_of(",", ".").replace("7.25", "7,25"))
    with pytest.raises(
        DatasetError, match=r"row 4: 4 cells where .* 3 \(the first too many is '5.75'\).*decimal comma"
    ):
        read(tmp_path / "run.csv")


def test_a_quotation_mark_that_stays_open_is_refused_in_a_table(tmp_path):
    (tmp_path / "run.csv").write_text('a,b\n1,2\n"3,4\n5,6\n')
    with pytest.raises(DatasetError, match="row 3: a quotation mark opens there that is never closed"):
        read_csv(tmp_path / "run.csv")


BELOW = [[], ["Durchschnitt", 6.6, 5.5], ["Ende"]]


def test_what_stands_below_the_data_is_left_out_of_text_and_workbooks_alike(tmp_path):
    book = openpyxl.Workbook()
    for row in [HEADINGS, *ROWS, *BELOW]:
        book.active.append(row)
    book.save(tmp_path / "run.xlsx")
    (tmp_path / "run.csv").write_text(
        text_of(",", ".") + "".join(",".join(map(str, row)) + "\n" for row in BELOW), encoding="utf-8"
    )
    for name in ("run.xlsx", "run.csv"):
        file = read_channels(tmp_path / name)
        np.testing.assert_array_equal(np.column_stack([c.values for c in file.channels]), ROWS)
        assert "ows 7 to 8 were left out" in " ".join(file.remarks)


@pytest.mark.parametrize("more", [0, 1000])
def test_short_recordings_and_tables_are_read_without_pandas(more, tmp_path):
    text = text_of(",", ".")
    (tmp_path / "run.csv").write_text(text + f"{text.splitlines()[-1]}\n" * more)
    code = (
        "import sys; from pathlib import Path; from bowdenfit.files import read_channels; "
        "from bowdenfit.files.tables import read_csv; path = Path(sys.argv[1]); read_csv(path); read_channels(path); "
        "print({'pandas', 'jax', 'openpyxl', 'matplotlib'} & sys.modules.keys())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "run.csv"], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "set()"


def read_forces(path):
    values = np.array([float(line) for line in path.read_text().split()])
    return ChannelFile(path, "force file", (Channel("force", "N", values),))


def test_a_format_is_added_by_a_function(tmp_path, monkeypatch):
    monkeypatch.setitem(FORMATS, ".newtons", read_forces)
    (tmp_path / "run.newtons").write_text("1\n2\n")
    np.testing.assert_array_equal(read_channels(tmp_path / "run.newtons").channels[0].values, [1, 2])


def test_an_added_format_may_start_as_another_does(tmp_path, monkeypatch):
    monkeypatch.setitem(FORMATS, ".newtons", lambda path: ChannelFile(path, "an HDF5 file of our own", ()))
    (tmp_path / "run.newtons").write_bytes(b"\x89HDF\r\n\x1a\n")
    assert read_channels(tmp_path / "run.newtons").kind == "an HDF5 file of our own"


def test_a_format_is_added_by_the_path_of_a_module_and_named_among_those_that_are_read(tmp_path, monkeypatch):
    (tmp_path / "newtons.py").write_text(
        "from bowdenfit.files.channels import ChannelFile\n"
        "def read(path):\n    return ChannelFile(path, path.read_text(), ())\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(FORMATS, ".newtons", "newtons")
    (tmp_path / "run.newtons").write_text("hello")
    assert read_channels(tmp_path / "run.newtons").kind == "hello"
    (tmp_path / "run.pounds").write_text("hello")
    with pytest.raises(DatasetError, match=r"run\.pounds has the ending \.pounds.*\.newtons"):
        read_channels(tmp_path / "run.pounds")
