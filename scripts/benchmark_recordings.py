"""How long recordings take: the play operator, reading, one likelihood value, and a whole fit, beside plain programs.

    python scripts/benchmark_recordings.py [--quick] [--repeats N] [--only PART ...] [--against TREE]

Run it with the Python of the environment that bowdenfit and its tests use, on a machine that does nothing else: it takes
up to four minutes, measures everything in one go, and prints a table for each part. Recordings are simulated from the plan
of datasets/synthetic-recordings, ten lengths at 250 samples a second, with 100 cycles of pull and return (10^5 samples
each) or one (10^3, "short"). `--quick` takes ten cycles for the long ones and a tenth of the rows and samples elsewhere.

play        The play operator with every sample in one recording, compiled and run once before; median of several. Plain
            Python runs on a tenth of the samples and its time is multiplied by ten. Ratios are to the fastest.
reading     One file, all its channels, in a fresh process each: "reading" has the imports and what is read, "process" the
            start of Python too. One process that is not measured comes first, so that Python's byte code exists. Ratios
            are to the library's own reader, which interprets no headings, units or clocks.
likelihood  Log density of the posterior for ten recordings, compiled and run once before: one value, one value with its
            gradient, and one batch as the sampler asks for it. "Long/short" is the value's time over that of the short
            recordings: runs are summed up before sampling, so that theirs must not grow. With capstan friction, whole
            recordings are summed up as runs are.
fit         `bowdenfit fit` with all figures, from start to exit, with no compiled program kept from before; memory is the
            peak sum of the resident memory of the process and those it starts, shared pages counted in each. One fit that
            is not measured comes first, so that Python's byte code and matplotlib's list of fonts exist. Below it, the
            stages as fit.json keeps them, and the steps before them as scripts/baselines/read_recordings.py times them
            in a process of its own. With `--against`, another checkout fits the same in turns, and each pair gives a
            ratio; the lowest and the highest of them stand beside their median.
large       One CSV file of 1 GB (0.1 with `--quick`), all its channels, in a fresh process: time, and peak memory.

The exit code is 0 whenever everything could be measured, whether or not the targets are met.
"""

import argparse
import dataclasses
import json
import os
import platform
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from datetime import date
from functools import cached_property, partial
from importlib.metadata import PackageNotFoundError, version
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from benchmark_fit import BASELINES, ROOT, Run, byte_code, measured, say, search_path, show, typical

import bowdenfit
from bowdenfit.dataset import Dataset
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.settings import load_description
from bowdenfit.model import build_model
from bowdenfit.physics.hysteresis import play_operator
from bowdenfit.questions.simulate.recordings.making import make_recordings
from bowdenfit.questions.simulate.recordings.plan import parse_recordings_plan
from bowdenfit.questions.simulate.recordings.writing import write_recordings
from bowdenfit.recordings.preparation.play import play

PLAN = ROOT / "datasets" / "synthetic-recordings" / "bench.toml"
LENGTHS = list(range(430, 530, 10))  # mm
RATE = 250.0  # samples a second
STROKE_TIME = 2.0  # s, with its pause; a cycle is 1000 samples
STROKE, ACCELERATION_TIME, DRUM_RADIUS, SPEED = 60.0, 0.1, 20.0, 20.0  # mm, s, mm, r/min
SEED = 20220728
VALUE_TARGET, GRADIENT_TARGET = 10.0, 20.0  # ms
FIT_TARGET, MEMORY_TARGET, LARGE_TARGET = 20.0, 1024.0, 1536.0  # s, MiB, MiB
FRICTIONS = ("capstan", "drag+load-dependent")
BAND = 0.3  # friction exponent
PLAIN_SHARE = 10
AGREEMENT = 1e-9
Table = list[list[str]]


@dataclass(frozen=True)
class Size:
    """How much is measured.

    Args:
        samples: Samples for the play operator, and rows of a file.
        cycles: Cycles of a long recording.
        repeats: Fresh processes a number.
        bytes: Size of a large file.
    """

    samples: int
    cycles: int
    repeats: int
    bytes: int


