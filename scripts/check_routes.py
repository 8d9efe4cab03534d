"""Do intervals hold on routes that are not bells? Simulated benches whose angles follow other curves than the model's family.

Two contacts with a curve each and an edge of constant angle; the curves are parabolas, cosines, hyperbolas, logistics, powers,
kinks, two bells or plateaus with an edge, or true bells (`bell`). Loads of 1 N to 5 kN, 5 to 25 lengths, 3 to 16 mountings,
noise of 0.7 to 3 deg. The simulator shares no code with the likelihood. Every bench is fitted with a bell that departs
smoothly or not, and with a smooth curve of no family.

    python scripts/check_routes.py --benches 12 --seed 1 [--only bell kinked] [--departure none smooth no-family] [--workers 2]

Prints one line per fit as it ends, then one line per family and departure: of how many fits the design answer may be used (exit
code 0); of all answers that may be used, how many of the 90 % intervals of coefficients, best length and efficiency contain the
truth, and how many of the promised windows are within 1 % of the best efficiency; the median ratio of the widths of the
coefficients' intervals to those without departure; and the median time of a fit [s of CPU].
"""

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

Route = Callable[[np.ndarray], np.ndarray]  # from 0 to 1 over the range to an angle [rad]
COLUMNS = ("first_angle", "second_angle")
DEPARTURES = ("none", "smooth", "no-family")  # from a bell, or a smooth curve instead of one


def parabola(rng: np.random.Generator, top: float) -> Route:
    """A parabola that is 0 nowhere in the range."""
    vertex, low = rng.uniform(-0.2, 1.2), rng.uniform(0.05, 0.3)
    reach = max(vertex, 1 - vertex) ** 2
    return lambda x: top * (low + (1 - low) * (x - vertex) ** 2 / reach)


def cosine(rng: np.random.Generator, top: float) -> Route:
    """Half a period of a cosine, or less."""
    turns, low = rng.uniform(0.6, 1.0) * np.pi, rng.uniform(0.03, 0.2)
    return lambda x: top * (low + (1 - low) * (1 + np.cos(turns * x)) / 2)


def hyperbola(rng: np.random.Generator, top: float) -> Route:
    """Falling as one over the distance to a place outside the range."""
    start = rng.uniform(0.1, 0.5)
    return lambda x: top * start / (start + x)


def logistic(rng: np.random.Generator, top: float) -> Route:
    """From a plateau to nothing."""
    middle, width = rng.uniform(0.3, 0.8), rng.uniform(0.08, 0.25)
    return lambda x: top / (1 + np.exp((x - middle) / width))


def power(rng: np.random.Generator, top: float) -> Route:
    """A power of the distance to the end of the range."""
    exponent, low = rng.uniform(1.2, 2.5), rng.uniform(0.02, 0.1)
    return lambda x: top * (low + (1 - low) * (1 - x) ** exponent)


def kinked(rng: np.random.Generator, top: float) -> Route:
    """Two straight lines."""
    kink, level, end = rng.uniform(0.3, 0.7), rng.uniform(0.15, 0.4), rng.uniform(0.05, 0.15)
    return lambda x: top * np.interp(x, [0, kink, 1], [1, level, end])


def two_bells(rng: np.random.Generator, top: float) -> Route:
    """Two bells of different widths."""
    places, widths, share = rng.uniform((0.0, 0.5), (0.3, 1.0)), rng.uniform(0.15, 0.4, 2), rng.uniform(0.3, 0.8)
    return lambda x: top * (
        np.exp(-(((x - places[0]) / widths[0]) ** 2)) + share * np.exp(-(((x - places[1]) / widths[1]) ** 2))
    ) + 0.03 * top


def plateau(rng: np.random.Generator, top: float) -> Route:
    """A plateau that ends at an edge."""
    edge, slope = rng.uniform(0.4, 0.7), rng.uniform(0.15, 0.3)
    return lambda x: top * np.clip((edge + slope - x) / slope, 0.05, 1.0)


def bell(rng: np.random.Generator, top: float) -> Route:
    """A true bell."""
    place, width = rng.uniform(-0.5, 0.4), rng.uniform(0.4, 1.0)
    highest = np.exp(-((max(0.0, -place) / width) ** 2))
    return lambda x: top / highest * np.exp(-(((x - place) / width) ** 2))


FAMILIES = {
    family.__name__: family for family in (parabola, cosine, hyperbola, logistic, power, kinked, two_bells, plateau, bell)
}


