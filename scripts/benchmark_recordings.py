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
import os
import tempfile
import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

from benchmark_tables import Table, machine, show
from recordings.fits import fit_tables
from recordings.likelihood import likelihood_tables
from recordings.play import play_tables
from recordings.reading import large_tables, reading_tables
from recordings.simulated import Simulated, Size, apart

LIBRARIES = ("jax", "numba", "numpy", "pandas", "pyarrow")
PARTS: dict[str, Callable[[Simulated], Iterable[Table]]] = {
    "play": partial(apart, play_tables),
    "reading": reading_tables,
    "likelihood": partial(apart, likelihood_tables),
    "fit": fit_tables,
    "large": large_tables,
}


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
    load = f" Load {os.getloadavg()[0]:.1f} at the end." if hasattr(os, "getloadavg") else ""
    print(f"{machine(*LIBRARIES)}{load} Measured in {time.monotonic() - start:.0f} s.")


if __name__ == "__main__":
    main()
