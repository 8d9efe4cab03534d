"""What a calibration could have seen: how often intervals too narrow by so much are caught with so many replications."""

from dataclasses import dataclass

import numpy as np

from bowdenfit.questions.calibrate.uniformity import UniformRanks

TOO_SMALL = (0.1, 0.2, 0.3)  # by which a posterior standard deviation is
_SIMULATED = 500  # calibrations
_SEED = 20_220_729


@dataclass(frozen=True)
class Power:
    """How often a calibration rejects one quantity whose intervals are too narrow, all others being right.

    Args:
        too_small: Share by which its posterior standard deviation is too small.
        caught: Probability, to 0.02 or so.
    """

    too_small: float
    caught: float


def estimate_power(n: int, level: float, bands: dict[float, tuple[float, float]], by_ranks: bool) -> tuple[Power, ...]:
    """The power of a calibration, by simulation of normal posteriors.

    Args:
        n: Replications.
        level: P value of the ranks of one quantity below which it is rejected.
        bands: Rates of intervals that are allowed, by what these claim.
        by_ranks: Whether ranks are judged too.
    """
    from scipy import special

    errors = np.random.default_rng(_SEED).standard_normal((_SIMULATED, n))
    uniform, powers = UniformRanks(n), []
    for too_small in TOO_SMALL:
        ranks = special.ndtr(errors / (1 - too_small))
        rates = {claimed: np.mean(np.abs(ranks - 0.5) < claimed / 2, axis=1) for claimed in bands}
        caught = np.any(
            [(rates[claimed] < low) | (rates[claimed] > high) for claimed, (low, high) in bands.items()], axis=0
        )
        if by_ranks:
            caught |= np.array([uniform.p_value(row) < level for row in ranks])
        powers.append(Power(too_small, float(caught.mean())))
    return tuple(powers)
