"""Whole recordings: every block through the play operator, the mounting effect integrated out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.load_cells import BLOCK_NOISE, LEAST_FORCE, RUN_SCATTER, LoadCells
from bowdenfit.cable.noise import noise_law, scatter
from bowdenfit.kinds.recordings.blocks import RECORDED, input_saturated, output_saturated, positive, restarts
from bowdenfit.kinds.recordings.mounting import (
    MOST_BLOCKS,
    Mounted,
    better_guess,
    joined,
    log_likelihood_of,
    mounted,
    residual_blocks_of,
    residuals_of,
    side_by_side,
    thinned,
)
from bowdenfit.kinds.resolve_angles import resolve_angles
from bowdenfit.physics.friction import transmission_efficiency
from bowdenfit.physics.hysteresis import play_operator_with_slope
from bowdenfit.recordings.recording import Recording, Recordings

__all__ = ["WholeRecordingsTerm", "joined", "padded"]

_MOST_BLOCKS = MOST_BLOCKS
_LEAST_BAND = 1e-9


@dataclass(frozen=True)
class WholeRecordingsTerm:
    r"""Likelihood of every block of whole recordings, one value a run.

    .. math:: y_t = \text{clip}(y_{t-1},\ x_t - \Lambda_t - m,\ x_t + \Lambda_t + m), \quad
              x = g(F_\text{in} - b_\text{in}), \quad
              \log F_\text{out} = \log\left(g^{-1}(y) e^{-\gamma} + b_\text{out}\right) + e

    with the offsets b and gain error gamma of the load cells. The output is linear in the mounting effect m but for
    changes of contact, so that m integrates out in closed form at the value that suits the recording best (two passes of
    the operator: one to find it, one to linearize there). With Student noise each run's mounting effect, with what noise adds
    to it, is a Student-t; the blocks scatter normally about their run.

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
        return residual_blocks_of(self.data, len(self.labels))

    def _followed(
        self, values: Mapping[str, Array], data: Mapping[str, Any], exponent: Array, mounting: Array
    ) -> tuple[Float[Array, "time recordings"], Float[Array, "time recordings"]]:
        """Deviation of log F_out from the operator's output, and the output's derivative by the exponent."""
        friction, cells = self.cable.friction, LoadCells.of(values)
        input_force = cells.true_input(data["input_force"], LEAST_FORCE)
        seen = cells.true_output(data["output_force"], LEAST_FORCE)
        band = jnp.maximum(exponent * friction.rate(values, data["velocity"]) + mounting, _LEAST_BAND)
        x, stands = friction.scaled(values, input_force), friction.scaled(values, seen)
        y, slope = play_operator_with_slope(x, band, stands[0], jnp.where(data["restart"], stands, jnp.nan))
        output_force = jnp.maximum(friction.force(values, y), LEAST_FORCE)
        shown = cells.shown_output(output_force, LEAST_FORCE)
        loading = cells.shown_change(slope) / (friction.slope(values, output_force) * shown)
        return data["log_output"] + cells.late(data["drift"]) - jnp.log(shown), loading

    def _deviations(
        self, values: Mapping[str, Array], data: Mapping[str, Any], weights: Mapping[str, Array]
    ) -> tuple[Mounted, Float[Array, " recordings"]]:
        """What the blocks say with the mounting integrated out, and the cable's exponent."""
        angles, variance = resolve_angles(self.cable, values, data)
        exponent = self.cable.friction_exponent(values, angles)
        typical = exponent * self.cable.friction.rate(values, data["speed"])
        guess = jnp.zeros_like(typical)
        if not self.cable.friction.depends_on_load:  # else the loop's width means another exponent at every scale
            guess = data["exponent"] - typical
        deviation, loading = self._followed(values, data, exponent, guess)
        guess = better_guess(data, guess, deviation, loading, 0.5 * data["exponent"])
        deviation, loading = self._followed(values, data, exponent, guess)
        of_angles = self.cable.exponent_variance(weights, angles, variance)
        noise = weights[self.reading_noise]
        return mounted(data, weights, noise, deviation + loading * guess, loading, of_angles), typical

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs"]:
        """Log likelihood of each run, all blocks together."""
        found, noise = self._deviations(values, data, values)[0], values[self.reading_noise]
        beyond = self._beyond(data, found.within, noise)
        return log_likelihood_of(data, found, noise, beyond, noise_law(self.cable.description))

    def _beyond(self, data: Mapping[str, Any], within: Array, noise: Array) -> Float[Array, "time recordings"]:
        """How far beyond the end of the range the output is expected, in standard deviations of a block."""
        return data["censored"] * -within * data["output_force"] / noise

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs_and_blocks"]:
        """Standardized residuals: between runs, and of the blocks of a run."""
        found = self._deviations(values, data, jax.lax.stop_gradient(dict(values)))[0]
        noise = jax.lax.stop_gradient(values[self.reading_noise])
        beyond = self._beyond(data, found.within, noise)
        return residuals_of(data, found, noise, beyond, noise_law(self.cable.description))

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs"]:
        """Expected efficiency of each run, the effect of its mounting left out [1]."""
        return transmission_efficiency(self._of_run(self._deviations(values, data, values)[1]))

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " runs"]:
        """Efficiency of each run as the bench would give it [1]."""
        found, typical = self._deviations(values, data, values)
        mounting = found.sd * scatter(key, found.sd.shape, self.cable.description)
        return transmission_efficiency(self._of_run(typical) + mounting)

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
    data = side_by_side(recordings, parts, angles, ("input_force", "output_force", "velocity"))
    return data | {
        "log_output": np.log(data["output_force"]),
        "exponent": np.array([r.strokes.exponent for r in recordings.each]),
        "speed": np.array([p["speed"] for p in parts]),
    }


def _thinned(recording: Recording, censored: bool) -> dict[str, Any]:
    """Blocks of one recording, joined inside their phases where there are many more than `_MOST_BLOCKS`."""
    blocks, strokes = recording.blocks, recording.strokes
    groups = thinned(recording, _MOST_BLOCKS)
    force_in, force_out = (np.maximum(groups.mean(f), LEAST_FORCE) for f in (blocks.input_force, blocks.output_force))
    off = input_saturated(recording)
    lost = groups.any_of(off)
    worth = groups.worth(positive(recording) & ~off, lost)
    standing = strokes.stroke[groups.starts] == 0
    weight = worth / (np.where(standing, 0.0, 1 / force_in**2) + 1 / force_out**2)
    speed = np.abs(blocks.velocity[strokes.used_sliding])
    return groups.censored(output_saturated(recording) & censored, force_out, lost) | {
        "input_force": force_in,
        "output_force": force_out,
        "velocity": groups.mean(blocks.velocity),
        "weight": weight,
        "worth": worth,
        "restart": restarts(lost),
        "drift": np.gradient(np.log(force_out), groups.mean(blocks.time)),
        "speed": float(speed.mean()) if len(speed) else float("nan"),
    }
