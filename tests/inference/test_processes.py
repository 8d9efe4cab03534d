"""What a copy of a process does meanwhile is done, by whomever; a copy ends with what it was made for."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are copied on Linux alone")

# A process is copied only where nothing else runs in it, so each of these is one of its own.
BEGIN = """
import os, sys, time
from pathlib import Path
from bowdenfit.inference.engines import processes
from bowdenfit.inference.engines.processes import meanwhile

processes.cores = lambda: 2
ours, place = os.getpid(), Path(sys.argv[1])

def leave(*more):
    (place / "by").write_text("us" if os.getpid() == ours else "a copy")
"""


def ran(code: str, place: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", BEGIN + code, str(place)], capture_output=True, text=True, check=False, timeout=60
    )


def test_a_copy_works_while_this_one_goes_on(tmp_path):
    """Both wait for each other: neither could end if one came after the other."""
    code = """
def both():
    leave()
    while not (place / "go").exists():
        time.sleep(0.01)

with meanwhile(both, True):
    while not (place / "by").exists():
        time.sleep(0.01)
    (place / "go").touch()
print("ended")
"""
    done = ran(code, tmp_path)
    assert (done.stdout, done.stderr, (tmp_path / "by").read_text()) == ("ended\n", "", "a copy")


@pytest.mark.parametrize(
    ("there", "in_background"),
    [("", False), ("processes.cores = lambda: 1", True), ("sys.modules['jax'] = None", True)],
    ids=["not asked for", "one core", "JAX has threads"],
)
def test_without_a_copy_it_is_done_afterwards(tmp_path, there, in_background):
    code = f"""
{there}
with meanwhile(leave, {in_background}):
    assert not (place / "by").exists()
"""
    done = ran(code, tmp_path)
    assert (done.stderr, (tmp_path / "by").read_text()) == ("", "us")


def test_what_a_copy_fails_at_is_done_again_and_fails_here(tmp_path):
    code = """
def fail():
    leave()
    raise ValueError("no room")

try:
    with meanwhile(fail, True):
        pass
except ValueError as error:
    print(error)
"""
    done = ran(code, tmp_path)
    assert (done.stdout, done.stderr, (tmp_path / "by").read_text()) == ("no room\n", "", "us")


def test_a_copy_ends_where_this_one_fails(tmp_path):
    code = """
def wait():
    (place / "number").write_text(str(os.getpid()))
    time.sleep(60)

try:
    with meanwhile(wait, True):
        while not (place / "number").exists() or not (place / "number").read_text():
            time.sleep(0.01)
        raise KeyboardInterrupt
except KeyboardInterrupt:
    print("interrupted")
"""
    before = time.monotonic()
    done = ran(code, tmp_path)
    assert (done.stdout, done.stderr) == ("interrupted\n", "")
    assert time.monotonic() - before < 50
    assert not Path(f"/proc/{(tmp_path / 'number').read_text()}").exists()
