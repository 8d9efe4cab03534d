"""Do 90 % intervals of the exported online estimator contain the friction exponent, with sensors that are not ideal?

    .venv/bin/python scripts/check_tracking.py [--runs 12] [--first 0] [--compiler gcc]

Cables are simulated by `scripts/tracking/bench.py`, which imports nothing from bowdenfit; `bowden_track` of the exported C
header, compiled, follows them. It knows the noise from a recording of the bench, and of gains, zeros and latency what is
exported where nothing is stated. The extended and the unscented Kalman filter of a textbook get the same samples. Prints for
each fault of the sensors, and each speed at which the exponent wanders, how often the intervals contained the exponent (of all
samples after the first second), their median half width, and how often the estimator said that it cannot tell; the same for
other cables and for sensors that are not as stated; then the time of a step.

Ends with 1 if fewer than `LEAST` of the samples of a row of the first two tables were inside.
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
from bowdenfit.questions.export.sensors import SensorErrors  # noqa: E402
from bowdenfit.questions.export.tables import (  # noqa: E402
    LEVELS,
    FitLabel,
    FrictionLevel,
    TablePoints,
    TransmissionTables,
)
from bowdenfit.recordings.preparation.noise import describe_noise  # noqa: E402

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
SHARE = 3**-0.5  # of a limit: the standard deviation of an error that may be anything within it
ALL = Fault(0.02, SHARE * 0.01, SHARE * -0.01, SHARE * 0.01, SHARE * 0.001, SHARE * -0.001)
MORE_FAULTS = {"zeros 0.1 % of the range apart": Fault(input_zero=0.001, output_zero=-0.001), "all at 0.6 of their limits": ALL}
CABLES = {
    "1 N": Bench(load=1.0),
    "10 kN": Bench(load=1e4),
    "exponent 0.05": Bench(exponent=0.05),
    "exponent 1.5": Bench(exponent=1.5, least=0.02, noise=0.0002),
    "triangles": Bench(wave="triangle"),
    "random motion": Bench(wave="random", seconds=24.0),
    "200 samples per second": Bench(rate=200.0),
    "five times the noise": Bench(noise=0.5 / 90),
    "taut loop": Bench(least=-1.0, preload=100.0, exponent=0.1),
    "loop that goes slack": Bench(least=-1.0, preload=10.0),
}
NOISE_OF_RECORDING = 8  # seed of the recording that says how noise is
BEYOND = {  # what sensors have, and what the estimator is told: nothing of it
    "noise filtered over 20 ms, said to be white": Fault(noise_time=0.02),
    "three times as much noise as said": Fault(louder=3.0),
    "one cell 5 % high, limit 1 %": Fault(output_gain=0.05),
    "output 30 ms late, limit 10 ms": Fault(latency=0.03),
}
DRIVER = r"""
#include <stdio.h>
#include <stdlib.h>
#include "bowden.h"

