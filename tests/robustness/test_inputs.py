"""What may be opened: regular files of a size that fits; patterns end; TOML that nobody would write is a sentence."""

import os
import shutil
import socket
import subprocess
import sys
import time

import pytest

import bowdenfit as bf


@pytest.fixture
def cable(on_body, tmp_path):
    return shutil.copytree(on_body, tmp_path / "cable")


def replace_in(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def pipe(path):
    os.mkfifo(path)


def endless(path):
    path.symlink_to("/dev/zero")


def listening(path):
    with socket.socket(socket.AF_UNIX) as unix_socket:
        unix_socket.bind(str(path))


@pytest.mark.parametrize(("make", "case"), [(pipe, "a named pipe"), (endless, "a device"), (listening, "a socket")])
@pytest.mark.parametrize("name", ["angles.csv", "efficiencies.csv", "cable.toml"])
def test_what_is_no_file_is_refused_before_it_is_opened(cable, monkeypatch, name, make, case):
    (cable / name).unlink()
    monkeypatch.chdir(cable)  # names of sockets are short
    make((cable / name).relative_to(cable))
    with pytest.raises(bf.BowdenfitError, match=f"{name} is {case}, not a file"):
        bf.check(cable)


@pytest.mark.parametrize("name", ["bench.csv", "cable.toml"])
def test_a_pipe_in_the_place_of_the_data_set_is_called_that(tmp_path, name):
    os.mkfifo(tmp_path / name)
    with pytest.raises(bf.BowdenfitError, match=f"{name} is a named pipe, not a file"):
        bf.check(tmp_path / name)


@pytest.mark.parametrize("ending", [".csv", ".mat", ".xlsx", ".h5", ".mf4"])
def test_a_recording_that_is_a_pipe_is_refused(tmp_path, ending):
    os.mkfifo(tmp_path / f"run{ending}")
    with pytest.raises(bf.DatasetError, match="is a named pipe, not a file"):
        bf.read(tmp_path / f"run{ending}", wrap_angle=(180, "deg"))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x = " + "[" * 5000 + "]" * 5000, "nested too deeply"),
        (".".join(["a"] * 20_000) + " = 1", "nested too deeply"),
        ("a = {" + "b = {" * 400 + "}" * 401, "nested too deeply"),
        ("x = " + "9" * 5000, "is not valid TOML"),
        ("x = 1\n" * 3, "is not valid TOML"),
        ("#" * 5_000_000, "larger than 4 MB"),
        ('x = "\x00"', "is not valid TOML"),
        ("[route]\nchoices = [" + "1, " * 10_001 + "]", "'choices': one list or table has 10,001 entries"),
        ("[friction]\n" + "".join(f"m{i}.fixed = 1\n" for i in range(10_001)), "'friction': one list or table"),
    ],
    ids=["list", "dots", "tables", "digits", "twice", "large", "nul", "long list", "long table"],
)
def test_toml_that_nobody_would_write_is_a_sentence(cable, text, says):
    (cable / "cable.toml").write_text(text)
    with pytest.raises(bf.DescriptionError, match=says) as refused:
        bf.check(cable)
    assert len(str(refused.value)) < 400


CONTACT = '[[contact]]\nname = "c{0}"\nfriction = "mu{0}"\nwrap_angle = {{ value = 45, unit = "deg" }}\n'


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("choices = [430,", "choices = [" + "430, " * 1000, "route.choices: there are 1,010 entries, and at most 1,000"),
        ("[tables]", "".join(map(CONTACT.format, range(100))) + "[tables]", "contact: .* at most 100 are read; join"),
        ("[tables]", '[[recording]]\nfile = "r.csv"\n' * 1001 + "[tables]", "recording: .* at most 1,000 are read; fit"),
        ("[tables]", "".join(f"[friction.m{i}]\nfixed = 1\n" for i in range(1001)) + "[tables]", "friction: .* at most 1,000"),
        ('file = "efficiencies.csv"', "files = [" + '"efficiencies.csv", ' * 1001 + "]", "names 1,001 files or more"),
        ("[route]", 'friction_model = "' + "drag+" * 41 + '"\n[route]', "friction_model: string should have at most 200"),
        ('source = "', 'source = "' + "a" * 10_001, "source: string should have at most 10000"),
    ],
    ids=["choices", "contacts", "recordings", "coefficients", "files", "words", "text"],
)
def test_every_count_in_a_description_has_a_limit(cable, old, new, says):
    replace_in(cable / "cable.toml", old, new)
    with pytest.raises(bf.DescriptionError, match=says):
        bf.read(cable)


