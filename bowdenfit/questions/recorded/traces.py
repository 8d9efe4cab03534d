"""Recordings as the fit follows them, sample by sample: predicted and fitted output force, and points of loops.

Output forces follow from the measured input force by the cable's play operator, for every draw.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.drive import LoopDrive, RopeDrive, make_drive
from bowdenfit.cable.sensors import BLOCK_NOISE, RUN_SCATTER, LoadCells, noise_law
from bowdenfit.inference.compilation import compile_program
from bowdenfit.inference.draws import for_each_value
from bowdenfit.kinds.recordings.blocks import RECORDED, block_steps, pad_columns
from bowdenfit.kinds.recordings.reader import angles_of_recordings
from bowdenfit.kinds.row_angles import collect_row_angles, resolve_angles
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.models import Model
from bowdenfit.questions.motor_gear import gear_factors, rope_measurements
from bowdenfit.recordings.preparation.hysteresis import last_contact, smooth_input
from bowdenfit.recordings.recording import Blocks, Recording, Recordings
from bowdenfit.results.record import Record, cached_per_fit, parameter_values, thinned_parameter_values

QUANTILES = (0.05, 0.5, 0.95)
DRAWS = 200  # draws that are followed, enough for the edges of a band
MOST_BLOCKS = 1000  # blocks of a recording in a figure
_MAX_MOUNTING = 0.1  # largest mounting effect of a run that is tried, either way; a judgement: mountings differ by less
_SAME_ANGLE = np.deg2rad(0.05)  # wrap angles that differ by less are shown as one


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


class RecordingFollower:
    """Follows all recordings of a data set with the cable's play operator, for `DRAWS` draws at a time; compiled once.

    Args:
        model: The model.
        recordings: The recordings.
        angles: The angle table, for recordings outside the curves.
    """

    def __init__(self, model: Model, recordings: Recordings, angles: AngleTable | None) -> None:
        steps = [_choose_steps(recording.blocks) for recording in recordings.items]
        self._shown = pad_columns([step.shown for step in steps])
        self._data = _step_arrays(model, recordings, angles, steps)
        values = {p.name: jax.ShapeDtypeStruct((DRAWS,), jnp.float64) for p in model.space.parameters}
        mounting = jax.ShapeDtypeStruct((DRAWS, len(recordings.items)), jnp.float64)
        function = jax.vmap(_make_follow_function(model), in_axes=(0, 0, None))
        self._program: Callable[..., Any] = compile_program(function, values, mounting, self._data, run_often=model.is_slow)

    def __call__(
        self, values: Mapping[str, np.ndarray], mounting: Float[np.ndarray, "draws recordings"]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the output force [N] of each draw, block and recording, and friction exponent [1] of each draw and recording.

        Args:
            values: Named values [internal units] of `DRAWS` draws.
            mounting: Effect of the mounting on the friction exponent of each recording [1].
        """
        force, exponent = self._program(values, mounting, self._data)
        return np.take_along_axis(np.asarray(force), self._shown[None], axis=1), np.asarray(exponent)


@cached_per_fit
def trace_recordings(fit: Record) -> tuple[RecordingTrace, ...]:
    """Trace every recording of a fit; empty without any."""
    recordings = rope_measurements(fit).table(Recordings)
    if recordings is None:
        return ()
    with jax.enable_x64(True):
        follower = RecordingFollower(fit.model, recordings, fit.dataset.measurements.table(AngleTable))
        predicted, exponent = _predict_forces(fit, recordings, follower)
        fitted = _fit_forces(fit, recordings, follower)
    recording_traces = []
    for i, recording in enumerate(recordings.items):
        block_numbers = choose_blocks(len(recording.blocks.time))
        forces = predicted[:, : len(block_numbers), i], fitted[: len(block_numbers), i]
        recording_traces.append(RecordingTrace(recording, recordings.loop, block_numbers, *forces, exponent[:, i]))
    return tuple(recording_traces)


def _predict_forces(fit: Record, recordings: Recordings, follower: RecordingFollower) -> tuple[np.ndarray, np.ndarray]:
    """Return quantiles of the output force with a new mounting, and of the friction exponent without."""
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


def _fit_forces(fit: Record, recordings: Recordings, follower: RecordingFollower) -> np.ndarray:
    """Return the output force with the mounting effect of each run that suits its recordings best, of a grid."""
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


