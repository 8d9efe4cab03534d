"""Sampling with emcee: several independent ensembles of walkers, started apart, run until they agree.

Moves: differential evolution, and now and then its mode-jumping variant. Not `DESnookerMove`: the one in emcee 3.1.6
does not sample the density it is given, and every ensemble agrees on the wrong answer.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import emcee
import numpy as np

from bowdenfit.description import SamplerSettings
from bowdenfit.inference.chain import Chain, Diagnose, Progress, Quantities, diagnose_draws, stuck_walkers, worst
from bowdenfit.inference.diagnostics import diagnose_all
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.log_density import LogDensity

THIN = 20  # steps from one stored state to the next
_BLOCK = 10  # stored states between two reports
_FIRST_LOOK = 50  # stored states before the first look
_KEPT_PER_WALKER = 20  # draws that are kept of each walker, spread over the second half of its path

Moves = Sequence[tuple[emcee.moves.RedBlueMove, float]]


class SideBySide(emcee.moves.RedBlueMove):
    """Independent ensembles moved side by side: proposals stay within an ensemble, evaluations are shared.

    Each ensemble is split in two at random; the walkers of one half get emcee's own proposal from the other half of
    their ensemble. All ensembles' proposals are evaluated in one call, which is why this is several times quicker than
    one sampler after the other.

    Args:
        move: The proposal.
        n_ensembles: Number of ensembles; walkers are ordered by ensemble.
    """

    def __init__(self, move: emcee.moves.RedBlueMove, n_ensembles: int) -> None:
        super().__init__()
        self.move, self.n_ensembles = move, n_ensembles

    def propose(self, model: Any, state: emcee.State) -> tuple[emcee.State, np.ndarray]:
        """One step of every walker."""
        n_walkers = len(state.coords) // self.n_ensembles
        self.move.setup(state.coords)
        order = np.stack([model.random.permutation(n_walkers) + e * n_walkers for e in range(self.n_ensembles)])
        accepted = np.zeros(len(state.coords), dtype=bool)
        for moving, resting in ((order[:, ::2], order[:, 1::2]), (order[:, 1::2], order[:, ::2])):
            pairs = zip(moving, resting, strict=True)
            proposed = [self.move.get_proposal(state.coords[m], [state.coords[r]], model.random) for m, r in pairs]
            coords, factors = (np.concatenate(part) for part in zip(*proposed, strict=True))
            log_density = model.log_prob_fn(coords)  # ours gives an array; emcee would go through it number by number
            which = moving.ravel()
            better = factors + log_density - state.log_prob[which] > np.log(model.random.uniform(size=len(which)))
            state.coords[which[better]] = coords[better]
            state.log_prob[which[better]] = log_density[better]
            accepted[which] = better
        return state, accepted


def default_moves() -> Moves:
    """Stretch moves find the bulk quickly, differential evolution mixes best there, gamma 1 jumps between modes."""
    return [(emcee.moves.StretchMove(), 0.3), (emcee.moves.DEMove(), 0.6), (emcee.moves.DEMove(gamma0=1.0), 0.1)]


def starting_points(start: MaximumPosterior, settings: SamplerSettings, generator: np.random.Generator) -> np.ndarray:
    """Over-dispersed starts, (ensemble, walker, parameter): each ensemble has a center of its own."""
    root = np.linalg.cholesky(start.covariance)
    centers = generator.standard_normal((settings.n_ensembles, 1, len(start.z)))
    walkers = generator.standard_normal((settings.n_ensembles, settings.n_walkers, len(start.z)))
    return start.z + (centers + walkers) @ root.T


def sample(
    posterior: LogDensity,
    log_density: Callable[[np.ndarray, Any], Any],
    start: MaximumPosterior,
    settings: SamplerSettings,
    seed: int,
    quantities: Quantities,
    checkpoint: Path | None = None,
    resume: bool = False,
    report: Callable[[Progress], None] | None = None,
    moves: Moves | None = None,
    diagnose: Diagnose = diagnose_all,
) -> Chain:
    """Sample until converged, or until the stated maximum of steps.

    Args:
        posterior: The posterior.
        log_density: Its compiled log density for batches of half of all walkers.
        start: Center and covariance of the start.
        settings: Ensembles, walkers, maximum of steps and targets.
        seed: Seed of everything random here.
        quantities: Derived quantities of many z; they must converge too.
        checkpoint: HDF5 file that every stored state is written to.
        resume: Go on from the states in `checkpoint`.
        report: Called after every block.
        moves: Proposals and their weights; `default_moves()` if omitted.
        diagnose: What diagnoses all quantities; `diagnose_all`, or something that has another process do it.
    """
    points = starting_points(start, settings, np.random.default_rng([seed, 0])).reshape(-1, len(start.z))
    backend = _backend(checkpoint, resume, points.shape)
    sampler = emcee.EnsembleSampler(
        *points.shape,
        _in_halves(log_density, posterior.data, len(points) // 2),
        vectorize=True,
        backend=backend,
        moves=[(SideBySide(move, settings.n_ensembles), weight) for move, weight in moves or default_moves()],
    )
    # emcee's wrapper prints a traceback of whatever stops an evaluation, the user's interrupt included.
    sampler.log_prob_fn = _in_halves(log_density, posterior.data, len(points) // 2)
    generator = np.random.RandomState(np.random.MT19937(np.random.SeedSequence([seed, 1])))
    state = None if backend.iteration else emcee.State(points, random_state=generator.get_state())
    limit = max(settings.max_steps // THIN, 2)
    target = min(max(_FIRST_LOOK, int(backend.iteration)), limit)
    seen: tuple[float | None, float | None] = (None, None)
    while True:
        while (missing := target - int(backend.iteration)) > 0:
            sampler.run_mcmc(state, min(missing, _BLOCK), thin_by=THIN, skip_initial_state_check=True)
            state = None
            if report is not None:
                report(Progress(int(backend.iteration) * THIN, settings.max_steps, *seen))
        chain = _summarized(posterior, backend, settings, quantities, diagnose)
        seen = worst(chain)
        if report is not None:
            report(Progress(chain.steps, settings.max_steps, *seen))
        if not chain.reasons or target >= limit:
            return chain
        target = min(target + target // 3, limit)


def _backend(checkpoint: Path | None, resume: bool, shape: tuple[int, ...]) -> emcee.backends.Backend:
    backend = emcee.backends.Backend() if checkpoint is None else emcee.backends.HDFBackend(str(checkpoint))
    if checkpoint is None or not (resume and checkpoint.exists() and backend.initialized):
        backend.reset(*shape)
    return backend


def _in_halves(log_density: Callable[..., Any], data: Any, half: int) -> Callable[[np.ndarray], np.ndarray]:
    """Log density in batches of half of all walkers, so that one compiled shape serves the start and every step."""

    def evaluate(z: np.ndarray) -> np.ndarray:
        return np.concatenate([np.asarray(log_density(part, data)) for part in z.reshape(-1, half, z.shape[1])])

    return evaluate


def _summarized(
    posterior: LogDensity,
    backend: emcee.backends.Backend,
    settings: SamplerSettings,
    quantities: Quantities,
    diagnose: Diagnose,
) -> Chain:
    """Draws from the second half of every walker's path, with their diagnostics."""
    stored = int(backend.iteration)
    kept = np.unique(np.linspace(stored // 2, stored - 1, _KEPT_PER_WALKER).round().astype(int))
    # In this order in memory, as in a loaded fit: sums must agree to the last bit.
    z = np.ascontiguousarray(np.asarray(backend.get_chain()[kept]).transpose(1, 0, 2))
    derived, diagnostics, reasons = diagnose_draws(posterior, z, settings.n_ensembles, settings, quantities, diagnose)
    if stored < _FIRST_LOOK:
        too_short = f"each walker took {stored * THIN} steps, and {_FIRST_LOOK * THIN} are the least that can be judged"
        reasons = (too_short, *reasons)
    reasons = (*reasons, *stuck_walkers(z))
    acceptance = float(np.mean(backend.accepted)) / stored
    return Chain(z, derived, diagnostics, settings.n_ensembles, stored * THIN, acceptance, reasons)
