"""Whether healthy benches are let through: none refused by reading, and at most one in a hundred not trusted.

Eight kinds of bench of a capstan in NumPy alone (`tests/support/hand_bench.py`), each bench with a friction, a scatter between
mountings, a noise and a last digit of its own. Every table is written to files and read as `bowdenfit check` does; the first
`--verdicts` of each kind are fitted by least squares, and their verdict is asked. Tables of one shape share the priors of the
first of them, so that one program serves all.

Of every table that is read, the columns whose readings are said to be cut off at the end of a range are counted, which may
be none; and as many are cut off on purpose, to count how often that is said.

    .venv/bin/python scripts/check_healthy_benches.py [--benches 500] [--verdicts 500] [--seed 1] [KIND ...]

Prints every bench that is refused or not trusted, and a table; ends with 1 if any is refused or named, or of a kind more
are not trusted than chance allows at one in a hundred (1 in 1000 runs).
"""

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
from scipy.stats import binom

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "support"))

from hand_bench import BENDS, LENGTHS, Readings, pull, write  # noqa: E402

import bowdenfit as bf  # noqa: E402
from bowdenfit.dataset import Dataset  # noqa: E402
from bowdenfit.finished_fit import Fit  # noqa: E402
from bowdenfit.inference.least_squares import find_maximum_posterior, fit_least_squares  # noqa: E402
from bowdenfit.inference.log_density import LogDensity  # noqa: E402
from bowdenfit.inference.objective import make_objective  # noqa: E402
from bowdenfit.kinds import iterate_tables  # noqa: E402
from bowdenfit.kinds.measured_columns import find_cut_off  # noqa: E402
from bowdenfit.models import build_model  # noqa: E402
from bowdenfit.questions.calibrate.replicator import replace_data  # noqa: E402
from bowdenfit.run.fitting import Stopwatch, provenance  # noqa: E402
from bowdenfit.words import table  # noqa: E402

ENDS = ("read", "refused", "judged", "not trusted", "named", "found", "missed")
RATE, CHANCE = 0.01, 0.001  # benches that may be not trusted, and how often chance alone says that more are
FEW = (0.2, 0.4, 0.6, 0.8, 1.0)  # loads in shares of the largest
ROUTE = LENGTHS.replace("[440, 540]", "[430, 550]").replace(
    'forces = { file = "forces.csv" }', 'efficiencies = { file = "efficiencies.csv" }'
)
ROUTE = ROUTE.replace('"angles.csv" }', '"angles.csv", detection_limit = { value = 5, unit = "deg" } }')

Write = Callable[[Path, np.random.Generator], Path]


def log_uniform(generator: np.random.Generator, least: float, most: float) -> float:
    """Return a number drawn between two, each factor as likely."""
    return float(np.exp(generator.uniform(np.log(least), np.log(most))))


def write_forces(largest: float, mountings: int, repeats: int = 4, loads: tuple[float, ...] = FEW) -> Write:
    """Return what writes a table of forces up to so many newtons, each mounting around a bend of its own."""

    def write_bench(folder: Path, generator: np.random.Generator) -> Path:
        places = generator.choice([90.0, 135.0, 180.0, 270.0], mountings)
        loss = log_uniform(generator, 0.03, 0.3) * np.deg2rad(places)
        noise = largest * log_uniform(generator, 0.001, 0.006)
        rows = pull(
            generator, places, loss, largest * np.array(loads), repeats=repeats, noise=(noise, noise),
            scatter=log_uniform(generator, 0.003, 0.05),
        )  # fmt: skip
        digits = int(np.ceil(-np.log10(noise)))  # the last digit is at most the noise
        return write(folder, round_forces(rows, digits), BENDS)

    return write_bench


def round_forces(rows: Readings, digits: int) -> Readings:
    """Return forces as a display shows them."""
    return replace(rows, force_in=rows.force_in.round(digits), force_out=rows.force_out.round(digits))


def write_route(places: int = 25, digits: int = 1) -> Write:
    """Return what writes angles at so many lengths with so many decimals."""
    return lambda folder, generator: write_angles(folder, generator, places, digits)


def write_angles(folder: Path, generator: np.random.Generator, places: int, digits: int) -> Path:
    """Write angles along a route, and efficiencies at ten lengths.

    Mountings scatter by less than the least friction: an efficiency above 101 % without its error is refused on purpose.
    """
    folder.mkdir(parents=True, exist_ok=True)
    height, middle, width = generator.uniform(50, 120), generator.uniform(460, 520), generator.uniform(80, 160)
    angle = lambda length: height * np.exp(-(((length - middle) / width) ** 2))  # noqa: E731
    lengths, mounted = np.linspace(430, 550, places), np.linspace(440, 540, 10).round()
    read = angle(lengths) + generator.uniform(0.5, 2.0) * generator.standard_normal(len(lengths))
    cells = [
        f"{length:g},{deg:.{digits}f}" if deg >= 5 else f"{length:g},<5" for length, deg in zip(lengths, read, strict=True)
    ]
    exponent = log_uniform(generator, 0.08, 0.3) * np.deg2rad(angle(mounted))
    exponent += log_uniform(generator, 0.003, 0.01) * generator.standard_normal(len(mounted))
    shares = [f"{length:g},{100 * np.exp(-loss):.1f}" for length, loss in zip(mounted, exponent, strict=True)]
    (folder / "cable.toml").write_text(ROUTE)
    (folder / "angles.csv").write_text("\n".join(["cable_length_mm,sheath_angle_deg", *cells]) + "\n")
    (folder / "efficiencies.csv").write_text("\n".join(["cable_length_mm,efficiency_percent", *shares]) + "\n")
    return folder


