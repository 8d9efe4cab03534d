"""The wheel alone, in an environment of its own and an empty folder, does all that README.md says."""

import os
import shutil
import subprocess
import sys
import sysconfig
import time
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest
from snippets import blocks

ROOT = Path(__file__).parents[2]
FILES = ROOT / "docs" / "files"  # what a reader has measured
MOST_BYTES = 1_500_000

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("hatchling") is None, reason="hatchling, which builds the wheel, is not installed"),
]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of this checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True, timeout=300)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """Runs commands in a fresh environment with nothing of bowdenfit but the wheel; its dependencies are those of here."""
    place = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", str(place)], check=True, capture_output=True, timeout=300)
    pip = [str(place / "bin" / "python"), "-m", "pip", "install", "--no-index", "--no-deps", "--quiet", str(wheel)]
    subprocess.run(pip, check=True, capture_output=True, timeout=300, env={**os.environ, "PYTHONPATH": ""})
    environment = {**os.environ, "PYTHONPATH": sysconfig.get_path("purelib"), "PATH": f"{place / 'bin'}:{os.environ['PATH']}"}

    def call(command, folder):
        if command[-1] == "&":
            processes.append(subprocess.Popen(["python", "-m", *command[:-1]], cwd=folder, env=environment, **silent))
            time.sleep(5)  # so that one that the next needs is there
            return None
        how = {"capture_output": True, "text": True, "timeout": 600, "check": False, "stdin": subprocess.DEVNULL}
        return subprocess.run(command, cwd=folder, env=environment, **how)

    processes, silent = [], dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    yield call
    for process in reversed(processes):
        process.terminate()
        process.wait(60)


def test_the_wheel_holds_every_data_set_and_is_small(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    for path in (ROOT / "datasets").rglob("*"):
        if path.is_file():
            assert f"bowdenfit/examples/{path.relative_to(ROOT / 'datasets').as_posix()}" in names
    assert not any(name.startswith(("tests/", "docs/", "scripts/")) for name in names)
    assert wheel.stat().st_size < MOST_BYTES


def test_the_program_is_that_of_the_wheel(installed, tmp_path):
    folder = installed(["python", "-c", "import bowdenfit; print(bowdenfit.__file__)"], tmp_path).stdout
    assert str(ROOT) not in folder and "site-packages" in folder


def test_every_command_of_the_readme_works_in_an_empty_folder(installed, tmp_path):
    for name in ("angles.csv", "forces.csv"):
        if (FILES / name).exists():
            shutil.copy(FILES / name, tmp_path)
    ran = []
    for block in blocks("sh", "console", pages=(ROOT / "README.md",)):
        for words in block.commands:
            if words[-1] == "&":
                installed(list(words), tmp_path)
            if words[0] != "bowdenfit" or words in ran:
                continue  # an installation, a script of the checkout, or the same again with what it prints
            done = installed(list(words), tmp_path)
            assert done.returncode in ({0, 3} if words[1] in {"fit", "next"} else {0}), (words, done.stdout, done.stderr)
            assert "inside bowdenfit" not in done.stderr
            ran.append(words)
    assert {words[1] for words in ran} >= {"init", "check", "fit", "next", "fleet", "pool"}


def test_the_python_of_the_readme_works_there_too(installed, tmp_path):
    installed(["bowdenfit", "init", "--example", "on-body-exoskeleton"], tmp_path)
    for block in blocks("python", pages=(ROOT / "README.md",)):
        done = installed(["python", "-c", block.text], tmp_path)
        assert done.returncode == 0, done.stderr
