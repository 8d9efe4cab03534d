"""Which promise was broken by a job that was struck, and whether it finds the same when it is told to go on."""

import os
import re
import signal
import subprocess
import time
from pathlib import Path

from kills.blow import Blow
from kills.jobs import START
from kills.runs import LONGEST, Known

PYTHONS = "Could not import runpy module", "Fatal Python error: init_import_site"  # how it ends where it has just begun
OURS = re.compile(r"Interrupted|Error: |Warning: |Wrote |\S+ holds the whole fit, but ")  # how what is said begins


def broken(blow: Blow, code: int, err: str, finished: bool, session: int, folder: Path) -> str:
    """Which promise a job broke that was struck; empty if none."""
    interrupted = blow.sent in {signal.SIGINT, signal.SIGTERM}
    initial = code == -blow.sent or err.startswith(PYTHONS) if interrupted else False  # anything of ours was loaded
    early = initial and blow.struck == START
    lines = err.splitlines()
    if is_running(session):
        os.killpg(session, signal.SIGKILL)
        return "a process is left"
    if code in {0, 3} and not finished:
        return f"exit code {code}, but {blow.job.done} is missing"
    if interrupted and blow.struck is not None and not finished and code != 130 and not early:
        return f"exit code {code}"
    if blow.starved and code < 0:  # a compiled library that gets no memory aborts, in words of its own
        return ""
    if blow.starved and not finished and (code != 1 or not err.startswith("Error: ") or len(lines) > 1):
        return f"exit code {code}, and said {err[:300]!r}"
    if not early and not all(OURS.match(line) for line in lines if line):
        return f"said {err[:300]!r}"
    if "--resume" in err and not (folder / blow.job.checkpoint).exists():
        return "--resume is promised, and nothing is kept"
    return ""


def go_on(blow: Blow, reference: Known, folder: Path) -> None:
    """Give the command again; it must find what it finds when nothing ends it."""
    job = blow.job
    if not folder.exists():
        blow.report += ", and nothing is left"
        return
    more = ["--resume"] if (folder / job.checkpoint).exists() else ["--force"] if any(folder.iterdir()) else []
    try:
        again = subprocess.run(job.command(folder, *more), capture_output=True, text=True, check=False, timeout=LONGEST)
    except subprocess.TimeoutExpired:
        blow.wrong = f"which goes on for more than {LONGEST:g} s"
        return
    blow.report += f", then {more[0] if more else 'anew'}"
    if again.returncode not in {0, 3}:
        blow.wrong = f"which ended with {again.returncode}: {again.stderr[-200:]}"
    elif job.result(folder) != reference.result:
        blow.wrong = "another result than without the kill"


def is_running(session: int) -> bool:
    """Whether a process of a session is left, after a moment to end."""
    for _ in range(100):
        try:
            os.killpg(session, 0)
        except ProcessLookupError:
            return False
        time.sleep(0.1)
    return True
