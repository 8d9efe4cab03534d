"""Smooth departures of a wrap angle from its family's curve.

No real route is exactly a bell. The angle of a contact is its family's curve plus a smooth function of the route variable, less
that function's constant and straight line, which the family has already: Legendre polynomials of the second and third degree.
Their priors are in the proportion that a Gaussian process (Matern, nu = 5/2) with a length scale of 0.6 of half the range gives
them. Higher degrees would have a fifth of its variance, and cost more time than they make coefficients and lengths truer.

References:
    Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), equation 4.17, for the process.
"""

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

VARIANCE_SHARES = (0.7, 0.3)
"""Share of the process's variance of each polynomial, of the second degree first."""
N_FUNCTIONS = len(VARIANCE_SHARES)


def departure_functions(z: Float[Array, " rows"]) -> Float[Array, "rows functions"]:
    """Legendre polynomials with a mean square of 1 over the range at z, -1 to 1 there; outside as at its nearer end."""
    z = jnp.clip(z, -1.0, 1.0)
    polynomials = (3 * z**2 - 1) / 2, (5 * z**3 - 3 * z) / 2
    return jnp.stack([jnp.sqrt(2 * degree + 1.0) * values for degree, values in enumerate(polynomials, 2)], axis=-1)
