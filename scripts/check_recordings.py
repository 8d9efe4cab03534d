"""Are fits of recordings ever wrong and trusted? Long, cyclic, noisy, slow and quick ones, with known truth.

    python scripts/check_recordings.py [--benches N] [--first S] [--sampled]

The benches are drawn at random (`tests/support/recorded_benches.py`, a simulator in NumPy alone): 20 Hz to 5 kHz, 20 to 700 s,
3 to 300 cycles of five wave forms, 1 N to 10 kN, noise that is white or stays alike over many samples, filters, delays and
drifts, one mounting or three. Each is fitted with the friction it was made with. It is refused, or not trusted, or trusted and
right, or WRONG: trusted, and the true coefficient outside the 90 % interval.

Prints a row for each and their sum. Ends with 1 if more trusted intervals miss the truth than chance allows at 1 %, or one by
more than four standard deviations.
"""

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
from scipy.stats import binom

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "support"))

from endings import answers  # noqa: E402
from recorded_benches import WRAP, RecordedBench, drawn, write  # noqa: E402

import bowdenfit as bf  # noqa: E402

MISSED, FAR, SDS_OF_90 = 0.1, 4.0, 1.645


def ending(bench: RecordedBench, folder: Path, seed: int, sampled: bool) -> tuple[str, float, str]:
    """How a fit ends, how many standard deviations the coefficient is off (NaN if there is none), and what is said."""
    given = {"friction": "drag"} if bench.drag else {}
    try:
        fit = bf.fit(write(bench, folder, seed), mcmc=sampled, seed=1, **given)
    except bf.BowdenfitError as error:
        return "refused", float("nan"), str(error)
    found, verdict = answers(fit)["mu"], fit.verdict()
    off = found.median - bench.exponent / WRAP
    sds = SDS_OF_90 * off / ((found.median - found.q05) if off > 0 else (found.q95 - found.median))
    relative = f"off by {100 * off / (bench.exponent / WRAP):+.1f} %"
    if not verdict.trusted:
        return "not trusted", sds, "; ".join([relative, *verdict.troubles])
    return ("WRONG" if abs(sds) > SDS_OF_90 else "right"), sds, relative


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--benches", type=int, default=60, metavar="N")
    parser.add_argument("--first", type=int, default=0, metavar="S")
    parser.add_argument("--sampled", action="store_true", help="by sampling, not least squares alone")
    asked = parser.parse_args()
    ends, far = Counter[str](), 0
    for seed in range(asked.first, asked.first + asked.benches):
        bench = drawn(seed)
        with tempfile.TemporaryDirectory() as scratch:
            end, sds, said = ending(bench, Path(scratch) / "bench", seed, asked.sampled)
        ends[end] += 1
        far += end == "WRONG" and bool(np.abs(sds) > FAR)
        print(f"{seed:3d} {end:11s} {sds:+5.1f} sd, {bench.unusual}: {said[:200]}", flush=True)
    trusted = ends["right"] + ends["WRONG"]
    chance = float(binom.sf(ends["WRONG"] - 1, trusted, MISSED))
    print(", ".join(f"{n} {end}" for end, n in ends.items()), f"(chance of so many misses {chance:.2g}; {far} far off)")
    sys.exit(int(chance < 0.01 or far > 0))


if __name__ == "__main__":
    main()
