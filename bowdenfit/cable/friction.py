"""The friction of a cable beyond its coefficients, as the options of its description make it."""

from collections.abc import Mapping
from dataclasses import dataclass

import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.conditions import Conditions
from bowdenfit.cable.friction_options import FRICTION_OPTIONS, FrictionOption
from bowdenfit.description import PriorDefaults
from bowdenfit.parameters.space import Parameter
from bowdenfit.physics.friction import force_from_scale, force_scale, force_scale_slope


@dataclass(frozen=True)
class FrictionModel:
    """The friction of a cable beyond its coefficients: the scale on which it is a shift, and its change with speed.

    Args:
        options: Names in `FRICTION_OPTIONS`.
        conditions: Loads and speeds of the measurements.
    """

    options: tuple[str, ...]
    conditions: Conditions

    @property
    def depends_on_load(self) -> bool:
        """Whether the log ratio of the forces depends on the force."""
        return any(option.of_load for option in self._options)

    @property
    def depends_on_rate(self) -> bool:
        """Whether friction depends on speed."""
        return any(option.of_rate for option in self._options)

    @property
    def depends_on_stroke(self) -> bool:
        """Whether friction is not the same pulling and returning."""
        return any(option.of_stroke for option in self._options)

    @property
    def counts_turns(self) -> bool:
        """Whether every block after a turn of the motion counts, and not only where the output stands."""
        return any(option.of_turns for option in self._options)

    def presliding_stiffness(self, values: Mapping[str, Array]) -> Array | None:
        """Return the presliding stiffness [1]; None for a play operator."""
        stated = [option.presliding_stiffness(values) for option in self._options]
        return next((stiffness for stiffness in stated if stiffness is not None), None)

    def bristle_damping(self, values: Mapping[str, Array]) -> Array | None:
        """Return the damping of the bristles over their stiffness [s]; None where they have none."""
        stated = [option.bristle_damping(values) for option in self._options]
        return next((damping for damping in stated if damping is not None), None)

    @property
    def groups(self) -> tuple[str, ...]:
        """Groups of readings that have coefficients of their own; empty where all share them."""
        return self.conditions.groups if any(option.of_group for option in self._options) else ()

    def parameters(self, defaults: PriorDefaults) -> list[Parameter]:
        """Return parameters of all options."""
        return [p for option in self._options for p in option.parameters(self.conditions, defaults)]

    @property
    def _options(self) -> list[FrictionOption]:
        return [FRICTION_OPTIONS[name] for name in self.options]

    def scale(self, values: Mapping[str, Array]) -> tuple[Array, Array, float]:
        """Return exponent p [1], drag D [N] and reference force [N] of the scale g; see `physics.friction.force_scale`."""
        exponent, drag = jnp.zeros(()), jnp.zeros(())
        for option in self._options:
            exponent, drag = exponent + option.load_exponent(values), drag + option.drag(values)
        return exponent, drag, self.conditions.reference_force

    def scaled(self, values: Mapping[str, Array], force: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the scale g of forces [1]."""
        return force_scale(force, *self.scale(values))

    def force(self, values: Mapping[str, Array], scaled: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return forces [N] at values of g."""
        return force_from_scale(scaled, *self.scale(values))

    def slope(self, values: Mapping[str, Array], force: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Derivative of g by the force [1/N]."""
        return force_scale_slope(force, *self.scale(values))

    def shifts(self, values: Mapping[str, Array], exponent: Float[Array, "*batch"]) -> tuple[Array, Array]:
        """Return the exponent while pulling and while returning [1], of one that is the mean of both."""
        if not self.depends_on_stroke:
            return exponent, exponent
        half = sum((option.stroke_difference(values) for option in self._options), jnp.zeros(())) / 2
        return exponent * (1 + half), exponent * (1 - half)

    def output_force(
        self, values: Mapping[str, Array], input_force: Array, exponent: Array, stroke: Array
    ) -> Float[Array, "..."]:
        """Return the force at the load side [N] while the rope slides, stroke +1 toward the motor and -1 back."""
        return self.force(values, self.scaled(values, input_force) - self._shift(values, exponent, stroke))

    def input_force(
        self, values: Mapping[str, Array], output_force: Array, exponent: Array, stroke: Array
    ) -> Float[Array, "..."]:
        """Return the force at the motor side [N] that gives one at the load side: the inverse of `output_force`."""
        return self.force(values, self.scaled(values, output_force) + self._shift(values, exponent, stroke))

    def _shift(self, values: Mapping[str, Array], exponent: Array, stroke: Array) -> Array:
        """Return what friction takes off the scale g."""
        pulling, returning = self.shifts(values, exponent)
        return stroke * (jnp.where(stroke > 0, pulling, returning) if self.depends_on_stroke else exponent)

    def rate(self, values: Mapping[str, Array], speed: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return the factor on the friction exponent at a speed [1], 1 at the reference speed and where no speed is known.

        So coefficients are stated for the reference speed, as they are for the reference force, and what the data say of
        them does not depend on how far friction would rise toward standstill.
        """
        if not self.depends_on_rate:
            return jnp.ones_like(speed)
        reference = jnp.asarray(self.conditions.reference_speed)
        speeds = jnp.where(jnp.isnan(speed), reference, speed)
        factors = [option.factor(values, speeds) / option.factor(values, reference) for option in self._options]
        return jnp.prod(jnp.stack(factors), axis=0)

    def efficiency(self, values: Mapping[str, Array], exponent: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Efficiency while pulling with the reference force at the reference speed [1]."""
        if not self.options:
            return jnp.exp(-exponent)
        at = jnp.asarray(self.conditions.reference_force)
        return self.output_force(values, at, exponent, jnp.ones(())) / at
