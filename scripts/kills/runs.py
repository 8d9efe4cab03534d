"""One run of a job, watched by what lies in its folder, and how long each of its phases takes lately."""

import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from kills.jobs import PHASES, WRITE, Job

# A shell that runs this in the background makes its children deaf to interrupts; this one hears again.
# It may have so many bytes of memory besides.
HEAR = (
    "import os, resource as r, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL); "
    "r.setrlimit(r.RLIMIT_DATA, (int(sys.argv[1]),) * 2); os.execv(sys.argv[2], sys.argv[2:])"
)
MUCH = 1100e6  # bytes, with which a fit has enough
LONGEST = 1800.0  # s that anything may take, on a machine that others keep busy; a judgement


@dataclass
class Known:
    """What is known of a job by now.

    Args:
        result: What it finds when nothing ends it.
        seconds: That each phase took lately, with what else the machine did.
        enough: The least memory that was enough [bytes].
    """

    result: object = None
    seconds: list[float] = field(default_factory=list)
    enough: float = MUCH

    def learn(self, began: list[float]) -> None:
        """Take over how long the phases took that were seen to end."""
        for phase, (start, end) in enumerate(pairwise(began)):
            self.seconds[phase] += (end - start - self.seconds[phase]) / 2


class Watched:
    """One run, and when its phases began."""

    def __init__(
        self, job: Job, folder: Path, memory: int = resource.RLIM_INFINITY, more: tuple[str, ...] = ()
    ) -> None:
        command = [sys.executable, "-c", HEAR, str(memory), *job.command(folder, *more)]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        self.job, self.folder, self.began = job, folder, [time.monotonic()]
        self.process = subprocess.Popen(command, **pipes, start_new_session=True)

    def lives(self) -> bool:
        """Whether it has not ended."""
        return os.waitid(os.P_PID, self.process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None

    def wait(self, phase: int, seconds: float = 0.0) -> bool:
        """Wait for so many seconds of a phase; whether it lives then."""
        while (alive := self.lives()) and not (
            len(self.began) > phase and time.monotonic() > self.began[phase] + seconds
        ):
            self._look()
            time.sleep(0.002)
        self._look()
        return alive

    def _look(self) -> None:
        now = self.job.phase(self.folder)
        self.began += [time.monotonic()] * (now + 1 - len(self.began))

    def end(self) -> tuple[str, str]:
        """What it prints; waits for it, and ends it where its output stays open."""
        try:
            streams = self.process.communicate(timeout=LONGEST)
            if self.process.returncode in {0, 3} and len(self.began) == len(PHASES):
                self.began.append(time.monotonic())  # which ends the last
            return streams
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            return "", f"its output stayed open for {LONGEST:g} s"


def run_whole(job: Job, folder: Path) -> Known:
    """How long a job takes once its programs are compiled, and what it finds."""
    subprocess.run(job.command(folder), check=False, capture_output=True)
    reference = Known(job.result(folder))
    shutil.rmtree(folder)
    run = Watched(job, folder)
    run.wait(WRITE, float("inf"))
    run.end()
    reference.seconds = [end - start for start, end in pairwise(run.began)]
    return reference
