"""Do 90 % intervals of the exported online estimator contain the friction exponent, with sensors that are not ideal?

    .venv/bin/python scripts/check_tracking.py [--runs 12] [--first 0] [--compiler gcc]

Cables are simulated by `scripts/tracking/bench.py`, which imports nothing from bowdenfit; `bowden_track` of the exported C
header, compiled, follows them. The extended and the unscented Kalman filter of a textbook get the same samples. Prints for each
fault of the sensors, and each speed at which the exponent wanders, how often the intervals contained the exponent (of all
samples after the first second) and their median half width; then the time of a step.

Ends with 1 if fewer than `LEAST` of the samples of a row were inside.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from tracking.bench import Bench, Fault, Samples, simulate  # noqa: E402
from tracking.kalman import extended_filter, loop_band, rope_band, unscented_filter  # noqa: E402

from bowdenfit.questions.export.c import c_header  # noqa: E402
from bowdenfit.questions.export.tables import (  # noqa: E402
    LEVELS,
    FitLabel,
    FrictionLevel,
    TablePoints,
    TransmissionTables,
)

LEAST = 0.85  # share of the samples of a row whose interval must contain the exponent, of 0.9
DRIFTS = (0.005, 0.02, 0.05)  # standard deviation by which the exponent wanders in a second
BURN_IN = 1.0  # s that do not count
DEVIATES = {"q05": -1.645, "q50": 0.0, "q95": 1.645}
FAULTS = {
    "white noise": Fault(),
    "noise filtered over 20 ms": Fault(noise_time=0.02),
    "output 10 ms late": Fault(latency=0.01),
    "one cell 2 % high": Fault(output_gain=0.02),
}
DRIVER = r"""
#include <stdio.h>
#include <stdlib.h>
#include "bowden.h"