class Bench:
    """One bench with its truth.

    Args:
        family: Name of the family of its routes.
        seed: Of everything random.
    """

    def __init__(self, family: str, seed: int) -> None:
        rng = np.random.default_rng([seed, list(FAMILIES).index(family)])
        first, second = (FAMILIES[family](rng, np.deg2rad(rng.uniform(30, 120))) for _ in range(2))
        self.routes = (first, lambda x: second(1 - x))  # one falls where the other rises
        self.start, self.span = (float(round(length)) for length in rng.uniform((200, 100), (1500, 800)))
        self.n_lengths, self.n_mountings = int(rng.choice([5, 9, 15, 25])), int(rng.choice([3, 6, 9, 16]))
        self.mu, self.edge = np.exp(rng.uniform(np.log(0.04), np.log(0.35), 3)), np.deg2rad(45.0)
        self.load, self.tau = 10 ** rng.uniform(0, 3.7), rng.uniform(0.003, 0.02)
        self.angle_noise, self.force_noise = np.deg2rad(rng.uniform(0.7, 3.0)), rng.uniform(0.002, 0.01)
        self._rng = rng

    def exponent(self, x: np.ndarray) -> np.ndarray:
        """Friction exponent [1] at places from 0 to 1."""
        return self.mu[0] * self.routes[0](x) + self.mu[1] * self.routes[1](x) + self.mu[2] * self.edge

    def loss(self, length: float | np.ndarray) -> np.ndarray:
        """Share of the best efficiency that is lost at a length."""
        return 1 - np.exp(-self.exponent((np.asarray(length) - self.start) / self.span)) / self.truth["efficiency"]

    @property
    def truth(self) -> dict[str, float]:
        """Coefficients, best length and efficiency there."""
        x = np.linspace(0, 1, 20001)
        best = int(np.argmin(self.exponent(x)))
        names = {f"mu{number}": float(mu) for number, mu in enumerate(self.mu, 1)}
        return names | {"length": self.start + self.span * x[best], "efficiency": float(np.exp(-self.exponent(x)[best]))}

    def write(self, folder: Path, departure: str) -> None:
        """Write it as a data set."""
        rng = np.random.default_rng(self._rng.bit_generator.seed_seq.spawn(1)[0])
        x = np.linspace(0, 1, self.n_lengths)
        angles = np.stack([route(x) for route in self.routes], axis=1)
        angles = np.rad2deg(angles + rng.normal(0, self.angle_noise, angles.shape))
        lines = [f"cable_length_mm,{','.join(f'{name}_deg' for name in COLUMNS)}"]
        for place, row in zip(x, angles, strict=True):
            lines.append(f"{self.start + self.span * place:.1f},{','.join('<5' if a < 5 else f'{a:.1f}' for a in row)}")
        (folder / "angles.csv").write_text("\n".join(lines) + "\n")
        lines = ["run,cable_length_mm,stroke,input_force_N,output_force_N"]
        for number, place in enumerate(rng.permutation(np.linspace(0.02, 0.98, self.n_mountings))):
            exponent = float(self.exponent(np.asarray(place))) + rng.normal(0, self.tau)
            for load in self.load * np.array([0.4, 0.7, 1.0]):
                forces = np.array([load, load * np.exp(-exponent)]) * (1 + rng.normal(0, self.force_noise, 2))
                lines.append(f"{number},{self.start + self.span * place:.1f},pull,{forces[0]:.6g},{forces[1]:.6g}")
        (folder / "forces.csv").write_text("\n".join(lines) + "\n")
        curve = 'curve = "smooth"' if departure == "no-family" else f'curve = "gaussian", departure = "{departure}"'
        contacts = [
            f'[[contact]]\nname = "{name}"\nfriction = "mu{number}"\nwrap_angle = {{ {curve}, column = "{name}" }}\n'
            for number, name in enumerate(COLUMNS, 1)
        ]
        contacts.append('[[contact]]\nname = "edge"\nfriction = "mu3"\nwrap_angle = { value = 45, unit = "deg" }\n')
        limits = f"[{self.start:g}, {self.start + self.span:g}]"
        (folder / "cable.toml").write_text(
            f'name = "bench"\n[route]\nvariable = "cable_length"\nunit = "mm"\nrange = {limits}\n'
            '[tables.angles]\nfile = "angles.csv"\ndetection_limit = { value = 5, unit = "deg" }\n'
            '[tables.forces]\nfile = "forces.csv"\n' + "\n".join(contacts)
        )


