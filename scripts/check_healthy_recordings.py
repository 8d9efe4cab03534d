"""Are healthy recordings refused, or not trusted? Of benches unlike each other, and of ropes that creep or feel speed.

    python scripts/check_healthy_recordings.py [--recordings N] [--first S]

A third each: benches of `tests/support/recorded_benches.py` without a drift (10 Hz to 1 kHz, 1 N to 10 kN, one mounting or
three), and ropes of `tests/support/creeping_rope.py`, an ODE solver, by the models of Dahl and of LuGre at loads of 1 N to
10 kN. Each is read from a file and fitted by least squares with the friction that `fit` assumes, benches with the drag they
were made with. Prints a row for each that is refused or not trusted, and the counts.

Counted as named are recordings that the assumed friction does not describe, or whose noise is large and slow, if the verdict
says so: ropes whose friction depends on the speed or that creep, where the fit with the option that is printed is trusted and
contains the true friction of a rope that creeps; and noise of 3 % of the full scale that stays alike for 0.1 s. So are
fits of benches whose least squares is stuck, if sampling, which is printed as the remedy, ends trusted and right.

Ends with 1 if one is refused, or more than one in a hundred are not trusted and not named, of each kind.
"""

import argparse
import sys
import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT / "scripts")]

from check_creeping_ropes import draw_rope  # noqa: E402
from creeping_rope import ANGLE, SPEED, creep, pulled  # noqa: E402
from recorded_benches import WRAP, draw_bench, write  # noqa: E402

import bowdenfit as bf  # noqa: E402

KINDS = ("bench", "creeping", "rate-dependent")
REMEDIES = {"creeping": ("dahl",), "rate-dependent": ("rate-dependent", "dahl")}  # what may be printed, by kind
LONGEST = 34.0  # s that the motion of a rope lasts


def write_rope(seed: int, kind: str, folder: Path) -> Path:
    """Write the recording of a rope as a CSV file."""
    generator = np.random.default_rng([11, seed])
    rate, load = (float(np.exp(generator.uniform(np.log(low), np.log(high)))) for low, high in ((10, 1000), (1, 1e4)))
    time = np.arange(0, LONGEST, 1 / rate)
    force, speed = pulled(time)
    output = creep(draw_rope(seed, "dahl" if kind == "creeping" else "lugre"), time)
    scale, noise = load / 90, generator.standard_normal((2, len(time))) * 0.15
    columns = np.column_stack([time, scale * (force + noise[0]), scale * (output + noise[1]), speed])
    folder.mkdir()
    path = folder / f"{kind}.csv"
    heads = "time (s),input_force (N),output_force (N),velocity (mm/s)"
    np.savetxt(path, columns, "%.8g", ",", header=heads, comments="")
    return path


def write_recording(seed: int, kind: str, folder: Path) -> tuple[Path, dict[str, object]]:
    """Write a healthy recording, and return it with the keywords of its fit."""
    if kind != "bench":
        return write_rope(seed, kind, folder), {"wrap_angle": (float(np.rad2deg(ANGLE)), "deg")}
    bench = draw_bench(seed)
    bench = replace(bench, rate=float(np.clip(bench.rate, 10, 1000)), drift=0.0)
    return write(bench, folder, seed), {"friction": "drag"} if bench.drag else {}


def is_named(seed: int, kind: str, path: Path, keywords: dict[str, object], message: str) -> bool:
    """Return whether a verdict names what is true of a recording, and the remedy that it prints works."""
    if kind == "bench":
        bench = draw_bench(seed)
        if "sampling gets past kinks" in message:
            fit = bf.fit(path, seed=1, **keywords)
            mu = fit.parameter_of_draws("mu")
            return fit.verdict().trusted and mu.q05 <= bench.exponent / WRAP <= mu.q95
        return bench.noise >= 0.03 and bench.correlated >= 0.1 and "The likeliest cause is noise" in message
    for friction in REMEDIES[kind]:
        if f"--friction {friction}" in message:
            speed = [f'reference_velocity={{value={SPEED:g},unit="mm/s"}}'] if friction == "rate-dependent" else []
            fit = bf.fit(path, mcmc=False, seed=1, friction=friction, settings=speed, **keywords)
            mu, truth = fit.least_squares.estimates["mu"], draw_rope(seed, "dahl").exponent / ANGLE
            return fit.verdict().trusted and (kind != "creeping" or mu.lower <= truth <= mu.upper)
    return False


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recordings", type=int, default=200, metavar="N")
    parser.add_argument("--first", type=int, default=0, metavar="S")
    options = parser.parse_args()
    ends = {kind: Counter[str]() for kind in KINDS}
    for seed in range(options.first, options.first + options.recordings):
        kind = KINDS[seed % len(KINDS)]
        with tempfile.TemporaryDirectory() as scratch:
            path, keywords = write_recording(seed, kind, Path(scratch) / "data")
            try:
                verdict = bf.fit(path, mcmc=False, seed=1, **keywords).verdict()
                end, message = ("trusted", "") if verdict.trusted else ("not trusted", " ".join(verdict.reasons))
                end = "named" if message and is_named(seed, kind, path, keywords, message) else end
            except bf.BowdenfitError as error:
                end, message = "refused", str(error)
        ends[kind][end] += 1
        if end != "trusted":
            print(f"{seed:3d} {kind}: {end}: {message}", flush=True)
    for kind, counts in ends.items():
        print(f"{kind}: {dict(counts)}")
    allowed = [100 * counts["not trusted"] <= sum(counts.values()) and not counts["refused"] for counts in ends.values()]
    sys.exit(int(not all(allowed)))


if __name__ == "__main__":
    main()
