"""Whether intervals with the error budget hold the truth on benches with faults that no reading shows.

Twelve kinds of fault, each drawn from its usual size, on tables of forces of a capstan that shares no code with the package.
Printed for each kind: how often the 90 % interval of mu holds it, by the readings alone and with the errors of the bench, and
how often the first page says that they more than half widen it. Benches whose fit is refused or not trusted count as neither.

With `--large` the faults are seven that exceed what is usual, each at its full size, on sweeps of 6 to 10 mountings from 30 to
270 deg in the order of their wrap angles; each bench is fitted with the usual limits, and with limits that its user states.
Printed besides: how wide the interval is, relative to that of the readings alone (median).

    .venv/bin/python scripts/check_hidden_faults.py --benches 20 --seed 1
    .venv/bin/python scripts/check_hidden_faults.py --benches 20 --seed 1 --large
"""

import argparse
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

GAIN, HYSTERESIS, ANGLE, ANGLE_SCALE = 0.01, 0.015, 3.0, 0.03  # limits of the errors, as the package takes them for usual
HEADING = "run,stroke,input_force_N,output_force_N,wrap_angle_deg"

Fault = Callable[[np.random.Generator], dict[str, float]]
FAULTS: dict[str, Fault] = {
    "none": lambda _: {},
    "gain of the output": lambda rng: {"gain_out": rng.uniform(-GAIN, GAIN)},
    "gain of both cells": lambda rng: {"gain_out": rng.uniform(-GAIN, GAIN), "gain_in": rng.uniform(-GAIN, GAIN)},
    "angles all in proportion": lambda rng: {"angle_scale": rng.uniform(-ANGLE_SCALE, ANGLE_SCALE)},
    "angles all by some degrees": lambda rng: {"angle_offset": rng.uniform(-ANGLE, ANGLE)},
    "hysteresis of the output": lambda rng: {"hysteresis_out": rng.uniform(0, HYSTERESIS)},
    "hysteresis of both cells": lambda rng: {
        "hysteresis_out": rng.uniform(0, HYSTERESIS),
        "hysteresis_in": rng.uniform(0, HYSTERESIS),
    },
    "load exponent": lambda rng: {"exponent": rng.uniform(-0.03, 0.03)},
    "bend gives way under load": lambda rng: {"softening": rng.uniform(0, 0.03)},
    "zeros": lambda rng: {"zero_out": rng.uniform(-0.001, 0.001), "zero_in": rng.uniform(-0.001, 0.001)},
    "cell that is no straight line": lambda rng: {"curvature": rng.uniform(-GAIN, GAIN)},
    "everything": lambda rng: {
        "gain_out": rng.uniform(-GAIN, GAIN),
        "gain_in": rng.uniform(-GAIN, GAIN),
        "hysteresis_out": rng.uniform(0, HYSTERESIS),
        "angle_scale": rng.uniform(-ANGLE_SCALE, ANGLE_SCALE),
    },
}

# Faults at their full size, of either sign, and limits under [errors] that they keep, as a user who knows of them states.
LARGE_FAULTS: dict[str, tuple[Fault, tuple[str, ...]]] = {
    "none": (lambda _: {}, ()),
    "angles 5 % off": (lambda rng: {"angle_scale": sign(rng) * 0.05}, ("angle_scale=0.06",)),
    "angles 5 deg off": (lambda rng: {"angle_offset": sign(rng) * 5.0}, ("angle={value=6,unit='deg'}",)),
    "gain 3 % off": (lambda rng: {"gain_out": sign(rng) * 0.03}, ("gain=0.04",)),
    "hysteresis 1 and 1.5 %": (lambda _: {"hysteresis_in": 0.01, "hysteresis_out": 0.015}, ("hysteresis=0.02",)),
    "wear 12 %": (lambda rng: {"wear": sign(rng) * 0.12}, ("wear=0.15",)),
    "compression 6 %": (lambda _: {"softening": -0.06}, ("compression=0.08",)),
    "load exponent 0.9": (lambda _: {"exponent": -0.1}, ("load_exponent=0.12",)),
}


