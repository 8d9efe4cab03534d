"""Does a fit that is ended at any moment lose anything? Signals and no memory at random times, and what comes of going on.

    python scripts/check_kills.py [--kills N] [--seed S]

Each time a small fit by emcee or NUTS, a calibration, or a fleet is started in a process of its own and ended by SIGINT,
SIGTERM or SIGKILL after a random part of the time that it takes; or memory runs out, as it does under a limit that a
container or a shell sets (of a random size around what it needs), or by the kernel, which ends one of its processes at such
a time. A fourth job is a fit by emcee too, ended in the second half, where its results are written. Where a limit leaves
too little, that must be said in a sentence, with exit code 1 and nothing that a library prints. Then the same command is
given again, with --resume where a checkpoint is said to be kept or is there, with --force where anything else is left. It
must end as usual, with the same draws (or replications) as one that nothing ended; no process of the first may be left; one
that was asked to end must have ended with 130 and a sentence, or have finished; and one that ends with 0 or 3 must have
finished.

Prints each kill, and ends with 1 if a promise was broken.
"""

import argparse
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SMALL = ("sampler.n_walkers=32", "sampler.max_steps=600", "sampler.target_ess=100")
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL, None)  # None: no more memory
# A shell that runs this in the background makes its children deaf to interrupts; this one hears again.
# It may have so many bytes of memory besides.
HEAR = (
    "import os, resource as r, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL); "
    "r.setrlimit(r.RLIMIT_DATA, (int(sys.argv[1]),) * 2); os.execv(sys.argv[2], sys.argv[2:])"
)
LITTLE, MUCH = 700e6, 1300e6  # bytes, between which a fit has too little or enough
INSPECTIONS = 18  # of the fleet


@dataclass(frozen=True)
class Job:
    """Something long that may be ended.

    Args:
        name: What it is.
        words: Of its command, before the results folder.
        kept: File that lets it go on.
        done: File that is there once it has finished.
        earliest: Part of its time before which it is left alone.
    """

    name: str
    words: tuple[str, ...]
    kept: str
    done: str
    earliest: float = 0.0

    def command(self, folder: Path, *more: str) -> list[str]:
        """Its command."""
        return [sys.executable, "-m", "bowdenfit", *self.words, "-o", str(folder), "--seed", "3", *more]

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


SET = tuple(f"--set={setting}" for setting in SMALL)
YARN = str(ROOT / "datasets" / "yarn-on-cylinder")
FLEET = ROOT / "datasets" / "synthetic-fleet"
JOBS = (
    Job("emcee", ("fit", YARN, "--no-figures", *SET), "chain.checkpoint", "fit.json"),
    Job("nuts", ("fit", YARN, "--no-figures", "--sampler", "nuts", *SET), "chain.checkpoint", "fit.json"),
    Job("calibrate", ("calibrate", YARN, "--replications", "6"), "replications.jsonl", "calibration.json"),
    Job("writing", ("fit", YARN, *SET), "chain.checkpoint", "fit.json", earliest=0.5),
)


def fleet_job(place: Path) -> Job:
    """The fit of a small fleet, by two processes where that pays; its measurements are laid into a folder."""
    shutil.copytree(FLEET / "readings", place / "readings")
    shutil.copy(FLEET / "fleet.toml", place)
    lines = (FLEET / "fleet.csv").read_text(encoding="utf-8").splitlines()[: INSPECTIONS + 1]
    (place / "fleet.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return Job("fleet", ("fleet", str(place), "--workers", "2"), "kept", "fleet.json")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    chance, broken = random.Random(asked.seed), 0
    with tempfile.TemporaryDirectory() as place:
        jobs = (*JOBS, fleet_job(Path(place) / "measured"))
        whole = {job.name: run_whole(job, Path(place) / job.name) for job in jobs}
        for number in range(asked.kills):
            job, sent = jobs[number % len(jobs)], SIGNALS[number // len(jobs) % len(SIGNALS)]
            seconds, result = whole[job.name]
            at = chance.uniform(job.earliest * seconds, 1.05 * seconds)
            said, wrong = kill_once(job, sent, at, result, Path(place) / f"{number}")
            broken += bool(wrong)
            said += f"; WRONG: {wrong}" if wrong else ""
            what = sent.name if sent else "no memory"
            print(f"{number:3d} {job.name:9s} {what} at {at:5.2f} s: {said}", flush=True)
    print(f"{broken} of {asked.kills} went wrong")
    sys.exit(broken > 0)


def run_whole(job: Job, folder: Path) -> tuple[float, object]:
    """Seconds that a job takes once its programs are compiled, and what it finds."""
    for more in ((), ("--force",)):
        start = time.monotonic()
        subprocess.run(job.command(folder, *more), check=False, capture_output=True)
    return time.monotonic() - start, job.result(folder)


def kill_once(job: Job, sent: signal.Signals | None, at: float, result: object, folder: Path) -> tuple[str, str]:
    """What a job said that was ended, and which promise was broken."""
    starved = sent is None and int(at * 1000) % 2 == 0
    memory = int(LITTLE + (at * 1e6 % 1) * (MUCH - LITTLE)) if starved else resource.RLIM_INFINITY
    command = [sys.executable, "-c", HEAR, str(memory), *job.command(folder)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes, start_new_session=True) as process:
        try:
            process.wait(None if starved else at)
        except subprocess.TimeoutExpired:
            process.send_signal(sent) if sent else end_one(process.pid, int(at * 1000))
        try:
            _, err = process.communicate(timeout=30)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            return "", "its output stayed open for 30 s"
    said = f"{process.returncode} {' '.join(err.split())[-90:]!r}"
    finished = (folder / job.done).exists()
    if process.returncode in {0, 3} and not finished:
        return said, f"exit code {process.returncode}, but {job.done} is missing"
    if sent in {signal.SIGINT, signal.SIGTERM} and not finished and process.returncode not in {130, -sent}:
        return said, f"exit code {process.returncode}"
    if starved and not finished and (process.returncode != 1 or not err.startswith("Error: ") or len(err.splitlines()) > 1):
        return said, f"exit code {process.returncode}, and said {err[:300]!r}"
    if is_running(process.pid):
        return said, "a process is left"
    if "--resume" in err and not (folder / job.kept).exists():
        return said, "--resume is promised, and nothing is kept"
    more = ["--resume"] if (folder / job.kept).exists() else ["--force"]
    again = subprocess.run(job.command(folder, *more), capture_output=True, text=True, check=False, timeout=300)
    if again.returncode not in {0, 3}:
        return said, f"{more[0]} ended with {again.returncode}: {again.stderr[-200:]}"
    return f"{said}, then {more[0]}", "" if job.result(folder) == result else "another result than without the kill"


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


if __name__ == "__main__":
    main()
