"""How long a fit takes and how much memory it needs, beside the same job written plainly with emcee and with NumPyro.

    python scripts/benchmark_fit.py [--repeats N]

Run it with the Python of the environment that bowdenfit and its tests use, on a machine that does nothing else: it takes
several minutes, measures everything in one go, and prints three tables. Every number is the median of N fresh
processes (default 3).

1. Whole processes, of the on-body data and, where it says so, of the haptic loop: wall time from start to exit, imports,
   compilation, figures and files included, and the peak of the resident memory of the process and those it starts.
   "Cache empty" has no program kept by JAX's compilation cache, as in a first fit; "cache filled" is every later one. One
   fit that is not measured comes first, so that Python's byte code and matplotlib's list of fonts exist. What reads a
   finished fit is asked of the first.
2. Stage times of these fits, as fit.json keeps them. "Other" is the rest of the wall time: starting, importing, reading,
   writing, and waiting for the figures.
3. Time to 1000 effective draws (bulk, the worst of all 11 parameters) of the joint posterior of the on-body data, by the
   programs in scripts/baselines, which draw and write nothing. "To 1000" is from the start of the process to the first
   look at the draws that finds as many, with imports and compilation; how many there were then is in the column beside
   it, because samplers overshoot, and bowdenfit most: it samples on until R-hat, the tails, l* and eta* are settled too,
   while the plain programs stop at 1000. "Draws/s" is effective draws for each second of sampling with everything
   compiled, burn-in or warm-up included. Ratios are to bowdenfit with the cache empty; above 1 means that bowdenfit is
   quicker. Means of the friction coefficients must agree, or a warning is printed.

The exit code is 0 whenever everything could be measured, whether or not the targets are met.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from importlib.metadata import version
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
DATASET = "datasets/on-body-exoskeleton"
LOOP = "datasets/synthetic-haptic-loop"  # stretch, preload and loop in one posterior
BASELINES = Path("scripts") / "baselines"
COEFFICIENTS = ("mu1", "mu2", "mu3")
TARGETS = {"fit": 12.0, "fit, haptic loop": 15.0, "fit --no-mcmc": 5.0, "--help": 0.3, "check": 1.5}  # seconds
READING = {  # what is asked of a finished fit, and its target; the last needs new physics
    "summary": 0.5, "length": 0.5, "predict": 0.5, "identify": 0.5, "plot --figure efficiency": 0.5, "predict 455": 1.0,
}  # fmt: skip
MEMORY_TARGET = 1024.0  # MiB
NOT_TRUSTED = 3  # exit code of a fit that has not converged
AGREEMENT = 0.2  # standard deviations between means


@dataclass(frozen=True)
class Run:
    """One process: when it started on the shared clock, its wall time [s], peak memory [MiB] and standard output."""

    started: float
    seconds: float
    memory: float
    output: str
    results: Path | None = None

    @property
    def stages(self) -> dict[str, float]:
        """Seconds of each stage of a fit."""
        assert self.results is not None  # asked of fits only
        page = json.loads((self.results / "fit.json").read_text(encoding="utf-8"))
        return page["provenance"]["stage_times"]


@dataclass(frozen=True)
class Sampler:
    """What one program needed for its effective draws, and what they say of the friction coefficients."""

    to_target: float
    ess: float
    draws_per_second: float
    mean: np.ndarray
    sd: np.ndarray


def measured(arguments: Sequence[str], environment: dict[str, str], results: Path | None = None) -> Run:
    """Run Python in a fresh process and measure it.

    Args:
        arguments: Arguments of Python.
        environment: Changes to the environment.
        results: Results folder that the process writes.
    """
    with tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as errors:
        started = time.monotonic()
        process = subprocess.Popen(
            [sys.executable, *arguments], cwd=ROOT, env={**os.environ, **environment}, stdout=output, stderr=errors
        )
        watch = MemoryWatch(process.pid)
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.monotonic() - started
        process.returncode = os.waitstatus_to_exitcode(status)
        kernel = usage.ru_maxrss / (1024**2 if sys.platform == "darwin" else 1024)
        memory = max(watch.stop(), kernel)
        written = [_read(file) for file in (output, errors)]
    if process.returncode == NOT_TRUSTED and results is not None:
        print("Warning: a fit did not converge; its times mean little.", file=sys.stderr)
    elif process.returncode:
        sys.exit(f"{' '.join(arguments)} ended with exit code {process.returncode}:\n{written[1]}")
    return Run(started, seconds, memory, written[0], results)


def _read(file) -> str:
    file.seek(0)
    return file.read().decode()


class MemoryWatch:
    """Largest sum of the resident memory of a process and all those it starts, looked at every 20 ms (Linux only)."""

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
        while not self.ended.wait(0.02):
            self.peak = max(self.peak, sum(resident(p) for p in family(pid)))


def resident(pid: int) -> float:
    """Resident memory of a process [MiB]; 0 if it is gone."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 1024**2


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


