"""Sampling with emcee: several independent ensembles of walkers, started apart, run until they agree.

Moves: emcee's stretch and differential evolution, and draws from a distribution fitted to the other walkers, half of them in
the values of the parameters instead of z. Not `DESnookerMove`: the one in emcee 3.1.6 does not sample the density it is given,
and every ensemble agrees on the wrong answer.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import emcee
import jax
import numpy as np

from bowdenfit.description import SamplerSettings
from bowdenfit.inference.chain import Chain, Progress, Sampling, stuck_walkers, worst
from bowdenfit.inference.checkpoint import append, records
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.proposals import Proposal, differential_evolution, independent, shares_of_moves, stretch
from bowdenfit.inference.value_chart import Chart, chart_values, in_values

THIN = 10  # steps from one stored state to the next
_BLOCK = 10  # stored states between two reports
_FIRST_LOOK = 60  # stored states before the first look; of five data sets the slowest is there after half of that
_FITTED = 4  # walkers a parameter that a covariance is fitted to half of
_KEPT_PER_WALKER = 20  # draws at least that are kept of each walker, spread over the second half of its path

Moves = Sequence[tuple[Proposal, float]]


class SideBySide(emcee.moves.RedBlueMove):
    """Independent ensembles moved side by side: proposals stay within an ensemble, everything else is shared.

    Each ensemble is split in two at random; the walkers of one half are proposed places by those of the other half of
    their ensemble. All ensembles' proposals are one array, evaluated in one call, which is why this is several times
    quicker than one sampler after the other.

    Args:
        proposal: Where to.
        n_ensembles: Number of ensembles; walkers are ordered by ensemble.
    """

    def __init__(self, proposal: Proposal, n_ensembles: int) -> None:
        super().__init__()
        self.proposal, self.n_ensembles = proposal, n_ensembles

    def propose(self, model: Any, state: emcee.State) -> tuple[emcee.State, np.ndarray]:
        """One step of every walker."""
        n, size = state.coords.shape
        walkers = n // self.n_ensembles
        order = np.argsort(model.random.rand(self.n_ensembles, walkers), axis=1)
        order += walkers * np.arange(self.n_ensembles)[:, None]
        accepted = np.zeros(n, dtype=bool)
        for moving, resting in ((order[:, ::2], order[:, 1::2]), (order[:, 1::2], order[:, ::2])):
            proposed, factors = self.proposal(state.coords[moving], state.coords[resting], model.random)
            coords, which = proposed.reshape(-1, size), moving.ravel()
            log_density = model.log_prob_fn(coords)  # ours gives an array; emcee would go through it number by number
            gain = factors.ravel() + log_density - state.log_prob[which]
            better = gain > np.log(model.random.uniform(size=len(which)))
            state.coords[which[better]] = coords[better]
            state.log_prob[which[better]] = log_density[better]
            accepted[which] = better
        return state, accepted


def default_moves(chart: Chart, n_walkers: int) -> Moves:
    """What the walkers do; see `shares_of_moves`.

    Args:
        chart: Values of the parameters over z.
        n_walkers: Walkers of an ensemble; a few cannot tell the shape of a t distribution.
    """
    fitted = independent if n_walkers >= _FITTED * chart.size else differential_evolution
    return shares_of_moves(stretch, differential_evolution, fitted, partial(in_values, chart=chart))


def starting_points(start: MaximumPosterior, settings: SamplerSettings, generator: np.random.Generator) -> np.ndarray:
    """Over-dispersed starts, (ensemble, walker, parameter).

    Each ensemble is drawn from the Gauss-Newton covariance about a center of its own, which is drawn from the same: twice the
    covariance in all, and far more of a noise scale, whose start is its prior. Importance-resampled draws would begin nearer,
    but with Pareto k at 0.5 they lack the far ends of bent ridges, and walkers spread into those no sooner than from here.
    """
    root = np.linalg.cholesky(start.covariance)
    centers = generator.standard_normal((settings.n_ensembles, 1, len(start.z)))
    walkers = generator.standard_normal((settings.n_ensembles, settings.n_walkers, len(start.z)))
    return start.z + (centers + walkers) @ root.T


def sample(asked: Sampling, program: Callable[..., Any], moves: Moves | None = None) -> Chain:
    """Sample by ensembles of walkers.

    Args:
        asked: What of, how long, and so on.
        program: Compiled log density for batches of half of all walkers.
        moves: Proposals and their weights; `default_moves` if omitted.
    """
    settings, start, seed = asked.settings, asked.start, asked.seed
    points = starting_points(start, settings, np.random.default_rng([seed, 0])).reshape(-1, len(start.z))
    backend = Checkpointed(points.shape, asked.checkpoint, asked.resume)
    log_density = _in_halves(program, asked.posterior.data, len(points) // 2)
    moves = moves or default_moves(chart_values(asked.posterior.model.space), settings.n_walkers)
    moved = [(SideBySide(proposal, settings.n_ensembles), weight) for proposal, weight in moves]
    sampler = emcee.EnsembleSampler(*points.shape, log_density, vectorize=True, backend=backend, moves=moved)
    # emcee's wrapper prints a traceback of whatever stops an evaluation, the user's interrupt included.
    sampler.log_prob_fn = log_density
    generator = np.random.RandomState(np.random.MT19937(np.random.SeedSequence([seed, 1])))
    state = None if backend.iteration else emcee.State(points, random_state=generator.get_state())
    limit = max(settings.max_steps // THIN, 2)
    target = _FIRST_LOOK
    while target < int(backend.iteration):  # the looks of a sampling that nothing interrupted
        target = _next_look(target)
    target = min(target, limit)
    seen: tuple[float | None, float | None] = (None, None)
    while True:
        while (missing := target - int(backend.iteration)) > 0:
            sampler.run_mcmc(state, min(missing, _BLOCK), thin_by=THIN, skip_initial_state_check=True)
            state = None
            asked.report(Progress(int(backend.iteration) * THIN, settings.max_steps, *seen))
        chain = _summarized(asked, backend)
        seen = worst(chain)
        asked.report(Progress(chain.steps, settings.max_steps, *seen))
        if not chain.reasons or target >= limit:
            return chain
        target = min(_next_look(target), limit)


def _next_look(stored: int) -> int:
    """Stored states at the look after one at so many."""
    return stored + stored // 3


class Checkpointed(emcee.backends.Backend):
    """States in memory, and one after the other in a checkpoint.

    Args:
        shape: Walkers and parameters.
        checkpoint: Where; nowhere if None.
        resume: Go on from the states there.
    """

    def __init__(self, shape: tuple[int, ...], checkpoint: Path | None, resume: bool) -> None:
        super().__init__()
        self.reset(*shape)
        self.checkpoint: Path | None = None
        before = records(checkpoint) if checkpoint is not None and resume else []
        self.grow(len(before), None)
        for record in before:
            keys = record["random_key"], *(int(i) for i in record["random_place"]), float(record["random_normal"])
            state = emcee.State(record["z"], log_prob=record["log_density"], random_state=("MT19937", *keys))
            self.save_step(state, record["accepted"])
        self.checkpoint = checkpoint

    def grow(self, ngrow: int, blobs: None) -> None:
        """Make room for more states, twice as much each time, since all that are there must move."""
        if ngrow > len(self.chain) - self.iteration:
            super().grow(max(ngrow, self.iteration), blobs)

    def save_step(self, state: emcee.State, accepted: np.ndarray) -> None:
        """Keep a state; how many proposals were accepted since the last is added up."""
        super().save_step(state, accepted)
        if self.checkpoint is not None:
            _, key, place, has_normal, normal = state.random_state
            append(
                self.checkpoint,
                {"z": state.coords, "log_density": state.log_prob, "accepted": np.asarray(accepted), "random_key": key,
                 "random_place": np.asarray([place, has_normal]), "random_normal": np.asarray(normal)},
            )  # fmt: skip


def _in_halves(program: Callable[..., Any], data: Any, half: int) -> Callable[[np.ndarray], np.ndarray]:
    """Log density in batches of half of all walkers, so that one compiled shape serves the start and every step."""
    on_device = jax.device_put(data)
    return lambda z: np.concatenate([program(part, on_device) for part in z.reshape(-1, half, z.shape[1])])


def _summarized(asked: Sampling, backend: emcee.backends.Backend) -> Chain:
    """Draws from the second half of every walker's path, with their diagnostics."""
    stored = int(backend.iteration)
    wanted = max(_KEPT_PER_WALKER, 2 * asked.settings.target_ess // backend.shape[0])
    kept = np.unique(np.linspace(stored // 2, stored - 1, wanted).round().astype(int))
    # In this order in memory, as in a loaded fit: sums must agree to the last bit.
    z = np.ascontiguousarray(np.asarray(backend.get_chain()[kept]).transpose(1, 0, 2))
    acceptance = float(np.mean(backend.accepted)) / stored
    chain = asked.chain_of(z, asked.settings.n_ensembles, steps=stored * THIN, acceptance=acceptance)
    too_short = f"each walker took {stored * THIN} steps, and {_FIRST_LOOK * THIN} are the least that can be judged"
    first = (too_short,) if stored < _FIRST_LOOK else ()
    return replace(chain, reasons=(*first, *chain.reasons, *stuck_walkers(z)))