KINDS: dict[str, Write] = {
    "three mountings": write_forces(120.0, 3),
    "one mounting": write_forces(120.0, 1),
    "twenty mountings": write_forces(120.0, 20, repeats=1),
    "forces of a newton": write_forces(1.0, 3),
    "forces of 10 kN": write_forces(1e4, 3, loads=(0.25, 0.5, 1.0)),
    "route with efficiencies": write_route(),
    "short route": write_route(places=7),
    "long route in whole degrees": write_route(places=41, digits=0),
}


class Judge:
    """Fits tables of one shape by least squares with one program.

    Args:
        first: The table whose priors serve for all.
    """

    def __init__(self, first: Dataset) -> None:
        with jax.enable_x64(True):
            self.model = build_model(first)
            self.objective = make_objective(LogDensity(self.model))

    def fit(self, data: Dataset) -> Fit:
        """Return a fit by least squares."""
        with jax.enable_x64(True):
            density = LogDensity(replace_data(self.model, data))
            start = find_maximum_posterior(density, self.objective)
            squares = fit_least_squares(density, self.objective, start.z)
        reasons = () if squares.converged else (squares.message,)
        return Fit(data, squares, None, not reasons, reasons, provenance(1, Stopwatch(announces=False), {}))


def shape_of(data: Dataset) -> str:
    """Return the shapes of all arrays of a table, which programs are compiled for."""
    with jax.enable_x64(True):
        return str(jax.tree.map(np.shape, LogDensity(build_model(data)).data))


def cut_off_columns(data: Dataset, generator: np.random.Generator) -> Counter[str]:
    """Count the columns of a bench that are named as they are, and those that are cut off on purpose and named or missed.

    A column is cut off at 50 to 85 % of its largest reading, where four readings and half of those that are beyond are so by a
    tenth.
    """
    ends = Counter[str]()
    for kind, measured in iterate_tables(data.measurements):
        for column in kind.measured_columns(measured):
            ends["named"] += any(len(rows) > 0 for rows in find_cut_off(column))
            limit = float(generator.choice(column.values[column.values > 0.5 * np.nanmax(column.values)]))
            limit = min(limit, 0.85 * float(np.nanmax(column.values)))
            limit = float(f"{limit:.3g}") if column.unit == "N" else round(limit, 1 if column.unit else 3)
            beyond = np.sum(column.values > 1.1 * limit)
            if max(4, np.sum(column.values >= limit) / 2) <= beyond <= np.sum(np.isfinite(column.values)) - 6:
                rows, _ = find_cut_off(replace(column, values=np.minimum(column.values, limit)))
                ends["found" if len(rows) else "missed"] += 1
    return ends


def try_kind(kind: str, benches: int, verdicts: int, seed: int) -> Counter[str]:
    """Return how many benches of a kind were read, refused, judged and not trusted."""
    ends, judges = Counter[str](), dict[str, Judge]()
    for number in range(benches):
        generator = np.random.default_rng([seed, list(KINDS).index(kind), number])
        with tempfile.TemporaryDirectory() as scratch:
            folder = KINDS[kind](Path(scratch) / "bench", generator)
            try:
                data = bf.check(folder)
            except bf.BowdenfitError as error:
                ends["refused"] += 1
                print(f"{kind} {number}: refused: {error}", flush=True)
                continue
        ends["read"] += 1
        ends += cut_off_columns(data, generator)
        if number >= verdicts:
            continue
        shape = shape_of(data)
        if shape not in judges:
            judges[shape] = Judge(data)
        verdict = judges[shape].fit(data).verdict()
        ends["judged"] += 1
        ends["not trusted"] += not verdict.trusted
        if not verdict.trusted:
            print(f"{kind} {number}: not trusted: {' '.join(verdict.reasons)}", flush=True)
    return ends


def main() -> None:
    """Print the benches that are not let through, and a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help="all if omitted")
    parser.add_argument("--benches", type=int, default=500, help="benches of each kind that are read")
    parser.add_argument("--verdicts", type=int, default=500, help="how many of them are fitted")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if unknown := [kind for kind in options.kinds if kind not in KINDS]:
        parser.error(f"there is no kind {unknown[0]!r}; there are {', '.join(KINDS)}.")
    rows, wrong = [], False
    for kind in options.kinds or KINDS:
        ends = try_kind(kind, options.benches, options.verdicts, options.seed)
        too_many = binom.sf(ends["not trusted"] - 1, ends["judged"], RATE) < CHANCE
        wrong = wrong or ends["refused"] > 0 or ends["named"] > 0 or bool(too_many)
        rows.append((kind, *(str(ends[end]) for end in ENDS)))
        print(" | ".join(rows[-1]), flush=True)
    print("\n" + table(("kind", *ENDS), rows))
    sys.exit(wrong)


if __name__ == "__main__":
    main()
