"""Do intervals hold truths that do not come from the priors? On simulated benches unlike each other.

    python scripts/check_truths.py [--replications N] [--seed S] [--apart] [BENCH ...]

Every bench is a cable on which wrap angles and forces are read, with ranges for what is true: coefficients of 0.015 to 0.8, all
that is accepted of a fit of which nothing is stated, narrow and wide bells, mountings that are alike or differ, loads of 1 N
and of 10 kN, two mountings and twenty. Nothing is said of the priors, so that they are the defaults. Each replication draws its
truth from the ranges, simulates tables, fits them and looks whether the 50 and 90 % intervals of the coefficients and of the
best length hold it; all of them should, as often as they claim to, up to what chance does, though priors that must serve every
cable are never exactly those of one bench.

Prints a line for each quantity, with the rates that chance allows.

With `--apart` it says instead what each prior does to them: the same draws, weighted so that a prior gives way to the very
range that truths are drawn from. With all priors replaced so, rates must be 50 and 90 %, whatever the priors are: what is
left then is the likelihood's and the sampler's. Replications of which the weights leave too few draws are left out, and those
that are not are counted.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.inference.batch.fitting import BatchFit
from bowdenfit.inference.draws import for_each_draw
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.kinds.descriptions import make_design, parse_description
from bowdenfit.questions.calibrate.plan import StatedTruth, list_quantities, parse_truths
from bowdenfit.questions.calibrate.rank_tests import summarize_replications
from bowdenfit.questions.calibrate.replications import RankedTruth
from bowdenfit.questions.calibrate.replicator import RANK_SETTINGS, BatchFitter, CalibrationPlan, Replicator
from bowdenfit.questions.simulate.tables import empty_tables
from bowdenfit.results.along_route import make_optimizer
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH
from bowdenfit.words import table

ROUTE = {"variable": "cable_length", "unit": "mm", "range": [400, 600]}
LENGTHS = tuple(np.linspace(400.0, 600.0, 15))
COLUMNS = ("free_angle", "squeezed_angle")
FEWEST = 30  # effective draws of which a rank is taken
# More draws than a rank needs, for weights that leave few of them.
MORE = replace(RANK_SETTINGS, sampler=RANK_SETTINGS.sampler.model_copy(update={"target_ess": 800}), n_kept=8192)


@dataclass(frozen=True)
class Bench:
    """A cable with what is measured and what is true of it.

    Args:
        load: Typical input force [N].
        mountings: How many.
        coefficients: One with one bell, or three: two bells and an edge.
        truth: Ranges other than the usual ones.
    """

    load: float = 60.0
    mountings: int = 8
    coefficients: int = 3
    truth: dict[str, Any] = field(default_factory=dict)

    def dataset(self) -> Dataset:
        """Tables of its design; their readings give way to simulated ones."""
        curved = [{"curve": "gaussian", "column": name} for name in COLUMNS[: 1 if self.coefficients == 1 else 2]]
        angles = [*curved, *([{"value": 45, "unit": "deg"}] if self.coefficients == 3 else [])]
        contacts = [{"name": f"contact {i}", "friction": f"mu{i}", "wrap_angle": a} for i, a in enumerate(angles, 1)]
        limit = {"file": "angles.csv", "detection_limit": {"value": 5, "unit": "deg"}}
        tables = {"angles": limit, "forces": {"file": "forces.csv"}}
        raw = {"name": "bench", "route": ROUTE, "contact": contacts, "tables": tables}
        points = np.linspace(410.0, 590.0, self.mountings)
        design = make_design(
            angles=LENGTHS, runs=tuple(points), input_forces=tuple(self.load * np.array([0.4, 0.8, 1.2, 1.6]))
        )
        description = parse_description(raw)
        return Dataset(description, empty_tables(description, design), {})

    def truths(self) -> dict[str, Any]:
        """Ranges of all parameters, in shown units."""
        usual: dict[str, Any] = {f"mu{i}": [0.015, 0.8] for i in range(1, self.coefficients + 1)}
        for name, slope in zip(COLUMNS[: 1 if self.coefficients == 1 else 2], ([0.5, 1.5], [-1.5, -0.5]), strict=False):
            usual |= {f"{name}_a": [-1.0, 0.0], f"{name}_b": slope, f"{name}_c": [0.3, 1.5]}
        noise = {"sigma_theta": [0.5, 3.0], "tau": [0.005, 0.05], "sigma_F": [0.002 * self.load, 0.02 * self.load]}
        return usual | noise | {k: v for k, v in self.truth.items() if k in usual | noise}


ANY = {"tau": [0.002, 0.3]}  # mountings from dowel pins to ones that nobody could repeat
BENCHES = {
    "plain": Bench(),
    "narrow bells": Bench(truth={f"{name}_c": [3.0, 11.0] for name in COLUMNS}),
    "wide bells": Bench(truth={f"{name}_c": [0.1, 0.3] for name in COLUMNS}),
    "any mountings": Bench(truth=ANY),
    "loads of 1 N": Bench(load=1.0),
    "loads of 10 kN": Bench(load=1e4),
    "two mountings": Bench(mountings=2, coefficients=1, truth=ANY),
    "twenty mountings": Bench(mountings=20, truth=ANY),
    "one contact": Bench(coefficients=1),
    "coefficients of rubber and PTFE": Bench(truth={f"mu{i}": [0.02, 0.6] for i in (1, 2, 3)}),
    "usual coefficients": Bench(truth={f"mu{i}": [0.05, 0.3] for i in (1, 2, 3)}),
    "mountings alike": Bench(truth={"tau": [0.002, 0.005]}),
    "mountings that differ": Bench(truth={"tau": [0.1, 0.3]}),
    "two mountings that differ": Bench(mountings=2, coefficients=1, truth={"tau": [0.1, 0.3]}),
}
REPLACED: dict[str, tuple[str, ...]] = {
    "none": (),
    "of coefficients": ("mu",),
    "of tau": ("tau",),
    "of other noise": ("sigma",),
    "of curves": COLUMNS,
    "of coefficients and tau": ("mu", "tau"),
    "all": ("",),
}


@dataclass(frozen=True)
class Keeping(BatchFitter):
    """Keeps what it fitted, in order."""

    collected: list[BatchFit] = field(default_factory=list)

    def fit_all(self, posteriors: Sequence[LogDensity], seeds: Sequence[int]) -> list[BatchFit]:
        """Fit as the calibration does, and keep the fits."""
        done = super().fit_all(posteriors, seeds)
        self.collected.extend(done)
        return done


@dataclass(frozen=True)
class Held:
    """What came of one quantity of one replication with other priors.

    Args:
        rank: Share of the posterior below the truth.
        width: Of its 90 % interval.
    """

    rank: float
    width: float


def plan_of(name: str, bench: Bench, seed: int) -> CalibrationPlan:
    """What is replicated."""
    dataset = bench.dataset()
    with jax.enable_x64(True):
        plan = CalibrationPlan(dataset, dataset, seed)
        return replace(plan, truths=parse_truths(bench.truths(), Replicator(plan).stated.space, name))


def rows_of(name: str, bench: Bench, replications: int, seed: int) -> list[tuple[str, ...]]:
    """What the intervals of one bench held, by quantity."""
    plan = plan_of(name, bench, seed)
    with jax.enable_x64(True):
        quantities = list_quantities(plan)
    made = Replicator(plan, BatchFitter()).replicate(range(replications))
    calibration = summarize_replications(list(made), quantities, truths=tuple(truth.text for truth in plan.truths), seed=seed)
    return [
        (name, q.name, *(f"{c.rate:.1%} ({c.low:.0%} to {c.high:.0%})" for c in q.coverage),
         f"{q.bias:+.2f} +- {q.bias_error:.2f}", f"{calibration.ranked}", q.fault)
        for q in calibration.quantities if q.judged_by
    ]  # fmt: skip


def apart(name: str, bench: Bench, replications: int, seed: int) -> list[tuple[str, ...]]:
    """What the intervals of one bench hold with priors replaced by the ranges of truths, by what is replaced and quantity."""
    plan, laboratory = plan_of(name, bench, seed), Keeping(MORE)
    workbench = Replicator(plan, laboratory)
    made = list(workbench.replicate(range(replications)))
    converged = [
        (replication, fit) for replication, fit in zip(made, laboratory.collected, strict=True) if not replication.reasons
    ]
    space, held = workbench.stated.space, dict[tuple[str, str], list[Held | None]]()
    with jax.enable_x64(True):
        optimum = for_each_draw(make_optimizer(workbench.stated), space.size)
        for item, fit in converged:
            draws = dict(zip((p.name for p in space.free), fit.z.T, strict=True))
            own_values = {truth.parameter.name: of_range(truth, draws[truth.parameter.name]) for truth in plan.truths}
            answers = {n: z for n, z in draws.items() if n.startswith("mu")}
            answers |= dict(zip((OPTIMAL_LENGTH, OPTIMAL_EFFICIENCY), optimum(fit.z), strict=True))
            for kind, starts in REPLACED.items():
                log_weight = sum((own_values[n] for n in own_values if n.startswith(starts)), start=np.zeros(len(fit.z)))
                for quantity, values in answers.items():
                    held.setdefault((kind, quantity), []).append(weighted(item.ranked[quantity], values, log_weight))
    return [
        (name, case, quantity, *summed(computed, held["none", quantity])) for (case, quantity), computed in held.items()
    ]  # fmt: skip


def of_range(truth: StatedTruth, z: np.ndarray) -> np.ndarray:
    """Logarithm of the density of a range over that of a prior, up to a constant, at draws of a parameter's z."""
    prior, scale = truth.parameter.prior, truth.parameter.shown_scale

    def even(position: jax.Array) -> jax.Array:
        value = jnp.asarray(prior.constrain(position)) * scale
        return jnp.log(value) if truth.log_uniform else value

    value, slope = (np.asarray(part) for part in jax.vmap(jax.value_and_grad(even))(jnp.asarray(z)))
    low, high = np.log([truth.low, truth.high]) if truth.log_uniform else (truth.low, truth.high)
    inside = (value >= low) & (value <= high) & (slope > 0)
    return np.where(inside, np.log(np.where(inside, slope, 1.0)) + z**2 / 2, -np.inf)


