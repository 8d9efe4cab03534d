"""What benchmarks print: tables, what is being measured, and on which machine."""

import os
import platform
import re
import subprocess
import sys
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from processes import ROOT

Table = list[list[str]]


def show(rows: Table) -> None:
    """Print an aligned table and an empty line."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    for i, (head, *cells) in enumerate(rows):
        line = "  ".join([head.ljust(widths[0]), *(c.rjust(w) for c, w in zip(cells, widths[1:], strict=True))])
        print(line.rstrip())
        if i == 0:
            print("-" * len(line))
    print(flush=True)


def say(case: str) -> None:
    """What is being measured, for those who wait."""
    print(f"measuring: {case}", file=sys.stderr, flush=True)


def machine(*libraries: str) -> str:
    """The line that says where these numbers are from, with the versions of libraries."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    try:
        models = re.findall(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text(encoding="utf-8"))
    except OSError:
        models = []
    versions = ", ".join(f"{name} {installed(name)}" for name in libraries)
    return (
        f"{models[0] if models else platform.machine()}, {cores} cores; Python {platform.python_version()}, {versions}; "
        f"{date.today().isoformat()}; commit {commit(ROOT)}."
    )


def installed(package: str) -> str:
    """Version of a package, or that there is none."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"


def commit(tree: Path) -> str:
    """What a checkout is at; "+" where it has been changed since."""
    command = ["git", "-C", str(tree), "describe", "--always", "--dirty=+", "--exclude", "*"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"
