"""How long a fit takes and how much memory it needs, beside another checkout and beside the same job written plainly.

    python scripts/benchmark_fit.py [--repeats N] [--against TREE] [--record]

Run it with the Python of the environment that bowdenfit and its tests use, on a machine that does nothing else: it takes
several minutes, measures everything in one go, and prints one table. Every number is the median of N fresh processes
(default 3). `--record` puts the table at the head of docs/benchmarks.md, with the machine, the date and the commit.

Whole processes: wall time from start to exit, imports, compilation, figures and files included, and the peak of the
resident memory of the process and those it starts, shared pages counted in each. No program is kept from before ("cold"),
but for "cache filled". With `--against`, another checkout does the same in turns, and each pair gives a ratio; the lowest
and the highest of them stand beside their median. Commands on a finished fit read the one that their own checkout wrote.

To 1000 effective draws (bulk, the worst of all 11 parameters) of the joint posterior of the on-body data, by the programs
in scripts/baselines, which draw and write nothing: from the start of the process to the first look at the draws that finds
as many. bowdenfit samples on until R-hat, the tails, l* and eta* are settled too, while the plain programs stop at 1000.
Their pairs are with bowdenfit's own run of the same turn, so that a ratio below 1 means that bowdenfit is quicker. Means of
the friction coefficients must agree, or a warning is printed. "cold fit beside" compares the whole command, with figures
and files, to a plain program that only draws.

Below the table: stages of the cold fits as fit.json keeps them; how many programs one fit compiles, and how many times it
works out each answer, which should be once (scripts/baselines/counted.py, in one process).

The exit code is 0 whenever everything could be measured, whether or not the targets are met.
"""

import argparse
import json
import os
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np
from benchmark_tables import Table, commit, machine, say, show
from processes import BASELINES, ROOT, Run, byte_code, measured, search_path, typical

DATASET = "datasets/on-body-exoskeleton"
LOOP = "datasets/synthetic-haptic-loop"  # stretch, preload and loop in one posterior
COEFFICIENTS = ("mu1", "mu2", "mu3")
BENCH, RECORDINGS = "datasets/synthetic-bench", "datasets/synthetic-recordings"
FITS: dict[str, tuple[str, ...]] = {  # arguments of a cold fit, by its name in the table
    "fit": (DATASET,),
    "fit --no-mcmc": (DATASET, "--no-mcmc"),
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
    "check": ("check", DATASET),
    "--help": ("--help",),
}
PLAIN = {"blackjax": "plain_blackjax.py", "emcee and NumPy": "plain_emcee.py", "NumPyro": "plain_numpyro.py"}
TARGETS = {  # ratios
    "fit": 0.45,
    "fit --no-mcmc": 0.55,
    "fit, haptic loop": 0.5,
    "fit, recordings": 0.5,
    "fit, bench": 0.5,
    "cold fit beside blackjax": 0.75,
    "to 1000, beside emcee and NumPy": 0.6,
}
SECONDS = {
    "summary": 0.5,
    "length": 0.5,
    "predict": 0.5,
    "predict 455": 1.0,
    "identify": 0.5,
    "plot one": 0.5,
}  # targets
RECORD = ROOT / "docs" / "benchmarks.md"
HEAD = "# Benchmarks\n\nWritten by `scripts/benchmark_fit.py --record`; its head says what each number is. The newest first.\n"
AGREEMENT = 0.2  # standard deviations between means
LIBRARIES = ("jax", "emcee", "blackjax", "numpyro", "numpy")


@dataclass(frozen=True)
class Sampler:
    """What one program needed for its effective draws, and what they say of the friction coefficients."""

    to_target: float
    ess: float
    mean: np.ndarray
    sd: np.ndarray


