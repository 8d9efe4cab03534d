"""Recordings of a pull-pull loop: every block through the loop's play operator, and the mean force that each run loses."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.drive import Each, Loop
from bowdenfit.cable.load_cells import LoadCells
from bowdenfit.cable.noise import scatter
from bowdenfit.kinds.recordings.blocks_term import BlocksTerm, Data, Values
from bowdenfit.kinds.recordings.side_by_side import beside, group_blocks, side_by_side
from bowdenfit.physics.loop import loop_output_force
from bowdenfit.recordings.loop_strokes import loop_limits
from bowdenfit.recordings.recording import Recording, Recordings

RECORDED_LOSS = "recorded_loss"  # name of the readings of a loop's recordings in results
_LEAST_PRELOAD = 1e-6  # of the loads
_LARGEST_EXPONENT = 3.0  # that a recording's own loss is taken to mean, however small the preload
_REACH = 0.5  # of the friction exponent, that its first guess is corrected by


@dataclass(frozen=True)
class LoopRecordingsTerm(BlocksTerm):
    r"""Likelihood of every block of a loop's recordings, one value a run.

    .. math:: y_t = \text{clip}(y_{t-1},\ f_-(x_t),\ f_+(x_t)), \quad x = F_\text{in} - b_\text{in}, \quad
              F_\text{out} = y e^{-\gamma} + b_\text{out} + e, \quad e \sim \text{Normal}(0, \sigma_B / \sqrt{w})

    where f are the output forces of `bowdenfit.physics.loop.loop_band` moving forward and back, at the cable's preload and
    at the friction exponent Lambda + m of the run.

    The reading of a run in results is the mean force lost while it moves, over the blocks inside its phases of motion.
    """

    name: str = RECORDED_LOSS
    unit: str = "N"

    def _first_guess(self, drive: Loop, data: Data) -> tuple[Each, Each]:
        """That with which the loop is as wide as the recording's own; none where that is not known."""
        least = _LEAST_PRELOAD * self.cable.friction.conditions.load.value
        by_loss = data["loss"] / (2 * jnp.maximum(drive.preload, least))
        own = jnp.where(data["tells_loss"], jnp.minimum(by_loss, _LARGEST_EXPONENT), data["exponent"])
        guess = jnp.where(data["tells_loss"] | data["tells_exponent"], own - drive.exponent, 0.0)
        return guess, _REACH * (drive.exponent + guess)

    def _lost(self, values: Values, data: Data, drive: Loop, more: Each | float = 0.0) -> Float[Array, " runs"]:
        """Mean force lost in the blocks that move [N], with more friction exponent than the cable's."""
        cells, force = LoadCells.of(values), data["input_force"]
        stroke = jnp.sign(data["moving"])  # which also holds the weight of each block
        exponent = (drive.exponent + more)[None, :]
        output = loop_output_force(cells.true_input(force), drive.preload[None, :], exponent, stroke)
        return self._per_run(data, data["moving"] * (force - cells.shown_output(output)))

    def expected(self, values: Values, data: Data) -> Float[Array, " runs"]:
        """Expected mean force lost while each run moves, the effect of its mounting left out [N]."""
        return self._lost(values, data, self._drive(values, data)[0])

    def simulate(self, values: Values, data: Data, key: Array) -> Float[Array, " runs"]:
        """Mean force lost while each run moves as the bench would give it [N]."""
        drive = self._drive(values, data)[0]

        def lost(more: Array) -> Array:
            return self._lost(values, data, drive, more)

        mean, by_exponent = jax.jvp(lost, (jnp.zeros_like(drive.exponent),), (jnp.ones_like(drive.exponent),))
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
    noise_ratio = cable.description.sensors.noise_ratio
    parts = [_blocks(r, censored, noise_ratio) for r in recordings.each]
    data = side_by_side(recordings, parts, angles)
    moving = beside([p["moving"] for p in parts], "constant")
    of_run = np.bincount(data["run"], np.abs(moving).sum(axis=0))
    loss, exponent = (np.array([getattr(r.strokes, name) for r in recordings.each]) for name in ("drag", "exponent"))
    return LoopRecordingsTerm(
        cable,
        data
        | {
            "reading": data["output_force"],
            "newtons": np.ones_like(data["output_force"]),
            "moving": moving / np.maximum(of_run, 1)[data["run"]],
            "loss": np.nan_to_num(loss),
            "tells_loss": np.isfinite(loss),
            "exponent": np.nan_to_num(exponent),
            "tells_exponent": np.isfinite(exponent),
        },
        labels,
    )


def _blocks(recording: Recording, censored: bool, noise_ratio: float) -> dict[str, Any]:
    """Blocks of one recording, joined inside their phases where there are many.

    `moving` is the number of samples that show the loss, with the sign of the motion.
    """
    blocks, strokes, groups = recording.blocks, recording.strokes, group_blocks(recording)
    arrays = groups.arrays(Loop, ~blocks.saturated, censored)
    stroke = strokes.stroke[groups.starts]
    used = strokes.used_sliding & ~blocks.saturated
    return arrays | {
        "weight": arrays["worth"] / (1 + (noise_ratio * _input_share(recording, arrays["input_force"], stroke)) ** 2),
        "moving": stroke * np.add.reduceat(blocks.samples * used, groups.starts).astype(float),
    }


def _input_share(recording: Recording, force: np.ndarray, stroke: np.ndarray) -> np.ndarray:
    """How much of the input's noise each block's output has in it: what the recording's own loop passes on while it moves."""
    loss, exponent = (float(np.nan_to_num(value)) for value in (recording.strokes.drag, recording.strokes.exponent))
    taut = np.where(stroke > 0, loop_limits(force, loss, 0.0)[0], loop_limits(force, loss, 0.0)[1])
    moving = np.where(stroke > 0, loop_limits(force, loss, exponent)[0], loop_limits(force, loss, exponent)[1])
    growth = np.where(moving == taut, 1.0, np.exp(-stroke * np.sign(force) * exponent))
    return np.where(stroke == 0, 0.0, growth)
