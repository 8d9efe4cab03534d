"""What was once tried on the command line: each ends in time, with an exit code and a sentence, and writes nothing."""

import os
import shutil

import pytest
from limited_processes import Attempts
from slow_cases import some_slow

pytestmark = pytest.mark.extended

SECONDS, MEMORY = 10.0, 400 << 20
TABLE = "time (s),input force (N),output force (N)\n" + "".join(f"{i / 100},{40 + i % 9},{30 + i % 9}\n" for i in range(200))


@pytest.fixture(scope="module")
def attempts():
    server = Attempts()
    yield server
    server.end()


@pytest.fixture
def tried(attempts, tmp_path):
    """Try a command: its exit code is one of those named, in bounds, in our words, and it writes nothing."""

    def call(*arguments, codes=(2,), names=""):
        files_at_start = sorted(tmp_path.rglob("*"))
        done = attempts(*arguments, folder=tmp_path)
        assert done.code in codes, done
        assert done.seconds < SECONDS and done.memory < MEMORY, done
        if done.code == 2:
            first, *more = done.err.splitlines()
            assert first.startswith("Error: ") and all(line.startswith("- ") for line in more), done.err
            assert done.out == "" and names in done.err and len(done.err) < 1500, done.err
        else:
            assert done.err == ""
        assert all(x.isprintable() or x in "\n\t\u00a0" for x in done.out + done.err)
        assert sorted(tmp_path.rglob("*")) == files_at_start
        return done

    return call


@pytest.fixture
def cable(on_body, tmp_path):
    return shutil.copytree(on_body, tmp_path / "cable")