def fit_bench(task: tuple[str, int, str]) -> dict[str, Any]:
    """Fit one bench; return what came of it."""
    import bowdenfit as bf

    family, seed, departure = task
    bench = Bench(family, seed)
    row: dict[str, Any] = {"family": family, "seed": seed, "departure": departure, "lengths": bench.n_lengths}
    row["mountings"] = bench.n_mountings
    start = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        bench.write(Path(folder), departure)
        try:
            fit = bf.fit(Path(folder), seed=seed, figures=False)
        except bf.BowdenfitError as error:
            return row | {"ended": f"refused: {str(error)[:120]}"}
    verdict, optimum, truth = fit.verdict(), fit.optimal_length(), bench.truth
    intervals = {f"mu{n}": fit.parameter_of_draws(f"mu{n}") for n in (1, 2, 3)} | {
        "length": optimum.length, "efficiency": optimum.efficiency,
    }  # fmt: skip
    row["ended"] = "trusted" if verdict.trusted else "not trusted"
    row["reasons"] = list(verdict.troubles)
    row["usable"] = [name for name in intervals if name not in verdict.usable.undetermined] if verdict.trusted else []
    if not verdict.may_be_used_for("design"):
        row["usable"] = [name for name in row["usable"] if name not in ("length", "efficiency")]
    elif "length" in row["usable"]:
        row["usable"].append("window")
    row["holds"] = {name: bool(i.q05 <= truth[name] <= i.q95) for name, i in intervals.items()}
    window = optimum.window
    if np.isfinite(window.start):
        row["holds"]["window"] = bool(np.all(bench.loss(np.linspace(window.start, window.stop, 101)) <= window.within))
    row["loss"] = float(bench.loss(optimum.length.median))
    row["width"] = {name: float(i.q95 - i.q05) for name, i in intervals.items()}
    return row | {"truth": truth, "seconds": round(time.process_time() - start, 1)}


def summarize(rows: list[dict[str, Any]]) -> Iterator[str]:
    """One line per family and departure."""
    plain = {(row["family"], row["seed"]): row for row in rows if row["departure"] == DEPARTURES[0]}
    heads = "family", "departure", "usable", "coefficients", "length", "efficiency", "window", "width", "s"
    yield "{:<11}{:<10}{:>9}{:>15}{:>9}{:>12}{:>9}{:>7}{:>6}".format(*heads)
    for family in (*FAMILIES, "all"):
        for departure in DEPARTURES:
            group = [row for row in rows if family in (row["family"], "all") and row["departure"] == departure]
            if not group:
                continue
            mu, length, efficiency, window = (
                f"{sum(map(bool, holds))}/{len(holds)}"
                for names in (("mu1", "mu2", "mu3"), ("length",), ("efficiency",), ("window",))
                for holds in [[row["holds"][n] for row in group for n in names if n in row.get("usable", ())]]
            )
            ratios = [
                row["width"][name] / plain[key]["width"][name]
                for row in group
                if (key := (row["family"], row["seed"])) in plain and "width" in row and "width" in plain[key]
                for name in ("mu1", "mu2", "mu3")
            ]
            width = f"{np.median(ratios):.2f}" if ratios else ""
            seconds = f"{np.median([row['seconds'] for row in group if 'seconds' in row] or [np.nan]):.0f}"
            counts = f"{sum('length' in row.get('usable', ()) for row in group)}/{len(group)}"
            cells = family, departure, counts, mu, length, efficiency, window, width, seconds
            yield "{:<11}{:<10}{:>9}{:>15}{:>9}{:>12}{:>9}{:>7}{:>6}".format(*cells)


def main() -> None:
    """Fit all benches and print what came of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--benches", type=int, default=12, help="benches of each family")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="+", choices=list(FAMILIES), default=list(FAMILIES), metavar="FAMILY")
    parser.add_argument("--departure", nargs="+", choices=DEPARTURES, default=list(DEPARTURES))
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    seeds = [options.seed * 1000 + number for number in range(options.benches)]
    tasks = [(family, seed, departure) for seed in seeds for family in options.only for departure in options.departure]
    rows = []
    with ProcessPoolExecutor(options.workers, get_context("spawn")) as workers:
        for row in workers.map(fit_bench, tasks):
            rows.append(row)
            print(json.dumps(row), flush=True)
    print("\n".join(summarize(rows)))


if __name__ == "__main__":
    main()
