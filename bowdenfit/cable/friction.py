"""How friction depends on load and speed: options beside the capstan equation that the data can be asked about.

An option is one class here and one line in `FRICTION_OPTIONS`; options combine with `+`, as in "drag+rate-dependent".
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Protocol, runtime_checkable

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.description import Description, PriorDefaults
from bowdenfit.errors import DescriptionError, nearest
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.parameters.priors import HalfNormal, LogNormal, Uniform
from bowdenfit.parameters.space import Parameter, Role
from bowdenfit.physics.friction import force_from_scale, force_scale, force_scale_slope, rate_factor
from bowdenfit.units import speed_dimension

DRAG, LOAD_EXPONENT = "drag", "load_exponent"
STRIBECK, STRIBECK_SPEED, VISCOUS = "stribeck", "stribeck_speed", "viscous"
_SHOWN_SPEED = {"mm/s": ("mm/s", 1.0), "rad/s": ("r/min", 30 / np.pi), "": ("mm/s", 1.0)}


@dataclass(frozen=True)
class Conditions:
    """At what loads and speeds the cable was measured.

    Args:
        reference_force: Force at which friction coefficients have their stated values [N].
        reference_speed: Speed that predictions are made for [mm/s or rad/s].
        speeds: Lowest and highest speed measured at; NaN without any.
        velocity_unit: "mm/s" or "rad/s"; empty without velocities.
        shows_loads: Whether any table shows the forces, and not their ratio alone.
    """

    reference_force: float
    reference_speed: float
    speeds: tuple[float, float]
    velocity_unit: str
    shows_loads: bool = True

    def needs_loads(self, option: str) -> None:
        """Refuse an option that efficiencies alone say nothing of.

        Raises:
            DescriptionError: No table shows the forces.
        """
        if not self.shows_loads:
            raise DescriptionError(
                f'friction_model has "{option}", but no force table or recording shows at which loads it was measured; '
                "efficiencies alone say nothing of it: leave it out, or add forces."
            )


@runtime_checkable
class FrictionOption(Protocol):
    """What an option must offer: the parameters it adds."""

    def parameters(self, conditions: Conditions, defaults: PriorDefaults) -> list[Parameter]:
        """Its parameters.

        Raises:
            DescriptionError: The measurements lack what the option needs.
        """
        ...


@dataclass(frozen=True)
class Drag:
    """A part of the tension that the load cells do not show: adhesion, seals, bending stiffness, preload tared away."""

    def parameters(self, conditions: Conditions, defaults: PriorDefaults) -> list[Parameter]:
        """The drag in newtons."""
        conditions.needs_loads("drag")
        meaning = "drag: tension that the load cells do not show"
        return [Parameter(DRAG, "$D$", meaning, "friction_model", HalfNormal(defaults.drag_newtons), "N")]


@dataclass(frozen=True)
class LoadDependent:
    """Friction coefficients that fall with the load, mu(F) = mu (F/F_ref)^-p."""

    def parameters(self, conditions: Conditions, defaults: PriorDefaults) -> list[Parameter]:
        """The exponent."""
        del defaults
        conditions.needs_loads("load-dependent")
        meaning = f"load exponent: how friction falls with the load, mu as stated at {conditions.reference_force:g} N"
        return [Parameter(LOAD_EXPONENT, "$p$", meaning, "friction_model", Uniform(0.0, 1.0))]


@dataclass(frozen=True)
class RateDependent:
    """Friction coefficients that change with the speed of the rope (Stribeck and viscous)."""

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


FRICTION_OPTIONS: Mapping[str, FrictionOption] = MappingProxyType(
    {"drag": Drag(), "load-dependent": LoadDependent(), "rate-dependent": RateDependent()}
)


def friction_options(text: str) -> tuple[str, ...]:
    """The options in a text such as "drag+rate-dependent"; "capstan" has none.

    Raises:
        DescriptionError: An option is unknown or named twice.
    """
    names = [part.strip() for part in text.split("+")]
    options = tuple(name for name in names if name != "capstan")
    for name in options:
        if name not in FRICTION_OPTIONS:
            known = ["capstan", *FRICTION_OPTIONS]
            raise DescriptionError(f"the friction model {name!r} is unknown{nearest(name, known)}")
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
        return "drag" in self.options or "load-dependent" in self.options

    @property
    def depends_on_rate(self) -> bool:
        """Whether friction depends on speed."""
        return "rate-dependent" in self.options

    def parameters(self, defaults: PriorDefaults) -> list[Parameter]:
        """Parameters of all options."""
        return [p for name in self.options for p in FRICTION_OPTIONS[name].parameters(self.conditions, defaults)]

    def _scale(self, values: Mapping[str, Array]) -> tuple[Any, Any, float]:
        zero = jnp.zeros(())
        return values.get(LOAD_EXPONENT, zero), values.get(DRAG, zero), self.conditions.reference_force

    def scaled(self, values: Mapping[str, Array], force: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """The scale g of forces [1]."""
        return force_scale(force, *self._scale(values))

    def force(self, values: Mapping[str, Array], scaled: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Forces [N] at values of g."""
        return force_from_scale(scaled, *self._scale(values))

    def slope(self, values: Mapping[str, Array], force: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Derivative of g by the force [1/N]."""
        return force_scale_slope(force, *self._scale(values))

    def output_force(
        self, values: Mapping[str, Array], input_force: Array, exponent: Array, stroke: Array
    ) -> Float[Array, "..."]:
        """Force at the load side [N] while the rope slides, stroke +1 toward the motor and -1 back."""
        return self.force(values, self.scaled(values, input_force) - stroke * exponent)

    def rate(self, values: Mapping[str, Array], speed: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Factor on the friction exponent at a speed [1], 1 at the reference speed, which stands in where none is known.

        So coefficients are stated for the reference speed, as they are for the reference force, and what the data say of
        them does not hang on how far friction would rise toward standstill.
        """
        if not self.depends_on_rate:
            return jnp.ones_like(speed)
        reference = jnp.asarray(self.conditions.reference_speed)
        known = jnp.where(jnp.isnan(speed), reference, speed)
        parameters = (values[STRIBECK], values[STRIBECK_SPEED], values[VISCOUS])
        return rate_factor(known, *parameters) / rate_factor(reference, *parameters)

    def efficiency(self, values: Mapping[str, Array], exponent: Float[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Efficiency while pulling with the reference force at the reference speed [1]."""
        if not self.options:
            return jnp.exp(-exponent)
        at = jnp.asarray(self.conditions.reference_force)
        return self.output_force(values, at, exponent, jnp.ones(())) / at


def make_friction_model(description: Description, measurements: Measurements) -> FrictionModel:
    """The friction model of a description, with reference force and speed as stated or from the middle of the data.

    Raises:
        DescriptionError: An option is unknown.
    """
    unit = _velocity_unit(measurements)
    forces, speeds = _forces(measurements), _speeds(measurements)
    stated = description.reference_force
    force = stated.to("force") if stated else _rounded(np.exp(np.mean(np.log(forces)))) if len(forces) else 1.0
    speed = _rounded(float(np.median(speeds))) if len(speeds) else 0.0
    if description.reference_velocity is not None:
        speed = description.reference_velocity.to(speed_dimension(unit or "mm/s"))
    ends = (float(speeds.min()), float(speeds.max())) if len(speeds) else (float("nan"), float("nan"))
    conditions = Conditions(float(force), float(speed), ends, unit, len(forces) > 0)
    return FrictionModel(friction_options(description.friction_model), conditions)


def _rounded(value: float) -> float:
    """To two digits: a reference is a convention, and should look like one."""
    return float(f"{value:.2g}")


def _velocity_unit(measurements: Measurements) -> str:
    forces, recordings = measurements.forces, measurements.recordings
    units = {u for u in (forces and forces.velocity_unit, recordings and recordings.velocity_unit) if u}
    if len(units) > 1:
        raise DescriptionError(
            "velocities are of the rope (mm/s) in one table and of the motor (r/min) in another; give both in the same kind."
        )
    return units.pop() if units else ""


def _forces(measurements: Measurements) -> np.ndarray:
    """Forces of both ends, wherever they are positive."""
    parts = [np.zeros(0)]
    if measurements.forces is not None:
        parts += [measurements.forces.input_force, measurements.forces.output_force]
    if measurements.loop is not None:
        parts.append(measurements.loop.input_force * measurements.loop.stroke)
    if measurements.recordings is not None:
        read = [f for r in measurements.recordings.each for f in (r.blocks.input_force, r.blocks.output_force)]
        # A loop's force passes through zero; what is asked of it is asked under load.
        parts += [f[f > 0.2 * f.max()] for f in read] if measurements.recordings.loop else read
    forces = np.concatenate(parts)
    return forces[forces > 0]


def _speeds(measurements: Measurements) -> np.ndarray:
    """Speeds while the rope slides."""
    parts = [np.zeros(0)]
    if measurements.forces is not None:
        parts.append(np.abs(measurements.forces.velocity))
    if measurements.recordings is not None:
        parts += [np.abs(r.blocks.velocity[r.strokes.used_sliding]) for r in measurements.recordings.each]
    speeds = np.concatenate(parts)
    return speeds[np.isfinite(speeds) & (speeds > 0)]
