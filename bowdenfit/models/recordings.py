"""Recordings: their sliding blocks as runs, or every block through the play operator.

Both ask for the same coefficients. A run's blocks say how large its friction exponent is; that of the cable is known from
it only up to what the mounting did to this run.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.stats import norm
from jaxtyping import Float

from bowdenfit.errors import DatasetError
from bowdenfit.measurements.preparation.play import play
from bowdenfit.measurements.recordings import Recording, Recordings
from bowdenfit.measurements.tables import AngleTable, OwnAngles
from bowdenfit.models.cable import Cable, resolve_angles, row_angles
from bowdenfit.models.runs import LEAST_FORCE, ROW_ARRAYS, RunsTerm, SlidingRows, run_sums
from bowdenfit.models.scatter import BLOCK_NOISE, DELAY_ERROR, GAIN_ERROR, INPUT_OFFSET, OUTPUT_OFFSET, RUN_SCATTER
from bowdenfit.physics.friction import transmission_efficiency
from bowdenfit.physics.hysteresis import play_operator_with_slope
from bowdenfit.physics.normal_tail import log_normal_cdf

NAME = "recorded_efficiency"
_MOST_BLOCKS = 600  # of one recording in the play operator; more say no more once noise is averaged
_LEAST_BAND = 1e-9
_NEAR_LIMIT = 0.005  # of the end of a range, within which a saturated reading is at it


@dataclass(frozen=True)
class RecordedAngles:
    """Where and at which wrap angles each recording was made; see `bowdenfit.models.cable.Measured`."""

    route: np.ndarray
    own: OwnAngles


def recorded_angles(recordings: Recordings) -> RecordedAngles:
    """Route values and own angles, one row a recording."""
    shape = (len(recordings.each), len(recordings.columns))
    angle, sd = (np.array([getattr(r, n) for r in recordings.each]).reshape(shape) for n in ("own_angle", "own_sd"))
    return RecordedAngles(np.array([r.route for r in recordings.each]), OwnAngles(recordings.columns, angle, sd))


def recordings_term(
    cable: Cable, recordings: Recordings, angles: AngleTable | None
) -> "RunsTerm | WholeRecordingsTerm":
    """The term of a data set's recordings, as its description wants them used.

    Raises:
        DatasetError: Whole recordings are wanted, and one has no reversal.
    """
    settings = cable.description.tables.recordings
    rows = row_angles(cable, recorded_angles(recordings), angles).data
    labels = tuple(_label(cable, recordings, run) for run in recordings.runs)
    if settings is None or settings.likelihood == "runs":
        parts = [_sliding_blocks(r) for r in recordings.each]
        return RunsTerm(cable, run_sums(cable, _rows(recordings, parts, rows)), labels, NAME, BLOCK_NOISE)
    for recording in recordings.each:
        _needs_reversal(recording)
    censored = settings.prepare.saturation == "censored" and any(r.blocks.saturated.any() for r in recordings.each)
    if not (cable.friction.options or cable.description.fits_offsets or censored):
        # On a scale that no parameter changes, the operator is linear in the exponent: it need not be run again.
        parts = [_all_blocks(r) for r in recordings.each]
        return RunsTerm(cable, run_sums(cable, _rows(recordings, parts, rows)), labels, NAME, BLOCK_NOISE)
    return WholeRecordingsTerm(cable, _padded(recordings, rows, censored), labels)


def _label(cable: Cable, recordings: Recordings, run: str) -> str:
    """Name of a run, with its route value where it has just one and does not say it itself."""
    route, at = cable.description.route, {r.route for r in recordings.each if r.run == run}
    where = f"{min(at):g} {route.unit}" if route is not None and len(at) == 1 else ""
    return f"{run} ({where})" if where and where not in run else run


def _needs_reversal(recording: Recording) -> None:
    if len(set(recording.strokes.stroke) - {0}) < 2:
        raise DatasetError(
            f"{recording.file}: the recording {recording.name!r} has no reversal, and the play operator has nothing to show "
            'without one; record a pull and a return, or set likelihood = "runs" for the recordings.'
        )


@dataclass(frozen=True)
class _Part:
    """Blocks of one recording that enter: indices, stroke, log ratio, worth."""

    used: np.ndarray
    stroke: np.ndarray
    log_ratio: np.ndarray
    worth: np.ndarray


def _positive(recording: Recording) -> np.ndarray:
    blocks = recording.blocks
    return ~blocks.saturated & (blocks.input_force > 0) & (blocks.output_force > 0)


def _worth(recording: Recording, used: np.ndarray) -> np.ndarray:
    """What each block is worth: in proportion to its samples, and less where deviations stay alike for long."""
    samples = recording.blocks.samples[used].astype(float)
    return samples / recording.blocks.samples.mean() / recording.strokes.correlation


def _sliding_blocks(recording: Recording) -> _Part:
    """Blocks in which the rope slides, with their log ratio."""
    used = np.flatnonzero(recording.strokes.used_sliding & _positive(recording))
    stroke, blocks = recording.strokes.stroke[used], recording.blocks
    ratio = stroke * np.log(blocks.input_force[used] / blocks.output_force[used])
    return _Part(used, stroke, ratio, _worth(recording, used))


def _all_blocks(recording: Recording) -> _Part:
    r"""Every block after the rope first slid, as the log ratio it would show had it gone on sliding.

    Between contacts the output stands still where the last stroke left it, :math:`y = y(\hat\Lambda) - s (\Lambda -
    \hat\Lambda)`; so every block reads the friction exponent of the stroke before it.
    """
    positive, blocks, strokes = _positive(recording), recording.blocks, recording.strokes
    x, y = np.log(blocks.input_force[positive]), np.log(blocks.output_force[positive])
    followed, (state, last) = _followed_in_parts(recording, positive, x, y)
    inside = _inside_phase(state)
    kept = (last != 0) & inside
    used, stroke = np.flatnonzero(positive)[kept], last[kept]
    ratio = strokes.exponent - stroke * (y - followed)[kept]
    force_in, force_out = blocks.input_force[used], blocks.output_force[used]
    of_output_alone = np.where(state[kept] == 0, 1 + (force_out / force_in) ** 2, 1.0)
    return _Part(used, stroke, ratio, _worth(recording, used) * of_output_alone * _standing_share(state)[kept])


def _inside_phase(state: np.ndarray) -> np.ndarray:
    """Blocks whose neighbors are in the same phase: at a corner a block's mean is of two phases."""
    same = np.diff(state) == 0
    return np.append(True, same) & np.append(same, True)


