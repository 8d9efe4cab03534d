"""How soon is a mounting in the answer of `bowdenfit watch`, and does its advice to stop come where `next` by hand says it?

    python scripts/watch_bench.py [--dataset DATASET] [--until UNCERTAINTY] [--every SECONDS] [--by-hand]
    python scripts/watch_bench.py [--dataset DATASET] --memory FITS

A simulated bench: one sheath bent by 180 deg and twelve mountings, or a copy of a data set with a table of forces. Two of the
mountings are there at the beginning; once these are fitted the others are written, one every so many seconds, each row by
itself as a bench does. Prints for each mounting how long after its last row an answer held it, what the answer was, and whether
enough is known. With `--by-hand` the first mountings are also
fitted by `bowdenfit fit` and asked by `bowdenfit next`, and both are set side by side. Ends with exit code 1 where an answer
took longer than 3 s, or where the two differ on whether to stop.

With `--memory` the bench writes one row after each verdict, for so many fits, and the memory of this process after each tenth
verdict is printed (Linux). Ends with exit code 1 where the last half of the fits added more than 30 MiB to it.
"""

import argparse
import mmap
import shutil
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import bowdenfit as bf
from bowdenfit.arguments import Length, read_lengths
from bowdenfit.questions.next.answer import choose_target
from bowdenfit.questions.next.ranking import is_good_enough
from bowdenfit.questions.watch import WatchedAnswer, watch_answers
from bowdenfit.questions.watch.watching import read_until

# MiB that the last half of 200 fits may add. The 17th mounting has programs compiled for twice as many, and the memory reached
# meanwhile stays with the process: 16 to 25 MiB, once. Programs that were kept made it 61 MiB.
ALLOWED_GROWTH = 30.0
ALLOWED = 3.0  # s from the last row of a mounting to an answer that holds it
_FIRST = 2  # mountings that are there from the start
_PATIENCE = 60.0  # s after the last row
_DESCRIPTION = """\
schema = 1
name = "simulated bench"
source = "scripts/watch_bench.py"

[[contact]]
name = "sheath"
friction = "mu"
wrap_angle = { value = 180, unit = "deg" }

[tables]
forces = { file = "forces.csv" }
"""


@dataclass(frozen=True)
class Bench:
    """A bench that writes mountings one after the other.

    Args:
        folder: Its data set.
        head: First line of its table of forces.
        mountings: Lines of each mounting.
    """

    folder: Path
    head: str
    mountings: tuple[tuple[str, ...], ...]

    @classmethod
    def simulate(cls, folder: Path, seed: int = 0, mountings: int = 12) -> "Bench":
        """Return a bench of one sheath, mu = 0.12, whose mountings differ by 6 % in friction."""
        random = np.random.default_rng(seed)
        folder.mkdir()
        (folder / "cable.toml").write_text(_DESCRIPTION)
        lines = ["run,stroke,input_force_N,output_force_N\n"]
        for mounting in range(1, mountings + 1):
            exponent = 0.12 * np.pi * (1 + 0.06 * random.standard_normal())
            for force in (20, 40, 60, 80, 100):
                for stroke, sign in (("pull", 1), ("return", -1)):
                    read = np.array([force, force * np.exp(-sign * exponent)]) + 0.2 * random.standard_normal(2)
                    lines.append(f"m{mounting},{stroke},{read[0]:.2f},{read[1]:.2f}\n")
        (folder / "forces.csv").write_text("".join(lines))
        return cls.cut(folder)

    @classmethod
    def cut(cls, folder: Path) -> "Bench":
        """Return a bench with the first mountings of a folder."""
        head, *lines = (folder / "forces.csv").read_text().splitlines(keepends=True)
        runs: dict[str, list[str]] = {}
        column = head.strip().split(",").index("run")
        for line in lines:
            runs.setdefault(line.split(",")[column], []).append(line)
        bench = cls(folder, head, tuple(map(tuple, runs.values())))
        bench.write(_FIRST)
        return bench

    def write(self, count: int) -> None:
        """Write the table anew with so many mountings."""
        rows = [line for lines in self.mountings[:count] for line in lines]
        (self.folder / "forces.csv").write_text("".join([self.head, *rows]))

    def append(self, number: int) -> None:
        """Append the rows of one mounting, each by itself, as a bench does."""
        for line in self.mountings[number]:
            with (self.folder / "forces.csv").open("a") as file:
                file.write(line)


