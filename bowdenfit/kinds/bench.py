"""A bench on the computer: true values, and what it takes to draw the readings of a table from them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.noise import scatter
from bowdenfit.kinds.angles.table import AngleTable
from bowdenfit.kinds.resolve_angles import resolve_angles
from bowdenfit.kinds.row_angles import row_angles
from bowdenfit.kinds.rows import ForceRows


@dataclass(frozen=True)
class Truth:
    """What tables are measured again with on the computer.

    Args:
        cable: The cable.
        angles: Measured wrap angles, which hold outside the range of the curves.
        values: True values [internal units].
        key: Random key of the whole bench. A kind makes one of its own of it that no other uses, so that its readings do not
            depend on which other tables there are.
        scale: Factor on all noise.
    """

    cable: Cable
    angles: AngleTable | None
    values: Mapping[str, Array]
    key: Array
    scale: float = 1.0

    def scatter(self, key: Array, shape: tuple[int, ...]) -> Array:
        """Deviations of readings in units of their scale."""
        return scatter(key, shape, self.cable.description)

    def wrap_angles(self, rows: ForceRows) -> tuple[Array, Array]:
        """Wrap angle [rad] of each row and contact without its error, and the error's variance [rad^2]."""
        data = row_angles(self.cable.description, rows, self.angles).data
        return resolve_angles(self.cable, self.values, {name: jnp.asarray(array) for name, array in data.items()})

    def simulate(self, term: Any, key: Array) -> Array:
        """Return readings drawn from a term whose `simulate` takes a factor on its noise.

        Args:
            term: The term, whose readings are those of its table in the same order.
            key: The kind's own key.
        """
        return term.simulate(self.values, jax.tree.map(jnp.asarray, term.data), key, self.scale)
