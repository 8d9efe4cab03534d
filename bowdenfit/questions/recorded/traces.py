"""Predicted and fitted output force of each recording."""

from dataclasses import dataclass

import jax
import numpy as np

from bowdenfit.cable.sensors import RUN_SCATTER, noise_law
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.questions.recorded.equations import DRAWS, RecordingFollower, choose_blocks
from bowdenfit.recordings.recording import Recording, Recordings
from bowdenfit.results.record import Record, cached_per_fit, thinned_parameter_values

QUANTILES = (0.05, 0.5, 0.95)
_MAX_MOUNTING = 0.1  # mounting effects of a run that are looked at, either way


@dataclass(frozen=True)
class RecordingTrace:
    """One recording in the blocks that are shown, with its predicted and fitted output force.

    Args:
        recording: The recording.
        is_loop: Whether it is of a pull-pull loop, which has no efficiency that is the same at all loads.
        block_numbers: Numbers of the blocks that are shown.
        predicted: Output force [N] of each block that the cable gives at the measured input force, `QUANTILES` (first axis)
            over draws and over new mountings; one row, least squares', without draws.
        fitted: Output force [N] of each block with this run's own mounting effect.
        exponent: Friction exponent of the cable here, `QUANTILES`; one number without draws.
    """

    recording: Recording
    is_loop: bool
    block_numbers: np.ndarray
    predicted: np.ndarray
    fitted: np.ndarray
    exponent: np.ndarray

    @property
    def time(self) -> np.ndarray:
        """Middle of each block [s]."""
        return self.recording.blocks.time[self.block_numbers]

    @property
    def input_force(self) -> np.ndarray:
        """Mean force at the motor side in each block [N]."""
        return self.recording.blocks.input_force[self.block_numbers]

    @property
    def output_force(self) -> np.ndarray:
        """Mean force at the load side in each block [N]."""
        return self.recording.blocks.output_force[self.block_numbers]

    @property
    def stroke(self) -> np.ndarray:
        """+1 pulling, -1 returning, 0 switching or held."""
        return self.recording.strokes.stroke[self.block_numbers]

    @property
    def used(self) -> np.ndarray:
        """Whether each block lies safely inside a sliding phase."""
        return self.recording.strokes.used_sliding[self.block_numbers]

    @property
    def deviation(self) -> np.ndarray:
        """How far the output force is off the fitted one in the blocks that are used; see `_force_difference`."""
        return _force_difference(self.output_force, self.fitted, self.is_loop)[self.used]


@cached_per_fit
def trace_recordings(fit: Record) -> tuple[RecordingTrace, ...]:
    """Trace every recording of a fit; empty without any."""
    recordings = fit.dataset.measurements.table(Recordings)
    if recordings is None:
        return ()
    with jax.enable_x64(True):
        follower = RecordingFollower(fit.model, recordings, fit.dataset.measurements.table(AngleTable))
        predicted, exponent = _predicted(fit, recordings, follower)
        fitted = _fitted(fit, recordings, follower)
    recording_traces = []
    for i, recording in enumerate(recordings.items):
        block_numbers = choose_blocks(len(recording.blocks.time))
        forces = predicted[:, : len(block_numbers), i], fitted[: len(block_numbers), i]
        recording_traces.append(RecordingTrace(recording, recordings.loop, block_numbers, *forces, exponent[:, i]))
    return tuple(recording_traces)


def _predicted(fit: Record, recordings: Recordings, follower: RecordingFollower) -> tuple[np.ndarray, np.ndarray]:
    """Quantiles of the output force with a new mounting, and of the friction exponent without."""
    values, n = thinned_parameter_values(fit, DRAWS), len(recordings.items)
    if fit.sampled is None:
        force, exponent = follower(values, np.zeros((DRAWS, n)))
        return force[:1], exponent[:1]
    tau = fit.posterior.values[RUN_SCATTER].ravel() if RUN_SCATTER in fit.posterior.values else np.zeros(1)
    scatter = tau[np.linspace(0, len(tau) - 1, DRAWS).astype(int)]
    law, generator = noise_law(fit.dataset.description), np.random.default_rng([fit.provenance.seed, 4])
    mounting = scatter[:, None] * law.draw_with(generator, (DRAWS, n))
    force, exponent = follower(values, mounting)
    return np.quantile(force, QUANTILES, axis=0), np.quantile(exponent, QUANTILES, axis=0)


def _fitted(fit: Record, recordings: Recordings, follower: RecordingFollower) -> np.ndarray:
    """Output force with the mounting effect of each run that suits its recordings best, by looking at many."""
    center = {name: np.full(DRAWS, np.median(draws)) for name, draws in thinned_parameter_values(fit, DRAWS).items()}
    grid = np.linspace(-_MAX_MOUNTING, _MAX_MOUNTING, DRAWS)
    force, _ = follower(center, np.repeat(grid[:, None], len(recordings.items), axis=1))
    columns = []
    for i, recording in enumerate(recordings.items):
        block_numbers = choose_blocks(len(recording.blocks.time))
        used, measured = recording.strokes.used_sliding[block_numbers], recording.blocks.output_force[block_numbers]
        distance = np.abs(_force_difference(force[:, : len(block_numbers), i], measured, recordings.loop))
        columns.append(force[int(np.argmin(np.median(distance[:, used], axis=1))) if used.any() else 0, :, i])
    return np.stack(columns, axis=1)


def _force_difference(one: np.ndarray, other: np.ndarray, loop: bool) -> np.ndarray:
    """Return the log ratio of two forces; for a loop, whose forces pass through zero, their difference [N]."""
    return one - other if loop else np.log(np.maximum(one, 1e-3) / np.maximum(other, 1e-3))
