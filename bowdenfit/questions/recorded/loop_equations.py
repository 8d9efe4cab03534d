"""What each draw says of a pull-pull loop's recording: the output force that the loop gives at the measured input force."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.cable.load_cells import LoadCells
from bowdenfit.kinds.resolve_angles import resolve_angles
from bowdenfit.kinds.tables import AngleTable
from bowdenfit.model import Model
from bowdenfit.physics.loop import loop_play
from bowdenfit.questions.recorded.equations import Follow, Follower
from bowdenfit.recordings.recording import Recordings

_LEAST_EXPONENT = 1e-9


def loop_follower(model: Model, recordings: Recordings, angles: AngleTable | None) -> Follower:
    """Follows all recordings of a loop with its play operator.

    Args:
        model: The model.
        recordings: The recordings.
        angles: The angle table, for recordings outside the curves.
    """
    return Follower(model, recordings, angles, _followed, np.asarray)


def _followed(model: Model) -> Follow:
    """Function of one z, of mounting effects and of the blocks."""
    cable = model.cable

    def follow(z: Array, mounting: Array, data: Mapping[str, Any]) -> tuple[Array, Array]:
        values = model.space.constrain(z)
        angles, _ = resolve_angles(cable, values, data)
        exponent, cells = cable.friction_exponent(values, angles), LoadCells.of(values)
        preload = cable.elasticity.preload(values, jnp.sum(angles, axis=-1))[0]
        start, force = cells.true_output(data["output_force"][0]), cells.true_input(data["input_force"])
        y = loop_play(force, preload, jnp.maximum(exponent + mounting, _LEAST_EXPONENT), start)
        return cells.shown_output(y) - cells.late(data["drift"]), exponent

    return follow
