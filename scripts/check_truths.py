"""Do intervals hold truths that do not come from the priors? On simulated benches unlike each other.

    python scripts/check_truths.py [--replications N] [--seed S] [BENCH ...]

Every bench is a cable on which wrap angles and forces are read, with ranges for what is true: narrow and wide bells,
mountings that are alike or differ, loads of 1 N and of 10 kN, two mountings and twenty. Nothing is said of the priors, so
that they are the defaults. Each replication draws its truth from the ranges, simulates tables, fits them and looks whether
the 50 and 90 % intervals of the coefficients and of the best length hold it; all of them should, as often as they claim to
what chance does, though priors that must serve every cable are never exactly those of one bench.

Prints a line for each quantity, with the rates that chance allows.
"""

import argparse
from dataclasses import dataclass, field
from typing import Any

import jax
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.kinds.designs import design_of
from bowdenfit.kinds.settings import parse_description
from bowdenfit.questions.calibrate.findings import findings
from bowdenfit.questions.calibrate.quantities import quantities_of
from bowdenfit.questions.calibrate.refit import Laboratory
from bowdenfit.questions.calibrate.truths import stated_truths
from bowdenfit.questions.calibrate.workbench import Plan, Workbench
from bowdenfit.questions.simulate.simulation import empty_tables
from bowdenfit.words import table

ROUTE = {"variable": "cable_length", "unit": "mm", "range": [400, 600]}
LENGTHS = tuple(np.linspace(400.0, 600.0, 15))
COLUMNS = ("free_angle", "squeezed_angle")


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
        at = np.linspace(410.0, 590.0, self.mountings)
        design = design_of(
            angles=LENGTHS, runs=tuple(at), input_forces=tuple(self.load * np.array([0.4, 0.8, 1.2, 1.6]))
        )
        description = parse_description(raw)
        return Dataset(description, empty_tables(description, design), {})

    def truths(self) -> dict[str, Any]:
        """Ranges of all parameters, in shown units."""
        usual: dict[str, Any] = {f"mu{i}": [0.05, 0.3] for i in range(1, self.coefficients + 1)}
        for name, slope in zip(COLUMNS[: 1 if self.coefficients == 1 else 2], ([0.5, 1.5], [-1.5, -0.5]), strict=False):
            usual |= {f"{name}_a": [-1.0, 0.0], f"{name}_b": slope, f"{name}_c": [0.3, 1.5]}
        noise = {"sigma_theta": [0.5, 3.0], "tau": [0.005, 0.05], "sigma_F": [0.002 * self.load, 0.02 * self.load]}
        return usual | noise | {k: v for k, v in self.truth.items() if k in usual | noise}


BENCHES = {
    "plain": Bench(),
    "narrow bells": Bench(truth={f"{name}_c": [3.0, 11.0] for name in COLUMNS}),
    "wide bells": Bench(truth={f"{name}_c": [0.1, 0.3] for name in COLUMNS}),
    "mountings alike": Bench(truth={"tau": [0.002, 0.005]}),
    "mountings that differ": Bench(truth={"tau": [0.1, 0.3]}),
    "loads of 1 N": Bench(load=1.0),
    "loads of 10 kN": Bench(load=1e4),
    "two mountings": Bench(mountings=2, coefficients=1),
    "twenty mountings": Bench(mountings=20),
}


def rows_of(name: str, bench: Bench, replications: int, seed: int) -> list[tuple[str, ...]]:
    """What the intervals of one bench held, by quantity."""
    dataset = bench.dataset()
    with jax.enable_x64(True):
        plan = Plan(dataset, dataset, seed)
        known, space = quantities_of(plan), Workbench(plan).stated.space
        plan = Plan(dataset, dataset, seed, stated_truths(bench.truths(), space, name))
    made = Workbench(plan, Laboratory()).replications(range(replications))
    found = findings(list(made), known, truths=tuple(truth.text for truth in plan.truths), seed=seed)
    return [
        (name, q.name, *(f"{c.rate:.1%} ({c.low:.0%} to {c.high:.0%})" for c in q.coverage),
         f"{q.bias:+.2f} +- {q.bias_error:.2f}", f"{found.ranked}", q.fault)
        for q in found.quantities if q.judged_by
    ]  # fmt: skip


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("benches", nargs="*", metavar="BENCH", help=f"of {', '.join(BENCHES)}; all if omitted")
    parser.add_argument("--replications", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    unknown = [name for name in asked.benches if name not in BENCHES]
    if unknown:
        parser.error(f"there is no bench {unknown[0]!r}; there are {', '.join(BENCHES)}.")
    rows = []
    for name in asked.benches or BENCHES:
        rows += rows_of(name, BENCHES[name], asked.replications, asked.seed)
        print(f"{name}: done", flush=True)
    print(table(("bench", "quantity", "50 % held", "90 % held", "bias", "ranked", "fault"), rows))


if __name__ == "__main__":
    main()
