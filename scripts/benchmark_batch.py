"""Time batches of simple cables, 1 to 1000 of them: three coefficients, six runs each, in one process.

    python scripts/benchmark_batch.py [--numbers 1 10 100 1000]

Each line: how many cables, seconds in all and of those compiling, CPU seconds and milliseconds a cable without compiling,
which engine drew for how many of them, how many may not be trusted; and, as a ratio, the seconds that emcee's ensembles take
for as many single posteriors, reckoned from one of them with its programs compiled.
"""

import argparse
import time
from collections import Counter

import jax

from bowdenfit.description import SamplerSettings
from bowdenfit.inference.batch.fitting import fit_batch
from bowdenfit.inference.batch.programs import BatchPrograms, BatchSettings
from bowdenfit.inference.chain import Sampling
from bowdenfit.inference.coordinates import walker_programs
from bowdenfit.inference.ensemble import sample
from bowdenfit.inference.least_squares import maximum_posterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.kinds.designs import design_of
from bowdenfit.kinds.settings import parse_description
from bowdenfit.model import build_model
from bowdenfit.questions.simulate.simulation import empty_tables, simulate, true_values

CONTACTS = ("sheath", "clamp", "edge")
ANGLES = ((200, 30, 20), (150, 80, 20), (90, 30, 60), (240, 60, 90), (60, 90, 30), (120, 20, 80))  # deg, of each run
FORCES, STROKES = (20.0, 50.0, 80.0), ("pull", "return")
NUMBERS = (1, 10, 100, 1000)
TARGETS = BatchSettings().sampler


def cables(number: int) -> list[LogDensity]:
    """Posteriors of cables whose coefficients are drawn from their priors."""
    description = parse_description(
        {
            "name": "simple cable",
            "contact": [{"name": n, "friction": f"mu_{n}", "wrap_angle": {"column": f"{n}_angle"}} for n in CONTACTS],
            "tables": {"forces": {"file": "forces.csv"}},
        }
    )
    own = {f"{name}_angle": column for name, column in zip(CONTACTS, zip(*ANGLES, strict=True), strict=True)}
    design = design_of(runs=(0.0,) * len(ANGLES), input_forces=FORCES, strokes=STROKES, own_angles=own)
    tables = empty_tables(description, design)
    found = []
    for seed in range(number):
        of_truth, of_readings = jax.random.split(jax.random.key(seed))
        values = true_values(description, tables, {"tau": 0.01, "sigma_F": 0.4}, of_truth)
        found.append(LogDensity(build_model(simulate(description, design, values, of_readings))))
    return found


def seconds_alone(posterior: LogDensity) -> float:
    """What emcee's ensembles take for one cable to the targets of a batch, once compiled."""
    settings = SamplerSettings(n_walkers=64, target_ess=TARGETS.target_ess, target_r_hat=TARGETS.target_r_hat)
    objective = make_objective(posterior)
    programs = walker_programs(posterior, settings.n_ensembles * settings.n_walkers // 2)
    for _ in range(2):
        begin = time.perf_counter()
        sample(Sampling(posterior, maximum_posterior(posterior, objective), settings, 1), programs)
    return time.perf_counter() - begin


def main() -> None:
    parser = argparse.ArgumentParser(description="Time batches of simple cables; the head of this file says how.")
    parser.add_argument("--numbers", type=int, nargs="+", default=NUMBERS, metavar="N", help="how many cables")
    numbers = parser.parse_args().numbers
    with jax.enable_x64(True):
        posteriors = cables(min(max(numbers), 50))
        single = seconds_alone(posteriors[0])
        print("cables  seconds  compiling    CPU  ms a cable  single fits / batch  engines")
        for number in numbers:
            programs = BatchPrograms(posteriors[0], BatchSettings())
            begin = time.perf_counter()
            _ = programs.gradients, programs.densities, programs.ensembles
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


if __name__ == "__main__":
    main()