int main(int n_arguments, char **arguments)
{
    double in[2], out[4];
    bowden_tracker tracker;

    if (n_arguments < 3 || bowden_track_start_with(&tracker, 0.0, atof(arguments[1]), &bowden_fitted_sensors)) {
        return 1;
    }
    while (fread(in, sizeof *in, 2, stdin) == 2) {
        out[0] = bowden_track(&tracker, 0.0, in[0], in[1], atof(arguments[2]));
        out[3] = bowden_track_interval(&tracker, out + 1, out + 2) == BOWDEN_CANNOT_TELL;
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
        laboratory = Laboratory(Path(scratch), options.compiler)
        worst = compare_with_filters(laboratory, seeds)
        worst = min(worst, try_cables(laboratory, seeds))
        try_wrong_statements(laboratory, seeds)
        print(f"\n{laboratory.microseconds_per_step(Bench()):.2f} us per step, with reading and writing")
    sys.exit(int(worst < LEAST))


def compare_with_filters(laboratory: "Laboratory", seeds: range) -> float:
    """Print the table of the estimator and the filters of a textbook; return the least coverage of the estimator."""
    bench, exact = Bench(), SensorErrors(Bench().force_sd)
    heads = ("sensors", "drift", "bowden_track", "half width", "flagged", "EKF", "half width", "UKF", "half width")
    print("| " + " | ".join(heads) + " |\n|" + " --- |" * len(heads))
    worst = 1.0
    for name, fault in {**FAULTS, **MORE_FAULTS, "white noise, sensors said to be exact": Fault()}.items():
        sensors = exact if name.endswith("exact") else usual_sensors(bench, fault)
        for drift in DRIFTS:
            runs = [simulate(bench, fault, drift, seed) for seed in seeds]
            rows = (laboratory.track(bench, sensors, runs, drift), *compare_filters(bench, runs, drift))
            worst = min(worst, rows[0].inside)
            cells = [f"{row.inside:.2f} | {row.half_width:.4f}" for row in rows]
            cells[0] += f" | {rows[0].flagged:.2f}"
            print(f"| {name} | {drift:g} | {' | '.join(cells)} |", flush=True)
    return worst


def try_cables(laboratory: "Laboratory", seeds: range) -> float:
    """Print coverage on other cables, by drift; return the least."""
    faults = FAULTS | MORE_FAULTS
    print("\n| cable | " + " | ".join(faults) + " |\n|" + " --- |" * (len(faults) + 1))
    worst = 1.0
    for name, bench in CABLES.items():
        cells = []
        for fault in faults.values():
            rows = [laboratory.cover(bench, usual_sensors(bench, fault), fault, drift, seeds) for drift in DRIFTS]
            worst = min(worst, *(row.inside for row in rows))
            cells.append(" ".join(f"{row.inside:.2f}" for row in rows))
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
    return worst


def try_wrong_statements(laboratory: "Laboratory", seeds: range) -> None:
    """Print coverage and flags where sensors are not as the estimator is told, by drift."""
    print("\n| wrong statement | inside | flagged |\n| --- | --- | --- |")
    for name, fault in BEYOND.items():
        sensors = usual_sensors(Bench(), Fault())
        rows = [laboratory.cover(Bench(), sensors, fault, drift, seeds) for drift in DRIFTS]
        cells = (" ".join(f"{getattr(row, column):.2f}" for row in rows) for column in ("inside", "flagged"))
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def usual_sensors(bench: Bench, fault: Fault) -> SensorErrors:
    """Sensors as exported where the description states none, with noise as a recording of the bench tells it."""
    run = simulate(replace(bench, seconds=60.0), fault, 0.0, NOISE_OF_RECORDING)
    noise = [describe_noise(force) for force in (run.input_force, run.output_force)]
    sd, samples = (max(values) for values in zip(*noise, strict=True))
    return SensorErrors(sd, samples / bench.rate, np.sqrt(2) * 0.01, 0.001 * bench.load, 0.01)


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


class Laboratory:
    """Compiled estimators.

    Args:
        folder: Where they are.
        compiler: Of C.
    """

    def __init__(self, folder: Path, compiler: str) -> None:
        self.folder, self.compiler = folder, compiler
        self.programs: dict[tuple[Bench, SensorErrors], Path] = {}

    def build(self, bench: Bench, sensors: SensorErrors) -> Path:
        """Compile the estimator of a bench; return the program."""
        if (bench, sensors) not in self.programs:
            folder = self.folder / str(len(self.programs))
            folder.mkdir()
            (folder / "bowden.h").write_text(c_header(replace(tables_of(bench), sensors=sensors)))
            (folder / "driver.c").write_text(DRIVER)
            strict = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2")
            subprocess.run([self.compiler, *strict, "-o", "tracker", "driver.c", "-lm"], cwd=folder, check=True)
            self.programs[bench, sensors] = folder / "tracker"
        return self.programs[bench, sensors]

    def run(self, bench: Bench, sensors: SensorErrors, run: Samples, drift: float) -> np.ndarray:
        """Run the estimator; return exponent, ends of its interval and flag by sample."""
        rows = np.column_stack([run.input_force, run.output_force])
        command = [self.build(bench, sensors), repr(drift), repr(1 / bench.rate)]
        output = subprocess.run(command, input=rows.tobytes(), capture_output=True, check=True).stdout
        return np.frombuffer(output).reshape(-1, 4).T

    def track(self, bench: Bench, sensors: SensorErrors, runs: list[Samples], drift: float) -> Coverage:
        """Coverage of the estimator."""
        inside, widths, flags = [], [], []
        for run in runs:
            _, low, high, flag = self.run(bench, sensors, run, drift)
            counted = run.time >= BURN_IN
            inside.append(((low <= run.exponent) & (run.exponent <= high))[counted])
            widths.append(0.5 * (high - low)[counted])
            flags.append(flag[counted])
        return Coverage(float(np.mean(inside)), float(np.median(widths)), float(np.mean(flags)))

    def cover(self, bench: Bench, sensors: SensorErrors, fault: Fault, drift: float, seeds: range) -> Coverage:
        """Coverage of the estimator on simulated recordings."""
        return self.track(bench, sensors, [simulate(bench, fault, drift, seed) for seed in seeds], drift)

    def microseconds_per_step(self, bench: Bench) -> float:
        """Time of a step [us] on this machine, with reading and writing of samples: the least of five."""
        bench = replace(bench, seconds=300.0)
        sensors, run = usual_sensors(bench, Fault()), simulate(bench, Fault(), 0.02, 0)
        times = []
        for _ in range(5):
            start = time.perf_counter()
            self.run(bench, sensors, run, 0.02)
            times.append(time.perf_counter() - start)
        return 1e6 * min(times) / len(run.time)


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


if __name__ == "__main__":
    main()
