"""The on-body posterior with bowdenfit as a library: what the plain programs do, so neither figures nor files."""

import sys
import time

import numpy as np
import onbody

import bowdenfit as bf


def main() -> None:
    """Fit with the seed that the command line names."""
    fit = bf.fit(onbody.DATASET, seed=int(sys.argv[1]), figures=False)
    ready_at = time.monotonic()
    draws = np.stack([fit.posterior.values[name] for name in onbody.NAMES], axis=-1)
    onbody.show(ready_at, draws, fit.provenance.stage_times["sample"], draws)


if __name__ == "__main__":
    main()
