"""Does a fit that is ended at any moment lose anything? Signals and no memory at random times, and what comes of going on.

    python scripts/check_kills.py [--kills N] [--seed S] [--jobs emcee,nuts,calibrate,writing,fleet]

Each time a small fit by emcee or NUTS, a calibration, or a fleet is started in a process of its own and struck once. It is
watched meanwhile: what lies in its folder says whether it still starts (nothing is there), compiles, samples, or writes its
results. One of these is drawn, and the blow comes either within 50 ms of its beginning or after a random part of the time
that it took lately, so that a machine which has become slow meanwhile is struck as one that is quick. A job `writing` is a fit
with figures and report, and is struck while it samples its last or writes. The blow is SIGINT, SIGTERM, SIGKILL, or no memory:
every other time the kernel's way, which ends one of its processes, else a limit as a container or a shell sets it, drawn
between far too little and the least that was enough. A blow counts where a process was there to be struck, and a limit where
it was too little; what came too late is said and tried again.

Then the same command is given again, with --resume where a checkpoint is said to be kept or is there, with --force where
anything else is left; where nothing at all is left, the run that nothing ended has shown already what it does. It must end as
usual, with the same draws (or replications) as one that nothing ended; no process of the first may be left; one that was asked
to end must have ended with 130 and a sentence, or have finished; one that ends with 0 or 3 must have finished; and nobody may
have read anything but our own words; a library that aborts for want of memory may say so in its own.

Prints each kill and how many struck what and when, and ends with 1 if a promise was broken.
"""

import argparse
import random
import sys
import tempfile
from collections import Counter
from pathlib import Path

from kills.blow import CALLED
from kills.jobs import JOBS, fleet_job
from kills.striking import blows


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", default="emcee,nuts,calibrate,writing,fleet")
    options = parser.parse_args()
    struck, wrong = Counter[str](), 0
    with tempfile.TemporaryDirectory() as place:
        jobs = tuple(job for job in (*JOBS, fleet_job(Path(place) / "measured")) if job.name in options.jobs.split(","))
        for blow in blows(random.Random(options.seed), jobs, Path(place)):
            wrong += bool(blow.wrong)
            if blow.struck is not None:
                kind = blow.sent.name if blow.sent else "memory"
                struck.update((f"{blow.job.name}, {kind}", CALLED[blow.struck], "all"))
            print(f"{struck['all']:3d} {blow}", flush=True)
            if struck["all"] >= options.kills:
                break
    print("; ".join(f"{case} {times}" for case, times in sorted(struck.items())))
    print(f"{wrong} went wrong of {struck['all']} that struck")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
