"""A contact law: friction only beyond a wrap angle of a tenth of a radian."""

import jax.numpy as jnp

from bowdenfit.cable.laws import ContactLaw


class Threshold(ContactLaw):
    """Mu (theta - 0.1), not below 0."""

    def exponent(self, values, wrap_angle):
        return values[self.friction] * jnp.maximum(wrap_angle - 0.1, 0.0)
