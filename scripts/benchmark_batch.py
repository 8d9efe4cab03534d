"""Time fleets of simple cables, 1 to 1000 of them: three coefficients, six runs each, by `bowdenfit fleet` as a user has it.

    python scripts/benchmark_batch.py [--numbers 1 10 100 1000] [--programs]

Each line: how many cables, seconds and CPU seconds of the whole command, which reads a file a cable and writes one for all,
with nothing compiled before (cold) and once more (warm); milliseconds of CPU a cable, warm; which engine drew for how many;
how many may not be trusted. Seconds are those of an idle machine only where nothing else runs; CPU seconds are anyhow.

With --programs the fits by themselves, in this process, of cables whose coefficients are drawn from their priors, as wide as
those are: seconds in all and of those compiling, CPU seconds and milliseconds a cable without compiling, engines; and, as a
ratio, the seconds that emcee's ensembles take for as many single posteriors, reckoned from one of them with its programs
compiled.
"""

import argparse
import itertools
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import jax

from bowdenfit.addons.fleet.fitting import SETTINGS
from bowdenfit.addons.fleet.folder import FLEET_PAGE
from bowdenfit.addons.fleet.simulation import read_fleet_plan, simulate_fleet, write_fleet
from bowdenfit.description import SamplerSettings
from bowdenfit.inference.batch.fitting import fit_batch
from bowdenfit.inference.batch.programs import BatchPrograms
from bowdenfit.inference.chain import SamplingRequest
from bowdenfit.inference.ensemble import sample
from bowdenfit.inference.least_squares import find_maximum_posterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.inference.walkers import compile_walkers
from bowdenfit.kinds.descriptions import make_design, parse_description
from bowdenfit.models import build_model
from bowdenfit.questions.calibrate.replicator import why_implausible
from bowdenfit.questions.simulate.tables import draw_true_values, empty_tables, simulate_design

CONTACTS = ("sheath", "clamp", "edge")
ANGLES = ((200, 30, 20), (150, 80, 20), (90, 30, 60), (240, 60, 90), (60, 90, 30), (120, 20, 80))  # deg, of each run
FORCES, STROKES = (20.0, 50.0, 80.0), ("pull", "return")
NUMBERS = (1, 10, 100, 1000)
TARGETS = SETTINGS.sampler
PLAN = """
schema = 1
name = "Simple cables"
{contacts}
[tables]
forces = {{ file = "forces.csv" }}

[truth]
mu_sheath = 0.1
mu_clamp = 0.12
mu_edge = 0.15
tau = 0.01
sigma_F = 0.4

[fleet]
cables = {number}
cycles = [0]
reference_cycles = 50000
spread = 0.2
wear = 0.2
wear_spread = 0.08
lubricated = 0.5
lubrication = -0.2
temperature = [15, 35]
reference_temperature = 20
per_degree = 0.004

[design]
runs = {runs}
own_angles = {{ {angles} }}
input_forces = {forces}
strokes = {strokes}
"""


def make_fleet(number: int, folder: Path) -> Path:
    """A folder of so many cables, inspected once."""
    contacts = [f'[[contact]]\nname = "{n}"\nfriction = "mu_{n}"\nwrap_angle = {{ column = "{n}_angle" }}' for n in CONTACTS]
    angles = [f"{name}_angle = {list(column)}" for name, column in zip(CONTACTS, zip(*ANGLES, strict=True), strict=True)]
    folder.mkdir()
    (folder / "bench.toml").write_text(
        PLAN.format(
            contacts="\n".join(contacts), number=number, runs=[0] * len(ANGLES), angles=", ".join(angles),
            forces=list(FORCES), strokes=json.dumps(STROKES),
        )
    )  # fmt: skip
    plan = read_fleet_plan(folder / "bench.toml")
    write_fleet(plan, *simulate_fleet(plan, number), folder / "fleet")
    return folder / "fleet"


