"""How friction depends on load and speed: options beside the capstan equation that the data can be asked about.

An option is one class here and one line in `FRICTION_OPTIONS`; options combine with `+`, as in "drag+rate-dependent".
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.conditions import Conditions
from bowdenfit.description import BY_GROUP, PriorDefaults
from bowdenfit.errors import DescriptionError, suggest_name
from bowdenfit.parameters.priors import HalfCauchy, HalfNormal, LogNormal, Normal, Uniform
from bowdenfit.parameters.space import Parameter, Role
from bowdenfit.physics.friction import force_from_scale, force_scale, force_scale_slope, rate_factor

DRAG, LOAD_EXPONENT = "drag", "load_exponent"
STROKE_DIFFERENCE = "stroke_difference"
STRIBECK, STRIBECK_SPEED, VISCOUS = "stribeck", "stribeck_speed", "viscous"
_SHOWN_SPEED = {"mm/s": ("mm/s", 1.0), "rad/s": ("r/min", 30 / np.pi), "": ("mm/s", 1.0)}


class FrictionOption(ABC):
    """One way in which friction may depend on load or speed: the parameters it adds, and what they do.

    Options that depend on load change the scale g on which friction is a shift; those that depend on speed are factors on
    every coefficient. Several add up, or multiply.
    """

    of_load = False
    of_rate = False
    of_stroke = False
    of_group = False

    @abstractmethod
    def parameters(self, conditions: Conditions, defaults: PriorDefaults) -> list[Parameter]:
        """Return its parameters.

        Raises:
            DescriptionError: The measurements lack what the option needs.
        """

    def load_exponent(self, values: Mapping[str, Array]) -> Array:
        """Return what it adds to the exponent p of the scale g, see `bowdenfit.physics.friction.force_scale` [1]."""
        del values
        return jnp.zeros(())

    def drag(self, values: Mapping[str, Array]) -> Array:
        """Return what it adds to the drag D of that scale [N]."""
        del values
        return jnp.zeros(())

    def stroke_difference(self, values: Mapping[str, Array]) -> Array:
        """Return by how much more friction there is pulling than returning, over the mean of both [1]."""
        del values
        return jnp.zeros(())

    def factor(self, values: Mapping[str, Array], speed: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Return its factor on every coefficient at a speed, up to a constant [1]."""
        del values
        return jnp.ones_like(speed)


class Drag(FrictionOption):
    r"""A part D of the tension that the load cells do not show: adhesion, seals, bending stiffness, preload tared away.

    .. math:: F_\text{out} = (F_\text{in} + D) e^{-\Lambda} - D = F_\text{in} e^{-\Lambda} - D (1 - e^{-\Lambda})

    So the force that it costs at any load is not D but D (1 - exp(-Lambda)).
    """

    of_load = True

    def parameters(self, conditions: Conditions, defaults: PriorDefaults) -> list[Parameter]:
        """Return the drag in newtons."""
        conditions.needs_loads("drag")
        meaning = "drag: hidden tension D, which the load cells do not show; D (1 - exp(-Lambda)) of the force is lost"
        prior = HalfCauchy(defaults.drag_share * conditions.load.value)
        by = conditions.load.describe_share(defaults.drag_share)
        return [Parameter(DRAG, "$D$ hidden", meaning, "friction_model", prior, "N", scaled_by=by)]

    def drag(self, values: Mapping[str, Array]) -> Array:
        """D"""
        return values[DRAG]


class LoadDependent(FrictionOption):
    """Friction coefficients that fall with the load, mu(F) = mu (F/F_ref)^-p."""

    of_load = True

    def parameters(self, conditions: Conditions, defaults: PriorDefaults) -> list[Parameter]:
        """Return the exponent."""
        del defaults
        conditions.needs_loads("load-dependent")
        meaning = f"load exponent: how friction falls with the load, mu as stated at {conditions.reference_force:g} N"
        return [Parameter(LOAD_EXPONENT, "$p$", meaning, "friction_model", Uniform(0.0, 1.0))]

    def load_exponent(self, values: Mapping[str, Array]) -> Array:
        """P"""
        return values[LOAD_EXPONENT]


