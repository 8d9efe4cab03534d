"""No tricks with libraries or processes in the package, and nothing needed that only POSIX has."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "bowdenfit"
TRICKS = {
    "stands in for a module": r"sys\.modules\[|\bmodules\[",
    "hooks imports": r"meta_path|MetaPathFinder|path_hooks",
    "copies the process": r"\bos\.fork|get_context\(\s*[\"']fork|register_at_fork",
    "calls C by hand": r"\bctypes\b|\bcffi\b",
    "uses private parts of matplotlib": r"matplotlib\.\w+\._|matplotlib\._",
    "uses private parts of JAX": r"jax\._src|jax\.\w+\._",
    "changes a library": r"setattr\((?!sys, name)",
}


@pytest.mark.parametrize("case", TRICKS)
def test_no_file_of_the_package(case):
    lines = [
        f"{path.relative_to(PACKAGE)}:{number}: {line.strip()}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if re.search(TRICKS[case], line)
    ]
    assert lines == []


WITHOUT_POSIX = """
import os, signal, subprocess, sys

import filelock, jax, matplotlib, numpy, scipy.linalg  # libraries use what their platform has; only ours is asked here

for name in ("fcntl", "resource", "termios", "pwd", "grp"):
    sys.modules[name] = None
for name in ("fork", "register_at_fork", "sched_getaffinity", "killpg", "getuid", "umask_of", "waitid", "setsid"):
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGKILL", "SIGALRM", "SIGXCPU", "setitimer", "pthread_sigmask", "sigwaitinfo", "set_wakeup_fd", "SIGCHLD"):
    if hasattr(signal, name):
        delattr(signal, name)
subprocess.Popen.kill = subprocess.Popen.terminate  # which are one on Windows
from bowdenfit.cli import main
codes = []
for command in sys.argv[1].split(";"):
    sys.argv = ["bowdenfit", *command.split(",")]
    try:
        main()
    except SystemExit as stop:
        codes.append(stop.code)
print("codes", *codes)
"""
FEW = "--sampler,emcee,--set,sampler.n_walkers=32,--set,sampler.target_ess=100,--set,sampler.target_r_hat=1.1"


@pytest.mark.extended
def test_check_fit_resume_report_and_plot_need_nothing_that_only_posix_has(tmp_path):
    data, fit, recorded = PACKAGE.parent / "datasets" / "yarn-on-cylinder", tmp_path / "fit", tmp_path / "table.xlsx"
    make_workbook(recorded)
    commands = [
        f"check,{data}",
        f"check,{recorded}",  # which another process reads
        f"fit,{data},-o,{fit},--seed,1,{FEW},--set,sampler.max_steps=200",
        f"fit,{data},-o,{fit},--seed,1,{FEW},--set,sampler.max_steps=2000,--resume",
        f"report,{fit}",
        f"plot,{fit},--figure,coefficients,--format,svg",
    ]
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_POSIX, ";".join(commands)],
        capture_output=True, text=True, check=False, timeout=240, env=os.environ | {"JAX_PLATFORMS": "cpu"},
    )  # fmt: skip
    codes = done.stdout.splitlines()[-1].split()[1:]
    assert codes[:2] == ["0", "0"], done.stderr
    assert codes[2] == "3", done.stderr  # too few steps
    assert codes[3:] == ["0", "0", "0"], done.stderr
    assert (fit / "figures" / "coefficients.svg").exists()


def make_workbook(path):
    """A table of forces as Excel has it."""
    from openpyxl import Workbook

    book = Workbook()
    for row in (["input_force_N", "output_force_N"], *([float(f), round(0.8 * f, 2)] for f in range(10, 60, 5))):
        book.active.append(row)
    book.save(path)