class Bench:
    """Runs of bowdenfit in one temporary folder, each by its name in the tables."""

    def __init__(self, folder: Path, repeats: int) -> None:
        self.folder, self.repeats = folder, repeats
        self.runs: dict[str, Run] = {}
        self.command("first", ["fit", DATASET, "--no-mcmc", "--seed", "1"], "unmeasured", fits=True)

    def command(self, name: str, arguments: Sequence[str], cache: str, fits: bool = False) -> Run:
        """Run one bowdenfit command with the compilation cache `cache`."""
        results = self.folder / name if fits else None
        output = ["--output", str(results), "--force"] if fits else []
        # matplotlib's list of fonts is no compiled program, so it stays where the cache is emptied.
        environment = {"XDG_CACHE_HOME": str(self.folder / cache), "MPLCONFIGDIR": str(self.folder / "matplotlib")}
        return measured(["-m", "bowdenfit.cli", *arguments, *output], environment, results)

    def fits(self, name: str, *options: str, dataset: str = DATASET) -> None:
        """Fit with the cache empty and again with it filled."""
        both: dict[str, list[Run]] = {"empty": [], "filled": []}
        for i in range(self.repeats):
            for state, runs in both.items():
                say(f"{name}, cache {state}, {i + 1} of {self.repeats}")
                label = f"{name} {i}".replace(",", "").replace(" ", "_")
                arguments = ["fit", dataset, "--seed", "1", *options]
                runs.append(self.command(f"{label}_{state}", arguments, f"{label}_cache", fits=True))
        for state, runs in both.items():
            self.runs[f"{name}, cache {state}"] = typical(runs)

    def quick(self, name: str, *arguments: str) -> None:
        """A command that compiles nothing."""
        say(name)
        self.runs[name] = typical([self.command(name, arguments, "unmeasured") for _ in range(self.repeats)])


def typical(runs: Sequence[Run]) -> Run:
    """The run of median wall time."""
    return sorted(runs, key=lambda run: run.seconds)[len(runs) // 2]


def sampled(name: str, script: str, environments: Sequence[dict[str, str]]) -> Sampler:
    """Median of runs of one of the compared programs, each with its own seed and environment."""
    pages = []
    for seed, environment in enumerate(environments, start=1):
        say(f"{name}, {seed} of {len(environments)}")
        run = measured([str(BASELINES / script), str(seed)], {"PYTHONPATH": search_path(), **environment})
        page = json.loads(run.output)
        pages.append(page | {"to_target": page["ready_at"] - run.started})
    medians = [float(np.median([page[key] for page in pages])) for key in ("to_target", "ess", "draws_per_second")]
    return Sampler(*medians, *(np.mean([page[key] for page in pages], axis=0) for key in ("mean", "sd")))


def search_path() -> str:
    """Where a script finds bowdenfit, installed or not."""
    return os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))


def compared(folder: Path, repeats: int) -> dict[str, Sampler]:
    """Bowdenfit, with the cache empty and filled, and the plain programs."""
    caches = [{"XDG_CACHE_HOME": str(folder / f"cache_{i}")} for i in range(repeats)]
    return {
        "bowdenfit, cache empty": sampled("bowdenfit, cache empty", "with_bowdenfit.py", caches),
        "bowdenfit, cache filled": sampled("bowdenfit, cache filled", "with_bowdenfit.py", caches),
        "emcee and NumPy": sampled("emcee and NumPy", "plain_emcee.py", [{}] * repeats),
        "NumPyro NUTS": sampled("NumPyro NUTS", "plain_numpyro.py", [{}] * repeats),
    }