@dataclass(frozen=True)
class Row:
    """A line of the table: what was run, and in the same turns what it is compared with."""

    name: str
    runs: list[Run]
    against: list[Run]

    @property
    def ratios(self) -> list[float]:
        """Of wall times, pair by pair."""
        return [a.seconds / b.seconds for a, b in zip(self.runs, self.against, strict=True)] if self.against else []

    def cells(self) -> list[str]:
        """Wall time and memory, those of the other, ratio with its spread, target."""
        sides = [side for runs in (self.runs, self.against) for side in _side(runs)]
        ratios, target = self.ratios, f"{TARGETS.get(self.name, '-')}"
        said = [f"{x:.2f}" for x in (np.median(ratios), min(ratios), max(ratios))] if ratios else ["-"] * 3
        return [self.name, *sides, *said, f"{SECONDS[self.name]} s" if self.name in SECONDS else target]


COLUMNS = ["", "wall [s]", "peak [MiB]", "other [s]", "peak [MiB]", "ratio", "lowest", "highest", "target"]


def _side(runs: list[Run]) -> list[str]:
    if not runs:
        return ["-", "-"]
    memory = float(np.median([run.memory for run in runs]))
    return [f"{np.median([run.seconds for run in runs]):.2f}", f"{memory:.0f}" if memory else "-"]


@dataclass(frozen=True)
class Bench:
    """Runs of bowdenfit of this checkout, and of another, in one temporary folder."""

    folder: Path
    repeats: int
    other: Path | None

    @property
    def trees(self) -> list[Path]:
        """The checkouts."""
        return [ROOT, *([] if self.other is None else [self.other])]

    def command(self, tree: Path, arguments: Sequence[str], cache: str, results: Path | None = None) -> Run:
        """Run one bowdenfit command with the compilation cache `cache`."""
        output = ["--output", str(results), "--force"] if results is not None else []
        # matplotlib's list of fonts is no compiled program, so it stays where the cache is emptied.
        environment = {"XDG_CACHE_HOME": str(self.folder / cache), "MPLCONFIGDIR": str(self.folder / "matplotlib")}
        environment |= {"PYTHONPATH": str(tree), "JAX_COMPILATION_CACHE_DIR": ""}
        return measured(["-m", "bowdenfit.cli", *arguments, *output], environment, results, tree)

    def rows(self) -> Iterator[Row]:
        """All commands, cold or not, in turns."""
        for tree in self.trees:
            self.command(tree, ["fit", DATASET, "--seed", "1"], "unmeasured", self.finished(tree))
        for name, arguments in FITS.items():
            yield self.row(name, ["fit", *arguments, "--seed", "1"], cold=True)
        yield self.row("fit, cache filled", ["fit", DATASET, "--seed", "1"], writes=True)
        for name, arguments in READS.items():
            yield self.row(name, arguments)

    def row(self, name: str, arguments: Sequence[str], cold: bool = False, writes: bool = False) -> Row:
        """One command."""
        sides: list[list[Run]] = [[] for _ in self.trees]
        for i in range(self.repeats):
            say(f"{name}, {i + 1} of {self.repeats}")
            for number, (tree, runs) in enumerate(zip(self.trees, sides, strict=True)):
                given = [str(self.finished(tree)) if part == "FIT" else part for part in arguments]
                at = self.folder / f"{name}_{number}_{i}".replace(",", "").replace(" ", "_")
                cache = f"{at.name}_cache" if cold else "unmeasured"
                runs.append(self.command(tree, given, cache, at if cold or writes else None))
        return Row(name, sides[0], sides[1] if len(sides) > 1 else [])

    def finished(self, tree: Path) -> Path:
        """The fit that commands on a finished fit read."""
        return self.folder / f"finished_{self.trees.index(tree)}"


def samplers(folder: Path, repeats: int) -> dict[str, list[Sampler]]:
    """Time to 1000 effective draws of bowdenfit and of the plain programs, in turns."""
    found: dict[str, list[Sampler]] = {}
    for seed in range(1, repeats + 1):
        for name, script in {"bowdenfit": "with_bowdenfit.py", **PLAIN}.items():
            say(f"{name} to 1000, {seed} of {repeats}")
            environment = {"PYTHONPATH": search_path(), "XDG_CACHE_HOME": str(folder / f"cache_{name}_{seed}")}
            run = measured([str(BASELINES / script), str(seed)], environment)
            page = json.loads(run.output)
            sampler = Sampler(page["ready_at"] - run.started, page["ess"], np.array(page["mean"]), np.array(page["sd"]))
            found.setdefault(name, []).append(sampler)
    return found


