"""Smooth functions of the route variable: departures of a wrap angle from its family's curve, and curves of no family.

No real route is exactly a bell. The angle of a contact is its family's curve plus a smooth function of the route variable, less
that function's constant and straight line, which the family has already: Legendre polynomials of the second and third degree.
A smooth curve of no family is a constant plus the polynomials of the first to the fifth degree. The priors of their weights are
in the proportion that a Gaussian process (Matern, nu = 5/2) with a length scale of 0.6 of half the range gives them. Higher
degrees of a departure would have a fifth of its variance, and cost more time than they make coefficients and lengths truer.

References:
    Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), equation 4.17, for the process.
"""

from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

DEPARTURE_SHARES: Mapping[int, float] = MappingProxyType({2: 0.7, 3: 0.3})
"""Share of a departure's variance of the polynomial of each degree."""
SMOOTH_SHARES: Mapping[int, float] = MappingProxyType({1: 0.26, 2: 0.115, 3: 0.048, 4: 0.021, 5: 0.009})
"""Share of the process's whole variance of the polynomial of each degree; that of the constant is the rest."""

_LEGENDRE: Mapping[int, Callable[[Array], Array]] = MappingProxyType(
    {
        1: lambda z: z,
        2: lambda z: (3 * z**2 - 1) / 2,
        3: lambda z: (5 * z**3 - 3 * z) / 2,
        4: lambda z: (35 * z**4 - 30 * z**2 + 3) / 8,
        5: lambda z: (63 * z**5 - 70 * z**3 + 15 * z) / 8,
    }
)


def smooth_functions(z: Float[Array, " rows"], degrees: Collection[int]) -> Float[Array, "rows functions"]:
    """Legendre polynomials with a mean square of 1 over the range at z, -1 to 1 there; outside as at its nearer end.

    Args:
        z: Route variable, -1 to 1 over the range [1].
        degrees: Degrees of the polynomials, 1 to 5.
    """
    z = jnp.clip(z, -1.0, 1.0)
    return jnp.stack([jnp.sqrt(2 * degree + 1.0) * _LEGENDRE[degree](z) for degree in degrees], axis=-1)
