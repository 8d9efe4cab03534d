"""The scripts that make the environment, tried with stand-ins for uv and the programs that it installs."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

pytestmark = pytest.mark.extended

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
REQUIREMENTS = {
    "runtime": PROJECT["project"]["dependencies"],
    "test": PROJECT["project"]["optional-dependencies"]["test"],
    "docs": PROJECT["project"]["optional-dependencies"]["docs"],
    "lab": PROJECT["project"]["optional-dependencies"]["lab"],
    "app": PROJECT["project"]["optional-dependencies"]["app"],
    "cluster": PROJECT["project"]["optional-dependencies"]["cluster"],
    "build": PROJECT["build-system"]["requires"],
}
PINS = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if line and not line.startswith("#")]

FAKE_UV = """#!/usr/bin/env bash
echo "$*" >> "$UV_CALLS"
case "$1 ${2-}" in
    "venv "*)
        environment="${*: -1}"
        mkdir -p "$environment/bin"
        printf '#!/bin/sh\\nexec "%s" "$@"\\n' "$BOWDENFIT_PYTHON" > "$environment/bin/python"
        chmod +x "$environment/bin/python" ;;
    "pip install")
        if [ -n "${UV_FAILS-}" ]; then exit 2; fi
        for name in bowdenfit pytest; do
            printf '#!/bin/sh\\necho %s "$@"\\n' "$name" > .venv/bin/$name
            chmod +x .venv/bin/$name
        done ;;
