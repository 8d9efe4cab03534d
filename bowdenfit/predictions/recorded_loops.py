"""What each draw says of a pull-pull loop's recording: the output force that the loop gives at the measured input force."""

from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.inference.compilation import compiled
from bowdenfit.measurements.recordings import Recordings
from bowdenfit.measurements.tables import AngleTable
from bowdenfit.models.build import Model
from bowdenfit.models.cable import resolve_angles, row_angles
from bowdenfit.models.recorded_blocks import recorded_angles
from bowdenfit.models.scatter import DELAY_ERROR, GAIN_ERROR, INPUT_OFFSET, OUTPUT_OFFSET
from bowdenfit.physics.loop import loop_play
from bowdenfit.predictions.recorded import DRAWS, blocks_shown

_LEAST_EXPONENT = 1e-9


class LoopFollower:
    """Follows all recordings of a loop with its play operator, for `DRAWS` draws at a time; compiled once.

    Args:
        model: The model.
        recordings: The recordings.
        angles: The angle table, for recordings outside the curves.
    """

    def __init__(self, model: Model, recordings: Recordings, angles: AngleTable | None) -> None:
        self._data = _arrays(model, recordings, angles)
        z = jax.ShapeDtypeStruct((DRAWS, model.space.size), jnp.float64)
        mounting = jax.ShapeDtypeStruct((DRAWS, len(recordings.each)), jnp.float64)
        function = jax.vmap(_followed(model), in_axes=(0, 0, None))
        self._program: Callable[..., Any] = compiled(function, z, mounting, self._data)

    def __call__(
        self, z: Float[np.ndarray, "draws free"], mounting: Float[np.ndarray, "draws recordings"]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Output force [N] of each draw, block and recording, and friction exponent [1] of each draw and recording.

        Args:
            z: `DRAWS` draws.
            mounting: Effect of the mounting on the friction exponent of each recording [1].
        """
        force, exponent = self._program(z, mounting, self._data)
        return np.asarray(force), np.asarray(exponent)


def _arrays(model: Model, recordings: Recordings, angles: AngleTable | None) -> dict[str, Any]:
    """Blocks of all recordings side by side, the shorter ones standing still at their end."""
    shown = [blocks_shown(len(r.blocks.time)) for r in recordings.each]
    longest = max(len(s) for s in shown)
    columns: dict[str, list[np.ndarray]] = {"input_force": [], "output_force": [], "drift": []}
    for recording, places in zip(recordings.each, shown, strict=True):
        blocks, room = recording.blocks, (0, longest - len(places))
        columns["input_force"].append(np.pad(blocks.input_force[places], room, "edge"))
        columns["output_force"].append(np.pad(blocks.output_force[places], room, "edge"))
        columns["drift"].append(np.pad(np.gradient(blocks.output_force, blocks.time)[places], room))
    rows = row_angles(model.cable, recorded_angles(recordings), angles).data
    return rows | {name: np.stack(parts, axis=1) for name, parts in columns.items()}


def _followed(model: Model) -> Callable[[Array, Array, Mapping[str, Any]], tuple[Array, Array]]:
    """Function of one z, of mounting effects and of the blocks."""
    cable = model.cable

    def follow(z: Array, mounting: Array, data: Mapping[str, Any]) -> tuple[Array, Array]:
        values = model.space.constrain(z)
        angles, _ = resolve_angles(cable, values, data)
        exponent, gain = cable.friction_exponent(values, angles), jnp.exp(values.get(GAIN_ERROR, jnp.zeros(())))
        preload = cable.elasticity.preload(values, jnp.sum(angles, axis=-1))[0]
        start = (data["output_force"][0] - values.get(OUTPUT_OFFSET, 0.0)) * gain
        force = data["input_force"] - values.get(INPUT_OFFSET, 0.0)
        y = loop_play(force, preload, jnp.maximum(exponent + mounting, _LEAST_EXPONENT), start)
        shown = y / gain + values.get(OUTPUT_OFFSET, 0.0)
        return shown - values.get(DELAY_ERROR, 0.0) * data["drift"], exponent

    return follow
