"""Recordings in the likelihood, and simulated anew: their sliding blocks as runs, or every block through the play operator.

Both likelihoods need the same coefficients. A run's blocks show how large its friction exponent is; that of the cable is known
from it only up to the effect of this run's mounting.

Recordings are simulated at the level of prepared blocks. The input force of every block is kept, smoothed, and stands for the
true one; the play operator of a cable with known coefficients makes the output force of it, errors of all sensors and the noise
of blocks are added, and the strokes are identified again as a reader does. What happens before blocks are made (clipping,
spikes, sampling) is not simulated.
"""

from collections.abc import Mapping
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from typing_extensions import override

from bowdenfit.cable.cable import CableContacts
from bowdenfit.cable.conditions import LEAST_SHARE
from bowdenfit.cable.drive import LoopDrive, RopeDrive, make_drive
from bowdenfit.cable.friction_options import FRICTION_OPTIONS, friction_options
from bowdenfit.cable.sensors import BLOCK_NOISE, DELAY_ERROR, RUN_SCATTER, LoadCells
from bowdenfit.description import Description
from bowdenfit.errors import DatasetError
from bowdenfit.kinds.recordings.blocks import (
    RECORDED,
    SelectedBlocks,
    block_steps,
    effective_counts,
    find_restarts,
    is_input_saturated,
    is_inside_phase,
    is_under_tension,
    output_drift,
    pad_columns,
    select_sliding_blocks,
    smooth_forces,
    standing_share,
)
from bowdenfit.kinds.recordings.reader import RecordingsTable, angles_of_recordings
from bowdenfit.kinds.recordings.turns import TurnsTerm, stack_turns
from bowdenfit.kinds.recordings.whole_recordings import (
    LoopRecordingsTerm,
    WholeRecordingsTerm,
    make_loop_recordings_term,
    stack_rope_recordings,
)
from bowdenfit.kinds.row_angles import RowAngles, collect_row_angles
from bowdenfit.kinds.runs import RunsTerm, sum_runs
from bowdenfit.kinds.shared_parameters import (
    declare_gear,
    declare_noise_of_forces,
    declare_offsets,
    declare_preload,
    declare_run_scatter,
)
from bowdenfit.kinds.sliding_rows import SlidingRows
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.kinds.term import Circumstances, Term, TermKind, Truth
from bowdenfit.parameters.priors import Normal
from bowdenfit.parameters.space import Parameter
from bowdenfit.recordings.preparation.hysteresis import clear_of_turns, last_contact, play, smooth_input
from bowdenfit.recordings.recording import Blocks, Recording, Recordings, Strokes
from bowdenfit.recordings.strokes import cable_of, find_strokes

_MOSTLY = 0.9  # share of blocks under tension from which a refusal does not speak of tension; a judgement
_NO_TENSION = (
    "while the rope slides no block has both forces above 0 inside the cells' ranges; the usual causes are a wrong tare, "
    "swapped or inverted channels, or a pull that barely moved: look at it with `bowdenfit check FILE`"
)
_NO_SLIDING = (
    "nothing shows that the rope slides: the forces neither make a loop nor rise together at both ends, and no velocity says "
    "that the motor moves. Record through a reversal, map the velocity, or say where it slides under its [[recording]], "
    'strokes = [{ start = ..., end = ..., stroke = "pull" }]'
)