def beside_plain(found: dict[str, list[Sampler]], fits: Row) -> Iterator[Row]:
    """Bowdenfit beside the plain programs: to 1000 effective draws, and a whole cold fit."""
    runs = {name: [Run(0.0, s.to_target, 0.0, "") for s in each] for name, each in found.items()}
    for name in PLAIN:
        yield Row(f"to 1000, beside {name}", runs["bowdenfit"], runs[name])
    for name in PLAIN:
        yield Row(f"cold fit beside {name}", fits.runs, runs[name])


def batch_rows() -> Iterator[Row]:
    """Many cables in one program: cost of 1000 cables, of 200 replications of `calibrate`; measured by a script of its own."""
    yield from ()


def stage_rows(rows: Sequence[Row]) -> Table:
    """Seconds of each stage of the cold fits, one column a fit."""
    fits = {row.name: typical(row.runs) for row in rows if row.name in FITS}
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
        answers = ", ".join(f"{asked.split('.', 2)[-1]} {times}" for asked, times in page["answers"].items())
        yield f"{name}: {page['programs']} programs compiled; answers worked out: {answers}."


def disagreements(found: dict[str, list[Sampler]]) -> Iterator[str]:
    """Means that differ, which would make this a comparison of unequal things."""
    first = found["bowdenfit"]
    for other in PLAIN:
        ours, theirs = (np.mean([s.mean for s in each], axis=0) for each in (first, found[other]))
        for name, distance in zip(COEFFICIENTS, np.abs(theirs - ours) / first[0].sd, strict=True):
            if not distance < AGREEMENT:
                yield f"Warning: the means of {name} by bowdenfit and by {other} are {distance:.2f} sd apart."


def markdown(rows: Table) -> str:
    """A table."""
    head, *lines = (f"| {' | '.join(row)} |" for row in rows)
    return "\n".join([head, "|" + " --- |" * len(rows[0]), *lines])


def record(sections: Sequence[str]) -> None:
    """Put what was measured at the head of the record."""
    before = RECORD.read_text(encoding="utf-8").removeprefix(HEAD) if RECORD.exists() else ""
    RECORD.parent.mkdir(exist_ok=True)
    RECORD.write_text(HEAD + "\n" + "\n\n".join(sections) + "\n" + before, encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description="Time fits; the head of this file says how to read the table.")
    parser.add_argument("--repeats", type=int, default=3, metavar="N", help="fresh processes a number [default: 3]")
    parser.add_argument(
        "--against", type=Path, metavar="TREE", help="another checkout, whose runs are paired with ours"
    )
    parser.add_argument("--record", action="store_true", help="keep the table in docs/benchmarks.md")
    asked = parser.parse_args()
    repeats, other = max(asked.repeats, 1), asked.against and asked.against.resolve()
    with tempfile.TemporaryDirectory() as folder:
        os.environ.update(byte_code(Path(folder)))
        rows = list(Bench(Path(folder), repeats, other).rows())
        found = samplers(Path(folder), repeats)
        rows += [*beside_plain(found, rows[0]), *batch_rows()]
        stages = stage_rows(rows)
    table, remarks = [COLUMNS, *(row.cells() for row in rows)], [*counts(), *disagreements(found)]
    show(table)
    show(stages)
    against = f" Other: commit {commit(other)}." if other else ""
    print("\n".join([*remarks, machine(*LIBRARIES) + against]))
    if asked.record:
        title = f"## {date.today().isoformat()}, {commit(ROOT)}"
        record([title, machine(*LIBRARIES) + against, markdown(table), markdown(stages), *remarks])


if __name__ == "__main__":
    main()
