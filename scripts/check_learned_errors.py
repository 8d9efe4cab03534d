"""Whether intervals with the errors of the bench hold: ranks of known truths, and of known errors, among their draws.

    python scripts/check_learned_errors.py [DATASET] [--replications N] [--seed S] [--set KEY=VALUE ...]

Truths are drawn from the priors, errors of the bench from their limits under [errors], and readings are simulated with both.
Each table is fitted as `bowdenfit calibrate` fits it, errors are learned from its readings, and the draws are moved as those of
the first page are. Without DATASET the bench has eight mountings from 30 to 270 deg, pulled and returned at three loads.

Printed of every parameter, and of every error, is the share of truths in the 90 % interval and the p-value of uniform ranks
(Talts et al. 2018, arXiv:1804.06788). The exit code is 1 where significantly fewer than 90 % of truths are held (a one-sided
binomial test at 0.01 over the number of quantities). Scales of noise are shown and do not count: they are those of the readings
alone, of which errors of the bench are a part. A constant wrap angle of cable.toml has no error here, so that DATASET must have
none.
"""

import argparse
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import jax
import numpy as np
from scipy import stats

import bowdenfit as bf
from bowdenfit.dataset import Dataset
from bowdenfit.inference.batch.fitting import BatchFit
from bowdenfit.inference.bench_errors import learn_errors
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import noise_scales
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.bench_error import BenchError, ErrorSource, iterate_error_sources
from bowdenfit.kinds.tables import Measurements
from bowdenfit.questions.calibrate.plan import make_plan
from bowdenfit.questions.calibrate.replications import RankedTruth, rank_truth
from bowdenfit.questions.calibrate.replicator import Replicator, SimulatedTables, replace_data

CHANCE = 0.01
HEADING = "run,stroke,input_force_N,output_force_N,wrap_angle_deg"


@dataclass(frozen=True)
class BenchReplicator(Replicator):
    """Replicates a bench whose errors are drawn from their limits.

    Args:
        errors: Drawn errors in units of their standard uncertainties, by kind, by replication.
    """

    errors: dict[int, dict[str, float]] = field(default_factory=dict)

    def _simulate(self, number: int) -> SimulatedTables:
        generator = np.random.default_rng([self.plan.seed, number])
        z, dataset, redrawn = self._draw_tables(generator)
        sources = tuple(iterate_error_sources(dataset.description))
        self.errors[number] = {kind: error for source in sources for kind, error in draw_errors(source, generator)}
        read = Dataset(dataset.description, add_errors(dataset.measurements, sources, self.errors[number]), {})
        model = replace(replace_data(self.assumed, read), measurements=read.measurements)
        return SimulatedTables(
            number, z, LogDensity(model), redrawn, int(generator.integers(2**31)), generator.uniform()
        )

    def _rank_truths(self, simulated: SimulatedTables, fit: BatchFit) -> dict[str, RankedTruth]:
        learned = learn_errors(simulated.posterior, fit.z.mean(axis=0))
        assert learned is not None
        draws, errors = learned.draw(len(fit.z), simulated.seed), self.errors[simulated.number]
        moved = super()._rank_truths(simulated, replace(fit, z=fit.z + draws @ learned.moves.T))
        steps = [step.kind for source in learned.sources for step in source.steps]
        return moved | {
            f"error: {kind}": rank_truth(-errors[kind], column)  # readings have it, and are corrected by the opposite
            for kind, column in zip(steps, draws.T, strict=True)
        }


def draw_errors(source: ErrorSource, generator: np.random.Generator) -> Iterator[tuple[str, float]]:
    """Yield each error of a source, in units of its standard uncertainty: every value within the limit is as likely."""
    for step in source.steps:
        yield step.kind, generator.uniform(-1, 1, source.cells).sum() * np.sqrt(3 / source.cells)


def add_errors(measurements: Measurements, sources: tuple[ErrorSource, ...], errors: dict[str, float]) -> Measurements:
    """Return tables as a bench with these errors reads them.

    Args:
        measurements: Tables without errors.
        sources: Causes of error.
        errors: Each error in units of its standard uncertainty, by kind.
    """
    steps = [(step.kind, size * getattr(step, step.kind)) for source in sources for step, size in source.steps.items()]
    error = BenchError(**{kind: size * errors[kind] for kind, size in steps})
    return Measurements(tuple(kind.with_bench_error(table, error) for kind, table in iterate_tables(measurements)))


def write_sweep(folder: Path) -> Path:
    """Write a bench of eight mountings whose readings give way to simulated ones, and return its table."""
    rows = [HEADING]
    for number, bend in enumerate(np.linspace(30, 270, 8)):
        for stroke, sign in (("pull", -1), ("return", 1)):
            for load in (20.0, 60.0, 100.0):
                output = load * np.exp(sign * 0.12 * np.radians(bend)) * (1 + 0.002 * np.sin(7 * number + load))
                rows.append(f"m{number},{stroke},{load:g},{output:.3f},{bend:.1f}")
    table = folder / "sweep.csv"
    table.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return table


def noise_names(replicator: Replicator) -> list[str]:
    """Return the names of scales of noise."""
    model = replicator.assumed
    names = [parameter.name for parameter in model.space.free]
    return [name for name, is_scale in zip(names, noise_scales(LogDensity(model)), strict=True) if is_scale]


def main() -> int:
    """Replicate, and print the table."""
    parser = argparse.ArgumentParser(description="Check learned errors of benches; the head of this file says how.")
    parser.add_argument("dataset", nargs="?")
    parser.add_argument("--replications", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--set", action="append", default=[], dest="settings")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        data = bf.read(options.dataset or write_sweep(Path(folder)), settings=options.settings)
        replicator = BenchReplicator(make_plan(data, data, options.seed, None))
        replications = list(replicator.replicate(range(options.replications)))
    good = [replication for replication in replications if not replication.reasons]
    print(f"{len(good)} of {len(replications)} fits converged")
    smallest, scales = 1.0, noise_names(replicator)
    for name in good[0].ranked:
        ranks = np.array([replication.ranked[name].rank for replication in good])
        inside = int(np.sum(np.abs(ranks - 0.5) < 0.45))
        if name not in scales:
            smallest = min(smallest, float(stats.binom.cdf(inside, len(ranks), 0.9)) * len(good[0].ranked))
        uniform = stats.kstest(ranks, "uniform").pvalue
        print(f"{name:30s} {inside / len(ranks):6.1%}  p = {uniform:.3f}", flush=True)
    return int(smallest < CHANCE)


if __name__ == "__main__":
    with jax.enable_x64(True):
        sys.exit(main())