def test_recordings_whose_links_lead_round_in_a_circle_are_a_sentence(tmp_path):
    (tmp_path / "a.csv").symlink_to("b.csv")
    (tmp_path / "b.csv").symlink_to("a.csv")
    text = 'recordings = {}\n[[recording]]\nfile = '
    for named in ('recordings = { files = "*.csv" }', f'{text}"a.csv"', f'{text}"a\\u0000"'):
        (tmp_path / "cable.toml").write_text(f'name = "x"\n{CONTACT.format(1)}[tables]\n{named}\n')
        with pytest.raises(bf.DatasetError, match="cannot be the name of a file"):
            bf.read(tmp_path)


def test_a_description_that_is_no_utf_8_is_a_sentence(cable):
    (cable / "cable.toml").write_bytes(b'name = "\xff\xfe"')
    with pytest.raises(bf.DescriptionError, match="not valid TOML"):
        bf.check(cable)


@pytest.mark.parametrize(
    ("pattern", "says"),
    [("/etc/*", "does not start in the folder"), ("a*\\u0000", "does not start in the folder"),
     ("**/**/**/*.csv", "too many stars"), ("*a" * 30, "too many stars"), ("nothing*.csv", "no file in"),
     ("[a-z]" * 300, "is too long")],
)  # fmt: skip
def test_patterns_end(cable, pattern, says):
    replace_in(cable / "cable.toml", '"efficiencies.csv"', f'"{pattern}"')
    start = time.monotonic()
    with pytest.raises(bf.BowdenfitError, match=says):
        bf.check(cable)
    assert time.monotonic() - start < 5


@pytest.mark.parametrize(
    "setting",
    [
        "contact.².friction=mu",
        "contact.9.friction=mu",
        "x=" + "9" * 5000,
        "x=" + "[" * 3000,
        "=",
        "tables=",
        "a.b.c.d=1",
    ],
)
def test_settings_that_lead_nowhere_are_sentences(on_body, setting):
    with pytest.raises(bf.DescriptionError) as refused:
        bf.check(on_body, settings=[setting])
    assert len(str(refused.value)) < 600


@pytest.mark.parametrize("answer", [bf.fit, bf.check, bf.identify, bf.calibrate])
def test_what_changes_the_reading_comes_too_late_for_a_data_set_that_has_been_read(on_body, answer):
    data = bf.read(on_body)
    with pytest.raises(bf.UsageError, match="settings and noise would change nothing: name that where it is read"):
        answer(data, settings=["friction.mu1.fixed=0.1"], noise="student", columns=())


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (["sampler.target_ess=1e12"], "307,200 draws at most"),
        (["sampler.method=nuts", "sampler.target_ess=200000"], "192,000 draws at most"),
        (["sampler.max_steps=200", "sampler.n_walkers=32", "sampler.target_ess=1281"], "1,280 draws at most"),
        (["sampler.max_steps=1e18"], "max_steps"),
        (["sampler.n_walkers=1e9"], "n_walkers"),
    ],
)
def test_targets_that_no_sampling_can_reach_are_refused_at_the_start(on_body, tmp_path, settings, says):
    with pytest.raises(bf.BowdenfitError, match=says) as refused:
        bf.fit(on_body, output=tmp_path / "fit", settings=settings)
    assert refused.value.exit_code == 2
    assert not (tmp_path / "fit").exists()


@pytest.mark.extended
@pytest.mark.parametrize(
    ("output", "code", "message"), [("| true", 141, ""), (">&-", 0, ""), ("2>&- >&-", 0, ""), ("2>/dev/full", 0, "On-body")]
)
def test_output_that_nobody_reads_is_no_failure(output, code, message):
    command = f"set -o pipefail; {sys.executable} -m bowdenfit metabolic datasets/on-body-metabolic {output}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stderr) == (code, "") and done.stdout.startswith(message)


@pytest.mark.parametrize("output", ["2>&-", "2>/dev/full"])
def test_a_refusal_that_nobody_reads_is_one_all_the_same(output):
    done = subprocess.run(["bash", "-c", f"{sys.executable} -m bowdenfit check /nowhere {output}"], check=False, timeout=60)
    assert done.returncode == 2


def test_names_of_files_in_a_refusal_break_no_line_and_steer_no_terminal(tmp_path):
    with pytest.raises(bf.BowdenfitError) as refused:
        bf.read(tmp_path / "51\u2028mm\x1b[31m.csv")
    assert "51\\u2028mm\\x1b[31m.csv" in str(refused.value)
    assert all(letter.isprintable() for letter in str(refused.value))
