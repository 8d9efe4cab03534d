"""How long a fit takes and how much memory it needs, beside another checkout and beside the same job written plainly.

    python scripts/benchmark_fit.py [--repeats N] [--against TREE] [--only NAME ...] [--record]

Run it with the Python of the environment that bowdenfit and its tests use, on a machine that does nothing else: it takes
several minutes, measures everything in one go, and prints one table. Every number is the median of N fresh processes
(default 3). `--only` measures some of it: rows by their names, "plain" (plain programs), "many" (many cables), "counts".
`--record` replaces the tables of docs/benchmarks.md, with the machine, the date and the commit.

Whole processes: wall time from start to exit, imports, compilation, figures and files included; the time that processors
spent on the process and those it starts, which says something on a busy machine too; and the peak of their resident memory
together, pages that several of them share counted once, in one more run with the first seed: watching four processes takes
a fifth of a core, and made --no-mcmc 0.57 of the time instead of 0.51. "load" is how many processes wanted to compute on
the machine, from the lowest to the highest; where it is above the number of cores by more than one or two, wall times say
little. No program is kept from before ("cold"), but for "cache filled"; byte code is kept. With `--against`, another
checkout does the same in turns, with the same seed, another one each turn, because how many steps a seed takes is chance;
each pair gives a ratio, and the lowest and the highest of them stand beside their median. Commands on a finished fit read
the one that their own checkout wrote.

"calibrate, 200": 200 replications of the on-body data. Of the other checkout as few are run as are needed for the time of
one more (FEW), and the rest is reckoned as if each took as long. "1000 cables": scripts/benchmark_batch.py says of what.

"until the answer" is the time from the start of a process to the first thing that it prints. Beside plain programs stand a
cold fit and one with the cache filled, until the answer and until all figures and files are written, and least squares
alone. The plain programs draw and write nothing, and wait for all they do: scripts/baselines/plain_blackjax.py samples the
posterior of the on-body data without departures, four chains with 1000 draws of warm-up and 1000 to keep, and
scripts/baselines/plain_lmfit.py fits them by least squares, without intervals. `--baseline` runs another program in place of
the first, such as "folder/nuts.py 1000 1000 dense".

Below the table: stages of the cold fits as fit.json keeps them; how many programs one fit compiles, and how many times it
works out each answer, which should be once (scripts/baselines/counted.py, in one process).

The exit code is 0 whenever everything could be measured, whether or not the targets are met.
"""

import argparse
import json
import os
import shlex
import tempfile
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

import numpy as np
from benchmark_tables import Table, commit, machine, say, show
from processes import BASELINES, ROOT, Run, byte_code, measured, search_path, typical

DATASET = "datasets/on-body-exoskeleton"
LOOP = "datasets/synthetic-haptic-loop"  # stretch, preload and loop in one posterior
BENCH, RECORDINGS = "datasets/synthetic-bench", "datasets/synthetic-recordings"
FITS: dict[str, tuple[str, ...]] = {  # arguments of a cold fit, by its name in the table
    "fit": (DATASET,),
    "fit --no-mcmc": (DATASET, "--no-mcmc", "--no-figures"),
    "fit, haptic loop": (LOOP,),
    "fit, recordings": (RECORDINGS,),
    "fit, bench": (BENCH,),
}
READS: dict[str, tuple[str, ...]] = {  # FIT stands for a finished fit of the on-body data
    "summary": ("summary", "FIT"),
    "length": ("length", "FIT"),
    "predict": ("predict", "FIT"),
    "predict 455": ("predict", "FIT", "455"),  # new physics
    "identify": ("identify", "FIT"),
    "plot one": ("plot", "FIT", "--figure", "efficiency"),
    "plot one anew": ("plot", "FIT", "--figure", "efficiency", "--width", "6in"),
    "check": ("check", DATASET),
    "--help": ("--help",),
}
FILLED = "fit, cache filled"
GROUPS = ("plain", "library", "many", "counts")
NOT_PAIRED = ("plot one", "plot one anew")  # older commands draw all figures
COLD, LEAST_SQUARES = "fit", "fit --no-mcmc"
PLAIN = {COLD: "blackjax", FILLED: "blackjax", LEAST_SQUARES: "lmfit"}  # program beside which a row stands
PROGRAMS = {"blackjax": ["plain_blackjax.py", "1"], "lmfit": ["plain_lmfit.py"]}
ANSWER = ", until the answer"
CALIBRATE, MANY, FEW = "calibrate, 200", 200, (10, 60)
CABLES = "1000 cables"
LIBRARY = "library beside command"
TARGETS = {  # ratios
    f"{COLD}{ANSWER}, beside blackjax": 1.0,
    f"{COLD} beside blackjax": 1.3,
    f"{FILLED}{ANSWER}, beside blackjax": 0.6,
    f"{FILLED} beside blackjax": 0.9,
    f"{LEAST_SQUARES} beside lmfit": 1.5,
    LIBRARY: 1.1,
}
SECONDS = {
    "summary": 0.5,
    "length": 0.5,
    "predict": 0.5,
    "predict 455": 1.0,
    "identify": 0.5,
    "plot one": 0.5,
    "plot one anew": 0.5,
    CABLES: 60.0,
}  # targets
RECORD = ROOT / "docs" / "benchmarks.md"
HEAD = """# Benchmarks

The last run of each table, newest first. `scripts/benchmark_fit.py --record` writes the first ones; its head explains them.
"""
BY_HAND = "## On a GPU"  # begins what is kept, because this script does not measure it
LIBRARIES = ("jax", "emcee", "blackjax", "lmfit", "numpy")


