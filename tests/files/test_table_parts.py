"""Tables with a life of their own: what stands over, between, beside and below the rows, and where every row went."""

import pytest

from bowdenfit.errors import DatasetError
from bowdenfit.files import read_channels
from bowdenfit.files.tables import read_csv

ROWS = ["20.5;15.25", "40.25;30.5", "61.0;45.25", "80.5;61.0"]
HEADER = "F_in (N);F_out (N)"
TABLE = [HEADER, *ROWS]


def read(folder, lines, end="\n"):
    path = folder / "table.csv"
    path.write_text(end.join(lines) + end, encoding="utf-8", newline="")
    table = read_csv(path)
    assert table.account.rows == len(path.read_bytes().splitlines()) == table.account.accounted
    assert table.account.read == len(table.rows)
    return table


def numbers(table, columns=2):
    return [[cell.number() for cell in row[:columns]] for row in table.rows]


def reasons(table):
    return {item.why: item.ranges for item in table.account.left_out}


CLEAN = [[20.5, 15.25], [40.25, 30.5], [61.0, 45.25], [80.5, 61.0]]
WHOLE = {
    "metadata above": (
        ["Operator;M. Weber", "Date;2021-02-04", "Load cell;500", "", *TABLE],
        {"above the headings": ((1, 3),)},
    ),
    "a title above": (["Messung 12, neues Seil", *TABLE], {"above the headings": ((1, 1),)}),
    "settings of channels above": (
        ["Channel;AI0;AI1", "Range;500;500", "Gain;1;1", *TABLE],
        {"above the headings": ((1, 3),)},
    ),
    "units below the headings": (["F_in;F_out", "[N];[N]", *ROWS], {}),
    "a footer": ([*TABLE, "", "Operator: M. Weber", "Cell: 500 N, calibrated 2021"], {"below the table": ((7, 8),)}),
    "a footer of two columns": ([*TABLE, "", "Radius (mm);25", "Operator;Weber"], {"below the table": ((7, 8),)}),
    "statistics": ([*TABLE, "Mean;", "", "Ende"], {"statistics below the table": ((6, 6),), "below the table": ((8, 8),)}),
    "statistics with numbers": ([*TABLE, "", "Mean: ;38", "SD:;19.4"], {"statistics below the table": ((7, 8),)}),
    "another table below": ([*TABLE, "", "Load;mu", "20;0.11"], {"below the table": ((7, 8),)}),
    "a remark between the rows": ([*TABLE[:3], "--- second day ---", *TABLE[3:]], {"a remark between the rows": ((4, 4),)}),
    "a remark behind a blank row": ([*TABLE[:3], "", "day 2", *TABLE[3:]], {"a remark between the rows": ((5, 5),)}),
    "the headings again": ([*TABLE[:3], "", HEADER, *TABLE[3:]], {"the headings again": ((5, 5),)}),
    "trailing separators": ([f"{line};;;" for line in TABLE], {}),
    "a remark beside": ([HEADER, ROWS[0] + ";new cable", *ROWS[1:]], {}),
    "a block beside": (
        [HEADER + ";;Radius;25", ROWS[0] + ";;Angle;180", *[row + ";;;" for row in ROWS[1:]]],
        {},
    ),
    "comments and blank rows": (["# made by hand", "", *TABLE[:3], "# later", *TABLE[3:], ""], {"a comment": ((1, 1), (6, 6))}),
    "a footer under blank cells": ([*TABLE, ";", "Notes;", "cable was new;"], {"below the table": ((7, 8),)}),
}


@pytest.mark.parametrize("case", WHOLE)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_table_is_read_whatever_stands_around_it_and_every_row_is_accounted_for(tmp_path, case, end):
    lines, left_out = WHOLE[case]
    table = read(tmp_path, lines, end)
    assert numbers(table) == CLEAN
    assert {reason: rows for reason, rows in reasons(table).items() if reason != "blank"} == left_out


def test_what_is_not_used_is_said_with_its_rows_and_its_words(tmp_path):
    table = read(tmp_path, [HEADER, ROWS[0] + ";new cable", *ROWS[1:], "", "Operator: Weber", "Radius (mm);25"])
    assert table.account.remarks == [
        "table.csv, rows 7 to 8: below the table ('Operator: Weber', 'Radius (mm) 25'); not used.",
        "table.csv, next to the table: 'new cable' in row 2; not used.",
    ]


def test_blank_rows_and_comments_alone_are_no_news(tmp_path):
    assert read(tmp_path, ["# by hand", *TABLE[:3], "", *TABLE[3:]]).account.remarks == []


