"""Files of a bench that still measures: whatever is half written, replaced or still growing is waited for, never misread."""

import os
import tracemalloc

import pytest

from bowdenfit.questions.watch.files import QUIET, BenchFiles

HEAD = "run,stroke,input_force_N,output_force_N\n"
ROW = "1,pull,20,13.2\n"


class Bench:
    """A folder that is watched, and a clock that goes as fast as the test."""

    def __init__(self, tmp_path):
        self.folder, self.now = tmp_path / "cable", 0.0
        self.folder.mkdir()
        copies = tmp_path / "copies"
        copies.mkdir()
        (self.folder / "cable.toml").write_text("schema = 1\n")
        self.files = BenchFiles(self.folder, copies)

    def wait(self, seconds: float = 2 * QUIET) -> bool:
        """Look, wait, and look again; return whether there is something to read."""
        self.files.look(self.now)
        self.now += seconds
        return self.files.look(self.now)

    def read(self, name: str = "forces.csv") -> bytes | None:
        """Return what a reader would see of a file; None where it would not see it."""
        copy = self.files.copy_settled(self.now)
        assert copy is not None
        return (copy / name).read_bytes() if (copy / name).exists() else None


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path)


def test_a_last_row_counts_once_its_line_has_ended(bench):
    (bench.folder / "forces.csv").write_text(HEAD + ROW + "1,pull,30,1")
    assert bench.wait()
    assert bench.read() == (HEAD + ROW).encode()
    with (bench.folder / "forces.csv").open("a") as file:
        file.write("9.7\n")
    assert bench.wait()
    assert bench.read() == (HEAD + ROW + "1,pull,30,19.7\n").encode()


def test_a_writer_that_was_killed_leaves_a_row_that_never_counts(bench):
    (bench.folder / "forces.csv").write_text(HEAD + ROW + "1,pull,30,")
    bench.wait()
    bench.read()
    assert not bench.wait(3600.0)
    assert bench.read() == (HEAD + ROW).encode()


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
def test_half_a_row_in_two_bytes_a_letter_does_not_count(bench, encoding):
    mark = {"utf-16-le": b"\xff\xfe", "utf-16-be": b"\xfe\xff"}[encoding]
    whole = mark + (HEAD + ROW + "Ċ,pull\n").encode(encoding)  # a letter that holds the byte of an end of line
    (bench.folder / "forces.csv").write_bytes(whole + "1,Ċ3".encode(encoding)[:-1])
    bench.wait()
    assert bench.read() == whole


def test_a_file_that_changes_is_waited_for(bench):
    path = bench.folder / "forces.csv"
    path.write_text(HEAD)
    for _ in range(20):
        with path.open("a") as file:
            file.write(ROW)
        bench.files.look(bench.now)
        bench.now += QUIET / 2
    assert bench.read() is None
    assert bench.wait()
    assert bench.read() == (HEAD + 20 * ROW).encode()


def test_while_a_file_that_was_read_is_replaced_nothing_is_read(bench):
    path = bench.folder / "forces.csv"
    path.write_text(HEAD + ROW)
    bench.wait()
    bench.read()
    path.unlink()
    assert not bench.files.look(bench.now)  # it is gone: for a moment, or for good
    bench.now += QUIET / 2
    path.write_text(HEAD)
    assert not bench.files.look(bench.now)
    bench.now += QUIET / 2
    path.write_text(HEAD + 2 * ROW)
    assert not bench.files.look(bench.now)
    assert bench.wait()
    assert bench.read() == (HEAD + 2 * ROW).encode()


def test_a_file_that_stays_away_is_gone(bench):
    path = bench.folder / "forces.csv"
    path.write_text(HEAD + ROW)
    bench.wait()
    bench.read()
    path.unlink()
    assert bench.wait()
    assert bench.read() is None


@pytest.mark.extended
def test_a_log_of_an_hour_is_waited_for_in_flat_memory(bench):
    path = bench.folder / "470mm.csv"
    path.write_text("time,input force,output force\n")
    (bench.folder / "forces.csv").write_text(HEAD + ROW)
    bench.wait()
    tracemalloc.start()
    for step in range(1800):  # 1 kHz, looked at each two seconds: 2000 rows of 40 bytes more
        os.truncate(path, 30 + 80_000 * (step + 1))
        bench.files.look(bench.now)
        bench.now += 1.9
    assert bench.read("470mm.csv") is None
    assert bench.read() == (HEAD + ROW).encode()  # of what else is there nothing waits
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2_000_000
    with path.open("r+b") as file:
        file.seek(-1, os.SEEK_END)
        file.write(b"\n")
    assert bench.wait(6.0)  # more than three times its longest pause
    bench.files.copy_settled(bench.now)
    assert (bench.files.copy / "470mm.csv").is_symlink()  # read where it lies
    assert bench.files.is_unchanged()
    os.truncate(path, 1000)
    assert not bench.files.is_unchanged()


def test_a_logger_that_writes_its_buffer_now_and_then_is_not_taken_for_one_that_has_ended(bench):
    path = bench.folder / "470mm.csv"
    path.write_text(20_000 * "0.001,20,13\n")
    for _ in range(4):
        bench.files.look(bench.now)
        with path.open("a") as file:
            file.write("0.001,20,13\n" * 1000)
        bench.now += 4.0
    bench.files.look(bench.now)
    bench.now += 8.0
    assert bench.read("470mm.csv") is None
    bench.now += 4.0
    assert bench.read("470mm.csv") is not None


def test_a_long_file_that_breaks_off_in_a_row_is_waited_for_a_minute(bench):
    path = bench.folder / "470mm.csv"
    path.write_text(20_000 * "0.001,20,13\n" + "0.0")
    bench.wait(30.0)
    assert bench.read("470mm.csv") is None
    bench.wait(40.0)
    assert bench.read("470mm.csv") == (20_000 * "0.001,20,13\n").encode()


def test_hidden_files_and_pipes_are_left_alone(bench):
    (bench.folder / ".~lock.forces.csv#").write_text("me")
    os.mkfifo(bench.folder / "pipe.csv")
    bench.wait()
    copy = bench.files.copy_settled(bench.now)
    assert [path.name for path in copy.iterdir()] == ["cable.toml"]


def test_a_description_may_name_what_lies_beside_its_folder(tmp_path):
    (tmp_path / "angles.csv").write_text("x\n")
    bench = Bench(tmp_path)
    (bench.folder / "cable.toml").write_text('file = "../angles.csv"\n')
    files = BenchFiles(bench.folder, tmp_path / "more")
    assert (files.copy / ".." / "angles.csv").read_text() == "x\n"


def test_one_file_is_watched_with_that_of_a_second_logger(tmp_path):
    for name in ("input.csv", "output.csv", "other.csv"):
        (tmp_path / name).write_text("a\n1\n")
    copies = tmp_path / "copies"
    copies.mkdir()
    files = BenchFiles(tmp_path / "input.csv", copies, tmp_path / "output.csv")
    files.look(0.0)
    assert files.look(1.0)
    files.copy_settled(1.0)
    assert files.copy.read_text() == files.joined_copy.read_text() == "a\n1\n"
    assert len(files.read_marks) == 2
