"""Recordings in Excel and Parquet files: every habit of those who write them."""

import datetime

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
from three_columns import INPUT, OUTPUT, TIME, check
from workbooks import write_workbook

from bowdenfit.errors import DatasetError
from bowdenfit.files import channels, excel, parquet

pytestmark = pytest.mark.extended


TABLE = [["time (s)", "input_force (N)", "output_force (N)"], *map(list, zip(TIME, INPUT, OUTPUT, strict=True))]


def test_a_workbook_with_one_sheet_has_plain_names(tmp_path):
    check(excel.read(write_workbook(tmp_path / "run.xlsx", {"Sheet1": TABLE, "notes": [["by Eve"], ["cable 7"]]})))


def test_a_workbook_with_several_sheets_has_the_sheet_before_the_names(tmp_path):
    file = excel.read(write_workbook(tmp_path / "run.xlsx", {"a": TABLE, "b": [["cable", 7], *TABLE]}))
    assert [c.name for c in file.channels][2:4] == ["a/output_force", "b/time"]
    assert file.channels[4].clock == "b/time"
    np.testing.assert_array_equal(file.channels[5].values, OUTPUT)


def test_pairs_of_columns_in_a_workbook_keep_their_own_clocks_and_lengths(tmp_path):
    rows = [[0.02 * i, i % 3, None, 0.04 * i if i < 6 else None, i % 2 if i < 6 else None] for i in range(9)]
    file = excel.read(write_workbook(tmp_path / "run.xlsx", {"raw": [[None, 45, None, None, 90], *rows]}))
    assert [c.name for c in file.channels] == ["time of 45", "45", "time of 90", "90"]
    assert [len(c.time) for c in file.channels[1::2]] == [9, 6]
    np.testing.assert_array_equal(file.channels[3].time, [0.04 * i for i in range(6)])


def test_two_rows_of_numbers_as_headings_and_statistics_below(tmp_path):
    rows = [[None, 0.02 * i, 6 + 0.1 * (i % 2), 7 - 0.1 * (i % 2)] for i in range(9)]
    below = [
        ["MIN", None, 6, 6.9],
        ["MAX", None, 6.1, 7],
        ["HALF RANGE", None, 0.05, 0.05],
        [],
        [None, None, None, None],
    ]
    sheet = [[None, "Angle", 45, 45], [None, "Trial", 1, 2], *rows, *below]
    file = excel.read(write_workbook(tmp_path / "run.xlsx", {"s": sheet}))
    assert [c.name for c in file.channels] == ["time of 45 1", "45 1", "45 2"]
    assert {len(c.values) for c in file.channels} == {9}
    assert "ows 12 to 14 were left out" in file.remarks[0]


def test_text_among_the_numbers_of_the_only_sheet_is_refused(tmp_path):
    rows = [list(row) for row in TABLE]
    rows[3][1] = "slip"
    with pytest.raises(DatasetError, match="sheet 'a', row 4, column 'input_force': 'slip' is not a number"):
        excel.read(write_workbook(tmp_path / "run.xlsx", {"a": rows}))
    file = excel.read(write_workbook(tmp_path / "run.xlsx", {"a": rows, "b": TABLE}))
    assert "A sheet was left out" in file.remarks[0]


def test_dates_in_a_workbook_are_clocks(tmp_path):
    start = datetime.datetime(2021, 2, 4, 14, 52)
    rows = [[start + datetime.timedelta(seconds=i / 2), force] for i, force in enumerate(INPUT)]
    file = excel.read(write_workbook(tmp_path / "run.xlsx", {"a": [["Timestamp", "input_force [N]"], *rows]}))
    np.testing.assert_allclose(file.channels[1].time, [0, 0.5, 1, 1.5, 2], atol=1e-6)


def test_damaged_workbooks_and_those_without_numbers_are_refused(tmp_path):
    whole = write_workbook(tmp_path / "run.xlsx", {"a": TABLE}).read_bytes()
    (tmp_path / "cut.xlsx").write_bytes(whole[: len(whole) * 6 // 10])
    with pytest.raises(DatasetError, match="cut off or damaged"):
        excel.read(tmp_path / "cut.xlsx")
    with pytest.raises(DatasetError, match="no sheet with columns of numbers"):
        excel.read(write_workbook(tmp_path / "run.xlsx", {"a": [["hello"]]}))


def write_parquet(folder, columns, fields=None):
    schema = pyarrow.schema(fields) if fields else None
    pyarrow.parquet.write_table(pyarrow.table(columns, schema=schema), folder / "run.parquet")
    return folder / "run.parquet"


def test_parquet_columns_have_the_units_of_their_metadata_or_headings(tmp_path):
    fields = [
        pyarrow.field("time", pyarrow.float64(), metadata={"unit": "s"}),
        pyarrow.field("input_force", pyarrow.float64(), metadata={"unit": "N"}),
        pyarrow.field("output_force [N]", pyarrow.float64()),
    ]
    check(parquet.read(write_parquet(tmp_path, [TIME, INPUT, OUTPUT], fields)))


def test_parquet_timestamps_are_clocks_and_nulls_are_missing(tmp_path):
    stamps = pyarrow.array([1612450320120000000 + i * 1234567 for i in range(5)], pyarrow.timestamp("ns"))
    file = parquet.read(write_parquet(tmp_path, {"stamp": stamps, "n": [1, None, 3, 4, 5], "word": ["a"] * 5}))
    np.testing.assert_array_equal(file.channels[1].time, np.arange(5) * 1234567 / 1e9)
    np.testing.assert_array_equal(file.channels[1].values, [1, np.nan, 3, 4, 5])
    assert "'word' holds no numbers" in file.remarks[0]


def test_damaged_and_huge_parquet_files_are_refused(tmp_path, monkeypatch):
    path = write_parquet(tmp_path, {"a": np.arange(1000.0)})
    monkeypatch.setattr(channels, "LARGEST_BYTES", 100)
    with pytest.raises(DatasetError, match="1000 rows of 1 columns"):
        parquet.read(path)
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(DatasetError, match="cut off or damaged"):
        parquet.read(path)