def test_units_in_a_row_of_their_own_and_two_rows_of_headings_are_joined(tmp_path):
    table = read(tmp_path, ["Motor side;;Load side;", "Force;Position;Force;Position", "N;mm;N;mm", "20;1;15;1", "30;2;22;2"])
    assert table.header == ("Motor side Force", "Motor side Position", "Load side Force", "Load side Position")
    assert table.units == ("N", "mm", "N", "mm")
    assert table.account.headings == (1, 2, 3)


@pytest.mark.parametrize(
    ("row", "column", "value"), [(3, "F_in (N)", "4o.25;30.5"), (2, "F_out (N)", "20.5;15,25x"), (5, "F_out (N)", "80.5;slack")]
)
def test_a_bad_cell_in_the_body_is_named_and_never_becomes_a_heading(tmp_path, row, column, value):
    lines = [*TABLE[: row - 1], value, *TABLE[row:]]
    with pytest.raises(DatasetError) as error:
        numbers(read(tmp_path, lines))
    wrong = next(cell for cell in value.split(";") if not cell.replace(".", "").isdigit())
    assert str(error.value).startswith(f"table.csv, row {row}, column '{column}': '{wrong}' is not a number")


def test_a_row_of_words_among_readings_is_named_as_one_without_numbers(tmp_path):
    with pytest.raises(DatasetError, match=r"row 4, column 'F_in \(N\)': 'invalid' is not a number"):
        numbers(read(tmp_path, [*TABLE[:3], "invalid;invalid", *TABLE[3:]]))


def test_the_first_row_of_a_block_with_a_bad_cell_does_not_end_the_table(tmp_path):
    with pytest.raises(DatasetError, match="row 5"):
        numbers(read(tmp_path, [*TABLE[:3], "", "x61.0;45.25", *TABLE[4:]]))


def test_words_with_many_rows_of_the_table_below_them_are_refused_rather_than_these_rows_lost(tmp_path):
    with pytest.raises(DatasetError, match=r"row 5: it has words \('day 2 new oil'\) .*and 2 rows of numbers"):
        read(tmp_path, [*TABLE[:3], "", "day 2;new oil", *TABLE[3:]])


def test_a_smaller_table_below_with_headings_of_its_own_is_left_out_and_one_as_wide_is_refused(tmp_path):
    rows = [f"{i};{row};0.{i}" for i, row in enumerate(ROWS * 5)]
    lines = [f"trial;{HEADER};mu", *rows, "", "Load;mean mu", *(f"{load};0.12" for load in range(8))]
    assert len(read(tmp_path, lines).rows) == 20
    with pytest.raises(DatasetError, match="row 23: it has words"):
        read(tmp_path, [*lines[:22], "day 2;new oil", *rows[:2]])


def test_groups_called_as_statistics_are_stay_readings(tmp_path):
    rows = [f"{level};{row}" for level, row in zip(("min", "min", "max", "max"), ROWS, strict=True)]
    assert len(read(tmp_path, [f"level;{HEADER}", *rows[:2], "", *rows[2:]]).rows) == 4


def test_rows_of_numbers_above_the_headings_are_refused(tmp_path):
    with pytest.raises(DatasetError, match=r"row 1: it has numbers .* above the headings in row 2"):
        read(tmp_path, [ROWS[0], HEADER, *ROWS[1:]])


def test_numbers_beside_the_last_column_are_refused_as_decimal_commas_may_be(tmp_path):
    with pytest.raises(DatasetError, match=r"row 2: 4 cells where .* 2"):
        read(tmp_path, ["F_in (N),F_out (N)", "20,5,15,25", "40,25,30,5", "61,0,45,25"])


@pytest.mark.parametrize(
    ("cells", "value"),
    [("1 234,5;900,25", 1234.5), ("1.234,5;900,25", 1234.5), ("1'234.5;900.25", 1234.5), ("1,234.5;900.25", 1234.5)],
)
def test_separators_of_thousands_are_read_where_they_leave_no_doubt(tmp_path, cells, value):
    assert numbers(read(tmp_path, [HEADER, cells, cells]))[0] == [value, 900.25]


def test_a_table_typed_with_blanks_between_its_columns_is_read(tmp_path):
    table = read(tmp_path, ["F_in_N  F_out_N", "20.5    15.25", "40.25   30.5"])
    assert table.header == ("F_in_N", "F_out_N") and numbers(table) == CLEAN[:2]


RECORDED = [f"{i / 10:.1f};{50 + i:.1f};{40 + 0.8 * i:.1f}" for i in range(30)]
CLOCKED = "Time (s);F_in (N);F_out (N)"
AROUND = {
    "a remark beside": ([CLOCKED, RECORDED[0] + ";start;of;the;pull", *RECORDED[1:]], []),
    "a remark between": ([CLOCKED, *RECORDED[:20], "--- pause ---", *RECORDED[20:]], ["a remark between the rows"]),
    "the headings again": ([CLOCKED, *RECORDED[:10], CLOCKED, *RECORDED[10:]], ["the headings again"]),
    "metadata": (["Operator;W", "Range;500;500", "", CLOCKED, *RECORDED], ["above the headings", "blank"]),
    "a footer": ([CLOCKED, *RECORDED, "", "Operator: W", "Radius (mm);25"], ["blank", "below the table"]),
    "blank rows": ([CLOCKED, *RECORDED[:10], "", *RECORDED[10:]], ["blank"]),
}


