"""Readings beside bounds: those that were read come first, those only known to be at most so come last.

Where the arrays of both have the place of every reading (see `LogDensity.padded`), NaN stands where there is none.
"""

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float


def first_less(reading: Float[Array, " read"], expected: Float[Array, " rows"]) -> Float[Array, " read"]:
    """Readings less what is expected of the first rows; 0 where there is no reading."""
    of_read = expected[: reading.shape[0]]
    return jnp.where(jnp.isnan(reading), 0.0, reading - of_read)


def last_less(bound: Float[Array, " bounds"], expected: Float[Array, " rows"]) -> Float[Array, " bounds"]:
    """Bounds less what is expected of the last rows; 0 where there is no bound."""
    of_bounds = expected[expected.shape[0] - bound.shape[0] :]
    return jnp.where(jnp.isnan(bound), 0.0, bound - of_bounds)


def joined(*parts: tuple[Array, Array]) -> Float[Array, " entries"]:
    """What each reading and bound contributes, one after the other; nothing where there is none."""
    return jnp.concatenate([jnp.where(jnp.isnan(known), 0.0, contributed) for known, contributed in parts])
