"""Does a fit that is ended at any moment lose anything? Signals and no memory at random times, and what comes of going on.

    python scripts/check_kills.py [--kills N] [--seed S] [--jobs emcee,nuts,calibrate,writing,fleet]

Each time a small fit by emcee or NUTS, a calibration, or a fleet is started in a process of its own and struck once. It is
watched meanwhile: what lies in its folder says whether it still starts (nothing is there), compiles, samples, or writes its
results. One of these is drawn, and the blow comes either within 50 ms of its beginning or after a random part of the time
that it took lately, so that a machine which has become slow meanwhile is struck as one that is quick. A job `writing` is a fit
with figures and report, and is struck while it samples its last or writes. The blow is SIGINT, SIGTERM, SIGKILL, or no memory:
every other time the kernel's way, which ends one of its processes, else a limit as a container or a shell sets it, drawn
between far too little and the least that was enough. A blow counts where a process was there to be struck, and a limit where
it was too little; what came too late is said and tried again.

Then the same command is given again, with --resume where a checkpoint is said to be kept or is there, with --force where
anything else is left; where nothing at all is left, the run that nothing ended has shown already what it does. It must end as
usual, with the same draws (or replications) as one that nothing ended; no process of the first may be left; one that was asked
to end must have ended with 130 and a sentence, or have finished; one that ends with 0 or 3 must have finished; and nobody may
have read anything but our own words.

Prints each kill and how many struck what and when, and ends with 1 if a promise was broken.
"""

import argparse
import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import count, pairwise
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SMALL = ("sampler.n_walkers=32", "sampler.max_steps=600", "sampler.target_ess=100")
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL, None)  # None: no more memory
PHASES = START, COMPILE, SAMPLE, WRITE = range(4)
CALLED = ("starting", "compiling", "sampling", "writing")
# A shell that runs this in the background makes its children deaf to interrupts; this one hears again.
# It may have so many bytes of memory besides.
HEAR = (
    "import os, resource as r, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL); "
    "r.setrlimit(r.RLIMIT_DATA, (int(sys.argv[1]),) * 2); os.execv(sys.argv[2], sys.argv[2:])"
)
LITTLE, MUCH = 850e6, 1100e6  # bytes, between which a fit has too little or enough
INSPECTIONS = 18  # of the fleet
AT_ONCE = 0.05  # s behind the beginning of a phase
OURS = re.compile(r"Interrupted|Error: |Warning: |Wrote |\S+ holds the whole fit, but ")  # how what is said begins


@dataclass(frozen=True)
class Job:
    """Something long that may be ended.

    Args:
        name: What it is.
        words: Of its command, before the results folder.
        kept: File or folder that lets it go on.
        done: File that is there once it has finished.
        samples: Whether, by what is kept, something has been drawn.
        phases: In which it is struck.
    """

    name: str
    words: tuple[str, ...]
    kept: str
    done: str
    samples: Callable[[Path], bool] = Path.exists
    phases: tuple[int, ...] = PHASES

    def command(self, folder: Path, *more: str) -> list[str]:
        """Its command."""
        return [sys.executable, "-m", "bowdenfit", *self.words, "-o", str(folder), "--seed", "3", *more]

    def phase(self, folder: Path) -> int:
        """What it does, by what lies in its folder."""
        try:
            others = {path.name for path in folder.iterdir()} - {self.kept, f".{self.kept}.partial"}
            return WRITE if others else SAMPLE if self.samples(folder / self.kept) else COMPILE
        except FileNotFoundError:
            return START

    def result(self, folder: Path) -> object:
        """What it found, to be compared."""
        if self.done == "fit.json":
            import bowdenfit as bf

            return bf.load(folder).posterior.z.tobytes()
        if self.done == "fleet.json":
            from bowdenfit.results.fleet_folder import read_fleet_draws

            drawn = read_fleet_draws(folder)
            return drawn.label, {name: values.tobytes() for name, values in drawn.values.items()}
        lines = [json.loads(line) for line in (folder / self.kept).read_text().splitlines()[1:]]
        return sorted((line["number"], json.dumps(line["ranked"])) for line in lines)


def has_lines(path: Path) -> bool:
    """Whether replications stand behind the heading."""
    return path.exists() and path.read_bytes().count(b"\n") > 1


