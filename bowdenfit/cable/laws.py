"""Contact laws: what one contact adds to the friction exponent of the cable.

A new law is one class here or in a file beside it, and one line in `bowdenfit.cable.registry`; the contract tests pick it
up. What it adds to the exponent is all that it must say: parameters of its own and derivatives follow.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.description import PriorDefaults
from bowdenfit.errors import DescriptionError
from bowdenfit.parameters.priors import HalfNormal
from bowdenfit.parameters.space import Parameter
from bowdenfit.parameters.symbols import make_symbol


@dataclass(frozen=True)
class ContactLaw(ABC):
    """The law of one contact. Contacts are in series, so what they add to the friction exponent is summed up.

    Args:
        contact: Name of the contact.
        friction: Name of its friction coefficient.
        sheath: Length of its sheath, where the law depends on it: what is constant of it [m], and what a unit of the route
            variable adds [m].
    """

    contact: str
    friction: str
    sheath: tuple[float, float] = (0.0, 0.0)

    def parameters(self, defaults: PriorDefaults) -> tuple[Parameter, ...]:
        """Return parameters of its own, beside the friction coefficient; named after the contact by `parameter_of`."""
        del defaults
        return ()

    @abstractmethod
    def exponent(self, values: Mapping[str, Array], wrap_angle: Float[Array, "*rows"]) -> Float[Array, "*rows"]:
        """Return the contribution to the friction exponent [1].

        Args:
            values: Values of the parameters.
            wrap_angle: Wrap angle of the contact [rad].
        """

    def exponent_of_length(self, values: Mapping[str, Array], length: Array | float) -> Array | float:
        """Return what a length of the sheath [m] adds to the friction exponent beside that [1]; none usually."""
        del values, length
        return 0.0

    def exponent_along(self, values: Mapping[str, Array], route: Array | float | None) -> Array | float:
        """Return what the length of the sheath at a value of the route variable adds to the friction exponent [1].

        Raises:
            DescriptionError: The length follows the route variable, and that is not given.
        """
        constant, by_route = self.sheath
        if not by_route:
            return self.exponent_of_length(values, constant)
        if route is None:
            raise DescriptionError(
                f"the length of the sheath {self.contact!r} is the route variable, and at a bend alone, as in loops, "
                'displacements and whole recordings, it is not known; state one length instead, length = { value = 1.2, '
                'unit = "m" }, or ask at a length.'
            )
        return self.exponent_of_length(values, constant + by_route * route)

    def slope(self, values: Mapping[str, Array], wrap_angle: Float[Array, "*rows"]) -> Float[Array, "*rows"]:
        """Return the derivative of `exponent` by the wrap angle [1/rad]; carries an angle's error into the force prediction."""
        return jax.jvp(lambda at: self.exponent(values, at), (wrap_angle,), (jnp.ones_like(wrap_angle),))[1]


class Capstan(ContactLaw):
    r"""Coulomb friction over a wrap angle, :math:`\mu_k \theta_k` (haptic paper, equation 1; on-body paper, eq. 7)."""

    def exponent(self, values: Mapping[str, Array], wrap_angle: Float[Array, "*rows"]) -> Float[Array, "*rows"]:
        """Mu theta"""
        return values[self.friction] * wrap_angle


class Wobble(ContactLaw):
    r"""Coulomb friction of a sheath that is never quite straight, :math:`\mu_k (\theta_k + w_k)`.

    A sheath wanders between its supports, so the rope rubs even where the route is straight. The unintended wrap angle w is
    the one of prestressing tendons in their ducts, w = k x of a tendon of length x, where k is generally 0.005 to 0.01 rad
    a meter. Here w itself is the parameter, of the sheath as long as it was measured: a sheath lies less straight than a
    duct that is tied every meter.

    References:
        EN 1992-1-1:2004 (Eurocode 2), 5.10.5.2, equation 5.45.
    """

    def parameters(self, defaults: PriorDefaults) -> tuple[Parameter, ...]:
        """Return the unintended wrap angle w."""
        degree = float(np.deg2rad(1.0))
        return (
            Parameter(
                parameter_of("wobble", self.contact), make_symbol("w", self.contact),
                f"unintended wrap angle, {self.contact}", "friction_model",
                HalfNormal(defaults.wobble_degrees * degree), "deg", 1 / degree,
            ),
        )  # fmt: skip

    def exponent(self, values: Mapping[str, Array], wrap_angle: Float[Array, "*rows"]) -> Float[Array, "*rows"]:
        """Mu (theta + w)"""
        return values[self.friction] * (wrap_angle + values[parameter_of("wobble", self.contact)])


class WobblePerLength(ContactLaw):
    r"""Coulomb friction of a sheath that wanders the more, the longer it is, :math:`\mu_k \theta_k + K_k L_k`.

    K is the wobble coefficient of ACI 318 (there 0.0003 to 0.0066 per metre, in ducts that are tied every metre). That of
    Eurocode 2 is an angle per length, k = K / mu. A sheath that hangs free wanders more, so the default prior is wider.

    References:
        ACI 318-08, 18.6.2; EN 1992-1-1:2004 (Eurocode 2), 5.10.5.2, equation 5.45.
    """

    def parameters(self, defaults: PriorDefaults) -> tuple[Parameter, ...]:
        """Return the wobble coefficient K."""
        return (
            Parameter(
                parameter_of("wobble_per_m", self.contact), make_symbol("K", self.contact),
                f"wobble coefficient, friction per length of the sheath, {self.contact}", "friction_model",
                HalfNormal(defaults.wobble_per_m), "1/m",
            ),
        )  # fmt: skip

    def exponent(self, values: Mapping[str, Array], wrap_angle: Float[Array, "*rows"]) -> Float[Array, "*rows"]:
        """Mu theta"""
        return values[self.friction] * wrap_angle

    def exponent_of_length(self, values: Mapping[str, Array], length: Array | float) -> Array | float:
        """K L"""
        return values[parameter_of("wobble_per_m", self.contact)] * length


def parameter_of(what: str, contact: str) -> str:
    """Return the name of a parameter that one contact has, such as "wobble_free_sheath"."""
    return f"{what}_" + "_".join(contact.lower().split())