def _standing_share(state: np.ndarray) -> np.ndarray:
    """What a block is worth beside others of its phase: all of it while sliding, a share of one while standing still.

    The operator stands where the highest (or lowest) input left it, noise and all: every block of that phase has this one
    error in common, and together they are worth no more than one reading with twice the noise.
    """
    phase = np.append(0, np.cumsum(np.diff(state) != 0))
    return np.where(state == 0, 0.5 / np.bincount(phase)[phase], 1.0)


def _at_limit(recording: Recording, force: np.ndarray) -> np.ndarray:
    """Saturated blocks in which this of the two forces stands at the end of the range, as its saturated samples do."""
    ends = [end for end in recording.account.limits if np.isfinite(end)]
    near = [np.abs(force - end) <= _NEAR_LIMIT * max(abs(end), 1.0) for end in ends]
    return recording.blocks.saturated & (np.any(near, axis=0) if near else np.zeros(len(force), dtype=bool))


def _output_saturated(recording: Recording) -> np.ndarray:
    return _at_limit(recording, recording.blocks.output_force)


def _input_saturated(recording: Recording) -> np.ndarray:
    return _at_limit(recording, recording.blocks.input_force)


def _restarts(lost: np.ndarray) -> np.ndarray:
    """Blocks after a stretch whose input is not known: where the operator stands there must be read anew."""
    return ~lost & np.append(False, lost[:-1])


