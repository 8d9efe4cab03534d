"""What every sampler gives, and what they share: draws with their diagnostics, reports on the way, the verdict's reasons."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from bowdenfit.description import SamplerSettings
from bowdenfit.inference.diagnostics import Diagnostics, shortfalls
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.trajectories import Trajectories

Diagnose: TypeAlias = Callable[[Mapping[str, np.ndarray], int], dict[str, Diagnostics]]
Quantities: TypeAlias = Callable[[np.ndarray], Mapping[str, np.ndarray]]


@dataclass(frozen=True)
class Progress:
    """Where sampling stands, for a progress bar; R-hat and effective sample size once they have been looked at."""

    steps: int
    max_steps: int
    r_hat: float | None
    ess: float | None
    sampler: str = "emcee"


@dataclass(frozen=True)
class Chain:
    """Draws of the posterior after burn-in.

    Args:
        z: Draws in z, (ensemble x walker, draw, parameter); a chain of NUTS is an ensemble of one walker.
        quantities: Named derived quantities of every draw, (ensemble x walker, draw).
        diagnostics: Of parameters and derived quantities.
        n_ensembles: Number of independent ensembles.
        steps: Steps taken by each walker; of NUTS, without warm-up.
        acceptance: Mean fraction of accepted proposals; of NUTS, mean acceptance along trajectories.
        reasons: Why the draws should not be trusted; empty if they may.
        sampler: "emcee" or "nuts".
        trajectories: How those of NUTS went.
    """

    z: np.ndarray
    quantities: dict[str, np.ndarray]
    diagnostics: dict[str, Diagnostics]
    n_ensembles: int
    steps: int
    acceptance: float
    reasons: tuple[str, ...]
    sampler: str = "emcee"
    trajectories: Trajectories | None = None


def diagnose_draws(
    posterior: LogDensity,
    z: np.ndarray,
    n_ensembles: int,
    settings: SamplerSettings,
    quantities: Quantities,
    diagnose: Diagnose,
) -> tuple[dict[str, np.ndarray], dict[str, Diagnostics], tuple[str, ...]]:
    """Derived quantities of draws, diagnostics of them and of the parameters, and why they should not be trusted.

    Args:
        posterior: What was sampled.
        z: Draws, (walker, draw, parameter), ordered by ensemble.
        n_ensembles: Number of independent ensembles.
        settings: Targets.
        quantities: Derived quantities of many z.
        diagnose: What diagnoses all quantities.
    """
    derived = {k: np.asarray(q).reshape(z.shape[:2]) for k, q in quantities(z.reshape(-1, z.shape[-1])).items()}
    draws = {p.name: z[..., i] for i, p in enumerate(posterior.model.space.free)} | derived
    diagnostics = diagnose(draws, n_ensembles)
    return derived, diagnostics, shortfalls(diagnostics, settings.target_r_hat, settings.target_ess)


def stuck_walkers(z: np.ndarray, what: str = "walkers") -> tuple[str, ...]:
    """Walkers that never moved in half their path; a few of them far out pass every other check."""
    count = int(np.sum(np.ptp(z[..., 0], axis=1) == 0)) if z.shape[1] > 1 and z.shape[2] else 0
    if not count:
        return ()
    return (f"{count} of {len(z)} {what} did not move in the second half of their path, far from where the others are",)


def worst(chain: Chain) -> tuple[float, float]:
    """Highest R-hat and lowest effective sample size of all quantities."""
    diagnostics = chain.diagnostics.values()
    return max(d.r_hat for d in diagnostics), min(min(d.ess_bulk, d.ess_tail) for d in diagnostics)
