"""What comes of one replication: the rank of the truth among the draws of each quantity."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RankedTruth:
    """Truth and posterior of one quantity; of a parameter in z, where its prior is a standard normal.

    Args:
        truth: What the readings were simulated with.
        mean: Posterior mean.
        sd: Posterior standard deviation.
        rank: Share of the posterior below the truth; uniform between 0 and 1 if all is right.
    """

    truth: float
    mean: float
    sd: float
    rank: float


@dataclass(frozen=True)
class Replication:
    """What came of one replication.

    Args:
        number: Its number.
        redrawn: Why tables were drawn again, with how many were.
        reasons: Why its draws should not be trusted; empty if they may.
        ranked: By quantity; empty where the fit failed.
        seconds: What it took, of those that were fitted together on average.
        steps: Steps of each walker.
        engine: What fitted it: weighted draws ("laplace"), "ensembles" or "nuts".
    """

    number: int
    redrawn: dict[str, int]
    reasons: tuple[str, ...]
    ranked: dict[str, RankedTruth]
    seconds: float
    steps: int = 0
    engine: str = ""


def rank_truth(truth: float, draws: np.ndarray, tie: float = 0.0) -> RankedTruth:
    """Where the truth is among the draws; of draws equal to it the share `tie` counts as below."""
    rank = float(np.mean(draws < truth) + tie * np.mean(draws == truth))
    return RankedTruth(truth, float(np.mean(draws)), float(np.std(draws)), rank)
