"""Whether the intervals of dahl and lugre hold: recordings of ropes that creep, by an integrator that shares no code with them.

Each rope (`tests/support/creeping_rope.py`) has a friction and a presliding stiffness of its own, and with lugre a Stribeck
rise, a viscous part and a damping. A recording of half a minute, with 0.15 N of noise in both cells, is prepared as usual and
fitted by least squares with priors. The 90 % profile interval of each parameter must contain its truth as often as chance
allows, at 1 % for each. Where a recording does not determine a parameter it has no interval, and does not count.

    .venv/bin/python scripts/check_creeping_ropes.py [--ropes 20] [--rate 100] [--first 0] [--friction lugre]

Prints a line for each rope and how often each parameter's interval held, and ends with 1 if any held too seldom. A rope takes
ten seconds on an idle core, mostly for compiling.
"""

import argparse
import sys
from pathlib import Path

import jax
import numpy as np
from scipy.stats import binom

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "support"))

from creeping_rope import ANGLE, SPEED, Truth, model_recordings, record  # noqa: E402

from bowdenfit.inference.least_squares import Estimate, find_maximum_posterior, fit_least_squares  # noqa: E402
from bowdenfit.inference.log_density import LogDensity  # noqa: E402
from bowdenfit.inference.objective import make_objective  # noqa: E402

SHARE, BY_CHANCE = 0.9, 0.01


def main() -> None:
    """Fit each rope, and count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ropes", type=int, default=20)
    parser.add_argument("--rate", type=float, default=100.0, help="samples a second")
    parser.add_argument("--first", type=int, default=0, help="seed of the first rope")
    parser.add_argument("--friction", choices=("dahl", "lugre"), default="lugre")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)

    held: dict[str, list[bool]] = {}
    for seed in range(options.first, options.first + options.ropes):
        truth = draw_rope(seed, options.friction)
        estimates = fit(truth, options.rate, seed, options.friction)
        words = []
        for name, value in true_values(truth, options.friction).items():
            estimate = estimates[name]
            if np.isnan(estimate.lower):
                words.append(f"{name} {value:.3g} undetermined")
                continue
            held.setdefault(name, []).append(bool(estimate.lower <= value <= estimate.upper))
            words.append(
                f"{name} {value:.3g} [{estimate.lower:.3g}, {estimate.upper:.3g}]{'' if held[name][-1] else ' MISSED'}"
            )
        print(f"{seed}: {'; '.join(words)}", flush=True)

    wrong = False
    for name, flags in held.items():
        seldom = binom.cdf(sum(flags), len(flags), SHARE) < BY_CHANCE
        wrong |= bool(seldom)
        print(f"{name}: {sum(flags)} of {len(flags)}{', too seldom' if seldom else ''}")
    sys.exit(1 if wrong else 0)


def draw_rope(seed: int, friction: str) -> Truth:
    """Return a rope, its friction exponent between 0.15 and 0.5, creeping by 2 to 10 % of the force after a turn."""
    generator = np.random.default_rng([7, seed])
    exponent, stiffness = generator.uniform(0.15, 0.5), np.exp(generator.normal(np.log(25), 0.4))
    if friction == "dahl":
        return Truth(exponent, stiffness, reference_speed=SPEED)
    return Truth(
        exponent, stiffness, damping=generator.uniform(0.002, 0.03), stribeck=generator.uniform(0.1, 0.5),
        stribeck_speed=generator.uniform(4, 12), viscous=generator.uniform(-0.003, 0.008), reference_speed=SPEED,
    )  # fmt: skip


def true_values(truth: Truth, friction: str) -> dict[str, float]:
    """Return the true value of each parameter, in its shown unit."""
    common = {"mu": truth.exponent / ANGLE, "presliding_stiffness": truth.stiffness}
    if friction == "dahl":
        return common
    of_rate = {name: getattr(truth, name) for name in ("stribeck", "stribeck_speed", "viscous")}
    return common | of_rate | {"bristle_damping": 1000 * truth.damping}


def fit(truth: Truth, rate: float, seed: int, friction: str) -> dict[str, Estimate]:
    """Return the estimates of least squares with priors, by parameter."""
    posterior = LogDensity(model_recordings([record(truth, rate, seed)], friction))
    objective = make_objective(posterior)
    return dict(fit_least_squares(posterior, objective, find_maximum_posterior(posterior, objective).z).estimates)


if __name__ == "__main__":
    main()
