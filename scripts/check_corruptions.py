"""Does a mistake in a table ever end with a wrong answer that says all is well? Mistakes drawn at random, in every data set.

    python scripts/check_corruptions.py [--seeds N] [--first S] [--least-squares] [DATA_SET ...]

Each mistake (columns exchanged, a wrong unit, a slipped decimal point, another sign, shifted headings, exchanged cells, merged
labels; `tests/support/corruptions.py`) ends in one of four ways: it is refused; it is fitted, and the verdict says that the fit
is not to be trusted; it hardly matters, every coefficient and the best length being within the 90 % intervals of the fit
without the mistake; or it is WRONG: trusted, and outside. What least squares refuses or does not trust is not sampled.

Prints every case that is wrong and a table of how many ended how, and ends with 1 if any is wrong, or if a data set is not
trusted without a mistake.
"""

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "support"))

from corruptions import corrupt  # noqa: E402
from mistaken_data_sets import ENDS, WRONG, answers, end_of  # noqa: E402

import bowdenfit as bf  # noqa: E402
from bowdenfit.words import table  # noqa: E402


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("datasets", nargs="*", type=Path, metavar="DATA_SET", help="all of datasets/ if omitted")
    parser.add_argument("--seeds", type=int, default=100, help="how many mistakes, shared among the data sets")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--least-squares", action="store_true", help="without sampling, in a quarter of the time")
    options = parser.parse_args()
    folders = options.datasets or sorted(path.parent for path in (ROOT / "datasets").glob("*/cable.toml"))
    fits = {folder: bf.fit(folder, mcmc=not options.least_squares, seed=1) for folder in folders}
    clean = {folder: answers(fit) for folder, fit in fits.items()}
    bad = [f"{folder.name}: not trusted without a mistake" for folder in folders if not fits[folder].verdict().trusted]
    ends: Counter[tuple[str, str]] = Counter()
    for seed in range(options.first, options.first + options.seeds):
        dataset = folders[seed % len(folders)]
        with tempfile.TemporaryDirectory() as scratch:
            corruption = corrupt(dataset, Path(scratch) / dataset.name, seed)
            end, reason = end_of(Path(scratch) / dataset.name, clean[dataset], not options.least_squares)
        ends[dataset.name, end] += 1
        print(f"{seed:3d} {dataset.name}, {corruption}: {end}{f' ({reason})' if reason else ''}", flush=True)
        bad += [f"{seed} {dataset.name}, {corruption}: {reason}"] if end == WRONG else []
    rows = [(folder.name, *(str(ends[folder.name, end]) for end in ENDS)) for folder in folders]
    total = ("all", *(str(sum(ends[folder.name, end] for folder in folders)) for end in ENDS))
    print("\n" + table(("data set", *ENDS), [*rows, total]))
    sys.exit("\n".join(bad) if bad else 0)


if __name__ == "__main__":
    main()