def weighted(ranked_truth: RankedTruth, values: np.ndarray, log_weight: np.ndarray) -> Held | None:
    """Rank of a truth among weighted draws, and the width of their interval; None of too few."""
    if not np.isfinite(log_weight).any():
        return None
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    if 1 / np.sum(weight**2) < FEWEST:
        return None
    tied, order = values == ranked_truth.truth, np.argsort(values)
    # Where an end of the range has probability of its own, the truth keeps the place that was drawn for it.
    tie = (ranked_truth.rank - np.mean(values < ranked_truth.truth)) / np.mean(tied) if tied.any() else 0.0
    low, high = np.interp([0.05, 0.95], np.cumsum(weight[order]), values[order])
    return Held(float(weight @ (values < ranked_truth.truth) + tie * (weight @ tied)), float(high - low))


def summed(computed: Sequence[Held | None], initial: Sequence[Held | None]) -> tuple[str, ...]:
    """Rates, and how much of the width there was before is left."""
    both = [
        (record, other) for record, other in zip(computed, initial, strict=True) if record is not None and other is not None
    ]
    apart = np.abs([record.rank - 0.5 for record, _ in both])
    of_all = sum(other.width for _, other in both)
    width = f"{sum(record.width for record, _ in both) / of_all:.2f}" if of_all > 0 else "-"
    return f"{np.mean(apart < 0.25):.1%}", f"{np.mean(apart < 0.45):.1%}", width, f"{len(both)}"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("benches", nargs="*", metavar="BENCH", help=f"of {', '.join(BENCHES)}; all if omitted")
    parser.add_argument("--replications", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--apart", action="store_true", help="say what each prior does to the rates")
    options = parser.parse_args()
    unknown = [name for name in options.benches if name not in BENCHES]
    if unknown:
        parser.error(f"there is no bench {unknown[0]!r}; there are {', '.join(BENCHES)}.")
    rows = []
    for name in options.benches or BENCHES:
        rows += (apart if options.apart else rows_of)(name, BENCHES[name], options.replications, options.seed)
        print(f"{name}: done", flush=True)
    rates = ("50 % held", "90 % held")
    of_all = ("bench", "priors replaced", "quantity", *rates, "width", "of") if options.apart else None
    print(table(of_all or ("bench", "quantity", *rates, "bias", "ranked", "fault"), rows))


if __name__ == "__main__":
    main()
