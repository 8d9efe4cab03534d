"""Recordings of a pull-pull loop: every block through the loop's play operator, the mounting effect integrated out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.load_cells import BLOCK_NOISE, RUN_SCATTER, LoadCells
from bowdenfit.cable.noise import noise_law, scatter
from bowdenfit.kinds.recordings.blocks import input_saturated, output_saturated, restarts
from bowdenfit.kinds.recordings.mounting import (
    Mounted,
    better_guess,
    log_likelihood_of,
    mounted,
    per_run,
    residual_blocks_of,
    residuals_of,
    side_by_side,
    thinned,
)
from bowdenfit.kinds.resolve_angles import resolve_angles
from bowdenfit.physics.loop import loop_output_force
from bowdenfit.physics.loop_motion import loop_play_with_slope
from bowdenfit.recordings.loop_strokes import loop_limits
from bowdenfit.recordings.recording import Recording, Recordings

RECORDED_LOSS = "recorded_loss"  # name of the readings of a loop's recordings in results
_LEAST_EXPONENT = 1e-9
_LEAST_PRELOAD = 1e-6  # N
_LARGEST_EXPONENT = 3.0  # that a recording's own loss is taken to mean, however small the preload
_REACH = 0.5  # of the friction exponent, that its first guess is corrected by


@dataclass(frozen=True)
class LoopRecordingsTerm:
    r"""Likelihood of every block of a loop's recordings, one value a run.

    .. math:: y_t = \text{clip}(y_{t-1},\ f_-(x_t),\ f_+(x_t)), \quad x = F_\text{in} - b_\text{in}, \quad
              F_\text{out} = y e^{-\gamma} + b_\text{out} + e, \quad e \sim \text{Normal}(0, \sigma_B / \sqrt{w})

    where f are the output forces of `bowdenfit.physics.loop.loop_band` moving forward and back, at the cable's preload and
    at the friction exponent Lambda + m of the run. While the return side is taut the output is linear in the mounting
    effect m ~ Normal(0, tau) but for changes of contact; m integrates out in closed form at the value that suits the
    recording best, as `bowdenfit.kinds.recordings.whole.WholeRecordingsTerm` does; with Student noise it is a Student-t there.

    The reading of a run in results is the mean force lost while it moves, over the blocks inside its phases of motion.

    Args:
        cable: The cable.
        data: Arrays over time and recordings (forces, weight), over recordings and over runs.
        labels: Each run in words.
    """

    cable: Cable
    data: dict[str, Any]
    labels: tuple[str, ...]
    name: str = RECORDED_LOSS
    unit: str = "N"
    noise: str = RUN_SCATTER
    reading_noise: str = BLOCK_NOISE

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """Runs scatter by their mounting; the blocks of a run about it by the load cells."""
        return residual_blocks_of(self.data, len(self.labels))

    def _followed(
        self, values: Mapping[str, Array], data: Mapping[str, Any], preload: Array, exponent: Array
    ) -> tuple[Float[Array, "time recordings"], Float[Array, "time recordings"]]:
        """Deviation of F_out from the operator's output, and the output's derivative by the exponent [N]."""
        cells = LoadCells.of(values)
        stands = cells.true_output(data["output_force"])
        y, slope = loop_play_with_slope(
            cells.true_input(data["input_force"]),
            preload,
            jnp.maximum(exponent, _LEAST_EXPONENT),
            stands[0],
            jnp.where(data["restart"], stands, jnp.nan),
        )
        late = cells.late(data["drift"])
        return data["output_force"] + late - cells.shown_output(y), cells.shown_change(slope)

    def _state(
        self, values: Mapping[str, Array], data: Mapping[str, Any]
    ) -> tuple[Array, Array, Float[Array, "recordings contacts"], Float[Array, "recordings contacts"]]:
        """Preload, friction exponent, wrap angles and their variances of each recording."""
        angles, variance = resolve_angles(self.cable, values, data)
        preload = self.cable.elasticity.preload(values, jnp.sum(angles, axis=-1))[0]
        return preload, self.cable.friction_exponent(values, angles), angles, variance

    def _deviations(
        self, values: Mapping[str, Array], data: Mapping[str, Any], weights: Mapping[str, Array]
    ) -> Mounted:
        """What the blocks say with the mounting integrated out."""
        preload, exponent, angles, variance = self._state(values, data)
        guess = self._first_guess(data, preload, exponent)
        deviation, loading = self._followed(values, data, preload, exponent + guess)
        guess = better_guess(data, guess, deviation, loading, _REACH * (exponent + guess))
        deviation, loading = self._followed(values, data, preload, exponent + guess)
        of_angles = self.cable.exponent_variance(weights, angles, variance)
        return mounted(data, weights, weights[self.reading_noise], deviation + loading * guess, loading, of_angles)

    def _first_guess(self, data: Mapping[str, Any], preload: Array, exponent: Array) -> Float[Array, " recordings"]:
        """Mounting effect with which the loop is as wide as the recording's own; none where that is not known."""
        by_loss = data["loss"] / (2 * jnp.maximum(preload, _LEAST_PRELOAD))
        own = jnp.where(data["tells_loss"], jnp.minimum(by_loss, _LARGEST_EXPONENT), data["exponent"])
        return jnp.where(data["tells_loss"] | data["tells_exponent"], own - exponent, 0.0)

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs"]:
        """Log likelihood of each run, all blocks together."""
        found, noise = self._deviations(values, data, values), values[self.reading_noise]
        beyond = data["censored"] * -found.within / noise
        return log_likelihood_of(data, found, noise, beyond, noise_law(self.cable.description))

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs_and_blocks"]:
        """Standardized residuals: between runs, and of the blocks of a run."""
        found = self._deviations(values, data, jax.lax.stop_gradient(dict(values)))
        noise = jax.lax.stop_gradient(values[self.reading_noise])
        beyond = data["censored"] * -found.within / noise
        return residuals_of(data, found, noise, beyond, noise_law(self.cable.description))

    def _lost(
        self, values: Mapping[str, Array], data: Mapping[str, Any], preload: Array, exponent: Array
    ) -> Float[Array, " runs"]:
        """Mean force lost in the blocks that move [N]."""
        cells = LoadCells.of(values)
        stroke = jnp.sign(data["moving"])  # which also holds the weight of each block
        output = loop_output_force(cells.true_input(data["input_force"]), preload[None, :], exponent[None, :], stroke)
        return per_run(data, data["moving"] * (data["input_force"] - cells.shown_output(output)))

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Float[Array, " runs"]:
        """Expected mean force lost while each run moves, the effect of its mounting left out [N]."""
        return self._lost(values, data, *self._state(values, data)[:2])

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Float[Array, " runs"]:
        """Mean force lost while each run moves as the bench would give it [N]."""
        preload, exponent, _, _ = self._state(values, data)

        def lost(more: Array) -> Array:
            return self._lost(values, data, preload, exponent + more)

        mean, by_exponent = jax.jvp(lost, (jnp.zeros_like(exponent),), (jnp.ones_like(exponent),))
        sd = self._deviations(values, data, values).sd
        return mean + by_exponent * sd * scatter(key, mean.shape, self.cable.description)

    def observed(self) -> np.ndarray:
        """Mean force lost while each run moved [N]."""
        lost = self.data["moving"] * (self.data["input_force"] - self.data["output_force"])
        return np.bincount(self.data["run"], lost.sum(axis=0))