class RateDependent(FrictionOption):
    """Friction coefficients that change with the speed of the rope (Stribeck and viscous)."""

    of_rate = True

    def parameters(self, conditions: Conditions, defaults: PriorDefaults) -> list[Parameter]:
        """Stribeck rise, Stribeck speed and viscous coefficient."""
        if not np.isfinite(conditions.speeds[1]) or conditions.speeds[1] <= 0:
            raise DescriptionError(
                'friction_model has "rate-dependent", but no force table or recording has a velocity; map a velocity '
                'channel, or state it: velocity = { value = 20, unit = "r/min" } under [[recording]].'
            )
        unit, shown = _SHOWN_SPEED[conditions.velocity_unit]
        low, high = conditions.speeds
        speed, bound = float(np.sqrt(max(low, high / 100) * high)), defaults.viscous_at_highest_speed / high
        role: Role = "friction_model"
        stribeck_speed, viscous = LogNormal(speed, defaults.stribeck_speed_log_sd), Uniform(-bound, bound)
        return [
            Parameter(
                STRIBECK, "$a$", "Stribeck rise: relative rise of friction toward standstill", role,
                HalfNormal(defaults.stribeck),
            ),
            Parameter(
                STRIBECK_SPEED, "$v_s$", "Stribeck speed: where that rise has ended", role,
                stribeck_speed, unit, shown, prior_words=stribeck_speed.text(unit, shown, 3),
            ),
            Parameter(
                VISCOUS, "$c$", "viscous coefficient: relative change of friction with speed", role,
                viscous, f"1/({unit})", 1 / shown, prior_words=viscous.text("", 1 / shown, 3),
            ),
        ]  # fmt: skip

    def factor(self, values: Mapping[str, Array], speed: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """1 + a exp(-(v/v_s)^2) + c |v|"""
        return rate_factor(speed, values[STRIBECK], values[STRIBECK_SPEED], values[VISCOUS])


class StrokeDependent(FrictionOption):
    """Friction that is not the same both ways, mu (1 + d/2) pulling and mu (1 - d/2) returning: a laid rope, wear."""

    of_stroke = True

    def parameters(self, conditions: Conditions, defaults: PriorDefaults) -> list[Parameter]:
        """Return the difference d."""
        conditions.needs_loads("stroke-dependent")
        meaning = "stroke difference: by how much more friction there is pulling than returning, over the mean of both"
        prior = Normal(0.0, defaults.stroke_difference)
        return [Parameter(STROKE_DIFFERENCE, "$d$", meaning, "friction_model", prior)]

    def stroke_difference(self, values: Mapping[str, Array]) -> Array:
        """D"""
        return values[STROKE_DIFFERENCE]


class ByGroup(FrictionOption):
    """Each group of readings has coefficients of its own, but of contacts with by_group = false."""

    of_group = True

    def parameters(self, conditions: Conditions, defaults: PriorDefaults) -> list[Parameter]:
        """Return none: the coefficients of its groups are parameters already."""
        del conditions, defaults
        return []


FRICTION_OPTIONS: dict[str, FrictionOption] = {
    "drag": Drag(),
    "load-dependent": LoadDependent(),
    "rate-dependent": RateDependent(),
    "stroke-dependent": StrokeDependent(),
    BY_GROUP: ByGroup(),
}


def friction_options(text: str) -> tuple[str, ...]:
    """Return the options in a text such as "drag+rate-dependent"; "capstan" has none.

    Raises:
        DescriptionError: An option is unknown or named twice.
    """
    names = [part.strip() for part in text.split("+")]
    options = tuple(name for name in names if name != "capstan")
    for name in options:
        if name not in FRICTION_OPTIONS:
            known = ["capstan", *FRICTION_OPTIONS]
            raise DescriptionError(f"the friction model {name!r} is unknown{suggest_name(name, known)}")
        if options.count(name) > 1:
            raise DescriptionError(f"the friction model {text!r} names {name!r} twice; once is enough.")
    return options


@dataclass(frozen=True)
class FrictionModel:
    """The friction of a cable beyond its coefficients: the scale on which it is a shift, and its change with speed.

    Args:
        options: Names in `FRICTION_OPTIONS`.
        conditions: What the measurements were made at.
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
        known = jnp.where(jnp.isnan(speed), reference, speed)
        factors = [option.factor(values, known) / option.factor(values, reference) for option in self._options]
        return jnp.prod(jnp.stack(factors), axis=0)

    def efficiency(self, values: Mapping[str, Array], exponent: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Efficiency while pulling with the reference force at the reference speed [1]."""
        if not self.options:
            return jnp.exp(-exponent)
        at = jnp.asarray(self.conditions.reference_force)
        return self.output_force(values, at, exponent, jnp.ones(())) / at
