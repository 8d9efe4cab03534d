"""Are fits of recordings ever wrong and trusted? Long, cyclic, noisy, slow and quick ones, with known truth.

    python scripts/check_recordings.py [--benches N] [--first S] [--sampled]

The benches are drawn at random (`tests/support/recorded_benches.py`, a simulator in NumPy alone): 20 Hz to 5 kHz, 20 to 700 s,
3 to 300 cycles of five wave forms, 1 N to 10 kN, noise that is white or stays alike over many samples, filters, delays and
drifts, one mounting or three. Each is fitted with the friction it was made with. It is refused, or not trusted, or trusted and
right, or WRONG: trusted, and the true coefficient outside the 90 % interval that the summary gives.

How far one is off is said in standard deviations of a normal distribution that are as unlikely: three mountings leave two
degrees of freedom, and Student's t is then beyond four in one fit of seventeen. Prints a row for each and their sum.

Ends with 1 if more trusted intervals miss the truth than chance allows at 1 %, or one by more than four standard deviations.
"""

import argparse
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtri, stdtr, stdtrit
from scipy.stats import binom

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "support"))

from recorded_benches import WRAP, RecordedBench, draw_bench, write  # noqa: E402

import bowdenfit as bf  # noqa: E402

MISSED, FAR = 0.1, 4.0
MANY = 1e6  # degrees of freedom that are as good as infinitely many


@dataclass(frozen=True)
class Shown:
    """The coefficient and its 90 % interval as the summary has them: of least squares that of its profile.

    Args:
        value, lower, upper: Median, or estimate, and the ends of the interval.
        freedom: Degrees of freedom of Student's distribution with this interval; infinite for a normal one.
    """

    value: float
    lower: float
    upper: float
    freedom: float

    def sds(self, truth: float) -> float:
        """How far off it is, as standard deviations of a normal distribution that are as unlikely."""
        half = self.value - self.lower if self.value > truth else self.upper - self.value
        t_value = stdtrit(self.freedom, 0.95) * (self.value - truth) / half
        return float(np.copysign(-ndtri(stdtr(self.freedom, -abs(t_value))), t_value))


def shown(fit: bf.Fit, mountings: int) -> Shown:
    """What the summary shows of the coefficient."""
    if fit.sampled is not None:
        computed = fit.parameter_of_draws("mu")
        return Shown(computed.median, computed.q05, computed.q95, mountings - 1 or MANY)
    estimate = fit.least_squares.estimates["mu"]
    errors = (estimate.upper - estimate.lower) / 2 / estimate.standard_error
    freedom = brentq(lambda f: stdtrit(f, 0.95) - errors, 0.5, MANY) if errors > stdtrit(MANY, 0.95) else MANY
    return Shown(estimate.value, estimate.lower, estimate.upper, freedom)


def ending(bench: RecordedBench, folder: Path, seed: int, sampled: bool) -> tuple[str, float, str]:
    """How a fit ends, how many standard deviations the coefficient is off (NaN if there is none), and what is said."""
    options = {"friction": "drag"} if bench.drag else {}
    try:
        fit = bf.fit(write(bench, folder, seed), mcmc=sampled, seed=1, **options)
    except bf.BowdenfitError as error:
        return "refused", float("nan"), str(error)
    verdict, truth = fit.verdict(), bench.exponent / WRAP
    computed = shown(fit, bench.mountings)
    relative = f"off by {100 * (computed.value / truth - 1):+.1f} %"
    if not np.all(np.isfinite([computed.lower, computed.upper])):
        return "no interval", float("nan"), relative
    sds = computed.sds(truth)
    if not verdict.trusted:
        return "not trusted", sds, "; ".join([relative, *verdict.troubles])
    return ("right" if computed.lower <= truth <= computed.upper else "WRONG"), sds, relative


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--benches", type=int, default=60, metavar="N")
    parser.add_argument("--first", type=int, default=0, metavar="S")
    parser.add_argument("--sampled", action="store_true", help="by sampling, not least squares alone")
    options = parser.parse_args()
    ends, far = Counter[str](), 0
    for seed in range(options.first, options.first + options.benches):
        bench = draw_bench(seed)
        with tempfile.TemporaryDirectory() as scratch:
            end, sds, message = ending(bench, Path(scratch) / "bench", seed, options.sampled)
        ends[end] += 1
        far += end == "WRONG" and bool(np.abs(sds) > FAR)
        print(f"{seed:3d} {end:11s} {sds:+5.1f} sd, {bench.unusual}: {message[:200]}", flush=True)
    trusted = ends["right"] + ends["WRONG"]
    chance = float(binom.sf(ends["WRONG"] - 1, trusted, MISSED))
    print(", ".join(f"{n} {end}" for end, n in ends.items()), f"(chance of so many misses {chance:.2g}; {far} far off)")
    sys.exit(int(chance < 0.01 or far > 0))


if __name__ == "__main__":
    main()