@pytest.mark.parametrize("case", AROUND)
def test_a_recording_is_read_whatever_stands_around_it_and_every_row_is_accounted_for(tmp_path, case):
    lines, left_out = AROUND[case]
    (tmp_path / "run.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    file = read_channels(tmp_path / "run.csv")
    channels = [(channel.name, channel.unit, len(channel.values)) for channel in file.channels]
    assert channels == [("Time", "s", 30), ("F_in", "N", 30), ("F_out", "N", 30)]
    assert file.account.rows == file.account.accounted == len(lines)
    assert [item.why for item in file.account.left_out] == left_out


def test_long_recordings_with_blank_rows_are_accounted_for(tmp_path):
    lines = [CLOCKED, *(f"{i / 100:.2f};{50 + i % 7}.5;40.25" for i in range(9000))]
    lines.insert(4000, "")
    (tmp_path / "run.csv").write_text("\n".join(lines), encoding="utf-8")
    account = read_channels(tmp_path / "run.csv").account
    assert (account.rows, account.accounted, account.read) == (9002, 9002, 9000)
    assert account.left_out[0].ranges == ((4001, 4001),)


@pytest.mark.parametrize(("row", "value"), [(2, "0.0;abc;48"), (3, "0.1;abc;48"), (12, "1.0;6o.0;48"), (25, "2.3;7x;-")])
def test_a_bad_cell_near_the_top_of_a_recording_is_named_and_never_becomes_a_heading(tmp_path, row, value):
    lines = [CLOCKED, *RECORDED]
    lines[row - 1] = value
    (tmp_path / "run.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(DatasetError, match=f"row {row}, column 'F_in': '{value.split(';')[1]}' is not a number"):
        read_channels(tmp_path / "run.csv")


def test_a_bad_cell_in_a_short_recording_never_makes_headings_of_the_samples_above_it(tmp_path):
    (tmp_path / "run.csv").write_text("\n".join([*TABLE[:2], "4o.25;30.5", *TABLE[3:]]) + "\n", encoding="utf-8")
    with pytest.raises(DatasetError, match=r"row 3, column 'F_in': '4o\.25' is not a number"):
        read_channels(tmp_path / "run.csv")


def test_settings_over_the_headings_of_a_recording_are_no_part_of_them(tmp_path):
    above = ["Channel;AI0;AI1", "Range;500;500", "Gain;1;1"]
    (tmp_path / "run.csv").write_text("\n".join([*above, *TABLE]) + "\n", encoding="utf-8")
    assert [channel.name for channel in read_channels(tmp_path / "run.csv").channels] == ["F_in", "F_out"]


@pytest.mark.parametrize("read", [read_csv, read_channels])
def test_other_headings_between_the_rows_are_refused_in_one_sentence(tmp_path, read):
    for rows, sentence in ((20, "row 22: every column has words"), (9, "row 2: it has numbers .* above the headings in row 1")):
        lines = [CLOCKED, *RECORDED[:rows], "trial;load;loss", *RECORDED[rows:]]
        (tmp_path / "run.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        with pytest.raises(DatasetError, match=sentence):
            read(tmp_path / "run.csv")


@pytest.mark.parametrize("read", [read_csv, read_channels])
def test_units_once_more_between_the_rows_are_left_out_with_the_headings(tmp_path, read):
    head = ["Time;F_in;F_out", "s;N;N"]
    (tmp_path / "run.csv").write_text("\n".join([*head, *RECORDED[:20], *head, *RECORDED[20:]]) + "\n", encoding="utf-8")
    (left_out,) = read(tmp_path / "run.csv").account.left_out
    assert (left_out.why, left_out.ranges) == ("the headings again", ((23, 24),))


@pytest.mark.parametrize("read", [read_csv, read_channels])
def test_statistics_between_the_rows_are_left_out(tmp_path, read):
    rows = [f"{i / 10:.1f};{50 + i % 7}.5;40.25" for i in range(120)]
    (tmp_path / "run.csv").write_text("\n".join([CLOCKED, *rows[:60], "Mean;53.5;40.25", *rows[60:]]) + "\n", encoding="utf-8")
    (left_out,) = read(tmp_path / "run.csv").account.left_out
    assert (left_out.why, left_out.ranges) == ("statistics between the rows", ((62, 62),))