int main(int n_arguments, char **arguments)
{
    double in[2], out[4];
    bowden_tracker tracker;

    if (n_arguments < 4 || bowden_track_start(&tracker, 0.0, atof(arguments[1]), atof(arguments[2]))) {
        return 1;
    }
    while (fread(in, sizeof *in, 2, stdin) == 2) {
        out[0] = bowden_track(&tracker, 0.0, in[0], in[1], atof(arguments[3]));
        bowden_track_interval(&tracker, out + 1, out + 2);
        out[3] = 0.0;
        fwrite(out, sizeof *out, 4, stdout);
    }
    return 0;
}
"""


@dataclass(frozen=True)
class Coverage:
    """How one filter did on the recordings of a row.

    Args:
        inside: Share of samples whose interval contained the exponent.
        half_width: Median half width of the intervals.
        flagged: Share of samples with the flag "cannot tell".
    """

    inside: float
    half_width: float
    flagged: float = 0.0


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=12)
    parser.add_argument("--first", type=int, default=0, help="seed of the first run")
    parser.add_argument("--compiler", default="gcc")
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.runs)
    with tempfile.TemporaryDirectory() as scratch:
        worst = print_table(Bench(), FAULTS, seeds, Path(scratch), options.compiler)
        print(f"\n{microseconds_per_step(Bench(), Path(scratch), options.compiler):.2f} us per step, with reading and writing")
    sys.exit(int(worst < LEAST))


def print_table(bench: Bench, faults: dict[str, Fault], seeds: range, folder: Path, compiler: str) -> float:
    """Print coverage and half widths of each filter for each fault and drift; return the least coverage of the estimator."""
    program = compile_tracker(bench, folder, compiler)
    heads = ("sensors", "drift", "bowden_track", "half width", "flagged", "EKF", "half width", "UKF", "half width")
    print("| " + " | ".join(heads) + " |\n|" + " --- |" * len(heads))
    worst = 1.0
    for name, fault in faults.items():
        for drift in DRIFTS:
            runs = [simulate(bench, fault, drift, seed) for seed in seeds]
            rows = (track(program, bench, runs, drift), *compare_filters(bench, runs, drift))
            worst = min(worst, rows[0].inside)
            cells = [f"{row.inside:.2f} | {row.half_width:.4f}" for row in rows]
            cells[0] += f" | {rows[0].flagged:.2f}"
            print(f"| {name} | {drift:g} | {' | '.join(cells)} |", flush=True)
    return worst


def tables_of(bench: Bench) -> TransmissionTables:
    """Tables of a fit that knows the cable, but for its mounting."""
    levels = []
    for name in LEVELS:
        of_mounting = name.startswith("mounting")
        spread = bench.mounting_sd * DEVIATES[name.removeprefix("mounting_")] * (1.0 if of_mounting else 0.3)
        exponent = bench.exponent * (1 + spread) * np.ones((2, 1))
        levels.append(FrictionLevel(name, exponent, 2 * bench.preload * exponent[0]))
    label = FitLabel("simulated", 0, "0", "", ())
    points = TablePoints("place", "", np.zeros(1))
    return TransmissionTables(label, points, tuple(levels), bool(bench.preload), (), bench.load, 0.0, "", 0.0)


def compile_tracker(bench: Bench, folder: Path, compiler: str) -> Path:
    """Compile the estimator of a bench; return the program."""
    (folder / "bowden.h").write_text(c_header(tables_of(bench)))
    (folder / "driver.c").write_text(DRIVER)
    strict = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2")
    subprocess.run([compiler, *strict, "-o", "tracker", "driver.c", "-lm"], cwd=folder, check=True)
    return folder / "tracker"


def run_program(program: Path, bench: Bench, run: Samples, drift: float) -> np.ndarray:
    """Run the estimator; return exponent, ends of its interval and flag by sample."""
    rows = np.column_stack([run.input_force, run.output_force])
    arguments = [repr(value) for value in (drift, bench.force_sd, 1 / bench.rate)]
    output = subprocess.run([program, *arguments], input=rows.tobytes(), capture_output=True, check=True).stdout
    return np.frombuffer(output).reshape(-1, 4).T


def track(program: Path, bench: Bench, runs: list[Samples], drift: float) -> Coverage:
    """Coverage of the estimator."""
    inside, widths, flags = [], [], []
    for run in runs:
        _, low, high, flag = run_program(program, bench, run, drift)
        counted = run.time >= BURN_IN
        inside.append(((low <= run.exponent) & (run.exponent <= high))[counted])
        widths.append(0.5 * (high - low)[counted])
        flags.append(flag[counted])
    return Coverage(float(np.mean(inside)), float(np.median(widths)), float(np.mean(flags)))


def compare_filters(bench: Bench, runs: list[Samples], drift: float) -> list[Coverage]:
    """Coverage of the extended and of the unscented Kalman filter."""
    forces, outputs = (np.stack([getattr(run, name) for run in runs]) for name in ("input_force", "output_force"))
    truth = np.stack([run.exponent for run in runs])
    band = loop_band(bench.preload) if bench.preload else rope_band
    start = bench.exponent, bench.exponent * bench.mounting_sd
    counted = runs[0].time >= BURN_IN
    rows = []
    for follow in (extended_filter, unscented_filter):
        exponent, sd = follow(forces, outputs, band, start, drift, bench.force_sd, 1 / bench.rate)
        half = 1.645 * sd[:, counted]
        inside = np.abs(exponent - truth)[:, counted] <= half
        rows.append(Coverage(float(np.mean(inside)), float(np.median(half))))
    return rows


def microseconds_per_step(bench: Bench, folder: Path, compiler: str) -> float:
    """Time of a step [us] on this machine, with reading and writing of samples: the least of five."""
    bench = replace(bench, seconds=300.0)
    program, run = compile_tracker(bench, folder, compiler), simulate(bench, Fault(), 0.02, 0)
    times = []
    for _ in range(5):
        start = time.perf_counter()
        run_program(program, bench, run, 0.02)
        times.append(time.perf_counter() - start)
    return 1e6 * min(times) / len(run.time)


if __name__ == "__main__":
    main()
