"""Sampling with emcee: several independent ensembles of walkers, started apart, run until they agree.

Moves: emcee's stretch and differential evolution, and draws from a distribution fitted to the other walkers. A quarter of the
moves is made in z, a quarter in parameter values, and half in coordinates of the conditional posterior of friction
coefficients, unless these hardly help (`bowdenfit.inference.coordinates`). `DESnookerMove` is not used: in emcee 3.1.6 it does
not sample the given density, and all ensembles agree on the wrong answer.

emcee keeps the states and the random numbers. From one state to the next it makes one move, which is `THIN` steps of every
ensemble in one compiled program; with one call a step, more than half of the time was spent in Python. Each core moves
ensembles of its own, because one program for all of them used two cores in turns rather than at once.
"""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import emcee
import jax
import numpy as np

from bowdenfit.description import SamplerSettings
from bowdenfit.description.defaults import KEPT_PER_WALKER, THIN
from bowdenfit.inference.chain import Chain, Progress, SamplingRequest, describe_stuck_walkers, worst_diagnostics
from bowdenfit.inference.checkpoint import append_record, damaged_checkpoint_error, read_records
from bowdenfit.inference.least_squares import MaximumPosterior
from bowdenfit.inference.resources import ENSEMBLES_AT_ONCE, available_cores, linear_algebra_in_one_thread
from bowdenfit.inference.walkers import SweepChoices, WalkerPrograms

_BLOCK = 10  # stored states between two progress reports
# stored states before convergence is first checked; the slowest of five data sets has converged after half of that
_FIRST_CHECK = 60
_PATIENCE = 2 * _FIRST_CHECK  # stored states after which walkers that have not converged run `WalkerPrograms.later`
# shapes of the state of the random generator
_GENERATOR_SHAPES = {"random_key": (624,), "random_place": (2,), "random_normal": ()}


class EnsembleMove(emcee.moves.Move):
    """An emcee move: `THIN` steps of independent ensembles side by side; proposals stay within an ensemble.

    Each ensemble is split in two at random. In each step the positions of one half serve to propose positions for the other
    half, and then the other way round.

    Args:
        programs: Compiled programs of the walkers.
        data: Data of the density.
        n_ensembles: Number of ensembles; walkers are ordered by ensemble.
        stored: States stored so far.
    """

    def __init__(self, programs: WalkerPrograms, data: Any, n_ensembles: int, stored: int = 0) -> None:
        super().__init__()
        self.programs, self.data, self.n_ensembles, self.stored = programs, jax.device_put(data), n_ensembles, stored
        self.threads = ThreadPoolExecutor(min(available_cores(), n_ensembles, ENSEMBLES_AT_ONCE))

    def propose(self, model: Any, state: emcee.State) -> tuple[emcee.State, np.ndarray]:
        """Move every walker by `THIN` steps; return the state and the share of accepted proposals."""
        walkers, accepted = np.arange(len(state.coords)).reshape(self.n_ensembles, -1), np.zeros(len(state.coords))
        if self.programs.later is not None and self.stored >= _PATIENCE:
            self.programs = self.programs.later()
        self.stored, pending = self.stored + 1, []
        for ensemble in walkers:
            order = model.random.permutation(ensemble)
            choices = self.programs.shares.choose(model.random, state.coords[order].shape)
            pending.append((order, self.threads.submit(self._run_sweep, choices, state.coords[order])))
        for order, future in pending:  # into the state's own arrays: those of JAX are for reading
            state.coords[order], state.log_prob[order], accepted[order] = future.result()
        return state, accepted / THIN

    def _run_sweep(self, choices: SweepChoices, z: np.ndarray) -> Any:
        with jax.enable_x64(True):  # the setting is each thread's own
            return jax.block_until_ready(self.programs.sweep(choices, z, self.data))


def draw_starting_points(start: MaximumPosterior, settings: SamplerSettings, generator: np.random.Generator) -> np.ndarray:
    """Draw over-dispersed starts, (ensemble, walker, parameter).

    Each ensemble is drawn from the Gauss-Newton covariance about a center of its own, which is drawn from the same covariance:
    twice the covariance in all, and far more for a noise scale, whose start is its prior. Importance-resampled draws would
    start nearer, but with a Pareto k of 0.5 they lack the far ends of bent ridges, and walkers do not reach those any sooner.
    """
    root = np.linalg.cholesky(start.covariance)
    centers = generator.standard_normal((settings.n_ensembles, 1, len(start.z)))
    walkers = generator.standard_normal((settings.n_ensembles, settings.walkers(len(start.z)), len(start.z)))
    return start.z + (centers + walkers) @ root.T


def make_initial_state(points: np.ndarray, generator: np.random.RandomState) -> emcee.State:
    """Return the first state of emcee; a sweep computes the log densities itself."""
    return emcee.State(points, log_prob=np.zeros(len(points)), random_state=generator.get_state())