class RecordingTerms(TermKind[Recordings]):
    """Recordings in the likelihood."""

    name = "recordings"
    shows_mounting_scatter = True

    @override
    def terms(self, cable: CableContacts, table: Recordings, angles: AngleTable | None) -> tuple[Term]:
        return (make_recordings_term(cable, table, angles),)

    @override
    def parameters(self, table: Recordings, at: Circumstances) -> list[Parameter]:
        """Return scatter of mountings, noise of blocks, errors of the load cells, and the preload of a loop."""
        late = table.delay_sd
        if late > 0 and at.cable.friction.depends_on_rate and not table.loop:  # it was estimated as if it did not
            late = float(np.hypot(late, at.defaults.stribeck * table.time_of_loss(LEAST_SHARE)))
        block_noise = declare_noise_of_forces(at, BLOCK_NOISE, r"$\sigma_B$", "standard deviation of a block's mean force")
        delay = Parameter(
            DELAY_ERROR, r"$\delta$", "error of the estimated delay between the load cells' channels", "sensor",
            Normal(0.0, late), "ms", 1000.0, prior_words=f"Normal(0, {1000 * late:.3g} ms)",
        )  # fmt: skip
        of_loop = declare_preload(at) if at.cable.is_loop else []
        of_input = [*declare_offsets(at), *declare_gear(at)]
        return [*of_loop, declare_run_scatter(at), block_noise, *of_input, *([delay] if late > 0 else [])]

    @override
    def draw(self, table: Recordings, truth: Truth) -> dict[str, Array]:
        return draw_recordings(table, truth)

    @override
    def with_readings(self, description: Description, table: Recordings, readings: Mapping[str, np.ndarray]) -> Recordings:
        return replace_forces(description, table, readings)

    @override
    def check_drawable(self, description: Description, table: Recordings) -> None:
        refuse_saturated(table)

    @override
    def events(self, term: Term, description: Description) -> np.ndarray:
        """Return how many blocks each run has and how they were chosen: a run is the likelihood of all its blocks."""
        if term.name != RECORDED:
            return super().events(term, description)
        settings = description.table(RecordingsTable)
        whole = float(settings is not None and settings.likelihood == "whole")
        return np.column_stack([term.data.n, np.full(len(term.labels), 2.0 if isinstance(term, TurnsTerm) else whole)])

    @override
    def why_events_differ(self, readings: str, descriptions: Mapping[str, Description]) -> str:
        if readings != RECORDED:
            return super().why_events_differ(readings, descriptions)
        of_turns = [
            any(FRICTION_OPTIONS[name].of_turns for name in friction_options(d.friction_model)) for d in descriptions.values()
        ]
        if len(set(of_turns)) > 1:
            return (
                "friction that builds up after a turn is seen in blocks that the other fits do not count; what dahl and lugre "
                "are compared with is a fit with --friction play, or play with other options, such as play+rate-dependent"
            )
        if len({table.likelihood for d in descriptions.values() if (table := d.table(RecordingsTable))}) > 1:
            return (
                "some fits take the sliding blocks of runs and others whole recordings, which are not the same readings"
            )
        return (
            "the fits do not count the same blocks of them, because they prepare them differently, or because friction that "
            'depends on load or speed takes another way through whole recordings; likelihood = "runs" counts them alike'
        )


def make_recordings_term(
    cable: CableContacts, recordings: Recordings, angles: AngleTable | None
) -> RunsTerm | WholeRecordingsTerm | LoopRecordingsTerm:
    """Return the term of a data set's recordings, used as its description says; those of a loop are always whole.

    Raises:
        DatasetError: Whole recordings are wanted, and one has no reversal; or in a run no block can be used.
    """
    settings = cable.description.table(RecordingsTable)
    rows = collect_row_angles(cable.description, angles_of_recordings(recordings), angles)
    labels = tuple(_run_label(cable, recordings, run) for run in recordings.runs)
    if recordings.loop:
        censored = settings is not None and _is_censored(settings, recordings)
        return make_loop_recordings_term(cable, recordings, rows, labels, censored)
    noise_ratio = cable.description.sensors.noise_ratio
    if cable.friction.counts_turns:
        _require_reversals(recordings)
        censored = settings is not None and _is_censored(settings, recordings)
        return TurnsTerm(cable, stack_turns(recordings, rows, censored, noise_ratio), labels)
    if settings is None or settings.likelihood == "runs":
        parts = [select_sliding_blocks(r, cable.description) for r in recordings.items]
        _require_blocks(recordings, parts)
        blocks = _make_sliding_rows(recordings, parts, rows)
        return RunsTerm(cable, sum_runs(cable, blocks), labels, RECORDED, BLOCK_NOISE, rows=blocks)
    _require_reversals(recordings)
    censored = _is_censored(settings, recordings)
    if not (cable.friction.options or cable.description.fits_offsets or censored):
        # On a scale that no parameter changes, the operator is linear in the exponent: it need not be run again.
        parts = [_select_all_blocks(r, noise_ratio) for r in recordings.items]
        _require_blocks(recordings, parts)
        blocks = _make_sliding_rows(recordings, parts, rows)
        return RunsTerm(cable, sum_runs(cable, blocks), labels, RECORDED, BLOCK_NOISE, rows=blocks)
    return WholeRecordingsTerm(cable, stack_rope_recordings(recordings, rows, censored, noise_ratio), labels)