def _followed_in_parts(
    recording: Recording, kept: np.ndarray, x: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The operator over the kept blocks, and the last contact up to each, started anew where the input was not known."""
    starts = np.flatnonzero(np.append(True, _restarts(_input_saturated(recording))[kept][1:]))
    strokes, followed, state = recording.strokes, np.zeros(len(x)), np.zeros(len(x), dtype=int)
    last = np.zeros(len(x), dtype=int)
    for start, stop in zip(starts, [*starts[1:], len(x)], strict=True):
        part = slice(start, stop)
        followed[part], state[part] = play(x[part], strokes.exponent, float(y[start] + strokes.center))
        last[part] = _last_contact(state[part])
    return followed, np.stack([state, last])


def _last_contact(state: np.ndarray) -> np.ndarray:
    """The last contact up to each block; 0 before the first."""
    at = np.maximum.accumulate(np.where(state != 0, np.arange(len(state)), -1))
    return np.where(at >= 0, state[np.maximum(at, 0)], 0).astype(int)


def _drift(recording: Recording) -> np.ndarray:
    """Change of log F_out with time [1/s], by which a delay of its channel shifts it."""
    blocks = recording.blocks
    return np.gradient(np.log(np.maximum(blocks.output_force, LEAST_FORCE)), blocks.time)


def _rows(recordings: Recordings, parts: list[_Part], angles: Mapping[str, np.ndarray]) -> SlidingRows:
    """Blocks of all recordings as rows of runs."""
    of_recording = np.repeat(np.arange(len(parts)), [len(p.used) for p in parts])
    runs = recordings.runs

    def gathered(name: str) -> np.ndarray:
        pairs = zip(recordings.each, parts, strict=True)
        return np.concatenate([getattr(r.blocks, name)[p.used] for r, p in pairs])

    run = np.array([runs.index(r.run) for r in recordings.each])[of_recording]
    return SlidingRows(
        gathered("input_force"),
        gathered("output_force"),
        np.concatenate([p.log_ratio for p in parts]),
        np.concatenate([p.stroke for p in parts]).astype(int),
        run,
        gathered("velocity"),
        np.concatenate([p.stroke * _drift(r)[p.used] for r, p in zip(recordings.each, parts, strict=True)]),
        np.concatenate([p.worth for p in parts]),
        {name: angles[name][of_recording] for name in ROW_ARRAYS},
    )


@dataclass(frozen=True)
class WholeRecordingsTerm:
    r"""Likelihood of every block of whole recordings, one value a run.

    .. math:: y_t = \text{clip}(y_{t-1},\ x_t - \Lambda_t - m,\ x_t + \Lambda_t + m), \quad
              x = g(F_\text{in} - b_\text{in}), \quad
              \log F_\text{out} = \log\left(g^{-1}(y) e^{-\gamma} + b_\text{out}\right) + e

    with the offsets b and gain error gamma of the load cells. The output is linear in the mounting effect m but for
    changes of contact, so that m integrates out in closed form at the value that suits the recording best (two passes of
    the operator: one to find it, one to linearize there).

    Args:
        cable: The cable.
        data: Arrays over time and recordings (forces, velocity, weight), over recordings and over runs.
        labels: Each run in words.
    """

    cable: Cable
    data: dict[str, Any]
    labels: tuple[str, ...]
    name: str = NAME
    unit: str = "1"
    noise: str = RUN_SCATTER
    reading_noise: str = BLOCK_NOISE

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """Runs scatter by their mounting; the blocks of a run about it by the load cells."""
        runs, blocks = len(self.labels), self.data["weight"].size
        return ((runs, runs), (blocks, max(int(np.sum(self.data["n"])) - runs, 1)))

    def _followed(
        self, values: Mapping[str, Array], data: Mapping[str, Any], exponent: Array, mounting: Array
    ) -> tuple[Float[Array, "time recordings"], Float[Array, "time recordings"]]:
        """Deviation of log F_out from the operator's output, and the output's derivative by the exponent."""
        friction, gain = self.cable.friction, values.get(GAIN_ERROR, 0.0)
        input_force = jnp.maximum(data["input_force"] - values.get(INPUT_OFFSET, 0.0), LEAST_FORCE)
        seen = jnp.maximum(data["output_force"] - values.get(OUTPUT_OFFSET, 0.0), LEAST_FORCE) * jnp.exp(gain)
        band = jnp.maximum(exponent * friction.rate(values, data["velocity"]) + mounting, _LEAST_BAND)
        x, stands = friction.scaled(values, input_force), friction.scaled(values, seen)
        y, slope = play_operator_with_slope(x, band, stands[0], jnp.where(data["restart"], stands, jnp.nan))
        output_force = jnp.maximum(friction.force(values, y), LEAST_FORCE)
        shown = jnp.maximum(output_force * jnp.exp(-gain) + values.get(OUTPUT_OFFSET, 0.0), LEAST_FORCE)
        loading = slope * jnp.exp(-gain) / (friction.slope(values, output_force) * shown)
        late = values.get(DELAY_ERROR, 0.0) * data["drift"]
        return data["log_output"] + late - jnp.log(shown), loading

    def _deviations(
        self, values: Mapping[str, Array], data: Mapping[str, Any], weights: Mapping[str, Array]
    ) -> tuple[Array, Array, Array, Array, Array]:
        """Deviations from each run's own mounting effect; that effect, its sd, its information; the cable's exponent."""
        angles, variance = resolve_angles(self.cable, values, data)
        exponent = self.cable.friction_exponent(values, angles)
        typical = exponent * self.cable.friction.rate(values, data["speed"])
        guess = jnp.zeros_like(typical)
        if not self.cable.friction.depends_on_load:  # else the loop's width means another exponent at every scale
            guess = data["exponent"] - typical
        deviation, loading = self._followed(values, data, exponent, guess)
        by_recording = jnp.sum(data["weight"] * loading**2, axis=0)
        step = jnp.sum(data["weight"] * loading * deviation, axis=0) / jnp.maximum(by_recording, 1e-30)
        reach = 0.5 * data["exponent"]
        guess = guess + jnp.clip(step, -reach, reach)
        deviation, loading = self._followed(values, data, exponent, guess)
        deviation = deviation + loading * guess
        total = self._per_run(data, data["weight"] * loading**2)
        mounting = self._per_run(data, data["weight"] * loading * deviation) / total
        of_angles = self.cable.exponent_variance(weights, angles, variance)
        from_angles = self._per_run(data, data["weight"] * loading**2 * of_angles) / total
        sd = jnp.sqrt(weights[RUN_SCATTER] ** 2 + from_angles + weights[self.reading_noise] ** 2 / total)
        return deviation - loading * mounting[data["run"]], mounting, sd, total, typical

    def _per_run(self, data: Mapping[str, Any], blocks: Float[Array, "time recordings"]) -> Float[Array, " runs"]:
        """Sum over the blocks of each run."""
        return jnp.zeros_like(data["n"]).at[data["run"]].add(jnp.sum(blocks, axis=0))

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs"]:
        """Log likelihood of each run, all blocks together."""
        within, mounting, sd, total, _ = self._deviations(values, data, values)
        noise, n = values[self.reading_noise], data["n"]
        scatter = self._per_run(data, data["weight"] * within**2)
        constant = (data["log_weights"] - jnp.log(total) - (n - 1) * jnp.log(2 * jnp.pi)) / 2
        inside = constant - (n - 1) * jnp.log(noise) - scatter / (2 * noise**2)
        return inside + norm.logpdf(mounting, 0.0, sd) + self._censored(data, within, noise)

    def _censored(self, data: Mapping[str, Any], within: Array, noise: Array) -> Float[Array, " runs"]:
        """Log probability that a saturated output lies beyond the end of the range, where it was read."""
        log_probability = log_normal_cdf(self._beyond(data, within, noise)) * data["share"]
        return self._per_run(data, jnp.where(data["censored"] != 0, log_probability, 0.0))

    def _beyond(self, data: Mapping[str, Any], within: Array, noise: Array) -> Float[Array, "time recordings"]:
        """How far beyond the end of the range the output is expected, in standard deviations of a block."""
        return data["censored"] * -within * data["output_force"] / noise

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs_and_blocks"]:
        """Standardized residuals: between runs, and of the blocks of a run."""
        within, mounting, sd, _, _ = self._deviations(values, data, jax.lax.stop_gradient(dict(values)))
        inside = jnp.sqrt(data["weight"]) * within / jax.lax.stop_gradient(values[self.reading_noise])
        beyond = self._beyond(data, within, jax.lax.stop_gradient(values[self.reading_noise]))
        # Beyond 30 sd the root is 0 to the last digit, and its derivative would be 0 times infinity.
        root = jnp.sqrt(-2 * data["share"] * log_normal_cdf(jnp.minimum(beyond, 29.0)) + 1e-300)
        censored = jnp.where((data["censored"] != 0) & (beyond < 30.0), root, 0.0)
        return jnp.concatenate([mounting / jax.lax.stop_gradient(sd), (inside + censored).ravel()])

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs"]:
        """Expected efficiency of each run, the effect of its mounting left out [1]."""
        return transmission_efficiency(self._of_run(self._deviations(values, data, values)[4]))

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " runs"]:
        """Efficiency of each run as the bench would give it [1]."""
        _, _, sd, _, typical = self._deviations(values, data, values)
        return transmission_efficiency(self._of_run(typical) + sd * jax.random.normal(key, sd.shape))

    def _of_run(self, of_recording: Array) -> Array:
        """Mean over the recordings of each run."""
        run, runs = jnp.asarray(self.data["run"]), len(self.labels)
        counts = jnp.zeros(runs).at[run].add(1.0)
        return jnp.zeros(runs).at[run].add(of_recording) / counts

    def observed(self) -> np.ndarray:
        """Efficiency of each run by the width of its own hysteresis loop [1]."""
        run, exponent = self.data["run"], self.data["exponent"]
        return np.exp(-np.bincount(run, exponent) / np.bincount(run))


def _padded(recordings: Recordings, angles: Mapping[str, np.ndarray], censored: bool) -> dict[str, Any]:
    """Arrays over time and recordings; the shorter ones stand still at their end, with no weight."""
    parts = [_thinned(r, censored) for r in recordings.each]
    longest = max(len(p["weight"]) for p in parts)

    def padded(name: str, mode: str) -> np.ndarray:
        return np.stack([np.pad(p[name], (0, longest - len(p[name])), mode) for p in parts], axis=1)  # type: ignore[call-overload]

    runs = recordings.runs
    run = np.array([runs.index(r.run) for r in recordings.each])
    held = {name: padded(name, "edge") for name in ("input_force", "output_force", "velocity")}
    free = {name: padded(name, "constant") for name in ("weight", "worth", "censored", "share", "drift", "restart")}
    worth = free.pop("worth")
    counted = free["weight"] > 0
    ratio = np.where(counted, free["weight"], 1.0) / np.where(counted, worth, 1.0)
    log_weights = np.where(counted, worth * np.log(ratio), 0.0)
    return {name: angles[name] for name in ROW_ARRAYS} | held | free | {
        "log_output": np.log(held["output_force"]),
        "run": run,
        "exponent": np.array([r.strokes.exponent for r in recordings.each]),
        "speed": np.array([p["speed"] for p in parts]),
        "n": np.bincount(run, worth.sum(axis=0)),
        "log_weights": np.bincount(run, log_weights.sum(axis=0)),
    }  # fmt: skip


def _thinned(recording: Recording, censored: bool) -> dict[str, Any]:
    """Blocks of one recording, joined inside their phases where there are many more than `_MOST_BLOCKS`."""
    blocks, strokes = recording.blocks, recording.strokes
    starts = _joined(strokes.stroke, _MOST_BLOCKS)
    samples = np.add.reduceat(blocks.samples, starts)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.add.reduceat(values * blocks.samples, starts) / samples

    def any_of(flags: np.ndarray) -> np.ndarray:
        return np.maximum.reduceat(flags, starts)

    force_in, force_out = (np.maximum(mean(f), LEAST_FORCE) for f in (blocks.input_force, blocks.output_force))
    off, saturated = _input_saturated(recording), _output_saturated(recording)
    lost, each = any_of(off), _worth(recording, np.arange(len(blocks.time)))
    counted = _positive(recording) & ~off & _inside_phase(strokes.stroke)
    worth = np.add.reduceat(each * counted * _standing_share(strokes.stroke), starts) * ~lost
    weight = worth / (np.where(strokes.stroke[starts] == 0, 0.0, 1 / force_in**2) + 1 / force_out**2)
    low, high = recording.account.limits
    end = np.where(force_out > (low + high) / 2 if np.isfinite(low + high) else np.isfinite(high), 1.0, -1.0)
    beyond = any_of(saturated & censored) & ~lost
    speed = np.abs(blocks.velocity[strokes.used_sliding])
    return {
        "input_force": force_in,
        "output_force": force_out,
        "velocity": mean(blocks.velocity),
        "weight": weight,
        "worth": worth,
        "restart": _restarts(lost),
        "drift": np.gradient(np.log(force_out), mean(blocks.time)),
        "censored": np.where(beyond, end, 0.0),
        "share": np.where(beyond, np.add.reduceat(each * saturated, starts), 0.0),
        "speed": float(speed.mean()) if len(speed) else float("nan"),
    }


def _joined(state: np.ndarray, most: int) -> np.ndarray:
    """First block of each group of blocks that are joined: of one phase only, its first and last block always alone.

    The operator stands where the end of a stroke left it, so the ends must not be averaged away.
    """
    factor = -(-len(state) // most)
    if factor == 1:
        return np.arange(len(state))
    phase = np.append(0, np.cumsum(np.diff(state) != 0))
    first = np.append(True, np.diff(phase) != 0)
    last = np.append(first[1:], True)
    place = np.arange(len(state)) - np.maximum.accumulate(np.where(first, np.arange(len(state)), 0))
    return np.flatnonzero(first | last | (place % factor == 1))