def replace_in(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


BLANKS = (" ", "\t", "\u00a0", "\u2003", "\x0b", "\x0c", "\x1c", "\x85", "\u2028", '""', '" "', ",,,", ";;;", "|", "'")
OTHERS = ("\ufeff", "\u200b", "\0", "#", "%")


@pytest.mark.parametrize("blank", some_slow((*BLANKS, *OTHERS), (" ", "\u2003", "\x1c", '" "', ",,,", "\0", "#")), ids=ascii)
def test_files_may_begin_with_lines_of_blanks_of_any_kind(cable, tmp_path, tried, blank):
    replace_in(cable / "efficiencies.csv", "", f"{blank}\n" * 20)
    tried("check", cable, codes=(0, 2), names="efficiencies.csv")
    (tmp_path / "run.csv").write_text(f"{blank}\n" * 20 + TABLE)
    tried("check", tmp_path / "run.csv", "--wrap-angle=180deg", codes=(0, 2), names="run.csv")


@pytest.mark.parametrize("blank", some_slow((*BLANKS, *OTHERS), (" ", "\x0b", "\u2028", ";;;", "\u200b")), ids=ascii)
def test_files_of_nothing_but_blanks_are_refused(tmp_path, tried, blank):
    (tmp_path / "run.csv").write_text(f"{blank}\n" * 2000)
    tried("check", tmp_path / "run.csv", "--wrap-angle=180deg", names="run.csv")


CELLS = ("x" * 140_000, "1" * 140_000, '"' + "a\n" * 70_000 + '"', '"' + "x" * 140_000)


@pytest.mark.parametrize("cell", some_slow(CELLS, (CELLS[2],)), ids=["letters", "digits", "lines", "open"])
def test_cells_of_any_length_are_refused_in_a_short_sentence(cable, tmp_path, tried, cell):
    for line in (0, 1, 2):
        text = (cable / "angles.csv").read_text().splitlines()
        text[line] = ",".join([*text[line].split(",")[:-1], cell])
        (tmp_path / "cable" / "angles.csv").write_text("\n".join(text) + "\n")
        tried("check", cable, names="angles.csv", codes=(0, 2) if line == 0 else (2,))
    for line in (0, 1, 50):
        text = TABLE.splitlines()
        text[line] += cell
        (tmp_path / "run.csv").write_text("\n".join(text) + "\n")
        tried("check", tmp_path / "run.csv", "--wrap-angle=180deg", codes=(0, 2), names="run.csv")


NAMES = (
    "/etc/*", "/etc/passwd", "/etc", "", ".", "..", "/", "~/x.csv", "a\\u0000b.csv", "*\\u0000", "a" * 300 + ".csv",
    "b/" * 3000 + ".csv", "angles.csv/x.csv", "loop.csv", "\\u001b[31m.csv", "a\\nb.csv", "**", "[a-", "?", "/dev/stdin",
    "/dev/tty", "/proc/self/mem", "/proc/kmsg", "/proc/self/environ", "/sys/kernel/notes", "file:///etc/passwd", "|ls",
    "cable.toml", "folder",
)  # fmt: skip


@pytest.mark.parametrize("name", some_slow(NAMES, NAMES[::2]))
def test_files_that_no_data_set_has_are_refused_by_their_names(cable, tried, name):
    (cable / "loop.csv").symlink_to("loop.csv")
    (cable / "folder").mkdir()
    replace_in(cable / "cable.toml", '"efficiencies.csv"', f'"{name}"')
    tried("check", cable)


TOML = {
    "lists": "x = " + "[" * 500 + "]" * 500,
    "dots": ".".join(["a"] * 20_000) + " = 1", "heading": f"[{'.'.join(['a'] * 20_000)}]",
    "digits": "x = " + "9" * 5000, "hexadecimal": "x = 0x" + "f" * 5000, "binary": "x = 0b" + "1" * 90_000,
    "decimals": "x = 1." + "1" * 9000, "exponent": "x = 1e" + "9" * 5000, "year": "x = 99999-01-01",
    "text": f'x = "{"a" * 1_000_000}"', "escape": '"\\u001b[31m" = 1', "key": "a" * 100_000 + " = 1", "control": "x = '\x01'",
}  # fmt: skip


@pytest.mark.parametrize("case", TOML)
def test_descriptions_that_nobody_would_write_are_refused(cable, tried, case):
    (cable / "cable.toml").write_text(f"{TOML[case]}\n{(cable / 'cable.toml').read_text()}")
    tried("check", cable)
    if len(TOML[case]) < 100_000:  # the system takes no longer argument
        tried("check", cable, "--set", TOML[case])


KEYS = ("name", "schema", "route.range", "friction.mu1.fixed", "sampler.max_steps")
VALUES = ("0x" + "f" * 5000, "1e308", "-1e300", "nan", "inf", "[]", "{}", "1979-05-27")
PAIRS = [(key, value) for key in KEYS for value in VALUES]


@pytest.mark.parametrize(("key", "value"), some_slow(PAIRS, PAIRS[::3]))
def test_settings_take_no_value_that_is_none(cable, tried, key, value):
    tried("check", cable, "--set", f"{key}={value}", codes=(2,) if value != "1e308" else (0, 2))


HEADS = (b"", b"MATLAB 5.0", b"PK\x03\x04")
ENDINGS = ("csv", "txt", "lvm", "toml", "mat", "h5", "xlsx", "parquet", "mf4", "tdms", "bag", "cmbl")
LARGE = [(head, ending) for head in HEADS for ending in ENDINGS]


@pytest.mark.parametrize(("head", "ending"), some_slow(LARGE, [*LARGE[:12], *LARGE[16::6]]))
def test_files_larger_than_the_memory_are_refused_unread(tmp_path, tried, head, ending):
    path = tmp_path / f"large.{ending}"
    with path.open("wb") as file:
        file.write(head)
        file.truncate(30 << 30)  # takes no room on the disk
    tried("check", path, "--wrap-angle=180deg", names="large")


@pytest.mark.parametrize("table", ["angles.csv", "efficiencies.csv", "cable.toml"])
def test_tables_larger_than_the_memory_are_refused_unread(cable, tried, table):
    with (cable / table).open("ab") as file:
        file.truncate(30 << 30)
    tried("check", cable, names=table)


PLACES = ("/dev/null", "/dev/null/x", "/proc/x", "cable/cable.toml", "cable/cable.toml/x", "n" * 300)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("verb", ["init", "fit"])
def test_what_cannot_be_written_is_refused_before_anything_is_done(cable, tried, verb, place):
    tried(*(("init", place) if verb == "init" else ("fit", cable, "--no-mcmc", "-o", place)))


NAMES = [b"\xff\xfe", b"a\x1b[31m", b"a\nb", b" ", b"%2F$_{"]


@pytest.mark.parametrize("name", some_slow(NAMES, NAMES[:2]), ids=ascii)
def test_names_of_any_bytes_are_taken_and_never_printed_raw(on_body, tmp_path, tried, name):
    folder = shutil.copytree(on_body, tmp_path / os.fsdecode(name))
    tried("check", folder, codes=(0,))
    (folder / "angles.csv").unlink()
    tried("check", folder, names="angles.csv")
    tried("init", folder)
    path = tmp_path / os.fsdecode(b"f" + name + b".csv")
    path.write_text("x")
    tried("check", path)
