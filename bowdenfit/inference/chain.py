"""What all samplers share: the request, progress reports, and the chain of draws with its diagnostics."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bowdenfit.description import SamplerSettings
from bowdenfit.inference.diagnostics import Diagnostics, Trajectories, describe_convergence_shortfalls, diagnose_all
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.log_density import LogDensity


@dataclass(frozen=True)
class Progress:
    """Progress of sampling, for a progress bar.

    Args:
        steps: Steps so far.
        max_steps: Most steps.
        r_hat: Largest R-hat, once it has been computed.
        ess: Smallest effective sample size, likewise.
        sampler: Its name.
        seconds_left: About how long sampling takes at least from now on [s], judged by what it took so far; None if unknown.
    """

    steps: int
    max_steps: int
    r_hat: float | None
    ess: float | None
    sampler: str = "emcee"
    seconds_left: float | None = None


@dataclass(frozen=True)
class Chain:
    """Draws of the posterior after burn-in.

    Args:
        z: Draws in z, (ensemble x walker, draw, parameter); a NUTS chain, or a batch of weighted draws, counts as an ensemble
            of one walker.
        quantities: Named derived quantities at every draw, (ensemble x walker, draw).
        diagnostics: Diagnostics of parameters and derived quantities.
        n_ensembles: Number of independent ensembles.
        steps: Steps taken by each walker; for NUTS, without warm-up.
        acceptance: Mean fraction of accepted proposals; for NUTS, mean acceptance along trajectories; for importance sampling,
            effective draws per draw.
        reasons: Why the draws should not be trusted; empty if they can be.
        sampler: "emcee", "nuts" or "importance".
        trajectories: Statistics of the trajectories of NUTS.
        pareto_k: Pareto k of the weights of importance sampling.
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
    pareto_k: float | None = None


@dataclass(frozen=True)
class SamplingRequest:
    """What a sampler is asked to do: sample until converged, or until the maximum number of steps.

    Args:
        posterior: The posterior to sample.
        start: Center and covariance of the start.
        settings: Ensembles or chains, maximum steps, and targets.
        seed: Random seed.
        quantities: Derived quantities at many z; they must converge too.
        checkpoint: File to which every stored state is written; see `bowdenfit.inference.checkpoint`.
        resume: Whether to continue from the states in `checkpoint`.
        report: Called after every block of steps.
        diagnose: Function that computes the diagnostics of all quantities by name; `diagnose_all` if omitted.
    """

    posterior: LogDensity
    start: MaximumPosterior
    settings: SamplerSettings
    seed: int
    quantities: Callable[[np.ndarray], Mapping[str, np.ndarray]] = lambda _: {}
    checkpoint: Path | None = None
    resume: bool = False
    report: Callable[[Progress], None] = lambda _: None
    diagnose: Callable[[Mapping[str, np.ndarray], int], dict[str, Diagnostics]] = diagnose_all

    def make_chain(self, z: np.ndarray, n_ensembles: int, **sampler_details: Any) -> Chain:
        """Return the chain of draws (walker, draw, parameter), ordered by ensemble, with derived quantities and diagnostics."""
        flat = self.quantities(z.reshape(-1, z.shape[-1]))
        derived = {name: np.asarray(values).reshape(z.shape[:2]) for name, values in flat.items()}
        draws = {p.name: z[..., i] for i, p in enumerate(self.posterior.model.space.free)} | derived
        diagnostics = self.diagnose(draws, n_ensembles)
        reasons = describe_convergence_shortfalls(diagnostics, self.settings.target_r_hat, self.settings.target_ess)
        return Chain(z, derived, diagnostics, n_ensembles, reasons=reasons, **sampler_details)


def describe_stuck_walkers(z: np.ndarray) -> tuple[str, ...]:
    """Describe walkers that never moved in half their path; a few of them far out pass every other check."""
    count = int(np.sum(np.ptp(z[..., 0], axis=1) == 0)) if z.shape[1] > 1 and z.shape[2] else 0
    if not count:
        return ()
    return (f"{count} of {len(z)} sampled paths did not move in their second half, far from where the others are",)


def worst_diagnostics(chain: Chain) -> tuple[float, float]:
    """Return the highest R-hat and the lowest effective sample size of all quantities."""
    diagnostics = chain.diagnostics.values()
    return max(d.r_hat for d in diagnostics), min(min(d.ess_bulk, d.ess_tail) for d in diagnostics)
