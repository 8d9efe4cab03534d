"""Twelve simulated laboratories, unlike each other: is the verdict right, the right model chosen, the truth held?

    python scripts/check_benches.py [--verdicts N] [--intervals N] [--no-comparison] [--write FILE] [LABORATORY ...]

The laboratories are those of `tests/support/bench_simulator.py`, in NumPy alone, with loads of 0.5 N to 20 kN, one mounting to
twenty, hung weights or cells, and what goes wrong on benches. In each

- every model is fitted by least squares to `--verdicts` sessions: the right one must be trusted, and any other end with a
  refusal or a verdict that names the cause;
- the models are fitted to one session by sampling and compared: no wrong one may be preferred clearly;
- the right model is fitted to `--intervals` sessions by the batch engine, with the priors of the first of them: 90 % intervals
  must contain the truth as often as chance allows, at 99 % for all of them together.

Prints a table, writes its rows into a file between two marks (`--write fits/README.md`; those of other laboratories stay), and
ends with 1 if anything is wrong.
"""

import argparse
import datetime
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "support"))

from bench_simulator import LABORATORIES, Laboratory  # noqa: E402
from laboratory_fits import HELD, ending, fault, held  # noqa: E402

import bowdenfit as bf  # noqa: E402
from bowdenfit.words import table  # noqa: E402

START, END = "<!-- twelve laboratories: written by scripts/check_benches.py -->", "<!-- end of twelve laboratories -->"
HEADS = ("laboratory", "verdicts right", "compared", "90 % intervals that contain the truth", "wrong")
TOGETHER = 0.01  # probability that chance alone makes one of all rates of a run look wrong


@dataclass
class Row:
    """What was found in one laboratory."""

    name: str
    verdicts: str = ""
    compared: str = "-"
    intervals: str = "-"
    wrong: tuple[str, ...] = ()

    @property
    def cells(self) -> tuple[str, ...]:
        """For the table."""
        return self.name, self.verdicts, self.compared, self.intervals, "; ".join(self.wrong) or "nothing"


def verdicts(laboratory: Laboratory, row: Row, sessions: int, scratch: Path) -> None:
    """How fits of every model end."""
    right = 0
    for seed in range(sessions):
        folder = laboratory.write(scratch / f"verdict {seed}", seed)
        for model in laboratory.models:
            message = fault(laboratory, model, *ending(laboratory, folder, model))
            right += not message
            row.wrong += (f"{message} (session {seed})",) if message else ()
    row.verdicts = f"{right} of {sessions * len(laboratory.models)}"


def comparison(laboratory: Laboratory, row: Row, scratch: Path) -> None:
    """What `compare` says of the models."""
    folder = laboratory.write(scratch / "compared", 1)
    computed = bf.compare({name: bf.fit(folder, seed=1, **options) for name, options in laboratory.models.items()})
    clear_losers = [name for name in computed.differences if name != computed.best and computed.verdict(name) == "clear"]
    alike = [name for name in computed.differences if name not in clear_losers]
    row.compared = f"{alike[0]} is best" if len(alike) == 1 else f"cannot tell {', '.join(alike)}"
    if laboratory.right not in alike:
        row.wrong += (f"compare prefers {computed.best}",)


def intervals(laboratory: Laboratory, row: Row, sessions: int, scratch: Path) -> None:
    """Whether intervals hold the truth at their rate."""
    from scipy.stats import binomtest

    coverage = held(laboratory, sessions, scratch)
    fitted = coverage.pop("")
    row.intervals = ", ".join(f"{name} {count / max(fitted, 1):.0%}" for name, count in coverage.items()) + f" of {fitted}"
    rates = sum(len(laboratory.truth) for laboratory in LABORATORIES.values() if laboratory.right)
    for name, count in coverage.items():
        if count < HELD * fitted and binomtest(count, fitted, HELD).pvalue < TOGETHER / rates:
            row.wrong += (f"the interval of {name} holds it too seldom",)
    if fitted < HELD * sessions:
        row.wrong += (f"{sessions - fitted} of {sessions} did not converge",)


def investigate(name: str, options: argparse.Namespace) -> Row:
    """Everything about one laboratory."""
    laboratory, row = LABORATORIES[name], Row(name)
    with tempfile.TemporaryDirectory() as scratch:
        if options.verdicts:
            verdicts(laboratory, row, options.verdicts, Path(scratch))
        if len(laboratory.models) > 1 and not options.no_comparison:
            comparison(laboratory, row, Path(scratch))
        if laboratory.right and options.intervals:
            intervals(laboratory, row, options.intervals, Path(scratch))
    return row


def write(path: Path, row: Row) -> None:
    """Put a row into the table between its marks in a file of text, in place of an earlier one of the laboratory."""
    commit = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout
    made = f"{datetime.datetime.now(datetime.UTC).date()}, {commit.strip()}"
    head, _, tail = path.read_text().partition(START)
    old, _, after = tail.partition(END)
    rows = {line.split(" | ")[0]: line for line in old.splitlines() if line.startswith("| ") and "---" not in line}
    rows[f"| {row.name}"] = "| " + " | ".join((*row.cells, made)) + " |"
    order = [f"| {name}" for name in LABORATORIES]
    heads = ["| " + " | ".join((*HEADS, "made")) + " |", "| " + " | ".join(["---"] * (len(HEADS) + 1)) + " |"]
    path.write_text(head + "\n".join([START, "", *heads, *(rows[k] for k in order if k in rows), "", END]) + after)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("laboratories", nargs="*", metavar="LABORATORY", help="all if omitted")
    parser.add_argument("--verdicts", type=int, default=5)
    parser.add_argument("--intervals", type=int, default=200)
    parser.add_argument("--no-comparison", action="store_true")
    parser.add_argument("--write", type=Path)
    options = parser.parse_args()
    unknown = [name for name in options.laboratories if name not in LABORATORIES]
    if unknown:
        parser.error(f"there is no laboratory {unknown[0]!r}; there are {', '.join(LABORATORIES)}.")
    rows = []
    for name in options.laboratories or LABORATORIES:
        rows.append(investigate(name, options))
        print(" | ".join(rows[-1].cells), flush=True)
        if options.write:
            write(options.write, rows[-1])
    print("\n" + table(HEADS, [row.cells for row in rows]))
    sys.exit(1 if any(row.wrong for row in rows) else 0)


if __name__ == "__main__":
    main()