@dataclass(frozen=True)
class Simulated:
    """The data sets that more than one part needs, made when first asked for."""

    folder: Path
    size: Size
    against: Path | None = None

    @cached_property
    def short(self) -> Path:
        """Ten recordings of one cycle."""
        return self._made("short", 1)

    @cached_property
    def long(self) -> Path:
        """Ten recordings of many cycles."""
        return self._made("long", self.size.cycles)

    @cached_property
    def long_parquet(self) -> Path:
        """The long recordings as Parquet."""
        return apart(as_parquet, self.long, self.folder / "long_parquet")

    @property
    def environment(self) -> dict[str, str]:
        """What measured processes share: neither byte code nor the list of fonts is a compiled program."""
        return byte_code(self.folder) | {"MPLCONFIGDIR": str(self.folder / "matplotlib"), "PYTHONPATH": search_path()}

    @cached_property
    def one_file(self) -> tuple[Path, Path]:
        """One recording with as many rows as wanted, as CSV and as Parquet."""
        return apart(one_file, self.long, self.folder, self.size.samples)

    def _made(self, name: str, cycles: int) -> Path:
        folder = self.folder / name
        return folder if folder.exists() else apart(simulate, folder, cycles)


def apart(function: Callable[..., Any], *arguments: Any) -> Any:
    """What a function returns, from a process of its own.

    A process counts the memory of the one that started it into its peak, so that this one has to stay small.
    """
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        return process.submit(function, *arguments).result()


def simulate(folder: Path, cycles: int) -> Path:
    """Write a data set of ten recordings."""
    say(f"(simulating {len(LENGTHS)} recordings, cycles each: {cycles})")
    text = PLAN.read_text(encoding="utf-8")
    plan = parse_recordings_plan(tomllib.loads(text) | {"recordings": recordings_page(cycles)}, text)
    write_recordings(make_recordings(plan, SEED), folder)
    return folder


def recordings_page(cycles: int) -> dict[str, Any]:
    """The [recordings] of a plan."""
    moving = STROKE / (SPEED * 2 * np.pi / 60 * DRUM_RADIUS) + ACCELERATION_TIME
    profile = {"stroke": STROKE, "drum_radius": DRUM_RADIUS, "acceleration_time": ACCELERATION_TIME}
    return {
        "lengths": LENGTHS,
        "speeds": [f"{SPEED:g} r/min"],
        "angles": list(range(430, 540, 10)),
        "profile": profile | {"pause": STROKE_TIME - moving, "cycles": cycles},
        "bench": {"rate": RATE},
    }


def as_parquet(folder: Path, copy: Path) -> Path:
    """A copy of a data set with its recordings in Parquet."""
    (copy / "recordings").mkdir(parents=True)
    for file in sorted((folder / "recordings").iterdir()):
        to_parquet(file, copy / "recordings" / f"{file.stem}.parquet")
    description = (folder / "cable.toml").read_text(encoding="utf-8")
    (copy / "cable.toml").write_text(description.replace("rpm.csv", "rpm.parquet"), encoding="utf-8")
    (copy / "angles.csv").write_bytes((folder / "angles.csv").read_bytes())
    return copy


def to_parquet(file: Path, copy: Path) -> None:
    """Write a CSV file as Parquet."""
    from pyarrow import csv, parquet

    parquet.write_table(csv.read_csv(file), copy)


def milliseconds(function: Callable[..., Any], *arguments: Any, budget: float = 1.0) -> float:
    """Median time of a call [ms], after one that is not measured.

    Args:
        function: What to call; arrays of JAX that it returns are waited for.
        arguments: Its arguments.
        budget: Calls go on for so long [s]; there are at least three.
    """
    jax.block_until_ready(function(*arguments))
    times: list[float] = []
    while len(times) < 3 or (sum(times) < budget and len(times) < 1000):
        start = time.perf_counter()
        jax.block_until_ready(function(*arguments))
        times.append(time.perf_counter() - start)
    return 1000 * float(np.median(times))


