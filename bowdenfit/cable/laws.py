"""Contact laws: what one contact adds to the friction exponent of the cable.

A new law is one class here or in a file beside it, and one line in `CONTACT_LAWS`; the contract tests pick it up.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol, runtime_checkable

from jax import Array
from jaxtyping import Float


@runtime_checkable
class ContactLaw(Protocol):
    """What a contact law must offer. Contacts are in series, so their contributions add."""

    def exponent(self, friction_coefficient: Array, wrap_angle: Array) -> Array:
        """Contribution to the friction exponent [1] at a wrap angle [rad]."""
        ...

    def sensitivity(self, friction_coefficient: Array, wrap_angle: Array) -> Array:
        """Derivative of `exponent` by the wrap angle [1/rad]; carries an angle's error into the force prediction."""
        ...


@dataclass(frozen=True)
class Capstan:
    r"""Coulomb friction over a wrap angle, :math:`\mu_k \theta_k` (haptic paper, equation 1; on-body paper, eq. 7)."""

    def exponent(
        self, friction_coefficient: Float[Array, ""], wrap_angle: Float[Array, " rows"]
    ) -> Float[Array, " rows"]:
        """Mu theta"""
        return friction_coefficient * wrap_angle

    def sensitivity(
        self, friction_coefficient: Float[Array, ""], wrap_angle: Float[Array, " rows"]
    ) -> Float[Array, " rows"]:
        """Mu"""
        return friction_coefficient + 0 * wrap_angle


CONTACT_LAWS: Mapping[str, ContactLaw] = MappingProxyType({"capstan": Capstan()})