def loop_recordings_term(
    cable: Cable, recordings: Recordings, angles: Mapping[str, np.ndarray], labels: tuple[str, ...], censored: bool
) -> LoopRecordingsTerm:
    """The term of a loop's recordings.

    Args:
        cable: The cable.
        recordings: Its recordings.
        angles: `ROW_ARRAYS` of each recording.
        labels: Each run in words.
        censored: Whether a saturated output counts as one beyond the end of the range.
    """
    parts = [_blocks(r, censored) for r in recordings.each]
    data = side_by_side(recordings, parts, angles, ("input_force", "output_force"))
    moving = np.stack([np.pad(p["moving"], (0, len(data["weight"]) - len(p["moving"]))) for p in parts], axis=1)
    of_run = np.bincount(data["run"], np.abs(moving).sum(axis=0))
    loss, exponent = (np.array([getattr(r.strokes, name) for r in recordings.each]) for name in ("drag", "exponent"))
    return LoopRecordingsTerm(
        cable,
        data
        | {
            "moving": moving / np.maximum(of_run, 1)[data["run"]],
            "loss": np.nan_to_num(loss),
            "tells_loss": np.isfinite(loss),
            "exponent": np.nan_to_num(exponent),
            "tells_exponent": np.isfinite(exponent),
        },
        labels,
    )


def _blocks(recording: Recording, censored: bool) -> dict[str, Any]:
    """Blocks of one recording, joined inside their phases where there are many.

    `moving` is the number of samples that show the loss, with the sign of the motion.
    """
    blocks, strokes, groups = recording.blocks, recording.strokes, thinned(recording)
    force_in, force_out = groups.mean(blocks.input_force), groups.mean(blocks.output_force)
    off = input_saturated(recording)
    lost = groups.any_of(off)
    worth = groups.worth(~blocks.saturated & ~off, lost)
    stroke = strokes.stroke[groups.starts]
    used = strokes.used_sliding & ~blocks.saturated
    return groups.censored(output_saturated(recording) & censored, force_out, lost) | {
        "input_force": force_in,
        "output_force": force_out,
        "weight": worth / (1 + _input_share(recording, force_in, stroke) ** 2),
        "worth": worth,
        "restart": restarts(lost),
        "drift": np.gradient(force_out, groups.mean(blocks.time)),
        "moving": stroke * np.add.reduceat(blocks.samples * used, groups.starts).astype(float),
    }


def _input_share(recording: Recording, force: np.ndarray, stroke: np.ndarray) -> np.ndarray:
    """How much of the input's noise each block's output has in it: what the recording's own loop passes on while it moves."""
    loss, exponent = (float(np.nan_to_num(value)) for value in (recording.strokes.drag, recording.strokes.exponent))
    taut = np.where(stroke > 0, loop_limits(force, loss, 0.0)[0], loop_limits(force, loss, 0.0)[1])
    moving = np.where(stroke > 0, loop_limits(force, loss, exponent)[0], loop_limits(force, loss, exponent)[1])
    growth = np.where(moving == taut, 1.0, np.exp(-stroke * np.sign(force) * exponent))
    return np.where(stroke == 0, 0.0, growth)
