"""What README.md and the guides show can be typed in, commands and descriptions, and what is printed is what they show.

One fit is made for all of them, that of the README. Other fits are made by the slow tests, with quick settings; by default
their options are understood, and their data sets read.
"""

import shutil
import subprocess
import time
import tomllib
from pathlib import Path

import nptdms
import numpy as np
import pytest
from conftest import ROOT
from distributed.cli import dask_scheduler, dask_worker
from snippets import FIRST, PAGES, PUBLISHED, as_shown, blocks, masked

import bowdenfit as bf
from bowdenfit.addons.fleet.inspections import read_inspections
from bowdenfit.addons.metabolic.study import read_study
from bowdenfit.cli import bowdenfit as program
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.questions.calibrate.plan import read_truths
from bowdenfit.reading import Reading

pytestmark = pytest.mark.extended

QUICK = [f"--set=sampler.{key}" for key in ("n_walkers=64", "max_steps=400", "target_ess=100", "target_r_hat=1.2")]
GO_ON = {"app", "watch"}  # until they are interrupted
TAKES_LONG = {"fit", "fleet", "calibrate", "identify", "next"}
CLUSTER = {"scheduler": dask_scheduler.main, "worker": dask_worker.main}
POUND = 4.4482216152605  # N
CABLE = {"name": "A cable", "contact": [{"name": "sheath", "friction": "mu", "wrap_angle": {"value": 90, "unit": "deg"}}]}
TABLES = {"forces": {"file": "forces.csv"}}
SH, CONSOLE, TOML, C, MATLAB = (blocks(language) for language in ("sh", "console", "toml", "c", "matlab"))


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder as a reader has it: the data sets, the files of the guides, and the first fit."""
    folder = tmp_path_factory.mktemp("reader")
    shutil.copytree(ROOT / "datasets", folder / "datasets")
    for file in (ROOT / "docs" / "files").iterdir():
        shutil.copy(file, folder / file.name)
    write_tdms(folder / "bench.tdms", folder / "datasets/synthetic-recordings/recordings/470mm_20rpm.csv")
    shutil.copytree(ROOT / "datasets" / FIRST, folder / FIRST)
    shutil.copytree(ROOT / "datasets" / "synthetic-bench", folder / "my-cable")
    bf.fit(folder / "datasets" / FIRST, output=folder / "fits" / FIRST, figures=False, seed=1)
    return folder


def write_tdms(path, source):
    """A recording as LabVIEW writes it, the motor's force in N and the load's in lbf."""
    time, force, load, _ = np.loadtxt(source, delimiter=",", skiprows=1).T
    clock = {"wf_increment": float(time[1] - time[0]), "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as writer:
        channels = (("motor", "ai0", force), ("load", "ai1", load / POUND))
        writer.write_segment([nptdms.ChannelObject(*channel, properties=clock) for channel in channels])


@pytest.fixture
def reader(place, monkeypatch):
    """The reader's folder, in which everything is run."""
    monkeypatch.chdir(place)
    return place


def understood(words):
    """The arguments and options of a command, as the program reads them; refuses what it does not know."""
    _, bound, _ = program.parse_args(words[1:])
    return bound.args, bound.kwargs


def test_every_page_has_its_blocks_found():
    assert {block.page.name for block in SH} >= {"README.md", "own-cable.md", "recordings.md", "loops.md", "trust.md"}
    assert len(TOML) >= 4


@pytest.mark.parametrize("block", SH + CONSOLE, ids=str)
def test_every_command_can_be_typed_in(block, reader, run):
    for words in block.commands:
        if words[0] != "bowdenfit":
            stands_in_for(words)
        elif len(words) > 1 and not words[1].startswith("-"):
            tried(words, run)


def stands_in_for(words):
    """What other commands need is there: a script, an extra of the package, or an option of Dask."""
    if words[0] == "dask":
        CLUSTER[words[1]].make_context(words[1], [word for word in words[2:] if word != "&"])
        return
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    named = [word for word in words if word.startswith(("./scripts", "scripts/"))]
    assert all((ROOT / name).exists() for name in named), words
    request = [word.partition("[")[2].rstrip("]") for word in words if "[" in word]
    assert all(extra in extras for extra in request), words
    assert named or words[:2] == ("pip", "install"), f"say what the tests should do with {words}"


def tried(words, run):
    """Run a command where that is quick, else read what it would work on."""
    verb, (arguments, options) = words[1], understood(words)
    named = [word for argument in arguments for word in (argument if isinstance(argument, list) else [argument])]
    paths = [name for name in named if isinstance(name, Path)]
    if verb == "init":
        shutil.rmtree(next(iter(paths or options["example"])), ignore_errors=True)
    elif not all(path.exists() for path in paths):
        return  # fits that another command of the page makes; the slow test makes them
    if verb in GO_ON:
        return
    if verb == "fleet":
        assert read_inspections(paths[0])
    elif verb in TAKES_LONG:
        keywords = {name: value for name, value in options.items() if name in Reading.__annotations__}
        if paths[0].parts[0] != "fits" and paths[0].name != "bench.toml":
            bf.check(paths[0], **keywords)
    else:
        code, out, err = run(*words[1:])
        named_first = verb == "check" and "\nTo fit it:\n" in out  # it says what the next command of the page names
        assert code == 0 or (code == 2 and named_first), (words, out, err)


