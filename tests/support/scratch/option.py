"""An option of the friction model: all friction is half of what the coefficient says."""

import jax.numpy as jnp

from bowdenfit.cable.friction_options import FrictionOption
from bowdenfit.parameters.priors import HalfNormal
from bowdenfit.parameters.space import Parameter


class HiddenTension(FrictionOption):
    """A drag by another name."""

    of_load = True

    def parameters(self, conditions, defaults):
        return [Parameter("hidden", "$H$", "hidden tension", "friction_model", HalfNormal(5.0), "N")]

    def drag(self, values):
        return values["hidden"] + jnp.zeros(())