@dataclass(frozen=True)
class Row:
    """A line of the table: what was run, and in the same turns what it is compared with."""

    name: str
    runs: list[Run]
    against: list[Run]

    def ratios(self, of: str) -> list[float]:
        """Of wall times ("seconds") or of processor time ("cpu"), pair by pair; none where either was not measured."""
        pairs = [(getattr(a, of), getattr(b, of)) for a, b in zip(self.runs, self.against, strict=False)]
        return [ours / theirs for ours, theirs in pairs if ours and theirs]

    def cells(self) -> list[str]:
        """Times and memory, those of the other, ratios with their spread, target, load."""
        sides = [side for runs in (self.runs, self.against) for side in _side(runs)]
        ratios = [spread(self.ratios(of)) for of in ("seconds", "cpu")]
        target = f"{SECONDS[self.name]} s" if self.name in SECONDS else f"{TARGETS.get(self.name, '-')}"
        loads = [run.load for run in (*self.runs, *self.against)]
        return [self.name, *sides, *ratios, target, f"{min(loads):.0f} to {max(loads):.0f}" if any(loads) else "-"]


SIDE = ["wall [s]", "CPU [s]", "peak [MiB]"]
COLUMNS = ["", *SIDE, *(f"other {head}" for head in SIDE), "wall ratio", "CPU ratio", "target", "load"]


def spread(ratios: list[float]) -> str:
    """The median, and in brackets the lowest and the highest."""
    return f"{np.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})" if ratios else "-"


def _side(runs: list[Run]) -> list[str]:
    numbers = [[getattr(run, of) for run in runs] for of in ("seconds", "cpu", "memory")]
    return [
        f"{np.median(number):.{digits}f}" if any(number) else "-" for number, digits in zip(numbers, (2, 2, 0), strict=True)
    ]


