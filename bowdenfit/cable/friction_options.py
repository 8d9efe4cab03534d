"""Options beside the capstan equation that the data can be asked about: how friction depends on load, speed and turns.

An option is one class here and one line in `FRICTION_OPTIONS`; options combine with `+`, as in "drag+rate-dependent".
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.conditions import Conditions
from bowdenfit.description import BY_GROUP, PriorDefaults
from bowdenfit.errors import DescriptionError, suggest_name
from bowdenfit.parameters.priors import HalfCauchy, HalfNormal, LogNormal, Normal, Uniform
from bowdenfit.parameters.space import Parameter, Role
from bowdenfit.physics.friction import rate_factor
from bowdenfit.words import listed

DRAG, LOAD_EXPONENT = "drag", "load_exponent"
STROKE_DIFFERENCE = "stroke_difference"
STRIBECK, STRIBECK_SPEED, VISCOUS = "stribeck", "stribeck_speed", "viscous"
PRESLIDING_STIFFNESS, BRISTLE_DAMPING = "presliding_stiffness", "bristle_damping"
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
    of_turns = False

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

    def presliding_stiffness(self, values: Mapping[str, Array]) -> Array | None:
        """Return its sigma, see `bowdenfit.physics.presliding` [1]; None where friction does not build up after a turn."""
        del values
        return None

    def bristle_damping(self, values: Mapping[str, Array]) -> Array | None:
        """Return its tau, see there [s]; None where bristles are not damped."""
        del values
        return None


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

    def parameters(self, conditions: Conditions, defaults: PriorDefaults, name: str = "rate-dependent") -> list[Parameter]:
        """Return the Stribeck rise, the Stribeck speed and the viscous coefficient, of the option that has them."""
        if not np.isfinite(conditions.speeds[1]) or conditions.speeds[1] <= 0:
            raise DescriptionError(
                f'friction_model has "{name}", but no force table or recording has a velocity; map a velocity '
                "channel, or state it: velocity = { value = 20, unit = 'r/min' } under [[recording]]."
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


class Play(FrictionOption):
    """The play operator, counted as `Dahl` is: what a rope that creeps is compared with."""

    of_turns = True
    name = "play"

    def parameters(self, conditions: Conditions, defaults: PriorDefaults) -> list[Parameter]:
        """Return none.

        Raises:
            DescriptionError: Nothing shows a turn of the motion.
        """
        del defaults
        if not conditions.shows_turns:
            raise DescriptionError(
                f'friction_model has "{self.name}", which says what happens when the motion turns, and only recordings of a '
                "single rope show that; leave it out, or add recordings."
            )
        return []


class Dahl(Play):
    """Friction that builds up over some motion after a turn, instead of all at once; see `bowdenfit.physics.presliding`."""

    name = "dahl"

    def parameters(self, conditions: Conditions, defaults: PriorDefaults) -> list[Parameter]:
        """Return the presliding stiffness."""
        meaning = (
            "presliding stiffness: after a turn friction is built up by 63 % when the output force has changed by one over it, "
            "as a share"
        )
        prior = HalfCauchy(defaults.presliding_stiffness)
        parameter = Parameter(PRESLIDING_STIFFNESS, r"$\sigma_0$", meaning, "friction_model", prior)
        return [*super().parameters(conditions, defaults), parameter]

    def presliding_stiffness(self, values: Mapping[str, Array]) -> Array:
        """Sigma"""
        return values[PRESLIDING_STIFFNESS]


class LuGre(Dahl):
    """Dahl's friction with Stribeck rise, viscous part and damping of the bristles; in steady sliding `RateDependent`."""

    of_rate = True
    name = "lugre"

    def parameters(self, conditions: Conditions, defaults: PriorDefaults) -> list[Parameter]:
        """Return the presliding stiffness, what changes friction with speed, and the damping."""
        meaning = "bristle damping: damping of the bristles over their stiffness"
        prior = HalfNormal(defaults.bristle_damping_ms / 1000)
        damping = Parameter(
            BRISTLE_DAMPING, r"$\sigma_1/\sigma_0$", meaning, "friction_model", prior, "ms", 1000.0,
            prior_words=prior.text("ms", 1000.0, 3),
        )  # fmt: skip
        stiffness = super().parameters(conditions, defaults)
        return [*stiffness, *_RATE_DEPENDENT.parameters(conditions, defaults, self.name), damping]

    def factor(self, values: Mapping[str, Array], speed: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """See `RateDependent`."""
        return _RATE_DEPENDENT.factor(values, speed)

    def bristle_damping(self, values: Mapping[str, Array]) -> Array:
        """Tau"""
        return values[BRISTLE_DAMPING]


_RATE_DEPENDENT = RateDependent()
FRICTION_OPTIONS: dict[str, FrictionOption] = {
    "drag": Drag(),
    "load-dependent": LoadDependent(),
    "rate-dependent": _RATE_DEPENDENT,
    "stroke-dependent": StrokeDependent(),
    "play": Play(),
    "dahl": Dahl(),
    "lugre": LuGre(),
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
            known_names = ["capstan", *FRICTION_OPTIONS]
            raise DescriptionError(f"the friction model {name!r} is unknown{suggest_name(name, known_names)}")
        if options.count(name) > 1:
            raise DescriptionError(f"the friction model {text!r} names {name!r} twice; once is enough.")
    of_turns = [name for name in options if FRICTION_OPTIONS[name].of_turns]
    if len(of_turns) > 1:
        raise DescriptionError(
            f"the friction model {text!r} says in two ways what happens when the motion turns, {listed(of_turns)}; keep one."
        )
    if {"lugre", "rate-dependent"} <= set(options):
        raise DescriptionError(f"the friction model {text!r}: lugre depends on the rate by itself; leave rate-dependent out.")
    return options
