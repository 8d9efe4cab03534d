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
from bowdenfit.inference.engines.processes import has_room_beside, meanwhile

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

with meanwhile(both):
    while not (place / "by").exists():
        time.sleep(0.01)
    (place / "go").touch()
print("ended")
"""
    done = ran(code, tmp_path)
    assert (done.stdout, done.stderr, (tmp_path / "by").read_text()) == ("ended\n", "", "a copy")


@pytest.mark.parametrize(
    ("there", "room"),
    [("", True), ("processes.cores = lambda: 1", False), ("sys.modules['jax'] = None", False)],
    ids=["two cores", "one core", "JAX has threads"],
)
def test_a_copy_is_made_only_where_it_would_work_on_a_core_of_its_own(tmp_path, there, room):
    assert ran(f"processes.cores = lambda: 2\n{there}\nprint(has_room_beside())", tmp_path).stdout == f"{room}\n"


def test_where_there_may_be_no_more_processes_it_is_done_afterwards(tmp_path):
    code = """
def refuse():
    raise BlockingIOError("Resource temporarily unavailable")

os.fork = refuse
with meanwhile(leave):
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
    with meanwhile(fail):
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
    with meanwhile(wait):
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
