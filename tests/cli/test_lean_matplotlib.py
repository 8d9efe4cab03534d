"""matplotlib without the manual of its artists: the program's own processes load it so, and nobody else's do."""

import subprocess
import sys

ARTISTS = """
import sys
import bowdenfit
from bowdenfit.cli import lean_matplotlib
if sys.argv[1] == "program":
    lean_matplotlib.load_without_manual()
finders = len(sys.meta_path)
from matplotlib.lines import Line2D
line = Line2D([0], [1])
line.set(color="red", linewidth=3)
has_manual, finders_gone = "Supported properties" in (Line2D.set.__doc__ or ""), finders - len(sys.meta_path)
print(has_manual, line.get_color(), line.get_linewidth(), finders_gone)
"""


def artists_of(process: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", ARTISTS, process], capture_output=True, text=True, check=True, timeout=60
    )
    return done.stdout.split()


def test_artists_have_no_manual_and_work_as_ever():
    assert artists_of("program") == ["False", "red", "3.0", "1"]


def test_a_library_leaves_matplotlib_as_it_is():
    assert artists_of("library") == ["True", "red", "3.0", "0"]


def test_the_program_loads_matplotlib_so():
    code = """
import os, sys
os._exit = lambda _: print(type(sys.meta_path[0]).__module__)
from bowdenfit import cli
sys.argv[1:] = ["--help"]
cli.start()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.splitlines()[-1] == "bowdenfit.cli.lean_matplotlib"
