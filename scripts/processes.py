"""Python in fresh processes: their wall time, their peak memory, what they print."""

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BASELINES = Path("scripts") / "baselines"
NOT_TRUSTED = 3  # exit code of a fit that has not converged


@dataclass(frozen=True)
class Run:
    """One process: when it started on the shared clock, its wall time [s], peak memory [MiB] and standard output.

    Args:
        memory: 0 where it was not watched.
        cpu: Seconds that it and those it started have computed.
        load: How many processes wanted to compute on this machine in the minute before it ended.
        answered: Seconds until it printed something.
    """

    started: float
    seconds: float
    memory: float
    output: str
    results: Path | None = None
    cpu: float = 0.0
    load: float = 0.0
    answered: float = 0.0

    @property
    def stages(self) -> dict[str, float]:
        """Seconds of each stage of a fit."""
        assert self.results is not None  # asked of fits only
        page = json.loads((self.results / "fit.json").read_text(encoding="utf-8"))
        return page["provenance"]["stage_times"]


def typical(runs: Sequence[Run]) -> Run:
    """The run of median wall time."""
    return sorted(runs, key=lambda run: run.seconds)[len(runs) // 2]


def measured(
    arguments: Sequence[str],
    environment: dict[str, str],
    results: Path | None = None,
    tree: Path = ROOT,
    watched: bool = True,
) -> Run:
    """Run Python in a fresh process and measure it.

    Args:
        arguments: Arguments of Python.
        environment: Changes to the environment.
        results: Results folder that the process writes.
        tree: The checkout that it starts in.
        watched: Whether its memory is watched, which takes a core 4 ms for each of its processes, twenty times a second.
    """
    with tempfile.TemporaryFile() as errors:
        started = time.monotonic()
        process = subprocess.Popen(
            [sys.executable, *arguments], cwd=tree, env={**os.environ, **environment}, stdout=subprocess.PIPE, stderr=errors
        )
        watch = MemoryWatch(process.pid) if watched else None
        assert process.stdout is not None
        output = process.stdout.read(1)
        answered = time.monotonic() - started
        output += process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.monotonic() - started
        process.returncode = os.waitstatus_to_exitcode(status)
        kernel = usage.ru_maxrss / (1024**2 if sys.platform == "darwin" else 1024)
        memory = watch.stop() or kernel if watch is not None else 0.0
        errors.seek(0)
        written = [output.decode(), errors.read().decode()]
    if process.returncode == NOT_TRUSTED and results is not None:
        print("Warning: a fit did not converge; its times mean little.", file=sys.stderr)
    elif process.returncode:
        sys.exit(f"{' '.join(arguments)} ended with exit code {process.returncode}:\n{written[1]}")
    cpu = usage.ru_utime + usage.ru_stime
    return Run(started, seconds, memory, written[0], results, cpu, os.getloadavg()[0], answered)


class MemoryWatch:
    """Largest memory of a process and all those it starts, looked at every 50 ms (Linux only)."""

    def __init__(self, pid: int) -> None:
        self.peak, self.ended = 0.0, threading.Event()
        self.thread = threading.Thread(target=self._watch, args=(pid,), daemon=True)
        self.thread.start()

    def stop(self) -> float:
        """The peak [MiB]; 0 where the system has no /proc."""
        self.ended.set()
        self.thread.join()
        return self.peak

    def _watch(self, pid: int) -> None:
        while not self.ended.wait(0.05):
            self.peak = max(self.peak, sum(resident(p) for p in family(pid)))


def resident(pid: int) -> float:
    """Resident memory of a process [MiB], what it shares with others divided among them; 0 if it is gone."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) for line in lines if line.startswith("Pss:")), 0) / 1024


def family(pid: int) -> Iterator[int]:
    """A process and all its descendants."""
    yield pid
    try:
        tasks = list(Path(f"/proc/{pid}/task").iterdir())
        children = [int(child) for task in tasks for child in (task / "children").read_text(encoding="ascii").split()]
    except OSError:
        return
    for child in children:
        yield from family(child)


def byte_code(folder: Path) -> dict[str, str]:
    """Settings that let Python keep byte code, which some machines forbid; without it every start compiles the libraries."""
    return {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(folder / "byte_code")}


def search_path() -> str:
    """Where a script finds bowdenfit, installed or not."""
    return os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