def _is_censored(settings: RecordingsTable, recordings: Recordings) -> bool:
    """Return whether readings at the end of the range count as bounds, and there are any."""
    return settings.prepare.saturation == "censored" and any(r.blocks.saturated.any() for r in recordings.items)


def _run_label(cable: CableContacts, recordings: Recordings, run: str) -> str:
    """Return the name of a run, with its route value where it has just one and does not state it itself."""
    route, at = cable.description.route, {r.route for r in recordings.items if r.run == run}
    place = f"{min(at):g} {route.unit}" if route is not None and len(at) == 1 else ""
    return f"{run} ({place})" if place and place not in run else run


def _require_blocks(recordings: Recordings, parts: list[SelectedBlocks]) -> None:
    """Refuse runs without any block that the likelihood can use."""
    for run in recordings.runs:
        members = [r for r in recordings.items if r.run == run]
        if not any(len(p.used) for r, p in zip(recordings.items, parts, strict=True) if r.run == run):
            under_tension = np.concatenate([is_under_tension(r) for r in members]).mean() > _MOSTLY
            reason = _NO_SLIDING if under_tension else _NO_TENSION
            raise DatasetError(
                f"{members[0].file}: nothing of the run {run!r} can be used, because {reason}; or leave the recording out."
            )


def _require_reversals(recordings: Recordings) -> None:
    for recording in recordings.items:
        if len(set(recording.strokes.stroke) - {0}) < 2:
            raise DatasetError(
                f"{recording.file}: the recording {recording.name!r} has no reversal, and the play operator has nothing to "
                'show without one; record a pull and a return, or set likelihood = "runs" for the recordings, without the '
                "friction models play, dahl and lugre."
            )


def _select_all_blocks(recording: Recording, noise_ratio: float) -> SelectedBlocks:
    r"""Select every block after the rope first slid, as the log ratio it would show had it gone on sliding.

    Between contacts the output stands still where the last stroke left it, :math:`y = y(\hat\Lambda) - s (\Lambda -
    \hat\Lambda)`; so every block reads the friction exponent of the stroke before it.
    """
    kept_at, blocks, strokes = is_under_tension(recording), recording.blocks, recording.strokes
    x, y = np.log(blocks.input_force[kept_at]), np.log(blocks.output_force[kept_at])
    likely_in, likely_out = smooth_forces(blocks)
    moved = np.log(likely_in[kept_at])
    followed, (state, last) = _follow_in_parts(recording, kept_at, moved, y)
    followed += np.where(state != 0, x - moved, 0.0)
    inside = is_inside_phase(state)
    retained = (last != 0) & inside
    used, stroke = np.flatnonzero(kept_at)[retained], last[retained]
    ratio = strokes.exponent - stroke * (y - followed)[retained]
    slides = state[retained] != 0
    likely_in, likely_out = likely_in[used], likely_out[used]
    of_output_alone = np.where(slides, 1.0, 1 + (noise_ratio * likely_out / likely_in) ** 2)
    n_effective = (
        effective_counts(recording, used) * of_output_alone * standing_share(state, blocks.input_force[kept_at])[retained]
    )
    information = 1 / ((noise_ratio / likely_in) ** 2 + 1 / likely_out**2)
    return SelectedBlocks(used, stroke, blocks.input_force[used], blocks.output_force[used], ratio, n_effective, information)