esac
"""


class Checkout:
    """A copy of what the scripts need, with a stand-in for uv."""

    def __init__(self, folder: Path):
        self.root = folder / "a checkout"
        (self.root / "scripts").mkdir(parents=True)
        for name in ("scripts/environment.sh", "scripts/fit", "scripts/test", "pyproject.toml", "constraints.txt"):
            shutil.copy(ROOT / name, self.root / name)
        self.calls = folder / "calls"
        self.calls.touch()
        commands = folder / "commands"
        commands.mkdir()
        (commands / "uv").write_text(FAKE_UV)
        (commands / "uv").chmod(0o755)
        self.variables = {
            **os.environ,
            "PATH": f"{commands}{os.pathsep}{os.environ['PATH']}",
            "BOWDENFIT_PYTHON": sys.executable,
            "UV_CALLS": str(self.calls),
        }

    def run(self, script: str, *arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
        """Run a script from another folder and forget the earlier calls of uv."""
        self.calls.write_text("")
        return subprocess.run(
            [self.root / "scripts" / script, *arguments],
            cwd=self.root.parent,
            env=self.variables | variables,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )

    @property
    def installations(self) -> list[str]:
        """What the last run asked uv for."""
        calls = self.calls.read_text().splitlines()
        return [
            call.split()[0] if call.startswith("venv") else call.split()[-1]
            for call in calls
            if "--version" not in call
        ]


@pytest.fixture
def checkout(tmp_path):
    return Checkout(tmp_path)


def pins_for(python: str) -> dict[str, str]:
    """The pinned versions for a version of Python."""
    surroundings = {"python_version": python, "python_full_version": f"{python}.0"}
    pins: dict[str, str] = {}
    for pin in map(Requirement, PINS):
        if pin.marker is None or pin.marker.evaluate(surroundings):
            assert pin.name not in pins, f"{pin.name} is pinned twice for Python {python}"
            pins[pin.name] = next(iter(pin.specifier)).version
    return pins


@pytest.mark.parametrize("script", ["scripts/fit", "scripts/test", "scripts/environment.sh", ".ci/run"])
def test_scripts_parse(script):
    subprocess.run(["bash", "-n", ROOT / script], check=True)


@pytest.mark.parametrize("script", ["scripts/fit", "scripts/test", ".ci/run"])
def test_scripts_can_be_executed(script):
    assert os.access(ROOT / script, os.X_OK)


def test_continuous_integration_runs_the_test_script():
    lines = (ROOT / ".ci" / "run").read_text().splitlines()
    assert "./scripts/test" in lines
    assert lines[-1].startswith("./scripts/test ") and '-m "extended and not slow"' in lines[-1]


def test_constraints_name_only_names_and_versions():
    pin = re.compile(r'[a-z0-9-]+==[0-9][0-9a-z.]*( ; (python_version|sys_platform) (<|>=|==) "[a-z0-9.]+")?')
    for line in PINS:
        assert pin.fullmatch(line), line


def test_constraints_name_no_address():
    assert not re.search(r"://|www\.|\.(org|com|io)\b", (ROOT / "constraints.txt").read_text())


@pytest.mark.parametrize("python", ["3.11", "3.12", "3.13", "3.14"])
@pytest.mark.parametrize("kind", list(REQUIREMENTS))
def test_constraints_pin_every_requirement_to_a_version_it_allows(kind, python):
    pins = pins_for(python)
    for requirement in map(Requirement, REQUIREMENTS[kind]):
        if requirement.name == "bowdenfit":  # the project's own extra, which is checked by itself
            assert requirement.extras <= set(REQUIREMENTS)
            continue
        assert pins[canonicalize_name(requirement.name)] in requirement.specifier, requirement


def test_first_start_makes_the_environment_and_says_so(checkout):
    result = checkout.run("fit", "a data set", "--quick")
    assert result.returncode == 0, result.stderr
    assert result.stdout == "bowdenfit fit a data set --quick\n"
    assert "making an environment" in result.stderr
    assert checkout.installations == ["venv", "."]


def test_second_start_calls_no_installer_and_says_nothing(checkout):
    checkout.run("fit")
    result = checkout.run("fit", "data")
    assert result.stdout == "bowdenfit fit data\n"
    assert result.stderr == ""
    assert checkout.installations == []


def test_tests_add_what_they_need_and_a_fit_keeps_it(checkout):
    checkout.run("fit")
    result = checkout.run("test", "-k", "nothing")
    assert result.stdout == "pytest -k nothing\n"
    assert checkout.installations == [".[test]"]
    checkout.run("fit")
    assert checkout.installations == []


@pytest.mark.parametrize("name", ["pyproject.toml", "constraints.txt"])
def test_changed_requirements_bring_the_environment_up_to_date(checkout, name):
    checkout.run("test", "-q")
    with (checkout.root / name).open("a") as file:
        file.write("# changed\n")
    result = checkout.run("fit")
    assert "up to date" in result.stderr
    assert checkout.installations == [".[test]"]


def test_unfinished_environment_is_made_again(checkout):
    result = checkout.run("fit", UV_FAILS="1")
    assert result.returncode == 1
    assert "could not be installed" in result.stderr
    (checkout.root / ".venv" / "half a package").touch()
    result = checkout.run("fit", "data")
    assert "left unfinished" in result.stderr
    assert result.stdout == "bowdenfit fit data\n"
    assert not (checkout.root / ".venv" / "half a package").exists()


def test_failed_update_leaves_the_earlier_environment_in_use(checkout):
    checkout.run("fit")
    assert checkout.run("test", UV_FAILS="1").returncode == 1
    result = checkout.run("fit", "data")
    assert result.stdout == "bowdenfit fit data\n"
    assert checkout.installations == []


def test_moved_checkout_gets_a_new_environment(checkout):
    checkout.run("fit")
    checkout.root = checkout.root.rename(checkout.root.with_name("elsewhere"))
    result = checkout.run("fit", "data")
    assert result.stdout == "bowdenfit fit data\n"
    assert checkout.installations == ["venv", "."]


def test_environment_of_another_maker_is_left_alone(checkout):
    (checkout.root / ".venv").mkdir()
    (checkout.root / ".venv" / "pyvenv.cfg").touch()
    result = checkout.run("fit")
    assert result.returncode == 1
    assert "was not made by this script" in result.stderr
    assert [file.name for file in (checkout.root / ".venv").iterdir()] == ["pyvenv.cfg"]


def test_unusable_python_is_named_with_a_remedy(checkout):
    result = checkout.run("fit", BOWDENFIT_PYTHON="no-such-python")
    assert result.returncode == 1
    assert "no-such-python, which is not a working Python 3.11 or newer" in result.stderr
    assert not (checkout.root / ".venv").exists()


def test_packages_on_pythonpath_do_not_reach_the_fit(checkout):
    checkout.run("fit")
    program = checkout.root / ".venv" / "bin" / "bowdenfit"
    program.write_text('#!/bin/sh\necho "${PYTHONPATH-none}"\n')
    assert checkout.run("fit", PYTHONPATH="elsewhere").stdout == "none\n"
