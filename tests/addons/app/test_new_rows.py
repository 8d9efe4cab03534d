"""Rows that are added to a table: read as the reader reads them, refused at their cell, and written whole or not at all."""

import pytest
from half_turn_bench import TABLE, describe_half_turn

import bowdenfit as bf
from bowdenfit.addons.app.new_rows import list_tables, open_table
from bowdenfit.errors import BowdenfitError, UsageError

NEW = [["20", "15.3", "3"], ["40", "30.4", "3"]]


@pytest.fixture
def data_set(tmp_path):
    """Make a data set with a table of some contents."""

    def make(content=TABLE, file="forces.csv", more=""):
        folder = tmp_path / "bench"
        (folder / file).parent.mkdir(parents=True)
        (folder / "cable.toml").write_text(describe_half_turn(f'file = "{file}"') + more)
        (folder / file).write_bytes(content if isinstance(content, bytes) else content.encode())
        return folder

    return make


def test_rows_are_added_below_the_last_and_the_rest_of_the_file_stays_to_the_byte(data_set):
    folder = data_set(f"# by hand\n{TABLE}\n# checked\n", "sheets/forces.csv")
    table = open_table(folder, "sheets/forces.csv")
    assert (table.headings, table.rows[-1]) == (("F_in (N)", "F_out (N)", "run"), ("40", "30.9", "2"))
    checked = table.check(NEW)
    assert (checked.count, checked.refusals) == (2, ())
    assert "Everything could be read" in checked.report
    assert "3 runs" in checked.report
    assert table.path.read_text() == f"# by hand\n{TABLE}\n# checked\n"
    table.save(NEW)
    assert table.path.read_text() == f"# by hand\n{TABLE}20,15.3,3\n40,30.4,3\n\n# checked\n"
    assert len(bf.read(folder).measurements.tables[0].run) == 6


@pytest.mark.parametrize(
    ("content", "row", "added"),
    [
        (TABLE.rstrip("\n").encode(), NEW[0], b"\n20,15.3,3\n"),
        (TABLE.replace("\n", "\r\n").encode(), NEW[0], b"20,15.3,3\r\n"),
        (TABLE.replace(",", ";").replace(".", ",").encode(), ["20", "15,3", "3"], b"20;15,3;3\n"),
        (TABLE.replace(",", "\t").encode("utf-16"), NEW[0], "20\t15.3\t3\n".encode("utf-16-le")),
        (TABLE.replace(",2\n", ",Größe\n").encode("cp1252"), ["20", "15.3", "Größe"], "20,15.3,Größe\n".encode("cp1252")),
    ],
)
def test_rows_are_written_as_the_file_is(data_set, content, row, added):
    folder = data_set(content)
    open_table(folder, "forces.csv").save([row])
    assert (folder / "forces.csv").read_bytes() == content + added
    assert len(bf.read(folder).measurements.tables[0].run) == 5


@pytest.mark.parametrize(
    ("row", "column", "words"),
    [
        (["20", "many", "3"], "F_out (N)", "'many' is not a number"),
        (["", "15.3", "3"], "F_in (N)", "is blank"),
        (["# 20", "15.3", "3"], "F_in (N)", "remark"),
    ],
)
def test_a_cell_that_cannot_be_read_is_named_with_its_row_and_nothing_is_written(data_set, row, column, words):
    folder = data_set()
    table = open_table(folder, "forces.csv")
    refusals = table.check([NEW[0], row]).refusals
    assert [(refusal.file, refusal.row, refusal.column) for refusal in refusals] == [("forces.csv", 7, column)]
    assert words in refusals[0].sentence
    with pytest.raises(UsageError, match=r"forces\.csv is as it was"):
        table.save([NEW[0], row])
    assert (folder / "forces.csv").read_text() == TABLE
    assert {path.name for path in folder.iterdir()} == {"cable.toml", "forces.csv"}


def test_a_file_that_changed_meanwhile_is_not_replaced(data_set):
    folder = data_set()
    table = open_table(folder, "forces.csv")
    with (folder / "forces.csv").open("a") as file:
        file.write("60,46.0,2\n")
    with pytest.raises(UsageError, match="has changed since"):
        table.save(NEW)
    assert (folder / "forces.csv").read_text() == f"{TABLE}60,46.0,2\n"


def test_what_was_wrong_before_does_not_keep_good_rows_out(data_set):
    folder = data_set(TABLE, more='[friction.nu]\nprior = { distribution = "uniform", low = 0, high = 1 }\n')
    with pytest.raises(BowdenfitError):
        bf.check(folder)
    table = open_table(folder, "forces.csv")
    table.save(NEW)
    assert (folder / "forces.csv").read_text().endswith("40,30.4,3\n")
    assert open_table(folder, "forces.csv").check([["20", "many", "3"]]).refusals


def test_neither_files_elsewhere_nor_links_nor_workbooks_are_opened(data_set, tmp_path):
    (tmp_path / "outside.csv").write_text(TABLE)
    folder = data_set(TABLE, "forces.csv")
    assert list_tables(folder) == ["forces.csv"]
    for name in ("../outside.csv", "cable.toml", "", "/etc/passwd", "forces.csv/"):
        with pytest.raises(UsageError, match="has no table"):
            open_table(folder, name)
    (folder / "cable.toml").write_text(describe_half_turn('file = "../outside.csv"'))
    assert list_tables(folder) == []
    assert bf.check(folder)
    (folder / "cable.toml").write_text(describe_half_turn('file = "forces.csv"'))
    (folder / "forces.csv").rename(folder / "real.csv")
    (folder / "forces.csv").symlink_to("real.csv")
    with pytest.raises(BowdenfitError, match="is a link"):
        open_table(folder, "forces.csv")
    (folder / "forces.csv").unlink()
    (folder / "forces.xlsx").write_bytes(b"PK")
    (folder / "cable.toml").write_text(describe_half_turn('file = "forces.xlsx"'))
    with pytest.raises(UsageError, match="is a workbook"):
        open_table(folder, "forces.xlsx")