def play_tables(simulated: Simulated) -> list[Table]:
    """The play operator in JAX, numba and Python."""
    samples = simulated.size.samples
    say(f"play operator, {samples} samples")
    x = np.log(50 + 30 * np.sin(np.arange(samples) * 2 * np.pi / 1000))
    x += 0.01 * np.random.default_rng(SEED).standard_normal(samples)
    times: dict[str, float] = {}
    with jax.enable_x64(True):
        for name, function in jax_operators().items():
            times[f"JAX, {name}"] = milliseconds(jax.jit(function), jnp.asarray(x), BAND, x[0])
        expected = np.asarray(jax.jit(output)(x, BAND, x[0]))
    loop = numba_loop()
    if loop is not None:
        warn_if_apart("numba", loop(x, BAND, x[0]), expected)
        times["numba, value"] = milliseconds(loop, x, BAND, x[0])
    part = x[: samples // PLAIN_SHARE]
    warn_if_apart("plain Python", python_loop(part, BAND, x[0]), expected[: len(part)])
    for name, plain in {"plain Python": python_loop, "bowdenfit's preparation, with contacts": play}.items():
        times[f"{name}, value (x{PLAIN_SHARE})"] = PLAIN_SHARE * milliseconds(plain, part, BAND, float(x[0]))
    fastest = min(times.values())
    rows = [[f"play operator, {samples} samples", "[ms]", "ns a sample", "ratio"]]
    rows += [[name, f"{t:.2f}", f"{1e6 * t / samples:.1f}", f"{t / fastest:.2f}"] for name, t in times.items()]
    return [rows if loop is not None else [*rows, ["numba is not installed", "-", "-", "-"]]]


def output(x: jax.Array, band: float, start: float) -> jax.Array:
    """What the operator gives, without its slope."""
    return play_operator(x - band, x + band, start)[0]


def jax_operators() -> dict[str, Callable[..., Any]]:
    """The operator, with three ways to its derivative by the friction exponent."""

    def with_slope(x: jax.Array, band: float, start: float) -> Any:
        return play_operator(x - band, x + band, start)

    def forward(x: jax.Array, band: float, start: float) -> Any:
        return jax.jvp(lambda b: output(x, b, start), (band,), (1.0,))

    def reverse(x: jax.Array, band: float, start: float) -> Any:
        return jax.value_and_grad(lambda b: jnp.sum(output(x, b, start) * x))(band)

    return {
        "value": output,
        "value with its slope": with_slope,
        "value, forward derivative": forward,
        "weighted sum, reverse derivative": reverse,
    }


def numba_loop() -> Callable[..., np.ndarray] | None:
    """The same loop by numba; None where it is not installed."""
    try:
        from numba import njit
    except ImportError:
        return None

    @njit
    def loop(x, band, start):
        y, path = start, np.empty_like(x)
        for i in range(len(x)):
            y = min(max(y, x[i] - band), x[i] + band)
            path[i] = y
        return path

    return loop


def python_loop(x: np.ndarray, band: float, start: float) -> np.ndarray:
    """The same loop in Python."""
    y, path = float(start), []
    for low, high in zip((x - band).tolist(), (x + band).tolist(), strict=True):
        y = low if y < low else high if y > high else y
        path.append(y)
    return np.array(path)


def warn_if_apart(name: str, path: np.ndarray, expected: np.ndarray) -> None:
    """Say when two ways to the same thing differ, which would make this a comparison of unequal things."""
    apart = float(np.max(np.abs(path - expected)))
    if not apart < AGREEMENT:
        print(f"Warning: the play operator by {name} is off by {apart:g}.", file=sys.stderr)


def reading_tables(simulated: Simulated) -> Iterator[Table]:
    """Reading of one file, in CSV and in Parquet."""
    samples, repeats = simulated.size.samples, simulated.size.repeats
    files = simulated.one_file
    rows = [
        [f"reading of {samples} rows", "file [MiB]", "reading [s]", "process [s]", "peak [MiB]", "ratio", "process"]
    ]
    for file in files:
        runs = {}
        for way in ("plain", "bowdenfit"):
            say(f"reading {file.suffix}, {way}")
            reader(simulated, way, file)
            runs[way] = typical([reader(simulated, way, file) for _ in range(repeats)])
        base = runs["plain"]
        library = "pyarrow.parquet.read_table" if file.suffix == ".parquet" else "pandas.read_csv"
        for way, run in runs.items():
            name = f"{file.suffix[1:]}, {library if way == 'plain' else 'bowdenfit read_channels'}"
            numbers = [f"{file.stat().st_size / 1024**2:.1f}", f"{inside(run):.2f}", f"{run.seconds:.2f}"]
            ratios = [f"{inside(run) / inside(base):.2f}", f"{run.seconds / base.seconds:.2f}"]
            rows.append([name, *numbers, f"{inside(run, 'memory'):.0f}", *ratios])
    yield rows


def one_file(long: Path, folder: Path, samples: int) -> tuple[Path, Path]:
    """The long recordings put one after the other, as CSV and as Parquet."""
    heading, body = "", []
    for file in sorted((long / "recordings").iterdir()):
        heading, *lines = file.read_text(encoding="ascii").splitlines()
        body += [line.partition(",")[2] for line in lines]
    text = "\n".join([heading, *(f"{i / RATE:.6f},{line}" for i, line in enumerate(body[:samples]))])
    csv, parquet = folder / "one.csv", folder / "one.parquet"
    csv.write_text(f"{text}\n", encoding="ascii")
    to_parquet(csv, parquet)
    return csv, parquet


def reader(simulated: Simulated, way: str, path: Path) -> Run:
    """A fresh process that reads."""
    return measured([str(BASELINES / "read_recordings.py"), way, str(path)], simulated.environment)


def inside(run: Run, what: str = "seconds") -> float:
    """What a reading process showed for itself."""
    return json.loads(run.output)[what]


def likelihood_tables(simulated: Simulated) -> list[Table]:
    """Cost of one log density, for both likelihoods and two models of friction, long and short."""
    targets = f"value (< {VALUE_TARGET:g}) [ms]", f"with gradient (< {GRADIENT_TARGET:g}) [ms]"
    rows = [["log density", "arrays [kB]", *targets, "batch", "batch [ms]", "long/short", "compiling [s]"]]
    folders = {"long": simulated.long, "short": simulated.short}
    data = {name: bowdenfit.read(folder) for name, folder in folders.items()}
    for likelihood in ("runs", "whole"):
        for friction in FRICTIONS:
            say(f"likelihood {likelihood}, {friction}")
            overrides = [f'tables.recordings.likelihood="{likelihood}"', f'friction_model="{friction}"']
            each = {name: density_costs(described(data[name], folders[name], overrides)) for name in folders}
            for name, costs in each.items():
                ratio = f"{costs.value / each['short'].value:.2f}" if name == "long" else ""
                times = f"{costs.value:.3f}", f"{costs.gradient:.3f}", str(costs.batch), f"{costs.batched:.2f}"
                rows.append(
                    [
                        f"{likelihood}, {friction}, {name}",
                        f"{costs.kilobytes:.0f}",
                        *times,
                        ratio,
                        f"{costs.compiling:.1f}",
                    ]
                )
    return [rows]


@dataclass(frozen=True)
class Costs:
    """Times of one log density [ms]: alone, with its gradient, a batch; size of its data, and time to compile all [s]."""

    value: float
    gradient: float
    batch: int
    batched: float
    kilobytes: float
    compiling: float


def described(data: Dataset, folder: Path, overrides: Sequence[str]) -> Dataset:
    """The same measurements under other settings that do not change how they are read."""
    return dataclasses.replace(data, description=load_description(folder / "cable.toml", overrides))


def density_costs(data: Dataset) -> Costs:
    """Measure one posterior."""
    with jax.enable_x64(True):
        start = time.perf_counter()
        density = LogDensity(build_model(data))
        settings, size = data.description.sampler, density.model.space.size
        batch = settings.n_ensembles * settings.n_walkers // 2
        many = jnp.asarray(0.1 * np.random.default_rng(SEED).standard_normal((batch, size)))
        arrays = jax.device_put(density.data)
        value = jax.jit(density.log_density).lower(many[0], arrays).compile()
        gradient = jax.jit(jax.value_and_grad(density.log_density)).lower(many[0], arrays).compile()
        batched = density.batched_log_density(batch)
        compiling = time.perf_counter() - start
        bytes_of = sum(np.asarray(leaf).nbytes for leaf in jax.tree.leaves(density.data))
        timed = partial(milliseconds, budget=0.5)
        alone = timed(value, many[0], arrays), timed(gradient, many[0], arrays)
        return Costs(*alone, batch, timed(batched, many, arrays), bytes_of / 1000, compiling)


def fit_tables(simulated: Simulated) -> Iterator[Table]:
    """Whole fits, long and short, and their stages."""
    folders = {"CSV, long": simulated.long, "Parquet, long": simulated.long_parquet, "CSV, short": simulated.short}
    say("(one fit that is not measured)")
    fit(simulated, simulated.short, "unmeasured", "--no-mcmc")
    fits, steps, others = {}, {}, {}
    for name, folder in folders.items():
        runs, against = [], []
        for i in range(simulated.size.repeats):
            say(f"fit, {name}, {i + 1} of {simulated.size.repeats}")
            results = f"{name} {i}".replace(", ", "_").replace(" ", "_")
            runs.append(fit(simulated, folder, results))
            if simulated.against:
                against.append(fit(simulated, folder, f"{results}_against", tree=simulated.against))
        fits[name] = typical(runs)
        others[name] = list(zip(runs, against, strict=False))
        steps[name] = json.loads(reader(simulated, "steps", folder).output)
    samples = {name: (1000 if "short" in name else 1000 * simulated.size.cycles) for name in folders}
    rows = [["fit of ten recordings", "samples", "wall [s]", "target [s]", "peak [MiB]", "target [MiB]"]]
    for name, run in fits.items():
        numbers = [f"{len(LENGTHS) * samples[name]}", f"{run.seconds:.2f}", f"{FIT_TARGET:g}"]
        rows.append([name, *numbers, f"{run.memory:.0f}", f"{MEMORY_TARGET:.0f}"])
    yield rows
    if simulated.against:
        yield pair_table(others)
    yield from (step_table(fits, steps), stage_table(fits, steps))


def pair_table(pairs: dict[str, list[tuple[Run, Run]]]) -> Table:
    """Fits beside those of another checkout."""
    rows = [["fit beside the other checkout's", "ratio of times", "lowest", "highest", "ratio of memory"]]
    for name, each in pairs.items():
        times, memory = ([getattr(a, what) / getattr(b, what) for a, b in each] for what in ("seconds", "memory"))
        rows.append([name, *(f"{x:.2f}" for x in (np.median(times), min(times), max(times), np.median(memory)))])
    return rows


def fit(simulated: Simulated, folder: Path, name: str, *options: str, tree: Path = ROOT) -> Run:
    """Fit in a fresh process whose compilation cache is empty, with the bowdenfit of a checkout."""
    results = simulated.folder / "results" / name
    environment = simulated.environment | {"XDG_CACHE_HOME": str(simulated.folder / "cache" / name)}
    environment |= {"PYTHONPATH": str(tree), "PYTHONSAFEPATH": "1"}
    arguments = ["-m", "bowdenfit.cli", "fit", str(folder), "--seed", "1", "--output", str(results), *options]
    return measured(arguments, environment, results)


def large_tables(simulated: Simulated) -> Iterator[Table]:
    """Reading of one file of a size that hardly fits."""
    file = apart(large_file, simulated.long, simulated.folder / "large.csv", simulated.size.bytes)
    say("reading a large file")
    run = reader(simulated, "bowdenfit", file)
    rows = [["reading of a large CSV file", "file [MB]", "rows", "reading [s]", "peak [MiB]", "target [MiB]"]]
    numbers = f"{file.stat().st_size / 1e6:.0f}", f"{inside(run, 'rows'):.0f}", f"{inside(run):.1f}"
    yield [*rows, ["bowdenfit read_channels", *numbers, f"{inside(run, 'memory'):.0f}", f"{LARGE_TARGET:.0f}"]]


def large_file(long: Path, file: Path, size: int) -> Path:
    """The first of the long recordings again and again, with a clock that goes on."""
    heading, *lines = min((long / "recordings").iterdir()).read_text(encoding="ascii").splitlines()
    rows = [line.partition(",")[2] for line in lines]
    with file.open("w", encoding="ascii") as stream:
        stream.write(f"{heading}\n")
        start = 0
        while stream.tell() < size:
            stream.writelines(f"{(start + i) / RATE:.3f},{row}\n" for i, row in enumerate(rows))
            start += len(rows)
    return file


def step_table(fits: dict[str, Run], steps: dict[str, dict[str, float]]) -> list[list[str]]:
    """Seconds of each step from the files to the model, in a process of its own."""
    names = list(dict.fromkeys(step for each in steps.values() for step in each))
    rows = [["steps before the fit [s]", *fits]]
    rows += [[step, *(f"{steps[name].get(step, 0.0):.2f}" for name in fits)] for step in names]
    return [*rows, ["sum", *(f"{sum(steps[name].values()):.2f}" for name in fits)]]


def stage_table(fits: dict[str, Run], steps: dict[str, dict[str, float]]) -> list[list[str]]:
    """Seconds of each stage of fit.json; the steps before are another process's, so that the rest is a difference."""
    names = list(dict.fromkeys(stage for run in fits.values() for stage in run.stages))
    rows = [["stages of the fit [s]", *fits]]
    rows += [[stage, *(f"{run.stages.get(stage, 0.0):.2f}" for run in fits.values())] for stage in names]
    rests = {name: run.seconds - sum(run.stages.values()) for name, run in fits.items()}
    rows.append(["start, reading, figures, writing", *(f"{rest:.2f}" for rest in rests.values())])
    after = {name: rest - sum(steps[name].values()) for name, rest in rests.items()}
    return [*rows, ["of these not in the steps above", *(f"{rest:.2f}" for rest in after.values())]]


PARTS: dict[str, Callable[[Simulated], Iterable[Table]]] = {
    "play": partial(apart, play_tables),
    "reading": reading_tables,
    "likelihood": partial(apart, likelihood_tables),
    "fit": fit_tables,
    "large": large_tables,
}


def machine() -> str:
    """The line that says where these numbers are from."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    libraries = ", ".join(f"{name} {installed(name)}" for name in ("jax", "numba", "numpy", "pandas", "pyarrow"))
    load = f"; load {os.getloadavg()[0]:.1f} at the end" if hasattr(os, "getloadavg") else ""
    return f"Python {platform.python_version()}, {libraries}; {cores} cores; {date.today().isoformat()}{load}."


def installed(package: str) -> str:
    """Version of a package, or that there is none."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"


def main() -> None:
    parser = argparse.ArgumentParser(description="Time recordings; the head of this file says how to read the tables.")
    parser.add_argument("--quick", action="store_true", help="a tenth of the samples")
    parser.add_argument("--repeats", type=int, default=1, metavar="N", help="fresh processes a number [default: 1]")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), metavar="PART", help=", ".join(PARTS))
    parser.add_argument(
        "--against", type=Path, metavar="TREE", help="another checkout, whose fits are paired with ours"
    )
    options = parser.parse_args()
    repeats = max(options.repeats, 1)
    size = Size(100_000, 10, repeats, 10**8) if options.quick else Size(1_000_000, 100, repeats, 10**9)
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        simulated = Simulated(Path(folder), size, options.against)
        for part in options.only:
            for rows in PARTS[part](simulated):
                show(rows)
    print(f"{machine()} Measured in {time.monotonic() - start:.0f} s.")


if __name__ == "__main__":
    main()