def choose_blocks(n_blocks: int) -> np.ndarray:
    """Choose the blocks of a recording that are followed: all, or evenly spaced ones of a long recording."""
    return np.arange(0, n_blocks, -(-n_blocks // MOST_BLOCKS))


@dataclass(frozen=True)
class _Steps:
    """What the play operator of one recording follows: the chosen blocks, with a step more wherever the input turns.

    Args:
        block: Number of the block of each step.
        input_force: Likely input force of each step [N].
        shown: Numbers of the steps whose output is that of the chosen blocks.
    """

    block: np.ndarray
    input_force: np.ndarray
    shown: np.ndarray


def _choose_steps(blocks: Blocks) -> _Steps:
    """Choose the steps of a recording; the step more is at the lowest or highest input of the samples about a turn.

    After a valley the output stands at what the lowest input was, so that means of blocks, and blocks that are left out
    between those that are chosen, would put it too high.
    """
    chosen, likely = choose_blocks(len(blocks.time)), smooth_input(blocks.input_force)
    turn = likely if blocks.input_turn is None else likely + (blocks.input_turn - blocks.input_force)
    lowest, highest = np.minimum.reduceat(turn, chosen), np.maximum.reduceat(turn, chosen)
    heading = last_contact(np.sign(np.diff(likely[chosen], append=likely[-1])).astype(int))  # to the next force that differs
    turns = np.flatnonzero(heading[1:] * heading[:-1] < 0) + 1
    ends = [lowest[i - 1 : i + 2].min() if heading[i] > 0 else highest[i - 1 : i + 2].max() for i in turns]
    shown = np.arange(len(chosen)) + np.searchsorted(turns, np.arange(len(chosen)))
    return _Steps(np.insert(chosen, turns + 1, chosen[turns]), np.insert(likely[chosen], turns + 1, ends), shown)


def _step_arrays(
    model: Model, recordings: Recordings, angles: AngleTable | None, steps: Sequence[_Steps]
) -> dict[str, Any]:
    """Return the steps of all recordings side by side, the shorter ones standing still at their end."""
    chosen = list(zip(recordings.items, steps, strict=True))
    drive = LoopDrive if model.cable.is_loop else RopeDrive
    rates = [np.gradient(drive.reading(r.blocks.output_force), r.blocks.time)[s.block] for r, s in chosen]
    rows = collect_row_angles(model.description, angles_of_recordings(recordings), angles)
    held = {
        name: pad_columns([getattr(r.blocks, name)[s.block] for r, s in chosen])
        for name in ("input_force", "output_force", "velocity")
    }
    likely = pad_columns([step.input_force for step in steps])
    times = pad_columns([block_steps(r.blocks.time[s.block]) for r, s in chosen], "constant")
    return held | {"angles": rows, "likely_force": likely, "drift": pad_columns(rates, "constant"), "step": times}


def _make_follow_function(
    model: Model,
) -> Callable[[Mapping[str, Array], Array, Mapping[str, Any]], tuple[Array, Array]]:
    """Return the output force and exponent as a function of one draw's values, of mounting effects and of the blocks."""

    def follow(values: Mapping[str, Array], mounting: Array, data: Mapping[str, Any]) -> tuple[Array, Array]:
        angles = resolve_angles(model.cable, values, data["angles"])[0]
        drive = make_drive(model.cable, values, angles, data["velocity"], step=data["step"])
        cells, least = replace(LoadCells.of(values), gear=None), drive.least_force
        start = drive.scaled(cells.true_output(data["output_force"][0], least))
        output, _ = drive.follow(cells.true_input(data["likely_force"], least), mounting, start)
        return drive.without_delay(cells.shown_output(output), cells.late(data["drift"])), drive.exponent

    return follow


def estimate_run_efficiencies(fit: Record) -> dict[str, tuple[np.ndarray, float, float]]:
    """Return the efficiency of each run as expected, as measured, and the standard error of that from its readings alone."""
    recordings, posterior = fit.dataset.measurements.table(Recordings), fit.sampled
    assert recordings is not None  # the caller has traces of them
    term = next(t for t in fit.model.terms if t.name == RECORDED)
    factors = gear_factors(fit, term)
    observed = factors * term.observed()
    weight = np.asarray(getattr(term.data, "run_weight", np.full(len(observed), np.nan)), dtype=float)
    expected, sigma = factors * fit.least_squares.readings[RECORDED][None], float("nan")
    if posterior is not None:
        expected = factors * np.quantile(posterior.expected[RECORDED], QUANTILES, axis=(0, 1))
        sigma = float(np.median(posterior.values[BLOCK_NOISE]))
    sd = observed * sigma / np.sqrt(weight)
    return {run: (expected[:, i], float(observed[i]), float(sd[i])) for i, run in enumerate(recordings.runs)}


def collect_loop_points(fit: Record, contact: int | None = None) -> np.ndarray:
    """Return wrap angle [rad], input and output force [N] and stroke of every block of a loop, the smallest angle first.

    Args:
        fit: The fit.
        contact: Number of the contact whose wrap angle is meant; that of all contacts together if omitted.

    Returns:
        Four rows; no columns without such recordings.
    """
    recordings, parts = fit.dataset.measurements.table(Recordings), [np.zeros((4, 0))]
    if recordings is None or not recordings.loop:
        return parts[0]
    angles = _recording_angles(fit, recordings)
    angle = angles.sum(axis=1) if contact is None else angles[:, contact]
    order = np.argsort(angle, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(angle[order]) > _SAME_ANGLE) + 1):
        parts += [_recording_points(float(angle[group].mean()), recordings.items[i]) for i in group.tolist()]
    return np.concatenate(parts, axis=1)


def _recording_angles(fit: Record, recordings: Recordings) -> np.ndarray:
    """Return the wrap angles of each recording in each contact [rad], by the middle of the draws where curves give them."""
    cable, angles = fit.model.cable, fit.dataset.measurements.table(AngleTable)
    measured = collect_row_angles(cable.description, angles_of_recordings(recordings), angles)
    middle = {name: np.median(draws, keepdims=True) for name, draws in parameter_values(fit).items()}

    def angles_of(values: Mapping[str, jax.Array]) -> jax.Array:
        return resolve_angles(cable, values, jax.tree.map(jnp.asarray, measured))[0]

    with jax.enable_x64(True):
        angles_by_recording: np.ndarray = for_each_value(angles_of, middle)[0]
    return angles_by_recording


def _recording_points(angle: float, recording: Recording) -> np.ndarray:
    """Return the blocks of a recording that are readings, moving and at rest."""
    blocks, stroke = recording.blocks, recording.strokes.stroke * recording.strokes.used_sliding
    shown = choose_blocks(len(blocks.time))
    retained = shown[~blocks.saturated[shown]]
    return np.stack(
        [np.full(len(retained), angle), blocks.input_force[retained], blocks.output_force[retained], stroke[retained]]
    )