def command(fleet: Path, results: Path, programs: Path) -> tuple[float, float]:
    """Seconds and CPU seconds of a whole command, which keeps what it compiles in a folder."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("JAX_")}
    begin, usage_at_start = time.perf_counter(), _used()
    words = [sys.executable, "-m", "bowdenfit", "fleet", fleet, "-o", results, "--seed", "1", "--force"]
    subprocess.run(words, env=environment | {"XDG_CACHE_HOME": str(programs)}, check=True, capture_output=True)
    return time.perf_counter() - begin, _used() - usage_at_start


def _used() -> float:
    """CPU seconds of all that has ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def time_commands(numbers: list[int]) -> None:
    print("cables  cold s    CPU  warm s    CPU  CPU ms a cable  engines")
    with tempfile.TemporaryDirectory() as place, jax.enable_x64(True):
        for number in numbers:
            folder = Path(place) / str(number)
            fleet = make_fleet(number, folder)
            (cold, of_cold), (warm, of_warm) = (command(fleet, folder / "fits", folder / "programs") for _ in range(2))
            fitted = json.loads((folder / "fits" / FLEET_PAGE).read_text())["fitted"]
            engines = ", ".join(f"{count} {name}" for name, count in Counter(item["engine"] for item in fitted).items())
            failed = sum(bool(item["reasons"]) for item in fitted)
            print(
                f"{number:6d} {cold:7.1f} {of_cold:6.1f} {warm:7.1f} {of_warm:6.1f} {1000 * of_warm / number:15.1f}  "
                f"{engines}; {failed} not to be trusted",
                flush=True,
            )


def cables(number: int) -> list[LogDensity]:
    """Posteriors of cables whose coefficients are drawn from their priors, again where no bench would hand in the readings."""
    description = parse_description(
        {
            "name": "simple cable",
            "contact": [{"name": n, "friction": f"mu_{n}", "wrap_angle": {"column": f"{n}_angle"}} for n in CONTACTS],
            "tables": {"forces": {"file": "forces.csv"}},
        }
    )
    own_angles = {f"{name}_angle": column for name, column in zip(CONTACTS, zip(*ANGLES, strict=True), strict=True)}
    design = make_design(runs=(0.0,) * len(ANGLES), input_forces=FORCES, strokes=STROKES, own_angles=own_angles)
    tables = empty_tables(description, design)
    densities: list[LogDensity] = []
    seeds = itertools.count()
    while len(densities) < number:
        seed = next(seeds)
        of_truth, of_readings = jax.random.split(jax.random.key(seed))
        values = draw_true_values(description, tables, {"tau": 0.01, "sigma_F": 0.4}, of_truth)
        made = simulate_design(description, design, values, of_readings)
        if not why_implausible(made, made):
            densities.append(LogDensity(build_model(made)))
    return densities


def seconds_alone(posterior: LogDensity) -> float:
    """What emcee's ensembles take for one cable to the targets of a batch, once compiled."""
    settings = SamplerSettings(n_walkers=64, target_ess=TARGETS.target_ess, target_r_hat=TARGETS.target_r_hat)
    objective = make_objective(posterior)
    programs = compile_walkers(posterior, settings)
    for _ in range(2):
        begin = time.perf_counter()
        sample(SamplingRequest(posterior, find_maximum_posterior(posterior, objective), settings, 1), programs)
    return time.perf_counter() - begin


def time_programs(numbers: list[int]) -> None:
    with jax.enable_x64(True):
        posteriors = cables(min(max(numbers), 50))
        single = seconds_alone(posteriors[0])
        print("cables  seconds  compiling    CPU  ms a cable  single fits / batch  engines")
        for number in numbers:
            programs = BatchPrograms(posteriors[0], SETTINGS)
            begin = time.perf_counter()
            _ = programs.gradients, programs.evaluate_points, programs.ensembles
            compiled = time.perf_counter()
            cpu, data = time.process_time(), [posteriors[i % len(posteriors)].data for i in range(number)]
            fits = fit_batch(posteriors[0], data, range(number), programs=programs)
            seconds, used = time.perf_counter() - compiled, time.process_time() - cpu
            engines = ", ".join(f"{count} {name}" for name, count in Counter(fit.engine for fit in fits).items())
            failed = sum(bool(fit.reasons) for fit in fits)
            print(
                f"{number:6d} {seconds + compiled - begin:8.1f} {compiled - begin:10.1f} {used:6.1f} "
                f"{1000 * seconds / number:11.1f} {single * number / seconds:20.1f}  {engines}; {failed} not to be trusted",
                flush=True,
            )


def main() -> None:
    parser = argparse.ArgumentParser(description="Time fleets of simple cables; the head of this file says how.")
    parser.add_argument("--numbers", type=int, nargs="+", default=NUMBERS, metavar="N", help="how many cables")
    parser.add_argument("--programs", action="store_true", help="the fits by themselves, of cables drawn from the priors")
    options = parser.parse_args()
    (time_programs if options.programs else time_commands)(list(options.numbers))


if __name__ == "__main__":
    main()