def watch_bench(bench: Bench, until: Length | None, every: float) -> tuple[list[float], dict[int, WatchedAnswer]]:
    """Return the seconds from each mounting's last row to an answer that holds it, and the last answer of each number."""
    ready, ended = threading.Event(), threading.Event()
    written: dict[int, float] = {}
    seen: dict[int, float] = {}
    answers: dict[int, WatchedAnswer] = {}

    def measure() -> None:
        ready.wait()
        for number in range(_FIRST, len(bench.mountings)):
            bench.append(number)
            written[number + 1] = time.monotonic()
            time.sleep(every)
        time.sleep(_PATIENCE)
        ended.set()

    threading.Thread(target=measure, daemon=True).start()
    # Enough is judged here, so that watching goes on to the last mounting whatever was asked for.
    for answer in watch_answers(bench.folder, until=until, is_stopped=ended.is_set):
        if not isinstance(answer, WatchedAnswer):
            print(answer, flush=True)
            continue
        now, answers[answer.mountings] = time.monotonic(), answer
        for count in written:
            if count <= answer.mountings:
                seen.setdefault(count, now)
        if answer.trusted is not None:
            ready.set()
            if answer.mountings == len(bench.mountings):
                break
    return [seen[count] - written[count] for count in sorted(written)], answers


def measure_memory(bench: Bench, fits: int) -> list[float]:
    """Return the memory after each of some verdicts [MiB], between which the bench writes one row."""
    rows = [line for lines in bench.mountings[_FIRST:] for line in lines]
    missing, memory = iter(rows * (fits // len(rows) + 1)), []
    for answer in watch_answers(bench.folder):
        if isinstance(answer, WatchedAnswer) and answer.trusted is not None:
            memory.append(resident_memory())
            if len(memory) % 10 == 1 or len(memory) == fits:
                print(f"{len(memory):5} fits, {answer.readings:4} readings  {memory[-1]:7.1f} MiB", flush=True)
            if len(memory) == fits:
                break
            with (bench.folder / "forces.csv").open("a") as file:
                file.write(next(missing))
    return memory


def resident_memory() -> float:
    """Return the memory of this process that is not swapped out [MiB]; Linux."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * mmap.PAGESIZE / 2**20


def by_hand(bench: Bench, count: int, until: Length | None) -> tuple[float, bool]:
    """Return how well the answer is known by `fit` and `next` from the first mountings, and whether it is enough."""
    bench.write(count)
    fit = bf.fit(bench.folder, seed=1)
    target = choose_target(fit, None)
    return target.sd, is_good_enough(fit, target) if until is None else target.sd <= read_until(until, target)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the bench and print what came of it; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dataset", type=Path)
    parser.add_argument("--until")
    parser.add_argument("--every", type=float, default=1.0)
    parser.add_argument("--by-hand", action="store_true")
    parser.add_argument("--memory", type=int, metavar="FITS")
    options = parser.parse_args(arguments)
    until = read_lengths([options.until], "--until")[0] if options.until else None
    with TemporaryDirectory() as folder:
        place = Path(folder) / "bench"
        if options.dataset:
            shutil.copytree(options.dataset, place)
        if options.memory:
            long = Bench.cut(place) if options.dataset else Bench.simulate(place, mountings=_FIRST + options.memory // 10 + 1)
            memory = measure_memory(long, options.memory)
            growth = memory[-1] - memory[len(memory) // 2]
            print(f"the last half added {growth:.1f} MiB, allowed {ALLOWED_GROWTH:g} MiB")
            return int(growth > ALLOWED_GROWTH)
        bench = Bench.cut(place) if options.dataset else Bench.simulate(place)
        delays, answers = watch_bench(bench, until, options.every)
        print("mounting  delay [s]")
        for number, delay in enumerate(delays, start=_FIRST + 1):
            print(f"{number:8}  {delay:9.2f}", flush=True)
        print(f"longest {max(delays):.2f} s, allowed {ALLOWED:g} s")
        differ = 0
        for count, answer in sorted(answers.items()):
            reference = f"{answer.interval}, sd {answer.interval.sd:.3g}, stop {answer.may_stop}"
            line = f"{count:3} mountings: {reference}, {answer.seconds:.2f} s"
            if options.by_hand:
                sd, enough = by_hand(bench, count, until)
                differ += enough != answer.may_stop
                line += f"; by hand sd {sd:.3g}, stop {enough}"
            print(line, flush=True)
    return int(max(delays) > ALLOWED or differ > 0)


if __name__ == "__main__":
    sys.exit(main())
