"""Do intervals hold the truth where a motor's current was read in place of a load cell at the input?

    .venv/bin/python scripts/check_motors.py [--benches N] [--first S]

Benches of a simulator of its own that shares no code with the package: 1 N to 10 kN, gears that pass on 50 to 95 % of the
torque and take 2 to 12 % of the largest one by friction, a torque constant that is off by its stated standard deviation,
tables of forces and recordings. Of each kind it prints how many are trusted, and in how many of these the 90 % interval holds
the friction of the cable. Of the last kind, one bend with a gear of which nothing is stated, every bench must be refused.

Ends with 1 if an interval of a kind holds the truth in so few as chance has once in a thousand, or if of the last kind one is
not refused.
"""

import argparse
import sys
import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.stats import binom

KINDS = {  # whether recordings, wrap angles in degrees (0 without the cable), what is stated of the gear
    "bends and no cable, gear learned": (False, (0, 0, 45, 90, 135, 180, 270), False),
    "bends, gear learned": (False, (45, 90, 135, 180, 225, 270), False),
    "bends, gear stated": (False, (45, 90, 135, 180, 225, 270), True),
    "one bend, gear stated": (False, (180,) * 5, True),
    "recordings, gear learned": (True, (0, 30, 60, 90, 120), False),
    "recordings, gear stated": (True, (30, 60, 90, 120), True),
    "one bend, gear learned": (False, (90,) * 5, False),
}
ALL_REFUSED = "one bend, gear learned"
RADIUS, GEAR_RATIO = 0.015, 26.0  # m, 1
RELATIVE_SD, EFFICIENCY_SD = 0.02, 0.04  # of the torque constant, and of the efficiency where it is stated
BY_CHANCE = 1e-3


def draw_bench(rng: np.random.Generator) -> dict[str, float]:
    """Return a cable and a motor: friction coefficient, scatter of mountings, forces, noise and gear."""
    largest = float(10 ** rng.uniform(0, 4))
    return {
        "mu": float(np.exp(rng.uniform(np.log(0.05), np.log(0.25)))),
        "tau": float(rng.uniform(0.002, 0.03)),
        "largest": largest,
        "noise": float(rng.uniform(0.002, 0.01)),
        "efficiency": float(rng.uniform(0.5, 0.95)),
        "gear_friction": float(rng.uniform(0.02, 0.12)) * largest * RADIUS,
        "torque_constant": 1e-3 * largest,
    }


def rope_force(torque: float, pull: bool, bench: dict[str, float]) -> float:
    """Return the force on the rope [N] at a torque of the motor behind its gear's ratio [N m]."""
    if pull:
        return (torque * bench["efficiency"] - bench["gear_friction"]) / RADIUS
    return (torque / bench["efficiency"] + bench["gear_friction"]) / RADIUS


def table(bench: dict[str, float], bends: tuple[float, ...], rng: np.random.Generator) -> str:
    """Return the table of forces of one bench; output forces are the loads, both ways."""
    factor = GEAR_RATIO * bench["torque_constant"] * (1 + RELATIVE_SD * rng.standard_normal())
    rows = ["run,stroke,bend_deg,input_current_A,output_force_N"]
    for run, bend in enumerate(bends):
        mounting = bench["tau"] * rng.standard_normal() if bend else 0.0
        exponent = bench["mu"] * np.deg2rad(bend) + mounting
        for stroke in (1, -1):
            for load in bench["largest"] * np.linspace(0.25, 1, 5):
                force = load * np.exp(stroke * exponent)
                torque = force * RADIUS + stroke * bench["gear_friction"]
                torque *= bench["efficiency"] ** -stroke
                if torque <= 0:  # the motor would have to push its gear back
                    continue
                current, output = (
                    value * (1 + bench["noise"] * rng.standard_normal()) for value in (torque / factor, load)
                )
                rows.append(f"{run},{'pull' if stroke > 0 else 'return'},{bend},{current:.7g},{output:.7g}")
    return "\n".join(rows) + "\n"


def recording(bench: dict[str, float], bend: float, factor: float, rng: np.random.Generator) -> str:
    """Return a recording of current and output force [A, N] at 200 Hz: gear and cable each stand still at a turn."""
    time = np.arange(0, 30, 0.005)
    exponent = bench["mu"] * np.deg2rad(bend) + (bench["tau"] * rng.standard_normal() if bend else 0.0)
    torques = bench["largest"] * RADIUS * (1.1 - np.cos(2 * np.pi * time / rng.uniform(6, 10)))
    force, output = (rope_force(torques[0], True, bench),) * 2
    lines = ["time (s),input_current (A),output_force (N)"]
    for t, torque in zip(time, torques, strict=True):
        force = float(np.clip(force, rope_force(torque, True, bench), rope_force(torque, False, bench)))
        output = float(np.clip(output, force * np.exp(-exponent), force * np.exp(exponent)))
        noise = bench["noise"] * rng.standard_normal(2)
        lines.append(f"{t:.4f},{(torque + noise[0] * torques.max()) / factor:.7g},{output + noise[1] * bench['largest']:.7g}")
    return "\n".join(lines) + "\n"


