"""Striking one job after the other at a random time, each in its own way."""

import os
import random
import resource
import shutil
import signal
from collections.abc import Iterator
from itertools import count
from pathlib import Path

from kills.blow import Blow
from kills.jobs import PHASES, Job
from kills.judging import broken, go_on
from kills.runs import Known, Watched, run_whole

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL, None)  # None: no more memory
LITTLE = 850e6  # bytes, with which a fit has too little
AT_ONCE = 0.05  # s behind the beginning of a phase


def next_blow(chance: random.Random, job: Job, number: int, reference: Known) -> Blow:
    """The next blow at a job."""
    sent, phase = SIGNALS[number % len(SIGNALS)], chance.choice(job.phases)
    value = chance.uniform(0, AT_ONCE) if chance.random() < 0.25 else chance.random() * reference.seconds[phase]
    starved = sent is None and number // len(SIGNALS) % 2 == 0
    return Blow(job, sent, phase, value, int(chance.uniform(LITTLE, reference.enough)) if starved else resource.RLIM_INFINITY)


def strike(blow: Blow, reference: Known, folder: Path) -> None:
    """Run a job, strike it, look whether a promise is broken, and go on with it."""
    job, run = blow.job, Watched(blow.job, folder, blow.memory)
    lives = run.wait(blow.phase, float("inf") if blow.starved else blow.moment)
    if lives:
        blow.struck = min(len(run.began), len(PHASES)) - 1
        run.process.send_signal(blow.sent) if blow.sent else end_one(run.process.pid, int(blow.moment * 1000))
    _, err = run.end()
    code, finished = run.process.returncode, (folder / job.done).exists()
    if blow.starved:
        blow.struck = None if code in {0, 3} else min(len(run.began), len(PHASES)) - 1
        reference.enough = min(reference.enough, blow.memory) if code in {0, 3} else reference.enough
    reference.learn(run.began)
    blow.report = f"{code} {' '.join(err.split())[-90:]!r}"
    blow.wrong = broken(blow, code, err, finished, run.process.pid, folder)
    if not blow.wrong and finished:
        blow.wrong = "" if job.result(folder) == reference.result else "what is finished differs"
    if not blow.wrong and blow.struck is not None and code not in {0, 3}:
        go_on(blow, reference, folder)


def end_one(session: int, number: int) -> None:
    """End one of the processes of a session as the kernel does where memory has run out."""
    processes = sorted(int(path.name) for path in Path("/proc").iterdir() if path.name.isdigit())
    members = [pid for pid in processes if session_of(pid) == session]
    for pid in members and [members[number % len(members)]]:
        os.kill(pid, signal.SIGKILL)


def session_of(pid: int) -> int:
    """The session of a process; 0 of one that has ended."""
    try:
        return os.getsid(pid)
    except ProcessLookupError:
        return 0


def blows(chance: random.Random, jobs: tuple[Job, ...], place: Path) -> Iterator[Blow]:
    """One blow after the other, at one job after the other, each dealt out."""
    reference = {job.name: run_whole(job, place / job.name) for job in jobs}
    for number in count():
        job = jobs[number % len(jobs)]
        blow = next_blow(chance, job, number // len(jobs), reference[job.name])
        strike(blow, reference[job.name], place / f"{number}")
        shutil.rmtree(place / f"{number}", ignore_errors=True)
        yield blow