@pytest.mark.parametrize("block", CONSOLE, ids=str)
def test_every_command_prints_what_is_shown(block, reader, run):
    for words, shown in block.shown:
        if (published := PUBLISHED.get(words)) is not None:
            assert as_shown(shown, published.read_text(encoding="utf-8")), words
        else:
            code, out, err = run(*words[1:])
            assert code == 0, err
            of_a_fit = any(word.startswith("fits/") for word in words)  # which another machine makes with other digits
            assert as_shown(shown, out) or (of_a_fit and as_shown(shown, out, masked)), f"{words}\n{out}"


def test_a_published_fit_has_no_draws_so_that_its_texts_are_for_reading_alone(run):
    code, out, err = run("summary", ROOT / "fits" / "published" / FIRST)
    assert (code, out) == (2, "")
    assert "posterior.nc is missing" in err


@pytest.mark.parametrize("block", TOML, ids=str)
def test_every_description_is_understood(block, tmp_path):
    document = tomllib.loads(block.text)
    if block.text.startswith("# truths.toml"):
        (tmp_path / "truths.toml").write_text(block.text, encoding="utf-8")
        assert read_truths(tmp_path / "truths.toml") == document
    elif "persons" in document:
        (tmp_path / "metabolic.toml").write_text(block.text, encoding="utf-8")
        assert read_study(tmp_path)[0].persons == document["persons"]
    else:
        tables = {} if "tables" in document else {"tables": TABLES}
        assert parse_description({**CABLE, **tables, **document}).to_json()


@pytest.mark.parametrize("block", C, ids=str)
@pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
def test_every_program_in_c_compiles_without_a_warning_and_runs(block, reader, tmp_path):
    bf.export(bf.load(f"fits/{FIRST}"), "c", tmp_path / "cable.h")
    (tmp_path / "main.c").write_text(block.text, encoding="utf-8")
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["gcc", *strict, "main.c", "-o", "main", "-lm"], cwd=tmp_path, check=True, timeout=60)
    done = subprocess.run([tmp_path / "main"], input="100 75\n", capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0 and any(char.isdigit() for char in done.stdout), done


@pytest.mark.slow
@pytest.mark.parametrize("block", MATLAB, ids=str)
@pytest.mark.skipif(shutil.which("octave") is None, reason="octave is not installed")
def test_everything_in_matlab_runs_in_octave(block, reader, tmp_path):
    bf.export(bf.load(f"fits/{FIRST}"), "matlab", tmp_path / "cable.m")
    command = ["octave", "--quiet", "--no-gui", "--eval", block.text]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stderr) == (0, "") and done.stdout.count(" = ") == block.text.count(" = "), done


@pytest.fixture
def run_other_command():
    """Programs that run beside the reader's commands, as those behind which an & stands; they end with the test."""
    started = []

    def start(words):
        started.append(subprocess.Popen(words[: words.index("&")], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        time.sleep(2)  # so that one that the next needs is there

    yield start
    for process in reversed(started):
        process.terminate()
        process.wait(60)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_command_of_a_page_runs_one_after_the_other(page, place, run_other_command, tmp_path, monkeypatch, run):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(place, tmp_path, dirs_exist_ok=True)
    for block in blocks("sh", "console", pages=(page,)):
        for words in block.commands:
            if words[-1] == "&":
                run_other_command(words)
            if words[0] != "bowdenfit" or len(words) < 2 or words[1].startswith("-"):
                continue
            if words[1] == "init":
                shutil.rmtree(next(iter(understood(words)[0]), FIRST), ignore_errors=True)
            quick = {"fit": [*QUICK, "--no-figures", "--force"], "calibrate": ["-n", "2", *QUICK, "--force"]}.get(words[1], [])
            code, out, err = run(*words[1:], *quick)
            may_differ = "They differ about the stated wall" in " ".join(out.split())  # linear loop and simulation
            assert code in (0, 3 if quick or may_differ else 0), (words, out, err)


@pytest.mark.slow
def test_the_first_fit_prints_what_the_readme_shows(reader, run):
    shown = next(shown for block in CONSOLE for words, shown in block.shown if words[1:] == ("fit", FIRST))
    code, out, _ = run("fit", FIRST, "--seed", "1", "--force", "--no-figures")
    assert code == 0
    assert masked(out) == masked(shown)