def describe(bench: dict[str, float], kind: str, rng: np.random.Generator) -> str:
    """Return cable.toml."""
    recorded, bends, gear_is_stated = KINDS[kind]
    constant = bench["torque_constant"]
    gear = ""
    if gear_is_stated:
        efficiency = min(bench["efficiency"] + EFFICIENCY_SD * rng.standard_normal(), 0.99)
        friction = bench["gear_friction"] * (1 + 0.2 * rng.standard_normal())
        gear = (
            f'gear_efficiency = {{ value = {efficiency:.4g}, unit = "1", sd = {EFFICIENCY_SD} }}\n'
            f'gear_friction = {{ value = {friction:.4g}, unit = "N*m", sd = {0.2 * bench["gear_friction"]:.4g} }}\n'
        )
    tables = 'forces = { file = "forces.csv" }\n'
    if recorded:
        tables = 'recordings = { prepare = { delay = "none" } }\n' + "".join(
            f'[[recording]]\nfile = "{i}.csv"\nwrap_angles = {{ bend = {{ value = {bend}, unit = "deg" }} }}\n'
            for i, bend in enumerate(bends)
        )
    return (
        'schema = 1\nname = "Motor"\n[cable]\ninput_pulley_radius = { value = 15, unit = "mm" }\n'
        f'[motor]\ntorque_constant = {{ value = {constant:.7g}, unit = "N*m/A", sd = {RELATIVE_SD * constant:.4g} }}\n'
        f'gear_ratio = {GEAR_RATIO:g}\n{gear}'
        '[[contact]]\nname = "sheath"\nfriction = "mu"\nwrap_angle = { column = "bend" }\n'
        f"[tables]\n{tables}"
    )


def inspect_bench(task: tuple[str, int]) -> tuple[str, int, str, bool, str]:
    """Fit one bench; return its kind and seed, how it ended, whether the interval of mu holds it, and the reasons."""
    import bowdenfit as bf

    kind, seed = task
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    bench, (recorded, bends, _) = draw_bench(rng), KINDS[kind]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "cable.toml").write_text(describe(bench, kind, rng))
        if recorded:
            factor = GEAR_RATIO * bench["torque_constant"] * (1 + RELATIVE_SD * rng.standard_normal())
            for i, bend in enumerate(bends):
                (folder / f"{i}.csv").write_text(recording(bench, bend, factor, rng))
        else:
            (folder / "forces.csv").write_text(table(bench, bends, rng))
        try:
            fit = bf.fit(folder, seed=seed)
        except bf.BowdenfitError as error:
            return kind, seed, "refused", False, str(error)
    mu, verdict = fit.parameter("mu"), fit.verdict()
    message = f"mu {mu.q05:.4f} to {mu.q95:.4f} for {bench['mu']:.4f}; {'; '.join(verdict.reasons)}"
    return kind, seed, "trusted" if verdict.trusted else "not trusted", bool(mu.q05 <= bench["mu"] <= mu.q95), message


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--benches", type=int, default=20, metavar="N")
    parser.add_argument("--first", type=int, default=0, metavar="S")
    options = parser.parse_args()
    tasks = [(kind, seed) for kind in KINDS for seed in range(options.first, options.first + options.benches)]
    ends, held = {kind: Counter[str]() for kind in KINDS}, Counter[str]()
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        for kind, seed, end, holds, message in pool.map(inspect_bench, tasks):
            ends[kind][end] += 1
            held[kind] += holds and end == "trusted"
            if (end == "trusted") != holds or (end == "refused") != (kind == ALL_REFUSED):
                print(f"{seed:3d} {kind}: {end}: {message}", flush=True)
    few = False
    for kind, counts in ends.items():
        print(f"{kind}: {dict(counts)}, holds the truth in {held[kind]} of {counts['trusted']}")
        few |= counts["trusted"] > 0 and binom.cdf(held[kind], counts["trusted"], 0.9) < BY_CHANCE
    sys.exit(int(few or ends[ALL_REFUSED]["refused"] < options.benches))


if __name__ == "__main__":
    main()
