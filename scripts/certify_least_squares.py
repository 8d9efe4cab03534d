"""Print how many digits the least-squares solver shares with NIST's certified nonlinear regressions.

    python scripts/certify_least_squares.py

27 problems, two starts each: the worst parameter, the worst standard error and the residual sum of squares, in decimal digits
(log relative error, at most 11), and how often the residuals and their Jacobian were computed.
"""

import sys
from pathlib import Path

import jax

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "support"))

from strd import MODELS, certify, problem


def main() -> None:
    """Print the table."""
    rows = []
    print(
        f"{'problem':<10} {'start':>5} {'parameters':>11} {'standard errors':>16} {'sum of squares':>15} {'evaluations':>12}"
    )
    for name in sorted(MODELS):
        for start, run in enumerate(certify(problem(name)), start=1):
            rows.append(run)
            digits = f"{run.parameters:>11.1f} {run.standard_errors:>16.1f} {run.sum_of_squares:>15.1f}"
            print(f"{problem(name).name:<10} {start:>5} {digits} {run.evaluations:>12}")
    parameters, errors = sum(r.parameters >= 6 for r in rows), sum(r.standard_errors >= 4 for r in rows)
    print(
        f"Parameters to at least 6 digits: {parameters} of {len(rows)} runs; standard errors to at least 4: {errors}."
    )


if __name__ == "__main__":
    with jax.enable_x64(True):
        main()