def sign(rng: np.random.Generator) -> float:
    """Return +1 or -1."""
    return float(rng.choice([-1.0, 1.0]))


def bench_text(rng: np.random.Generator, fault: dict[str, float], sweep: bool = False) -> tuple[str, float]:
    """Return the table of one bench and its true mu.

    Args:
        rng: Random numbers.
        fault: Its errors: relative, angles in degrees, zeros in shares of the largest force. The load exponent counts from the
            mean of the logarithms of the loads; wear is the change of friction from the first to the last mounting, and the
            true mu that of the middle.
        sweep: Whether wrap angles rise from 30 to 270 deg from mounting to mounting.
    """
    get = lambda name: fault.get(name, 0.0)  # noqa: E731
    mu, largest = float(np.exp(rng.uniform(np.log(0.05), np.log(0.25)))), float(10 ** rng.uniform(0.5, 3.5))
    mountings, noise = int(rng.integers(3, 9)), rng.uniform(0.001, 0.006)
    tau, loads = rng.uniform(0.002, 0.02), largest * np.linspace(0.2, 1, int(rng.integers(2, 5)))
    bends = rng.choice([60.0, 90.0, 135.0, 180.0, 270.0], mountings)
    if sweep:
        tau, bends = rng.uniform(0.01, 0.05), np.linspace(30, 270, int(rng.integers(6, 11)))
    middle = np.exp(np.mean(np.log(loads / largest)))
    rows = [HEADING]
    for number, bend in enumerate(bends):
        mounting = rng.normal(0, tau)
        shown = bend * (1 + get("angle_scale")) + get("angle_offset")
        for stroke in (1, -1):
            for load in loads:
                share = load / largest
                worn = 1 + get("wear") * (number / (len(bends) - 1) - 0.5)
                exponent = 0.0
                for _ in range(20):  # friction depends on the mean tension, and this on friction
                    tension = share * np.exp(-stroke * exponent / 2)
                    friction = mu * worn * (1 - get("softening") * tension) * (tension / middle) ** get("exponent")
                    exponent = friction * np.radians(bend) + mounting
                out = load * np.exp(-stroke * exponent)
                read = list[float]()
                for force, end in ((load, "in"), (out, "out")):
                    gain, hysteresis = 1 + get(f"gain_{end}"), 1 - get(f"hysteresis_{end}") * stroke / 2
                    read.append(force * gain * hysteresis + get(f"zero_{end}") * largest)
                read[1] *= 1 + get("curvature") * (out / largest - 0.5)
                noisy = [force * (1 + rng.normal(0, noise)) for force in read]
                way = "pull" if stroke > 0 else "return"
                rows.append(f"m{number},{way},{noisy[0]:.6g},{noisy[1]:.6g},{shown:.2f}")
    return "\n".join(rows) + "\n", mu


def inspect_bench(task: tuple[str, int]) -> tuple[str, str, bool, bool, bool]:
    """Fit one bench; return its kind, how it ended, whether each of both intervals holds mu, and whether both are shown."""
    import bowdenfit as bf

    kind, seed = task
    rng = np.random.default_rng([seed, list(FAULTS).index(kind)])
    text, mu = bench_text(rng, FAULTS[kind](rng))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.csv"
        path.write_text(text)
        try:
            fit = bf.fit(path, seed=seed)
        except bf.BowdenfitError:
            return kind, "refused", False, False, False
    if not fit.verdict().trusted:
        return kind, "not trusted", False, False, False
    row = fit.error_budget.row("mu")
    assert row is not None
    holds = [interval.q05 <= mu <= interval.q95 for interval in (row.readings, row.bench)]
    return kind, "trusted", holds[0], holds[1], row.is_notable