def _follow_in_parts(
    recording: Recording, kept: np.ndarray, x: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the operator over the kept blocks, and the last contact up to each, restarted where the input was not known."""
    starts = np.flatnonzero(np.append(True, find_restarts(is_input_saturated(recording))[kept][1:])[: len(x)])
    strokes, followed, state = recording.strokes, np.zeros(len(x)), np.zeros(len(x), dtype=int)
    last = np.zeros(len(x), dtype=int)
    for start, stop in zip(starts, np.append(starts[1:], len(x))[: len(starts)], strict=True):
        part = slice(start, stop)
        followed[part], state[part] = play(x[part], strokes.exponent, float(y[start] + strokes.center))
        last[part], state[part] = last_contact(state[part]), clear_of_turns(state[part], x[part])
    return followed, np.stack([state, last])


def _make_sliding_rows(recordings: Recordings, parts: list[SelectedBlocks], angles: RowAngles) -> SlidingRows:
    """Return the blocks of all recordings as rows of runs."""
    of_recording = np.repeat(np.arange(len(parts)), [len(p.used) for p in parts])
    runs = recordings.runs

    def concatenate(name: str) -> np.ndarray:
        return np.concatenate([getattr(part, name) for part in parts])

    pairs = list(zip(recordings.items, parts, strict=True))
    return SlidingRows(
        concatenate("input_force"),
        concatenate("output_force"),
        concatenate("log_ratio"),
        concatenate("stroke").astype(int),
        np.array([runs.index(r.run) for r in recordings.items])[of_recording],
        np.concatenate([r.blocks.velocity[p.used] for r, p in pairs]),
        np.concatenate([p.stroke * output_drift(r)[p.used] for r, p in pairs]),
        concatenate("n_effective"),
        angles.select(of_recording),
        concatenate("information"),
    )


def draw_recordings(recordings: Recordings, truth: Truth) -> dict[str, jax.Array]:
    """Draw forces of every block (rows) of every recording (columns), padded to the longest, and the delay's error [s].

    All recordings of a run share the effect of its mounting. Noise is as the likelihood counts it: it stays alike from block
    to block for as long as a block is worth less than an independent reading, and blocks of fewer samples have more.

    Args:
        recordings: The recordings as measured.
        truth: True values and random key.
    """
    cable, values, scale = truth.cable, truth.values, truth.scale
    of_run, of_angles, of_input, of_output = jax.random.split(jax.random.fold_in(truth.key, 4), 4)
    angles, variance = truth.wrap_angles(angles_of_recordings(recordings))
    error = jnp.sqrt(variance) * jax.random.normal(of_angles, angles.shape)
    run = np.array([recordings.runs.index(r.run) for r in recordings.items])
    mounting = values[RUN_SCATTER] * truth.scatter(of_run, (len(recordings.runs),))[run]
    exponent = cable.friction_exponent(values, angles + scale * error)
    force = jnp.asarray(pad_columns([smooth_input(r.blocks.input_force) for r in recordings.items]))
    velocity = jnp.asarray(pad_columns([r.blocks.velocity for r in recordings.items]))
    step = jnp.asarray(pad_columns([block_steps(r.blocks.time) for r in recordings.items], "constant"))
    stroke = jnp.asarray(pad_columns([last_contact(r.strokes.contact) for r in recordings.items]), dtype=float)
    cells, drive = LoadCells.of(values), make_drive(cable, values, angles, velocity, exponent, step)
    at_least = jnp.maximum(force, drive.least_force)
    output, _ = drive.follow(at_least, scale * mounting, _start_positions(drive, recordings, at_least, scale * mounting))
    error_numbers = pad_columns(
        [number_shared_errors(len(r.blocks.time), r.strokes.correlation) for r in recordings.items]
    ).astype(int)
    fewer = jnp.asarray(pad_columns([np.sqrt(r.blocks.samples.mean() / r.blocks.samples) for r in recordings.items]))
    shape, noise = (error_numbers.max() + 1, len(recordings.items)), scale * values[BLOCK_NOISE] * fewer
    noises = ((cable.description.sensors.noise_ratio * noise, of_input), (noise, of_output))
    errors = [sd * jax.random.normal(k, shape)[error_numbers, np.arange(shape[1])] for sd, k in noises]
    return {
        "input_force": cells.shown_input(force, stroke) + errors[0],
        "output_force": cells.shown_output(output),
        "output_error": errors[1],
        "delay_error": jnp.asarray(scale * cells.delay_error),
    }


def _start_positions(drive: RopeDrive | LoopDrive, recordings: Recordings, force: jax.Array, mounting: jax.Array) -> jax.Array:
    """Return where the operator starts: a rope where it was in its band when measured, a loop at the measured force."""
    if isinstance(drive, LoopDrive):
        return jnp.array([r.blocks.output_force[0] for r in recordings.items])
    return drive.scaled(force)[0] + drive.band(mounting)[0] * np.array([_start_in_band(r) for r in recordings.items])


def _start_in_band(recording: Recording) -> float:
    """Return where in its friction band a recording starts, from -1 (pulling) to 1 (returning)."""
    blocks, strokes = recording.blocks, recording.strokes
    least = LEAST_SHARE * np.max(np.abs(blocks.input_force))
    ratio = np.log(max(blocks.output_force[0], least) / max(blocks.input_force[0], least))
    return float(np.clip((ratio + strokes.center) / strokes.exponent, -1.0, 1.0))


def number_shared_errors(blocks: int, correlation: float) -> np.ndarray:
    """Return which error each block has, so that means of blocks scatter as those of a `correlation`-th as many would.

    With errors shared by blocks in groups, the mean of N scatters by as much as that of N / c independent ones if c is the size
    of the group that a block is in, on average over blocks. So a share c - k of the blocks, with k the whole part of c, is in
    groups of k + 1, and the others in groups of k; squares of errors then scatter as those of N / c readings do, too.

    Args:
        blocks: How many.
        correlation: c, at least 1.
    """
    least = int(correlation)
    owed, starts, at = 0.0, [], 0
    while at < blocks:
        starts.append(at)
        more = int(owed + (correlation - least) * (least + 1) >= least + 1)
        owed += (correlation - least) * (least + more) - more * (least + 1)
        at += least + more
    return np.searchsorted(starts, np.arange(blocks), "right") - 1


def replace_forces(description: Description, recordings: Recordings, readings: Mapping[str, np.ndarray]) -> Recordings:
    """Return the recordings with forces drawn by `draw_recordings`, their strokes identified again.

    What the likelihood takes a block to be worth is kept: how long deviations stay alike is not found anew.

    Args:
        description: The cable.
        recordings: The recordings as measured.
        readings: Arrays drawn by `draw_recordings`.

    Raises:
        DatasetError: Strokes cannot be found.
    """
    items = []
    for i, recording in enumerate(recordings.items):
        n, time = len(recording.blocks.time), recording.blocks.time
        shown, error = readings["output_force"][:n, i], readings["output_error"][:n, i]
        late = shown - float(readings["delay_error"]) * np.gradient(shown, time)
        force_in = readings["input_force"][:n, i]
        blocks = replace(recording.blocks, input_force=force_in, output_force=late + error, finer=None)
        strokes = _find_strokes_again(description, recording, blocks)
        items.append(replace(recording, blocks=blocks, strokes=strokes))
    return replace(recordings, items=tuple(items))


def _find_strokes_again(description: Description, recording: Recording, blocks: Blocks) -> Strokes:
    spans = [
        phase
        for entry in description.recording
        if entry.file == recording.file and recording.strokes.by_hand
        for phase in entry.strokes
    ]
    strokes = find_strokes(blocks, recording.file, recording.name, spans, cable_of(description))
    return replace(strokes, correlation=recording.strokes.correlation)


def refuse_saturated(recordings: Recordings) -> None:
    """Refuse recordings with readings at the end of a load cell's range.

    Raises:
        DatasetError: There are such; which ones would be with another friction is not known from blocks.
    """
    for recording in recordings.items:
        if recording.blocks.saturated.any():
            raise DatasetError(
                f"{recording.file}: {int(recording.blocks.saturated.sum())} blocks of the recording {recording.name!r} are at "
                "the end of a load cell's range, and what else would be clipped with another friction cannot be known from "
                "blocks; leave the recording out to calibrate."
            )
