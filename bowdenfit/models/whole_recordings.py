"""Whole recordings: every block through the play operator, the mounting effect integrated out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.stats import norm
from jaxtyping import Float

from bowdenfit.measurements.recordings import Recording, Recordings
from bowdenfit.models.cable import Cable, resolve_angles
from bowdenfit.models.recorded_blocks import (
    RECORDED,
    input_saturated,
    inside_phase,
    output_saturated,
    positive,
    restarts,
    standing_share,
    worth_of,
)
from bowdenfit.models.runs import LEAST_FORCE, ROW_ARRAYS
from bowdenfit.models.scatter import BLOCK_NOISE, DELAY_ERROR, GAIN_ERROR, INPUT_OFFSET, OUTPUT_OFFSET, RUN_SCATTER
from bowdenfit.physics.friction import transmission_efficiency
from bowdenfit.physics.hysteresis import play_operator_with_slope
from bowdenfit.physics.normal_tail import log_normal_cdf

_MOST_BLOCKS = 600  # of one recording in the play operator; more say no more once noise is averaged
_LEAST_BAND = 1e-9


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
    name: str = RECORDED
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


def padded(recordings: Recordings, angles: Mapping[str, np.ndarray], censored: bool) -> dict[str, Any]:
    """Arrays over time and recordings; the shorter ones stand still at their end, with no weight."""
    parts = [_thinned(r, censored) for r in recordings.each]
    longest = max(len(p["weight"]) for p in parts)

    def side_by_side(name: str, mode: str) -> np.ndarray:
        return np.stack([np.pad(p[name], (0, longest - len(p[name])), mode) for p in parts], axis=1)  # type: ignore[call-overload]

    runs = recordings.runs
    run = np.array([runs.index(r.run) for r in recordings.each])
    held = {name: side_by_side(name, "edge") for name in ("input_force", "output_force", "velocity")}
    free = {
        name: side_by_side(name, "constant") for name in ("weight", "worth", "censored", "share", "drift", "restart")
    }
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
    starts = joined(strokes.stroke, _MOST_BLOCKS)
    samples = np.add.reduceat(blocks.samples, starts)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.add.reduceat(values * blocks.samples, starts) / samples

    def any_of(flags: np.ndarray) -> np.ndarray:
        return np.maximum.reduceat(flags, starts)

    force_in, force_out = (np.maximum(mean(f), LEAST_FORCE) for f in (blocks.input_force, blocks.output_force))
    off, saturated = input_saturated(recording), output_saturated(recording)
    lost, each = any_of(off), worth_of(recording, np.arange(len(blocks.time)))
    counted = positive(recording) & ~off & inside_phase(strokes.stroke)
    worth = np.add.reduceat(each * counted * standing_share(strokes.stroke), starts) * ~lost
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
        "restart": restarts(lost),
        "drift": np.gradient(np.log(force_out), mean(blocks.time)),
        "censored": np.where(beyond, end, 0.0),
        "share": np.where(beyond, np.add.reduceat(each * saturated, starts), 0.0),
        "speed": float(speed.mean()) if len(speed) else float("nan"),
    }


def joined(state: np.ndarray, most: int) -> np.ndarray:
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