def process_table(runs: dict[str, Run]) -> list[list[str]]:
    """Wall times and memory beside their targets."""
    rows = [["process", "wall [s]", "target [s]", "peak [MiB]", "target [MiB]"]]
    for name, run in runs.items():
        target = (TARGETS | READING)[name.rsplit(", cache", 1)[0]]
        rows.append([name, f"{run.seconds:.2f}", f"{target:g}", f"{run.memory:.0f}", f"{MEMORY_TARGET:.0f}"])
    return rows


def stage_table(runs: dict[str, Run]) -> list[list[str]]:
    """Seconds of each stage, one column a fit."""
    fits = {name: run for name, run in runs.items() if run.results is not None}
    stages = list(dict.fromkeys(stage for run in fits.values() for stage in run.stages))
    rows = [["stage [s]", *fits]]
    for stage in stages:
        rows.append([stage, *(f"{run.stages[stage]:.2f}" if stage in run.stages else "-" for run in fits.values())])
    rows.append(["other", *(f"{run.seconds - sum(run.stages.values()):.2f}" for run in fits.values())])
    return rows


def sampler_table(samplers: dict[str, Sampler]) -> list[list[str]]:
    """Time and rate of effective draws, and their ratios to the first."""
    first = next(iter(samplers.values()))
    rows = [["program", "to 1000 [s]", "draws then", "ratio", "draws/s", "ratio", *COEFFICIENTS]]
    for name, s in samplers.items():
        time_ratio, rate_ratio = s.to_target / first.to_target, first.draws_per_second / s.draws_per_second
        numbers = [f"{s.to_target:.1f}", f"{s.ess:.0f}", f"{time_ratio:.2f}", f"{s.draws_per_second:.0f}"]
        rows.append([name, *numbers, f"{rate_ratio:.2f}", *(f"{x:.4f}" for x in s.mean)])
    return rows


def disagreements(samplers: dict[str, Sampler]) -> Iterator[str]:
    """Means that differ, which would make this a comparison of unequal things."""
    first, *others = samplers
    for other in others:
        apart = np.abs(samplers[other].mean - samplers[first].mean) / samplers[first].sd
        for name, distance in zip(COEFFICIENTS, apart, strict=True):
            if not distance < AGREEMENT:
                yield f"Warning: the means of {name} in {first!r} and {other!r} are {distance:.2f} sd apart."


def show(rows: list[list[str]]) -> None:
    """Print an aligned table and an empty line."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    for i, (head, *cells) in enumerate(rows):
        line = "  ".join([head.ljust(widths[0]), *(c.rjust(w) for c, w in zip(cells, widths[1:], strict=True))])
        print(line.rstrip())
        if i == 0:
            print("-" * len(line))
    print(flush=True)


def say(what: str) -> None:
    """What is being measured, for those who wait."""
    print(f"measuring: {what}", file=sys.stderr, flush=True)


def machine() -> str:
    """The line that says where these numbers are from."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    libraries = ", ".join(f"{name} {version(name)}" for name in ("jax", "emcee", "numpyro", "numpy"))
    return f"Python {platform.python_version()}, {libraries}; {cores} cores; {date.today().isoformat()}."


def main() -> None:
    parser = argparse.ArgumentParser(description="Time fits; the head of this file says how to read the tables.")
    parser.add_argument("--repeats", type=int, default=3, metavar="N", help="fresh processes a number [default: 3]")
    repeats = max(parser.parse_args().repeats, 1)
    with tempfile.TemporaryDirectory() as folder:
        os.environ.update(byte_code(Path(folder)))
        bench = Bench(Path(folder), repeats)
        bench.fits("fit")
        bench.fits("fit --no-mcmc", "--no-mcmc")
        bench.fits("fit, haptic loop", dataset=LOOP)
        bench.quick("--help", "--help")
        bench.quick("check", "check", DATASET)
        for name in READING:
            verb, *rest = name.split()
            bench.quick(name, verb, str(bench.runs["fit, cache empty"].results), *rest)
        samplers = compared(Path(folder), repeats)
        for rows in (process_table(bench.runs), stage_table(bench.runs), sampler_table(samplers)):
            show(rows)
    for warning in disagreements(samplers):
        print(warning)
    print(machine())


if __name__ == "__main__":
    main()
