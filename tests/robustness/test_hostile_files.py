"""Small files that ask for much: each ends within bounds, in a sentence that names it."""

import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor

import h5py
import numpy as np
import pytest
import scipy.io
from recorded_files import WRITERS, channels_of

import bowdenfit as bf
from bowdenfit.files import isolation, read_channels, tables
from bowdenfit.files.isolation import Limits, limits_times

pytestmark = pytest.mark.extended

MATLAB = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H2s", 0x0100, b"IM")


def element(kind: int, content: bytes) -> bytes:
    """A data element of a .mat file, padded to 8 bytes."""
    return struct.pack("<II", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def matrix(of: int, rows: int, name: bytes, *parts: bytes) -> bytes:
    """An array of a class, such as 2 of structures and 1 of cells."""
    head = element(6, struct.pack("<II", of, 0)) + element(5, struct.pack("<ii", rows, 1)) + element(1, name)
    return element(14, head + b"".join(parts))


def structures(path):
    """A column of 400 million structures in some 200 bytes."""
    fields = struct.pack("<HHi", 5, 4, 8) + element(1, b"a".ljust(8, b"\0"))
    path.write_bytes(MATLAB + matrix(2, 400_000_000, b"x", fields))


def nested_cells(path):
    """Cells in cells in cells."""
    inner = matrix(6, 1, b"", element(9, struct.pack("<d", 1.0)))
    for _ in range(20_000):
        inner = matrix(1, 1, b"", inner)
    path.write_bytes(MATLAB + matrix(1, 1, b"x", inner))


def sheet(path, rows):
    """A workbook whose only sheet has these rows."""
    content = "<worksheet xmlns='http://schemas.openxmlformats.org/spreadsheetml/2006/main'><sheetData>"
    kinds = "application/vnd.openxmlformats-officedocument.spreadsheetml"
    office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    links = "http://schemas.openxmlformats.org/package/2006/relationships"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as book:
        book.writestr(
            "[Content_Types].xml",
            "<Types xmlns='http://schemas.openxmlformats.org/package/2006/content-types'>"
            f"<Override PartName='/xl/workbook.xml' ContentType='{kinds}.sheet.main+xml'/>"
            f"<Override PartName='/xl/worksheets/sheet1.xml' ContentType='{kinds}.worksheet+xml'/></Types>",
        )
        book.writestr(
            "_rels/.rels",
            f"<Relationships xmlns='{links}'><Relationship Id='r1' Type='{office}/officeDocument' Target='xl/workbook.xml'/>"
            "</Relationships>",
        )
        book.writestr(
            "xl/workbook.xml",
            f"<workbook xmlns='http://schemas.openxmlformats.org/spreadsheetml/2006/main' xmlns:r='{office}'>"
            "<sheets><sheet name='a' sheetId='1' r:id='r1'/></sheets></workbook>",
        )
        book.writestr(
            "xl/_rels/workbook.xml.rels",
            f"<Relationships xmlns='{links}'><Relationship Id='r1' Type='{office}/worksheet' Target='worksheets/sheet1.xml'/>"
            "</Relationships>",
        )
        with book.open("xl/worksheets/sheet1.xml", "w") as stream:
            stream.write(content.encode())
            for row in rows:
                stream.write(row)
            stream.write(b"</sheetData></worksheet>")


def far_row(path):
    """A workbook whose second row is the hundred-thousand-millionth."""
    sheet(
        path,
        [b"<row r='1'><c r='A1'><v>1</v></c></row>", b"<row r='99999999999'><c r='A99999999999'><v>2</v></c></row>"],
    )


def bomb(path):
    """A workbook of some megabytes that unpacks to gigabytes."""
    cell = b"<c><v>1</v></c>" * 16_000
    sheet(path, (b"<row>" + cell + b"</row>" for _ in range(1500)))


def looped_blocks(path):
    """An MDF file whose list of data groups links to itself."""
    mark = struct.pack("<8s8s8s4xH2x28xHH", b"MDF     ", b"4.10    ", b"bowden  ", 410, 0, 0)
    header = struct.pack("<4s4xQQ", b"##HD", 104, 6) + struct.pack("<6Q", 168, 0, 0, 0, 0, 0) + b"\0" * 32
    group = struct.pack("<4s4xQQ", b"##DG", 64, 4) + struct.pack("<4Q", 168, 0, 0, 0) + b"\0" * 8
    path.write_bytes(mark.ljust(64, b"\0") + header + group)


HOSTILE = {
    "structures.mat": structures, "cells.mat": nested_cells, "far.xlsx": far_row, "bomb.xlsx": bomb, "loop.mf4": looped_blocks,
}  # fmt: skip


@pytest.mark.parametrize("share", [0.1, pytest.param(0.3, marks=pytest.mark.slow)])  # 0.8 and 2.4 s of CPU
@pytest.mark.parametrize("name", HOSTILE)
def test_small_files_that_ask_for_much_are_refused_in_time(tmp_path, name, share):
    path = tmp_path / name
    HOSTILE[name](path)
    start = time.monotonic()
    with limits_times(share), pytest.raises(bf.DatasetError, match=name) as refused:
        read_channels(path)
    assert time.monotonic() - start < 60
    assert len(str(refused.value)) < 500


def far_column(path):
    """A workbook with a cell in a column that no workbook has."""
    sheet(path, [b"<row r='1'><c r='ZZZZZZ1'><v>1</v></c></row>"])


def never_written(path):
    """Channels of gigabytes of which nothing was ever written, in two kilobytes."""
    with h5py.File(path, "w") as file:
        for name in ("time_s", "input_force_N", "output_force_N"):
            file.create_dataset(name, shape=(4_000_000_000,), chunks=(1 << 20,), dtype="f8")


def deep(path):
    """Groups in groups in groups."""
    with h5py.File(path, "w") as file:
        file.create_group("/".join("g" * 500))


def entities(path):
    """A name that unfolds to gigabytes."""
    declared = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 12))
    path.write_text(f'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a0 "ha">{declared}]><Document>&a11;</Document>')


