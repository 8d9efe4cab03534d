"""How the trajectories of Hamiltonian Monte Carlo went, and what keeps their draws from being trusted."""

from dataclasses import dataclass

import numpy as np

MOST_FINE_DIVERGED = 0.001  # share of the trajectories of fine steps, without which a corner is out of reach
MOST_DIVERGED = 0.01  # share of all; those of ordinary steps may fail where the fine ones do not
LEAST_ENERGY_MIXING = 0.3


@dataclass(frozen=True)
class Trajectories:
    """How the trajectories of Hamiltonian Monte Carlo went.

    Args:
        warm_up: Steps of each chain that tuned the sampler; they are not among the draws.
        drawn: Trajectories of all chains after that.
        diverged: How many of them broke off because their energy was not kept.
        fine: How many of them took the fine steps that reach where the others break off.
        fine_diverged: How many of those broke off too.
        saturated: How many of the others were as long as trajectories may be.
        energy_mixing: E-BFMI of the chain where it is lowest.
        step_size: Step size after tuning, the same for all chains.
        gradients: Gradients computed in all, those of tuning included.
        statistics: Of every kept draw under ArviZ's names, (chain, draw).
    """

    warm_up: int
    drawn: int
    diverged: int
    fine: int
    fine_diverged: int
    saturated: int
    energy_mixing: float
    step_size: float
    gradients: int
    statistics: dict[str, np.ndarray]


def energy_mixing(energy: np.ndarray) -> float:
    """E-BFMI of the chain where it is lowest: how far one step may change the energy, against how far it spreads.

    Args:
        energy: Of every draw, (chain, draw), none left out.

    References:
        Betancourt 2016, "Diagnosing suboptimal cotangent disintegrations in Hamiltonian Monte Carlo" (arXiv:1604.00695).
    """
    from arviz_stats.base import array_stats

    if not np.all(np.isfinite(energy)) or np.any(np.ptp(energy, axis=1) == 0):
        return float("nan")
    return float(np.min(array_stats.bfmi(energy, chain_axis=0, draw_axis=1)))


def trajectory_shortfalls(trajectories: Trajectories) -> tuple[str, ...]:
    """What keeps draws of Hamiltonian Monte Carlo from being trusted, in words; empty if nothing does."""
    reasons = []
    for diverged, drawn, most, which in (
        (trajectories.fine_diverged, trajectories.fine, MOST_FINE_DIVERGED, " of fine steps"),
        (trajectories.diverged, trajectories.drawn, MOST_DIVERGED, ""),
    ):
        if diverged > most * drawn:
            reasons.append(
                f"{diverged} of {drawn} trajectories{which} diverged, and 1 in {1 / most:.0f} is the most: a narrow corner of "
                "the posterior may be missing; raise sampler.target_acceptance, or state what is known as priors"
            )
    if not trajectories.energy_mixing >= LEAST_ENERGY_MIXING:
        reasons.append(
            f"the energy of a chain mixes slowly (E-BFMI {trajectories.energy_mixing:.2f}, which should be at least "
            f"{LEAST_ENERGY_MIXING:g}): its tails may be missing; let it run longer, or state what is known as priors"
        )
    return tuple(reasons)