@linear_algebra_in_one_thread()
def sample(request: SamplingRequest, programs: WalkerPrograms, data: Any = None) -> Chain:
    """Sample with ensembles of walkers.

    Args:
        request: Posterior, start, settings and seed.
        programs: Compiled programs of the walkers.
        data: Data of the density; those of the posterior if omitted.
    """
    settings, start, seed = request.settings, request.start, request.seed
    data = request.posterior.data if data is None else data
    points = draw_starting_points(start, settings, np.random.default_rng([seed, 0])).reshape(-1, len(start.z))
    backend = CheckpointedBackend(points.shape, request.checkpoint, request.resume)
    moves = EnsembleMove(programs, data, settings.n_ensembles, int(backend.iteration))

    sampler = emcee.EnsembleSampler(*points.shape, request.posterior.log_density, backend=backend, moves=moves)
    generator = np.random.RandomState(np.random.MT19937(np.random.SeedSequence([seed, 1])))
    state = None if backend.iteration else make_initial_state(points, generator)
    limit = max(settings.max_steps // THIN, 2)
    target = _FIRST_CHECK
    while target < int(backend.iteration):  # the looks of a sampling that nothing interrupted
        target = _next_check(target)
    target = min(target, limit)
    worst: tuple[float | None, float | None] = (None, None)
    begin, stored_before = time.monotonic(), int(backend.iteration)
    while True:
        while (missing := target - int(backend.iteration)) > 0:
            sampler.run_mcmc(state, min(missing, _BLOCK), skip_initial_state_check=True)
            state = None
            stored = int(backend.iteration)
            seconds_left = (time.monotonic() - begin) * (target - stored) / (stored - stored_before)
            request.report(Progress(stored * THIN, settings.max_steps, *worst, seconds_left=seconds_left))
        chain = _summarize(request, backend)
        worst = worst_diagnostics(chain)
        request.report(Progress(chain.steps, settings.max_steps, *worst))
        if not chain.reasons or target >= limit:
            return chain
        target = min(_next_check(target), limit)


def _next_check(stored: int) -> int:
    """Return the number of stored states at the convergence check after one at `stored`."""
    return stored + stored // 3


class CheckpointedBackend(emcee.backends.Backend):
    """emcee's backend: states in memory, and in a checkpoint file.

    Args:
        shape: Numbers of walkers and parameters.
        checkpoint: The file; None for none.
        resume: Whether to continue from the states in the file.
    """

    def __init__(self, shape: tuple[int, ...], checkpoint: Path | None, resume: bool) -> None:
        super().__init__()
        self.reset(*shape)
        self.checkpoint: Path | None = None
        shapes = {"z": shape, "log_density": shape[:1], "accepted": shape[:1]} | _GENERATOR_SHAPES
        records_before = read_records(checkpoint, shapes) if checkpoint is not None and resume else []
        self.grow(len(records_before), None)
        for record in records_before:
            keys, (place, has_normal) = record["random_key"], (int(i) for i in record["random_place"])
            if checkpoint is not None and not 0 <= place <= len(keys):  # else the generator would read beyond its keys
                raise damaged_checkpoint_error(checkpoint)
            generator = "MT19937", keys, place, has_normal, float(record["random_normal"])
            state = emcee.State(record["z"], log_prob=record["log_density"], random_state=generator)
            self.save_step(state, record["accepted"])
        self.checkpoint = checkpoint

    def grow(self, ngrow: int, blobs: None) -> None:
        """Make room for more states, doubling each time because all states must be copied."""
        if ngrow > len(self.chain) - self.iteration:
            super().grow(max(ngrow, self.iteration), blobs)

    def save_step(self, state: emcee.State, accepted: np.ndarray) -> None:
        """Store a state, and the number of proposals accepted since the last one."""
        super().save_step(state, accepted)
        if self.checkpoint is not None:
            _, key, place, has_normal, normal = state.random_state
            append_record(
                self.checkpoint,
                {"z": state.coords, "log_density": state.log_prob, "accepted": np.asarray(accepted), "random_key": key,
                 "random_place": np.asarray([place, has_normal]), "random_normal": np.asarray(normal)},
            )  # fmt: skip


def _summarize(request: SamplingRequest, backend: emcee.backends.Backend) -> Chain:
    """Return draws from the second half of every walker's path, with their diagnostics."""
    stored = int(backend.iteration)
    n_kept = max(KEPT_PER_WALKER, 2 * request.settings.target_ess // backend.shape[0])
    retained = np.unique(np.linspace(stored // 2, stored - 1, min(stored, n_kept)).round().astype(int))
    # In this order in memory, as in a loaded fit: sums must agree to the last bit.
    z = np.ascontiguousarray(np.asarray(backend.get_chain()[retained]).transpose(1, 0, 2))
    acceptance = float(np.mean(backend.accepted)) / stored
    chain = request.make_chain(z, request.settings.n_ensembles, steps=stored * THIN, acceptance=acceptance)
    too_short = f"the sampling took {stored * THIN} steps, and convergence can only be judged after {_FIRST_CHECK * THIN}"
    first = (too_short,) if stored < _FIRST_CHECK else ()
    return replace(chain, reasons=(*first, *chain.reasons, *describe_stuck_walkers(z)))