@dataclass(frozen=True)
class Bench:
    """Runs of bowdenfit of this checkout, and of another, in one temporary folder."""

    folder: Path
    repeats: int
    other: Path | None
    only: Collection[str]
    programs: Mapping[str, Sequence[str]]

    def is_requested(self, name: str) -> bool:
        """Whether a row or a group of them is to be measured."""
        return not self.only or name in self.only

    @property
    def trees(self) -> list[Path]:
        """The checkouts."""
        return [ROOT, *([] if self.other is None else [self.other])]

    def command(
        self, tree: Path, arguments: Sequence[str], cache: str, results: Path | None = None, watched: bool = True
    ) -> Run:
        """Run one bowdenfit command with the compilation cache `cache`."""
        output = ["--output", str(results), "--force"] if results is not None else []
        # matplotlib's list of fonts is no compiled program, so it stays where the cache is emptied.
        environment = {"XDG_CACHE_HOME": str(self.folder / cache), "MPLCONFIGDIR": str(self.folder / "matplotlib")}
        environment |= {"PYTHONPATH": str(tree), "JAX_COMPILATION_CACHE_DIR": ""}
        return measured(["-m", "bowdenfit", *arguments, *output], environment, results, tree, watched)

    def rows(self) -> Iterator[Row]:
        """All commands, cold or not, in turns."""
        for tree in self.trees:  # this keeps byte code for all that follow
            say("a fit to read")
            self.command(tree, ["fit", DATASET, "--seed", "1"], "unmeasured", self.finished(tree))
        for name, arguments in FITS.items():
            if self.is_requested(name):
                yield self.row(name, ["fit", *arguments, "--seed", "SEED"], cold=True)
        if self.is_requested(FILLED):
            yield self.row(FILLED, ["fit", DATASET, "--seed", "SEED"], writes=True)
        for name, arguments in READS.items():
            if self.is_requested(name):
                yield self.row(name, arguments)

    def library(self) -> Row:
        """A cold fit by a program that calls the library, beside one by the command, in turns."""
        ours, theirs = list[Run](), list[Run]()
        for i in range(1, self.repeats + 1):
            say(f"{LIBRARY}, {i} of {self.repeats}")
            place, cache = self.folder / f"library_{i}", self.folder / f"library_{i}_cache"
            environment = {"XDG_CACHE_HOME": str(cache), "MPLCONFIGDIR": str(self.folder / "matplotlib")}
            environment |= {"PYTHONPATH": str(ROOT), "JAX_COMPILATION_CACHE_DIR": "", "JAX_PLATFORMS": "cpu"}
            program = [str(BASELINES / "whole_fit.py"), DATASET, str(place), str(i)]
            ours.append(measured(program, environment, place, watched=False))
            command = ["fit", DATASET, "--seed", str(i)]
            theirs.append(self.command(ROOT, command, f"command_{i}_cache", self.folder / f"command_{i}", watched=False))
        return Row(LIBRARY, ours, theirs)

    def calibrations(self) -> Row:
        """Many replications here; of the other checkout few, from which as many are reckoned."""
        say(CALIBRATE)
        ours = [self._calibration(ROOT, MANY)]
        return Row(CALIBRATE, ours, [] if self.other is None else [self._reckoned(self.other)])

    def _reckoned(self, tree: Path) -> Run:
        few, more = (self._calibration(tree, n) for n in FEW)
        left = (MANY - FEW[1]) / (FEW[1] - FEW[0])
        seconds, cpu = (b + left * (b - a) for a, b in ((few.seconds, more.seconds), (few.cpu, more.cpu)))
        return replace(more, seconds=seconds, cpu=cpu)

    def _calibration(self, tree: Path, n: int) -> Run:
        index = self.folder / f"calibration_{n}_{self.trees.index(tree)}"
        command = ["calibrate", DATASET, "--replications", str(n), "--seed", "1"]
        return self.command(tree, command, f"{index.name}_cache", index)

    def cables(self) -> tuple[Row, str]:
        """Whole fleets of simple cables; the row of the largest number, cold, and what is printed of all."""
        say(CABLES)
        environment = {"PYTHONPATH": search_path(), "JAX_COMPILATION_CACHE_DIR": ""}
        run = measured([str(ROOT / "scripts" / "benchmark_batch.py")], environment)
        last = run.output.splitlines()[-1].split()
        return Row(CABLES, [replace(run, seconds=float(last[1]), cpu=float(last[2]))], []), run.output

    def row(self, name: str, arguments: Sequence[str], cold: bool = False, writes: bool = False) -> Row:
        """One command: so many times, and once more of which the memory is watched."""
        trees = self.trees[:1] if name in NOT_PAIRED else self.trees
        sides: list[list[Run]] = [[] for _ in trees]
        for i in range(self.repeats + 1):
            watched = i == self.repeats
            say(f"{name}, {'memory' if watched else f'{i + 1} of {self.repeats}'}")
            for number, (tree, runs) in enumerate(zip(trees, sides, strict=True)):
                stands = {"FIT": str(self.finished(tree)), "SEED": str(i % self.repeats + 1)}
                values = [stands.get(part, part) for part in arguments]
                folder = self.folder / f"{name}_{number}_{i}".replace(",", "").replace(" ", "_")
                cache = f"{folder.name}_cache" if cold else "unmeasured"
                run = self.command(tree, values, cache, folder if cold or writes else None, watched)
                if watched:
                    runs[:] = [replace(item, memory=run.memory) for item in runs]
                else:
                    runs.append(run)
        return Row(name, sides[0], sides[1] if len(sides) > 1 else [])

    def finished(self, tree: Path) -> Path:
        """The fit that commands on a finished fit read."""
        return self.folder / f"finished_{self.trees.index(tree)}"


def beside_plain(rows: Sequence[Row], programs: Mapping[str, Sequence[str]], repeats: int) -> Iterator[Row]:
    """Whole fits, and the same until the answer, beside plain programs, which run as often."""
    fits = {row.name: row.runs for row in rows if row.name in PLAIN}
    times = dict[str, list[Run]]()
    for name in dict.fromkeys(PLAIN[fit] for fit in fits):
        for i in range(repeats):
            say(f"{name}, {i + 1} of {repeats}")
            times.setdefault(name, []).append(measured(programs[name], {"JAX_PLATFORMS": "cpu"}, watched=False))
    for fit, runs in fits.items():
        program = PLAIN[fit]
        answers = [replace(run, seconds=run.answered, cpu=0.0, memory=0.0) for run in runs]
        yield Row(f"{fit}{ANSWER}, beside {program}", answers, times[program])
        yield Row(f"{fit} beside {program}", runs, times[program])