def has_pieces(folder: Path) -> bool:
    """Whether a piece of a fleet is kept."""
    return any(folder.glob("*.npz"))


SET = tuple(f"--set={setting}" for setting in SMALL)
YARN = str(ROOT / "datasets" / "yarn-on-cylinder")
FLEET = ROOT / "datasets" / "synthetic-fleet"
JOBS = (
    Job("emcee", ("fit", YARN, "--no-figures", *SET), "chain.checkpoint", "fit.json"),
    Job("nuts", ("fit", YARN, "--no-figures", "--sampler", "nuts", *SET), "chain.checkpoint", "fit.json"),
    Job("calibrate", ("calibrate", YARN, "--replications", "6"), "replications.jsonl", "calibration.json", has_lines),
    Job("writing", ("fit", YARN, *SET), "chain.checkpoint", "fit.json", phases=(SAMPLE, WRITE, WRITE, WRITE)),
)


def fleet_job(place: Path) -> Job:
    """The fit of a small fleet, by two processes where that pays; its measurements are laid into a folder."""
    shutil.copytree(FLEET / "readings", place / "readings")
    shutil.copy(FLEET / "fleet.toml", place)
    lines = (FLEET / "fleet.csv").read_text(encoding="utf-8").splitlines()[: INSPECTIONS + 1]
    (place / "fleet.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return Job("fleet", ("fleet", str(place), "--workers", "2"), "kept", "fleet.json", has_pieces)


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
            said = self.process.communicate(timeout=60)
            if self.process.returncode in {0, 3} and len(self.began) == len(PHASES):
                self.began.append(time.monotonic())  # which ends the last
            return said
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            return "", "its output stayed open for 60 s"


def run_whole(job: Job, folder: Path) -> Known:
    """How long a job takes once its programs are compiled, and what it finds."""
    subprocess.run(job.command(folder), check=False, capture_output=True)
    known = Known(job.result(folder))
    shutil.rmtree(folder)
    run = Watched(job, folder)
    run.wait(WRITE, float("inf"))
    run.end()
    known.seconds = [end - start for start, end in pairwise(run.began)]
    return known


@dataclass
class Blow:
    """One kill.

    Args:
        job: What is struck.
        sent: The signal; None for no memory.
        phase: Aimed at.
        at: Seconds behind its beginning.
        memory: The limit that it runs under [bytes].
        struck: Phase that it was in; None where it was too late, or the limit was enough.
        said: How it ended and what came then.
        wrong: Which promise was broken.
    """

    job: Job
    sent: signal.Signals | None
    phase: int
    at: float
    memory: int = resource.RLIM_INFINITY
    struck: int | None = None
    said: str = ""
    wrong: str = ""

    @property
    def starved(self) -> bool:
        """Whether it is by a limit."""
        return self.memory != resource.RLIM_INFINITY

    def __str__(self) -> str:
        what = self.sent.name if self.sent else f"{self.memory / 1e6:.0f} MB" if self.starved else "OOM killer"
        when = "too late" if self.struck is None else CALLED[self.struck]
        return f"{self.job.name:9s} {what:10s} {when:9s} {self.said}{self.wrong and f'; WRONG: {self.wrong}'}"


def drawn(chance: random.Random, job: Job, number: int, known: Known) -> Blow:
    """The next blow at a job."""
    sent, phase = SIGNALS[number % len(SIGNALS)], chance.choice(job.phases)
    at = chance.uniform(0, AT_ONCE) if chance.random() < 0.25 else chance.random() * known.seconds[phase]
    starved = sent is None and number // len(SIGNALS) % 2 == 0
    return Blow(job, sent, phase, at, int(chance.uniform(LITTLE, known.enough)) if starved else resource.RLIM_INFINITY)


def strike(blow: Blow, known: Known, folder: Path) -> None:
    """Run a job, strike it, look whether a promise is broken, and go on with it."""
    job, run = blow.job, Watched(blow.job, folder, blow.memory)
    lives = run.wait(blow.phase, float("inf") if blow.starved else blow.at)
    if lives:
        blow.struck = min(len(run.began), len(PHASES)) - 1
        run.process.send_signal(blow.sent) if blow.sent else end_one(run.process.pid, int(blow.at * 1000))
    _, err = run.end()
    code, finished = run.process.returncode, (folder / job.done).exists()
    if blow.starved:
        blow.struck = None if code in {0, 3} else min(len(run.began), len(PHASES)) - 1
        known.enough = min(known.enough, blow.memory) if code in {0, 3} else known.enough
    known.learn(run.began)
    blow.said = f"{code} {' '.join(err.split())[-90:]!r}"
    blow.wrong = broken(blow, code, err, finished, run.process.pid, folder)
    if not blow.wrong and finished:
        blow.wrong = "" if job.result(folder) == known.result else "what is finished differs"
    if not blow.wrong and blow.struck is not None and code not in {0, 3}:
        go_on(blow, known, folder)


def broken(blow: Blow, code: int, err: str, finished: bool, session: int, folder: Path) -> str:
    """Which promise a job broke that was struck; empty if none."""
    asked = blow.sent in {signal.SIGINT, signal.SIGTERM}
    early = asked and code == -blow.sent and blow.struck == START  # before anything of ours was loaded
    lines = err.splitlines()
    if is_running(session):
        os.killpg(session, signal.SIGKILL)
        return "a process is left"
    if code in {0, 3} and not finished:
        return f"exit code {code}, but {blow.job.done} is missing"
    if asked and blow.struck is not None and not finished and code != 130 and not early:
        return f"exit code {code}"
    if blow.starved and not finished and (code != 1 or not err.startswith("Error: ") or len(lines) > 1):
        return f"exit code {code}, and said {err[:300]!r}"
    if not early and not all(OURS.match(line) for line in lines if line):
        return f"said {err[:300]!r}"
    if "--resume" in err and not (folder / blow.job.kept).exists():
        return "--resume is promised, and nothing is kept"
    return ""


def go_on(blow: Blow, known: Known, folder: Path) -> None:
    """Give the command again; it must find what it finds when nothing ends it."""
    job = blow.job
    if not folder.exists():
        blow.said += ", and nothing is left"
        return
    more = ["--resume"] if (folder / job.kept).exists() else ["--force"] if any(folder.iterdir()) else []
    again = subprocess.run(job.command(folder, *more), capture_output=True, text=True, check=False, timeout=300)
    blow.said += f", then {more[0] if more else 'anew'}"
    if again.returncode not in {0, 3}:
        blow.wrong = f"which ended with {again.returncode}: {again.stderr[-200:]}"
    elif job.result(folder) != known.result:
        blow.wrong = "another result than without the kill"


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


def is_running(session: int) -> bool:
    """Whether a process of a session is left, after a moment to end."""
    for _ in range(100):
        try:
            os.killpg(session, 0)
        except ProcessLookupError:
            return False
        time.sleep(0.1)
    return True


def blows(chance: random.Random, jobs: tuple[Job, ...], place: Path) -> Iterator[Blow]:
    """One blow after the other, at one job after the other, each dealt out."""
    known = {job.name: run_whole(job, place / job.name) for job in jobs}
    for number in count():
        job = jobs[number % len(jobs)]
        blow = drawn(chance, job, number // len(jobs), known[job.name])
        strike(blow, known[job.name], place / f"{number}")
        shutil.rmtree(place / f"{number}", ignore_errors=True)
        yield blow


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", default="emcee,nuts,calibrate,writing,fleet")
    asked = parser.parse_args()
    struck, wrong = Counter[str](), 0
    with tempfile.TemporaryDirectory() as place:
        jobs = tuple(job for job in (*JOBS, fleet_job(Path(place) / "measured")) if job.name in asked.jobs.split(","))
        for blow in blows(random.Random(asked.seed), jobs, Path(place)):
            wrong += bool(blow.wrong)
            if blow.struck is not None:
                what = blow.sent.name if blow.sent else "memory"
                struck.update((f"{blow.job.name}, {what}", CALLED[blow.struck], "all"))
            print(f"{struck['all']:3d} {blow}", flush=True)
            if struck["all"] >= asked.kills:
                break
    print("; ".join(f"{what} {times}" for what, times in sorted(struck.items())))
    print(f"{wrong} went wrong of {struck['all']} that struck")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