UNFOLDING = {"column.xlsx": far_column, "never.h5": never_written, "deep.h5": deep, "entities.cmbl": entities}


@pytest.mark.parametrize("name", UNFOLDING)
def test_files_that_unfold_or_lead_nowhere_are_refused_at_once(tmp_path, name):
    UNFOLDING[name](tmp_path / name)
    start = time.process_time()
    with pytest.raises(bf.DatasetError, match=name) as refused:
        read_channels(tmp_path / name)
    assert time.process_time() - start < 5 and len(str(refused.value)) < 500


@pytest.mark.slow
@pytest.mark.parametrize("name", ["far.xlsx"])
def test_a_workbook_is_read_within_the_same_limits_where_it_is_a_table(tmp_path, name):
    HOSTILE[name](tmp_path / name)
    start = time.monotonic()
    with limits_times(0.1), pytest.raises(bf.DatasetError, match=name):
        bf.read(tmp_path / name, wrap_angle=(180, "deg"))
    assert time.monotonic() - start < 60


def test_a_refused_file_leaves_the_next_one_readable(tmp_path):
    structures(tmp_path / "bad.mat")
    scipy.io.savemat(tmp_path / "good.mat", {"F": np.arange(5.0), "t": np.arange(5.0)})
    with pytest.raises(bf.DatasetError):
        read_channels(tmp_path / "bad.mat")
    assert [channel.name for channel in read_channels(tmp_path / "good.mat").channels]


