"""Output force of each recording by the play operator, for every draw, from the measured input force."""

from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.drive import LoopDrive, RopeDrive, make_drive
from bowdenfit.cable.sensors import LoadCells
from bowdenfit.inference.compilation import compile_program
from bowdenfit.kinds.recordings.blocks import pad_columns
from bowdenfit.kinds.recordings.reader import angles_of_recordings
from bowdenfit.kinds.row_angles import collect_row_angles, resolve_angles
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.model import Model
from bowdenfit.recordings.preparation.hysteresis import smooth_input
from bowdenfit.recordings.recording import Recordings

DRAWS = 200  # enough for the edges of a band
MOST_BLOCKS = 1000  # of a recording in a figure


def choose_blocks(n_blocks: int) -> np.ndarray:
    """Choose the blocks of a recording that are followed: all, or evenly spaced ones of a long recording."""
    return np.arange(0, n_blocks, -(-n_blocks // MOST_BLOCKS))


class RecordingFollower:
    """Follows all recordings of a data set with the cable's play operator, for `DRAWS` draws at a time; compiled once.

    Args:
        model: The model.
        recordings: The recordings.
        angles: The angle table, for recordings outside the curves.
    """

    def __init__(self, model: Model, recordings: Recordings, angles: AngleTable | None) -> None:
        self._data = _block_arrays(model, recordings, angles)
        values = {p.name: jax.ShapeDtypeStruct((DRAWS,), jnp.float64) for p in model.space.parameters}
        mounting = jax.ShapeDtypeStruct((DRAWS, len(recordings.items)), jnp.float64)
        function = jax.vmap(_follow_function(model), in_axes=(0, 0, None))
        self._program: Callable[..., Any] = compile_program(function, values, mounting, self._data)

    def __call__(
        self, values: Mapping[str, np.ndarray], mounting: Float[np.ndarray, "draws recordings"]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Output force [N] of each draw, block and recording, and friction exponent [1] of each draw and recording.

        Args:
            values: Named values [internal units] of `DRAWS` draws.
            mounting: Effect of the mounting on the friction exponent of each recording [1].
        """
        force, exponent = self._program(values, mounting, self._data)
        return np.asarray(force), np.asarray(exponent)


def _block_arrays(model: Model, recordings: Recordings, angles: AngleTable | None) -> dict[str, Any]:
    """Blocks of all recordings side by side, the shorter ones standing still at their end."""
    shown = [choose_blocks(len(r.blocks.time)) for r in recordings.items]
    chosen = list(zip(recordings.items, shown, strict=True))
    drive = LoopDrive if model.cable.is_loop else RopeDrive
    rates = [np.gradient(drive.reading(r.blocks.output_force), r.blocks.time)[s] for r, s in chosen]
    rows = collect_row_angles(model.description, angles_of_recordings(recordings), angles).data
    held = {
        name: pad_columns([getattr(r.blocks, name)[s] for r, s in chosen])
        for name in ("input_force", "output_force", "velocity")
    }
    likely = pad_columns([smooth_input(r.blocks.input_force)[s] for r, s in chosen])
    return rows | held | {"likely_force": likely, "drift": pad_columns(rates, "constant")}


def _follow_function(model: Model) -> Callable[[Mapping[str, Array], Array, Mapping[str, Any]], tuple[Array, Array]]:
    """Function of one draw's values, of mounting effects and of the blocks."""

    def follow(values: Mapping[str, Array], mounting: Array, data: Mapping[str, Any]) -> tuple[Array, Array]:
        drive = make_drive(model.cable, values, resolve_angles(model.cable, values, data)[0], data["velocity"])
        cells, least = LoadCells.of(values), drive.least_force
        start = drive.scaled(cells.true_output(data["output_force"][0], least))
        output, _ = drive.follow(cells.true_input(data["likely_force"], least), mounting, start)
        return drive.without_delay(cells.shown_output(output), cells.late(data["drift"])), drive.exponent

    return follow