def inspect_large_fault(task: tuple[str, bool, int]) -> tuple[str, bool, str, bool, bool, float]:
    """Fit one sweep; return its kind, whether limits were stated, how it ended, which intervals hold mu, and their ratio."""
    import bowdenfit as bf

    kind, of_user, seed = task
    fault, limits = LARGE_FAULTS[kind]
    rng = np.random.default_rng([seed, list(LARGE_FAULTS).index(kind), 7])
    text, mu = bench_text(rng, fault(rng), sweep=True)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.csv"
        path.write_text(text)
        try:
            fit = bf.fit(path, seed=seed, settings=[f"errors.{limit}" for limit in limits] if of_user else [])
        except bf.BowdenfitError as error:
            return kind, of_user, f"refused: {error}", False, False, np.nan
    row = fit.error_budget.row("mu")
    assert row is not None
    holds = [interval.q05 <= mu <= interval.q95 for interval in (row.readings, row.bench)]
    ratio = (row.bench.q95 - row.bench.q05) / (row.readings.q95 - row.readings.q05)
    verdict = fit.verdict()
    return kind, of_user, "trusted" if verdict.trusted else f"not: {' '.join(verdict.troubles)}", *holds, ratio


def print_large_faults(benches: int, seed: int, workers: int) -> None:
    """Print a line for each kind of large fault, with usual and with stated limits."""
    states = [(kind, of_user) for kind, (_, limits) in LARGE_FAULTS.items() for of_user in (False, True)[: 1 + bool(limits)]]
    tasks = [(*state, seed * 1000 + number) for number in range(benches) for state in states]
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        ended = list(pool.map(inspect_large_fault, tasks))
    print(f"{'fault':<26}{'limits':<9}{'trusted':>8}{'readings':>10}{'bench':>7}{'bench, trusted':>16}{'width':>7}")
    for kind, of_user in states:
        of_kind = [end for end in ended if end[:2] == (kind, of_user)]
        trusted = [end for end in of_kind if end[2] == "trusted"]
        counts = [sum(end[i] for end in of_kind) for i in (3, 4)]
        line = f"{kind:<26}{'stated' if of_user else 'usual':<9}{len(trusted):>8}{counts[0]:>10}{counts[1]:>7}"
        width = np.nanmedian([end[5] for end in of_kind])
        print(line + f"{sum(end[4] for end in trusted):>10} of {len(trusted):>2}{width:>7.2f}")
        for reason in sorted({end[2] for end in of_kind} - {"trusted"}):
            print(f"    {sum(end[2] == reason for end in of_kind)} {reason[:110]}")


def main() -> None:
    """Print a line for each kind of fault."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--benches", type=int, default=20, help="benches of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--large", action="store_true", help="seven large faults on sweeps instead")
    options = parser.parse_args()
    if options.large:
        print_large_faults(options.benches, options.seed, options.workers)
        return
    tasks = [(kind, options.seed * 1000 + number) for number in range(options.benches) for kind in FAULTS]
    with ProcessPoolExecutor(options.workers, get_context("spawn")) as workers:
        ended = list(workers.map(inspect_bench, tasks))
    print(f"{'fault':<30}{'trusted':>9}{'refused':>9}{'readings':>10}{'budget':>8}{'shown':>7}{'shown alone':>13}")
    for kind in (*FAULTS, "all"):
        of_kind = [end for end in ended if kind in (end[0], "all")]
        trusted = [end for end in of_kind if end[1] == "trusted"]
        alone = [end[2] for end in trusted if not end[4]]
        counts = [sum(end[i] for end in trusted) for i in (2, 3, 4)]
        print(
            f"{kind:<30}{len(trusted):>9}{len(of_kind) - len(trusted):>9}{counts[0]:>10}{counts[1]:>8}{counts[2]:>7}"
            f"{f'{sum(alone)} of {len(alone)}':>13}"
        )


if __name__ == "__main__":
    main()