def test_files_read_at_the_same_time_and_in_a_copy_of_the_process_get_their_own_answers(tmp_path):
    for i in range(6):
        scipy.io.savemat(tmp_path / f"{i}.mat", {"F": np.full(50_000, float(i)), "t": np.arange(50_000.0)})

    def read_nth(i):
        return float(np.median(read_channels(tmp_path / f"{i}.mat").channels[0].values))

    with ThreadPoolExecutor(6) as threads:
        assert list(threads.map(read_nth, range(6))) == list(range(6))
    program = (
        "import os, sys; import numpy as np; from pathlib import Path; from bowdenfit.files import read_channels\n"
        "of = lambda i: float(np.median(read_channels(Path(sys.argv[1]) / f'{i}.mat').channels[0].values))\n"
        "of(0); child = os.fork(); mine = 1 if child else 2\n"
        "same = all(of(mine) == mine for _ in range(20))\n"
        "if not child: os._exit(not same)\n"
        "sys.exit(not (same and os.waitpid(child, 0)[1] == 0))"
    )
    done = subprocess.run([sys.executable, "-c", program, str(tmp_path)], capture_output=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr


def test_limits_grow_with_the_file_and_with_what_is_asked(tmp_path):
    (tmp_path / "a.mat").write_bytes(b"x" * 1000)
    (tmp_path / "b.mat").write_bytes(b"x" * 1_000_000)
    small, large = Limits.for_file(tmp_path / "a.mat"), Limits.for_file(tmp_path / "b.mat")
    assert large.memory > small.memory and large.seconds > small.seconds
    with limits_times(4):
        assert Limits.for_file(tmp_path / "a.mat").seconds == pytest.approx(4 * small.seconds)


def test_a_file_under_too_small_a_limit_names_the_option(tmp_path):
    structures(tmp_path / "bad.mat")
    with limits_times(0.1), pytest.raises(bf.DatasetError, match="--reading-limit 4"):
        read_channels(tmp_path / "bad.mat")


def test_a_file_that_took_too_much_is_not_tried_again_until_it_changes(tmp_path):
    structures(tmp_path / "bad.mat")
    with limits_times(0.1):
        with pytest.raises(bf.DatasetError, match="--reading-limit 4") as first:
            read_channels(tmp_path / "bad.mat")
        start = time.monotonic()
        with pytest.raises(bf.DatasetError) as second:
            isolation.call_isolated(tmp_path / "bad.mat", "bowdenfit.files:read_here")
        assert time.monotonic() - start < 0.1 and str(second.value) == str(first.value)
        scipy.io.savemat(tmp_path / "bad.mat", {"F": np.arange(5.0)})
        assert read_channels(tmp_path / "bad.mat").channels


def test_a_pipe_inside_a_bag_is_refused_before_it_is_opened(tmp_path):
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {relative_file_paths: [a.db3]}\n")
    os.mkfifo(tmp_path / "a.db3")
    with pytest.raises(bf.DatasetError, match=r"a\.db3 is a named pipe, not a file"):
        read_channels(tmp_path)


LEAVES_A_FILE = """
import tempfile

def read(path):
    with open(tempfile.gettempdir() + "/half.tmp", "w") as file:
        file.write("half")
    path.with_name("started").touch()
    while True:
        pass
"""


def test_what_a_killed_reader_was_writing_is_removed(tmp_path, monkeypatch):
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    (tmp_path / "reader_that_hangs.py").write_text(LEAVES_A_FILE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    with isolation._request_lock:
        isolation._end_reader()
    (tmp_path / "a.mat").write_bytes(b"x")
    with limits_times(0.1), pytest.raises(bf.DatasetError, match="takes more than"):
        isolation.call_isolated(tmp_path / "a.mat", "reader_that_hangs:read")
    assert (tmp_path / "started").exists()
    assert list(scratch.iterdir()) == []


def test_an_interrupted_request_does_not_answer_the_next_one_and_a_dead_reader_is_replaced(tmp_path, monkeypatch):
    for i in range(3):
        scipy.io.savemat(tmp_path / f"{i}.mat", {"F": np.full(5, float(i)), "t": np.arange(5.0)})

    def interrupt(stream):
        stream.peek(1)  # the answer has come
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(isolation.pickle, "load", interrupt)
        read_channels(tmp_path / "0.mat")
    assert read_channels(tmp_path / "1.mat").channels[0].values[0] == 1
    isolation._readers[os.getpid()].process.kill()
    isolation._readers[os.getpid()].process.wait()
    assert read_channels(tmp_path / "2.mat").channels[0].values[0] == 2


def test_a_reader_that_fails_is_no_file_that_takes_too_long(tmp_path, monkeypatch):
    slow = "import time\nclass Slow:\n    def __del__(self):\n        time.sleep(0.5)\nslow = Slow()\n"
    (tmp_path / "reader_that_fails.py").write_text(f"{slow}def read(path):\n    raise SystemError('no object')\n")
    monkeypatch.syspath_prepend(tmp_path)
    isolation._end_reader()
    (tmp_path / "a.mat").write_bytes(b"x")
    with pytest.raises(bf.DatasetError, match="the library that reads such files crashed on it"):
        isolation.call_isolated(tmp_path / "a.mat", "reader_that_fails:read")


def test_readers_that_have_nothing_to_do_hold_no_output_of_ours(tmp_path):
    scipy.io.savemat(tmp_path / "good.mat", {"F": np.arange(5.0)})
    ours, theirs = os.pipe()
    os.set_inheritable(theirs, False)
    read_channels(tmp_path / "good.mat")
    os.close(theirs)
    assert os.read(ours, 1) == b""
    os.close(ours)


@pytest.mark.parametrize("name", [name for name in WRITERS if name != "zip.xlsx"])
def test_what_the_fuzzer_spoils_is_read_unspoilt(tmp_path, name):
    WRITERS[name](tmp_path / name)
    assert bf.read(tmp_path / name, wrap_angle=(180, "deg"), channels=channels_of(name)).measurements


def test_an_archive_is_called_one(tmp_path):
    WRITERS["zip.xlsx"](tmp_path / "zip.xlsx")
    with pytest.raises(bf.DatasetError, match=r"zip\.xlsx is not a \.xlsx file but a ZIP archive; unpack it"):
        read_channels(tmp_path / "zip.xlsx")


def test_what_is_said_of_a_file_is_short_however_many_channels_it_has_and_however_they_are_called(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with h5py.File("wide.h5", "w") as file:
        for name in ("time_s", "input_force_N", "output_force_N", "n" * 5000, *(f"s{i}" for i in range(1000))):
            file[name] = np.arange(80.0)
        file["s0"].attrs["unit"] = "u" * 50_000
    code, out, err = run("check", "wide.h5")
    assert (code, err) == (2, "")  # forces that are equal make no recording of a cable
    assert "... and 904 more channels." in out and "To fit it once that is corrected:" in out
    assert len(out.splitlines()) < 400
    assert max(map(len, out.splitlines())) <= 80


def test_a_table_that_is_not_what_its_ending_says_is_called_what_it_is(run, on_body, tmp_path):
    folder = shutil.copytree(on_body, tmp_path / "cable")
    (folder / "angles.csv").rename(folder / "angles.xlsx")
    text = (folder / "cable.toml").read_text().replace("angles.csv", "angles.xlsx")
    (folder / "cable.toml").write_text(text)
    code, _, err = run("check", folder)
    assert (code, err) == (2, "Error: angles.xlsx is not a .xlsx file but text; rename it to .csv.\n")


def wide(path, columns):
    """A table of forces with so many columns."""
    more = [f"c{i}" for i in range(columns - 2)]
    rows = [["input_force_N", "output_force_N", *more]]
    rows += [[f"{10 + i}", f"{7 + 0.7 * i:.2f}", *"1" * len(more)] for i in range(5)]
    path.write_text("".join(",".join(row) + "\n" for row in rows))


def test_of_a_wide_table_few_columns_are_listed_and_a_very_wide_one_is_refused(run, tmp_path):
    wide(tmp_path / "a.csv", 150)
    code, out, _ = run("check", tmp_path / "a.csv")
    assert code == 0 and "... and 50 more columns." in out
    wide(tmp_path / "a.csv", 10_000)
    code, _, err = run("check", tmp_path / "a.csv")
    assert code == 2 and "a.csv has rows of 10,000 cells, and a table has at most 2,000 columns" in err


def test_a_table_that_would_take_minutes_to_read_is_refused_and_blank_rows_do_not_count(tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "_MOST_CELLS", 40)
    rows = [f"{10 + i},{7 + 0.7 * i:.2f}" for i in range(18)]
    (tmp_path / "a.csv").write_text("\n".join(["input_force_N,output_force_N", *rows]) + "\n,," * 21 + "\n")
    assert bf.read(tmp_path / "a.csv", wrap_angle=(180, "deg")).measurements
    (tmp_path / "a.csv").write_text("\n".join(["input_force_N,output_force_N", *rows, *rows]) + "\n")
    with pytest.raises(bf.DatasetError, match=r"a\.csv has 37 rows with 74 cells, and a table has at most 40 cells; .* logger"):
        bf.read(tmp_path / "a.csv", wrap_angle=(180, "deg"))
    assert bf.read(tmp_path / "a.csv", wrap_angle=(180, "deg"), reading_limit=4).measurements
    (tmp_path / "a.csv").write_text("\n".join(["input_force_N,output_force_N", *rows]) + "\n" * 90)
    with pytest.raises(bf.DatasetError, match=r"a\.csv has 108 lines, and a table has at most 40, blank ones and remarks too"):
        bf.read(tmp_path / "a.csv", wrap_angle=(180, "deg"))
