"""How tables are measured again on the computer, as their likelihood takes readings to scatter."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bowdenfit.cable.cable import Cable
from bowdenfit.cable.noise import scatter
from bowdenfit.description import Description
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


def _with_fields(description: Description, table: Any, drawn: Mapping[str, np.ndarray]) -> Any:
    """The table with the arrays that were drawn in place of its own."""
    del description
    return replace(table, **drawn)


def drawn_by_term(
    term_of: Callable[[Cable, Any, AngleTable | None], Any], reading: str, own_key: Callable[[Array], Array]
) -> Callable[[Any, Truth], dict[str, Array]]:
    """The draw of a kind whose tables hold just what its term replicates, given the same rows.

    Args:
        term_of: Term of a table; its `simulate` takes a factor on the noise.
        reading: What the table calls the readings.
        own_key: The kind's own key, of that of the bench.
    """

    def draw(table: Any, truth: Truth) -> dict[str, Array]:
        term = term_of(truth.cable, table, truth.angles)
        data = jax.tree.map(jnp.asarray, term.data)
        return {reading: term.simulate(truth.values, data, own_key(truth.key), truth.scale)}

    return draw


@dataclass(frozen=True)
class Remeasurement:
    """How a table is measured again on the computer, as its likelihood takes readings to scatter.

    Args:
        draw: New readings by name, of a function that JAX can compile; an array called "slipped" says which readings a bench
            could not have taken as it says it did.
        table: The table with what was drawn.
        check: Refuses a table that cannot be measured again.
    """

    draw: Callable[[Any, Truth], dict[str, Array]]
    table: Callable[[Description, Any, Mapping[str, np.ndarray]], Any] = _with_fields
    check: Callable[[Description, Any], object] = lambda *_: None
