"""Sampling with emcee: several independent ensembles of walkers, started apart, run until they agree.

Moves: emcee's stretch and differential evolution, and draws from a distribution fitted to the other walkers; a quarter of them
in z, a quarter in the values of the parameters, half where friction coefficients follow everything else. Not `DESnookerMove`:
the one in emcee 3.1.6 does not sample the density it is given, and every ensemble agrees on the wrong answer.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import emcee
import jax
import numpy as np

from bowdenfit.description import SamplerSettings
from bowdenfit.description.defaults import THIN, WALKERS_PER_PARAMETER
from bowdenfit.inference.chain import Chain, Progress, Sampling, stuck_walkers, worst
from bowdenfit.inference.checkpoint import append, damaged_checkpoint, records
from bowdenfit.inference.coordinates import Coordinates, Places, WalkerPrograms, Z, coordinates_of
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.proposals import Proposal, differential_evolution, independent, shares_of_moves, stretch

_BLOCK = 10  # stored states between two reports
_FIRST_LOOK = 60  # stored states before the first look; of five data sets the slowest is there after half of that
_OF_RANDOM = {"random_key": (624,), "random_place": (2,), "random_normal": ()}  # shapes of what makes random numbers
_KEPT_PER_WALKER = 20  # draws at least that are kept of each walker, spread over the second half of its path

Moves = Sequence[tuple[Proposal, float]]


class Sweep(emcee.moves.Move):
    """Some steps of independent ensembles side by side, in one kind of coordinates: proposals stay within an ensemble.

    At each step one of the moves is made. Each ensemble is split in two at random; the walkers of one half are proposed
    places by those of the other half of their ensemble. All ensembles' proposals are one array, evaluated in one call, which
    is why this is several times quicker than one sampler after the other.

    Args:
        moves: Where to, and how often.
        coordinates: In which coordinates.
        n_ensembles: Number of ensembles; walkers are ordered by ensemble.
    """

    def __init__(self, moves: Moves, coordinates: Coordinates, n_ensembles: int) -> None:
        super().__init__()
        self.coordinates, self.n_ensembles = coordinates, n_ensembles
        self.proposals = [proposal for proposal, _ in moves]
        self.shares = np.array([share for _, share in moves])

    def propose(self, model: Any, state: emcee.State) -> tuple[emcee.State, np.ndarray]:
        """`THIN` steps of every walker, and the share that was accepted."""
        at, accepted = self.coordinates.from_z(state.coords), np.zeros(len(state.coords))
        for which in model.random.choice(len(self.proposals), size=THIN, p=self.shares):
            for half in self._halves(model.random, len(state.coords)):
                accepted[self._move(self.proposals[which], half, model, state, at)] += 1
        return state, accepted / THIN

    def _halves(self, random: np.random.RandomState, n: int) -> Sequence[tuple[np.ndarray, np.ndarray]]:
        """Positions of those that move and those that rest, (ensemble, walker); twice."""
        walkers = n // self.n_ensembles
        order = np.argsort(random.rand(self.n_ensembles, walkers), axis=1)
        order += walkers * np.arange(self.n_ensembles)[:, None]
        return (order[:, ::2], order[:, 1::2]), (order[:, 1::2], order[:, ::2])

    def _move(
        self, proposal: Proposal, half: tuple[np.ndarray, np.ndarray], model: Any, state: emcee.State, at: Places
    ) -> np.ndarray:
        """Move one half, in z and in the coordinates; positions of those that were moved."""
        (moving, resting), (w, volume) = half, at
        proposed, factors = proposal(w[moving], w[resting], model.random)
        new, which = proposed.reshape(-1, w.shape[1]), moving.ravel()
        z, new_volume = self.coordinates.to_z(new)
        log_density = model.log_prob_fn(z)  # ours gives an array; emcee would go through it number by number
        with np.errstate(invalid="ignore"):  # out of reach of the coordinates the volume may be infinite as the density is
            gain = factors.ravel() + volume[which] - new_volume + log_density - state.log_prob[which]
        better = np.isfinite(new_volume) & (gain > np.log(model.random.uniform(size=len(which))))
        taken = which[better]
        state.coords[taken], state.log_prob[taken] = z[better], log_density[better]
        w[taken], volume[taken] = new[better], new_volume[better]
        return taken


def default_moves(size: int, n_walkers: int) -> Moves:
    """What the walkers do; see `shares_of_moves`.

    Args:
        size: Number of parameters.
        n_walkers: Walkers of an ensemble; a few cannot tell the shape of a t distribution.
    """
    fitted = independent if n_walkers >= WALKERS_PER_PARAMETER * size else differential_evolution
    return shares_of_moves(stretch, differential_evolution, fitted)


def starting_points(start: MaximumPosterior, settings: SamplerSettings, generator: np.random.Generator) -> np.ndarray:
    """Over-dispersed starts, (ensemble, walker, parameter).

    Each ensemble is drawn from the Gauss-Newton covariance about a center of its own, which is drawn from the same: twice the
    covariance in all, and far more of a noise scale, whose start is its prior. Importance-resampled draws would begin nearer,
    but with Pareto k at 0.5 they lack the far ends of bent ridges, and walkers spread into those no sooner than from here.
    """
    root = np.linalg.cholesky(start.covariance)
    centers = generator.standard_normal((settings.n_ensembles, 1, len(start.z)))
    walkers = generator.standard_normal((settings.n_ensembles, settings.walkers(len(start.z)), len(start.z)))
    return start.z + (centers + walkers) @ root.T


def sample(asked: Sampling, programs: WalkerPrograms, moves: Moves | None = None) -> Chain:
    """Sample by ensembles of walkers.

    Args:
        asked: What of, how long, and so on.
        programs: Compiled for batches of half of all walkers.
        moves: Proposals and their shares, to be made in z alone; `default_moves`, in all coordinates, if omitted.
    """
    settings, start, seed = asked.settings, asked.start, asked.seed
    points = starting_points(start, settings, np.random.default_rng([seed, 0])).reshape(-1, len(start.z))
    backend = Checkpointed(points.shape, asked.checkpoint, asked.resume)
    half = len(points) // 2
    log_density = _in_halves(programs.log_density, asked.posterior.data, half)
    frames = coordinates_of(asked.posterior, programs, half) if moves is None else [(Z(), 1.0)]
    moves = moves or default_moves(points.shape[1], settings.walkers(points.shape[1]))
    sweeps = [(Sweep(moves, coordinates, settings.n_ensembles), share) for coordinates, share in frames]
    sampler = emcee.EnsembleSampler(*points.shape, log_density, vectorize=True, backend=backend, moves=sweeps)
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
            sampler.run_mcmc(state, min(missing, _BLOCK), skip_initial_state_check=True)
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
        like = {"z": shape, "log_density": shape[:1], "accepted": shape[:1]} | _OF_RANDOM
        before = records(checkpoint, like) if checkpoint is not None and resume else []
        self.grow(len(before), None)
        for record in before:
            keys, (place, has_normal) = record["random_key"], (int(i) for i in record["random_place"])
            if checkpoint is not None and not 0 <= place <= len(keys):  # else the generator would read beyond its keys
                raise damaged_checkpoint(checkpoint)
            generator = "MT19937", keys, place, has_normal, float(record["random_normal"])
            state = emcee.State(record["z"], log_prob=record["log_density"], random_state=generator)
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
    kept = np.unique(np.linspace(stored // 2, stored - 1, min(stored, wanted)).round().astype(int))
    # In this order in memory, as in a loaded fit: sums must agree to the last bit.
    z = np.ascontiguousarray(np.asarray(backend.get_chain()[kept]).transpose(1, 0, 2))
    acceptance = float(np.mean(backend.accepted)) / stored
    chain = asked.chain_of(z, asked.settings.n_ensembles, steps=stored * THIN, acceptance=acceptance)
    too_short = f"the sampling took {stored * THIN} steps, and {_FIRST_LOOK * THIN} are the least that can be judged"
    first = (too_short,) if stored < _FIRST_LOOK else ()
    return replace(chain, reasons=(*first, *chain.reasons, *stuck_walkers(z)))
