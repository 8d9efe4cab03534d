"""Nothing that lies in the working folder runs: each module that a fit imports lies there as a trap."""

import shutil
import sys
from pathlib import Path

import pytest
from traps import caught, environment, run_among, run_until, set_traps

from bowdenfit.cli.commands import COMMANDS

DATASETS = Path(__file__).parents[2] / "datasets"
LABORATORY = DATASETS.parent / "docs" / "files" / "laboratory.toml"
FEW = ("--set", "sampler.n_walkers=32", "--set", "sampler.target_ess=100", "--set", "sampler.max_steps=400")
ALIKE = {"check", "summary", "predict", "length", "identify", "next", "teleoperate", "cell", "schema", "completion"}
START_A_FIT = """
import sys, time
from pathlib import Path
from bowdenfit.addons.app.fit_job import FitJob, FitRequest
job = FitJob(FitRequest(Path(sys.argv[1]), Path(sys.argv[2]), seed=1, mcmc=False))
while job.running:
    time.sleep(0.05)
sys.exit(job.refusal or 0)
"""


@pytest.fixture(scope="module")
def traps(tmp_path_factory):
    """The folder of traps."""
    place = tmp_path_factory.mktemp("traps")
    return set_traps(place / "folder", place / "fit")


@pytest.fixture
def bench(tmp_path):
    """A data set with a binary recording, which a process of its own reads; and a folder for results."""
    from openpyxl import Workbook

    book = Workbook()
    for row in (["input_force_N", "output_force_N"], *([float(force), round(0.8 * force, 2)] for force in range(10, 60, 5))):
        book.active.append(row)
    book.save(tmp_path / "table.xlsx")
    return tmp_path


def test_the_reader_of_binary_files_the_fit_of_the_app_and_the_workers_of_a_fleet_import_nothing_there(
    traps, bench, quick_results
):
    run_among(traps, "length", quick_results, "--json")  # whose draws a process of its own reads
    run_among(traps, "check", bench / "table.xlsx", codes=(0, 2))
    run_among(traps, sys.executable, "-P", "-c", START_A_FIT, DATASETS / "yarn-on-cylinder", bench / "fit")
    assert (bench / "fit" / "fit.json").is_file()
    run_among(traps, "fleet", small_fleet(bench / "fleet"), "-o", bench / "cables", "-j", 2, "--seed", 1)


def small_fleet(folder):
    """Write two inspections."""
    from half_turn_bench import TABLE, describe_half_turn

    for cable in ("one", "two"):
        (folder / cable).mkdir(parents=True)
        (folder / cable / "cable.toml").write_text(describe_half_turn(name=cable))
        (folder / cable / "forces.csv").write_text(TABLE)
    return folder


@pytest.mark.extended
def test_a_foreign_pythonpath_does_not_reach_child_processes(traps, bench, quick_results):
    """The program itself was started without it (`-I`), and its child processes are, too."""
    start = "import sys; from bowdenfit.__main__ import start; start()"
    for words in (("length", quick_results), ("fleet", small_fleet(bench / "fleet"), "-o", bench / "cables", "-j", 2)):
        run_among(traps, sys.executable, "-I", "-c", start, *words, PYTHONPATH=f":{traps}")


def test_python_m_bowdenfit_drops_the_working_folder_before_it_imports(traps, tmp_path, quick_results):
    """Python itself imports some modules of its own from there first, unless it is started with -P."""
    run_among(traps, sys.executable, "-P", "-m", "bowdenfit", "length", quick_results)
    for trap in traps.glob("*.py"):
        if trap.stem not in sys.stdlib_module_names and trap.stem != "bowdenfit":
            shutil.copy(trap, tmp_path)
    run_among(tmp_path, sys.executable, "-m", "bowdenfit", "length", quick_results)
    assert caught(traps) == []


def make_commands(place, fit, loop):
    """Return the words of a command for each verb; results go to a place of their own."""
    body, yarn = DATASETS / "on-body-exoskeleton", DATASETS / "yarn-on-cylinder"
    device = DATASETS / "haptic-teleoperation" / "device.toml"
    fleet = small_fleet(place / "fleet")
    return {
        "init": ["init", place / "new", "--example", "on-body-exoskeleton"],
        "check": ["check", body],
        "fit": ["fit", yarn, "-o", place / "fit", "--seed", 1, *FEW],
        "summary": ["summary", fit],
        "predict": ["predict", fit, "470", "--json"],
        "length": ["length", fit, "--json"],
        "identify": ["identify", fit],
        "next": ["next", fit, "--top", 2],
        "compare": ["compare", place / "fit", place / "copy", "-o", place / "compared"],
        "compensate": ["compensate", loop, "--device", device],
        "teleoperate": ["teleoperate", loop, device],
        "export": ["export", fit, "--to", "csv", "-o", place / "cable.csv"],
        "calibrate": ["calibrate", yarn, "-n", 20, "-j", 2, "-o", place / "calibration", "--seed", 1],
        "fleet": ["fleet", fleet, "-o", place / "cables", "-j", 2, "--seed", 1],
        "pool": ["pool", place / "cables"],
        "plot": ["plot", fit, "-o", place / "figures"],
        "report": ["report", fit, "-o", place / "report.html"],
        "simulate": ["simulate", DATASETS / "synthetic-bench" / "bench.toml", "-o", place / "simulated"],
        "metabolic": ["metabolic", DATASETS / "on-body-metabolic"],
        "certificate": ["certificate", fit, LABORATORY, "-o", place / "certified"],
        "cell": ["cell", LABORATORY.with_name("cell.xml")],
        "schema": ["schema", "cable"],
        "completion": ["completion", "bash"],
    }


@pytest.mark.parametrize("alike", [pytest.param(False, marks=pytest.mark.extended), pytest.param(True, marks=pytest.mark.slow)])
def test_no_verb_imports_from_the_working_folder(traps, tmp_path, quick_results, loop_results, alike):
    """Those that answer a question about a finished fit start alike, and load no library that others do not."""
    commands = make_commands(tmp_path, quick_results, loop_results)
    served = {"watch": (tmp_path / "bench", "mountings"), "app": (tmp_path, "The app is open")}
    assert {*commands, *served} == {name for command in COMMANDS for name in command.name}
    shutil.copytree(DATASETS / "yarn-on-cylinder", tmp_path / "bench")
    for words in [words for words in commands.values() if (words[0] in ALIKE) == alike]:
        run_among(traps, *words, codes=(0, 2, 3) if words[0] in {"pool", "compensate"} else (0, 3))
        if words[0] == "fit":
            shutil.copytree(tmp_path / "fit", tmp_path / "copy")
    if not alike:
        run_until(traps, "watch", served["watch"][0], says=served["watch"][1])
        run_until(traps, "app", served["app"][0], "--no-browser", says=served["app"][1])
    assert environment().get("PYTHONSAFEPATH") is None