def stage_rows(rows: Sequence[Row]) -> Table:
    """Seconds of each stage of the cold fits, one column a fit."""
    fits = {row.name: typical(row.runs) for row in rows if row.name in FITS}
    if not fits:
        return []
    stages = list(dict.fromkeys(stage for run in fits.values() for stage in run.stages))
    shown = [["stage [s]", *fits]]
    for stage in stages:
        shown.append([stage, *(f"{run.stages[stage]:.2f}" if stage in run.stages else "-" for run in fits.values())])
    return shown


def counts() -> Iterator[str]:
    """How many programs each fit compiles, and the answers that it works out, with how many times."""
    for name in (DATASET, LOOP):
        say(f"counting, {name}")
        run = measured([str(BASELINES / "counted.py"), name], {"PYTHONPATH": search_path()})
        page = json.loads(run.output)
        answers = ", ".join(f"{request.split('.', 2)[-1]} {times}" for request, times in page["answers"].items())
        yield f"{name}: {page['programs']} programs compiled; answers worked out: {answers}."


def markdown(rows: Table) -> str:
    """A table."""
    head, *lines = (f"| {' | '.join(row)} |" for row in rows)
    return "\n".join([head, "|" + " --- |" * len(rows[0]), *lines])


def record(sections: Sequence[str]) -> None:
    """Replace the tables of the last record by those just measured."""
    initial = RECORD.read_text(encoding="utf-8") if RECORD.exists() else ""
    by_hand = initial[initial.index(BY_HAND) :] if BY_HAND in initial else ""
    RECORD.parent.mkdir(exist_ok=True)
    RECORD.write_text(HEAD + "\n" + "\n\n".join(sections) + "\n\n" + by_hand, encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description="Time fits; the head of this file says how to read the table.")
    parser.add_argument("--repeats", type=int, default=3, metavar="N", help="fresh processes a number [default: 3]")
    parser.add_argument(
        "--against", type=Path, metavar="TREE", help="another checkout, whose runs are paired with ours"
    )
    parser.add_argument("--record", action="store_true", help="keep the table in docs/benchmarks.md")
    names = [*FITS, FILLED, *READS, *GROUPS]
    parser.add_argument(
        "--only", nargs="+", default=(), choices=names, metavar="NAME", help="rows, or plain, many, counts [default: all]"
    )
    parser.add_argument("--baseline", metavar="PROGRAM", help="plain sampler and its arguments [default: plain_blackjax.py 1]")
    options = parser.parse_args()
    other = options.against and options.against.resolve()
    programs = {name: [str(ROOT / BASELINES / script), *arguments] for name, (script, *arguments) in PROGRAMS.items()}
    if options.baseline:
        programs["blackjax"] = shlex.split(options.baseline)
    with tempfile.TemporaryDirectory() as folder:
        os.environ.update(byte_code(Path(folder)))
        rows, remarks = measurements(Bench(Path(folder), max(options.repeats, 1), other, options.only, programs))
        stages = stage_rows(rows)
    table = [COLUMNS, *(row.cells() for row in rows)]
    for item in filter(None, (table, stages)):
        show(item)
    against = f" Other: commit {commit(other)}." if other else ""
    print("\n".join([*remarks, machine(*LIBRARIES) + against]))
    if options.record:
        title = f"## {date.today().isoformat()}, {commit(ROOT)}"
        tables = [markdown(stage) for stage in (table, stages) if stage]
        record([title, machine(*LIBRARIES) + against, *tables, *remarks])


def measurements(bench: Bench) -> tuple[list[Row], list[str]]:
    """All rows that are asked for, and what is to be said besides."""
    rows, remarks = list(bench.rows()), list[str]()
    if bench.is_requested("plain"):
        rows += beside_plain(rows, bench.programs, bench.repeats)
    if bench.is_requested("library"):
        rows.append(bench.library())
    if bench.is_requested("many"):
        row, printed = bench.cables()
        rows += [bench.calibrations(), row]
        remarks.append(f"```text\n{printed}```")
    return rows, [*remarks, *(counts() if bench.is_requested("counts") else ())]


if __name__ == "__main__":
    main()
