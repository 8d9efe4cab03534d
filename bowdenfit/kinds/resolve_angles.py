"""Which wrap angles the rows of a table have at given parameters."""

from collections.abc import Mapping

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.cable import ANGLE_NOISE, Cable


def resolve_angles(
    cable: Cable, values: Mapping[str, Array], rows: Mapping[str, Array]
) -> tuple[Float[Array, "rows contacts"], Float[Array, "rows contacts"]]:
    """Wrap angle [rad] and its variance [rad^2] for each row and contact, at given parameters."""
    angles = jnp.where(rows["is_own"], rows["own"], cable.wrap_angles(values, rows["route"]))
    variance = rows["known_variance"]
    if ANGLE_NOISE in values:
        variance = variance + jnp.where(rows["noisy"], values[ANGLE_NOISE] ** 2, 0.0)
    return angles, jnp.asarray(variance)
