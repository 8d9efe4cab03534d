"""What a description says of the cable: its route, the contacts along it, its sizes and pulleys."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, field_validator, model_validator

from bowdenfit.description.values import Choice, Finite, Frozen, Name, NonNegative, Positive, QuantityValue
from bowdenfit.errors import DatasetError
from bowdenfit.words import capitalized

MOST_CHOICES = 1000  # judged: a metre of cable by millimetres; every draw has an efficiency and two forces at each
LEAST_BEND_RATIO = 20.0  # rope diameters; haptic paper, equation 2


class Route(Frozen):
    """What the design question varies: a column of the tables, and where the angle curves hold."""

    variable: Name = "cable_length"
    unit: str = "mm"
    range: tuple[Finite, Finite]
    choices: Annotated[tuple[Finite, ...], Field(max_length=MOST_CHOICES)] = ()

    @model_validator(mode="after")
    def _ordered(self) -> "Route":
        if not self.range[0] < self.range[1]:
            raise ValueError("range must be [lowest, highest]")
        outside = [c for c in self.choices if not self.range[0] <= c <= self.range[1]]
        if outside:
            raise ValueError(f"choices must lie inside range; {outside[0]:g} does not")
        return self

    @property
    def middle(self) -> float:
        """Middle of the range."""
        return (self.range[0] + self.range[1]) / 2

    @property
    def half_width(self) -> float:
        """Half the range."""
        return (self.range[1] - self.range[0]) / 2

    @property
    def label(self) -> str:
        """Name and unit for an axis or a heading."""
        return f"{capitalized(self.variable.replace('_', ' '))} ({self.unit})"

    def outside(self, value: float) -> str:
        """Return words on a value at which the angle curves do not hold; empty where they do."""
        low, high = self.range
        return "" if low <= value <= high else f"outside the curves, {low:g} to {high:g} {self.unit}"


class WrapAngle(Frozen):
    """Where a contact's wrap angle comes from: a curve through the angle table, each row, a constant, or points of a route."""

    curve: Choice | None = None
    column: Name | None = None
    departure: Literal["smooth", "none"] | None = None
    published_range: tuple[Finite, Finite] | None = None
    nominal: QuantityValue | None = None
    value: NonNegative | None = None
    unit: str | None = None
    sd: Positive | None = None
    route: Annotated[str, Field(min_length=1, max_length=4096)] | None = None
    path: Literal["polyline", "spline"] | None = None
    error: QuantityValue | None = None

    @model_validator(mode="after")
    def _one_source(self) -> "WrapAngle":
        if self.route is not None:
            return self._checked_route()
        if self.path is not None or self.error is not None:
            raise ValueError('path and error belong to points along a route, such as { route = "points.csv", path = "spline" }')
        if (self.value is None) == (self.column is None):
            raise ValueError(
                'write either { value = 45, unit = "deg" } or { column = "..." }, with curve where it has one'
            )
        if self.value is not None and (self.unit is None or self.curve is not None):
            raise ValueError('a constant wrap angle needs a unit and no curve, such as { value = 45, unit = "deg" }')
        if self.column is not None and (self.unit is not None or self.sd is not None):
            raise ValueError("unit and sd belong to a constant angle; a column carries its unit in its heading")
        if self.published_range is not None and self.curve is None:
            raise ValueError("published_range belongs to a curve")
        if self.departure == "smooth" and self.curve is None:
            raise ValueError('departure = "smooth" belongs to a curve: it is how an angle departs from that')
        if self.departure is not None and self.curve == "smooth":
            raise ValueError('curve = "smooth" has no family to depart from: leave departure out, or name a family')
        if self.nominal is not None and self.curve is not None:
            raise ValueError("nominal belongs to an angle measured in each row, without a curve")
        return self

    def _checked_route(self) -> "WrapAngle":
        sources = (self.curve, self.column, self.departure, self.published_range, self.nominal, self.value, self.unit, self.sd)
        if any(source is not None for source in sources):
            raise ValueError("route gives the wrap angle; beside it only path and error may be written")
        if self.error is not None and (self.error.value < 0 or self.error.sd is not None):
            raise ValueError('error is the standard deviation of each coordinate, such as { value = 1, unit = "mm" }')
        if self.path == "spline" and (self.error is None or self.error.value == 0):
            raise ValueError(
                'path = "spline" needs the standard deviation of each coordinate, by which it smooths: '
                'error = { value = 1, unit = "mm" }'
            )
        return self

    @property
    def constant(self) -> QuantityValue | None:
        """The constant angle, if it is one."""
        if self.value is None or self.unit is None:
            return None
        return QuantityValue(value=self.value, unit=self.unit, sd=self.sd)


class ContactSettings(Frozen):
    """One place where rope rubs; whether its coefficient may be another in each group of readings, if groups are asked for."""

    name: Name
    friction: Name
    law: Choice = "capstan"
    length: QuantityValue | Literal["route"] | None = None
    by_group: bool = True
    wrap_angle: WrapAngle

    @field_validator("friction")
    @classmethod
    def _is_a_name(cls, friction: str) -> str:
        if friction.replace("-", " ").strip().lower() == "by group":
            raise ValueError(
                'this is the name of the coefficient, such as "mu"; for one in each group write friction_model = "by-group" at '
                "the top of the file, or --friction by-group"
            )
        return friction

    @property
    def special_law(self) -> str:
        """Its law where that is not the usual one; empty otherwise."""
        return "" if self.law == type(self).model_fields["law"].default else self.law


def radius_setting(end: str) -> str:
    """Return the argument of --set that states the radius of the pulley at one end, "input" or "output", as an example."""
    return f'cable.{end}_pulley_radius={{value=15,unit="mm"}}'


def _with_unit(unit: str) -> BeforeValidator:
    """Return what reads a plain number as a quantity in a unit."""
    return BeforeValidator(lambda value: {"value": value, "unit": unit} if isinstance(value, int | float) else value)


class MotorSettings(Frozen):
    r"""A motor with a gear, whose current or torque was recorded in the place of a load cell at the input.

    .. math:: F_\text{in} = \frac{\eta N K_t I - T_g}{r} \text{ pulling}, \quad
              F_\text{in} = \frac{N K_t I / \eta + T_g}{r} \text{ returning}

    with the torque constant K_t, the gear ratio N, the efficiency eta and the friction T_g of the gear at its output, and the
    radius r of the pulley. What is stated of the efficiency or the friction is exact without `sd`; what is left out is learned.
    """

    torque_constant: QuantityValue | None = None
    gear_ratio: Annotated[QuantityValue, _with_unit("1")] = QuantityValue(value=1, unit="1")
    gear_efficiency: Annotated[QuantityValue | None, _with_unit("1")] = None
    gear_friction: QuantityValue | None = None

    @model_validator(mode="after")
    def _possible(self) -> "MotorSettings":
        for name in ("torque_constant", "gear_ratio"):
            factor = getattr(self, name)
            if factor is not None and factor.value <= 0:
                raise ValueError(f"{name} = {factor.value:g} must be more than 0")
        if self.gear_efficiency is not None and not 0 < self.gear_efficiency.value <= 1:
            raise ValueError(
                f"gear_efficiency = {self.gear_efficiency.value:g} must be above 0 and at most 1, the share of the torque that "
                "passes through the gear; write 0.8 for 80 %"
            )
        if self.gear_friction is not None and self.gear_friction.value < 0:
            raise ValueError(f"gear_friction = {self.gear_friction.value:g}, a torque at the gear's output, must be 0 or more")
        return self

    @property
    def relative_sds(self) -> tuple[float, ...]:
        """Relative standard deviations of the factors from a current to a torque [1]."""
        factors = (self.torque_constant, self.gear_ratio)
        return tuple(factor.sd / factor.value for factor in factors if factor is not None and factor.sd is not None)


@dataclass(frozen=True)
class Pulleys:
    """Radii of the pulleys at the motor and at the load side [mm], None if not stated; and a motor in place of a load cell."""

    input_radius: float | None = None
    output_radius: float | None = None
    motor: MotorSettings | None = None

    def forces(self, values: np.ndarray, quantity: str, file: str) -> np.ndarray:
        """Return forces on the rope [N] from torques [N mm] or currents [A]; those of a motor as if its gear lost nothing.

        Args:
            values: The readings.
            quantity: "input_torque", "output_torque" or "input_current".
            file: File that they were read from.

        Raises:
            DatasetError: The radius of that pulley is not known; or that of a current's motor.
        """
        end, _, dimension = quantity.partition("_")
        radius = self.input_radius if end == "input" else self.output_radius
        constant = self.motor.torque_constant if self.motor is not None else None
        if dimension == "current" and constant is None:
            raise DatasetError(
                f"{file} gives {quantity}, but nothing says what torque a current makes; add the motor to cable.toml, with its "
                'own numbers: [motor] torque_constant = { value = 0.05, unit = "N*m/A", sd = 0.002 }, with gear_ratio, '
                f"gear_efficiency and gear_friction if it has a gear, and [cable] {end}_pulley_radius."
            )
        if radius is None:
            raise DatasetError(
                f"{file} gives {quantity}, but the radius of that pulley is not known; add it to cable.toml: [cable] "
                f'{end}_pulley_radius = {{ value = 15, unit = "mm" }}; or for a file by itself, '
                f"--set '{radius_setting(end)}'."
            )
        factor = constant.to("torque_constant") if constant is not None and dimension == "current" else 1.0
        if end == "input" and self.motor is not None:
            factor *= self.motor.gear_ratio.to("ratio")
        return values * factor / radius

    def check_input_force(self, file: str) -> None:
        """Refuse an input force that was read where a motor is described, which stands in its place.

        Raises:
            DatasetError: There is a motor.
        """
        if self.motor is not None:
            raise DatasetError(
                f"{file} gives input_force, the reading of a load cell, and cable.toml has a [motor], which takes the place of "
                "one; name the column input_current or input_torque if it holds that, else delete [motor]."
            )


class CableSettings(Frozen):
    """What kind of cable it is: one rope, or a pull-pull loop of two; radii of the pulleys; sizes to check."""

    kind: Literal["single", "loop"] = "single"
    input_pulley_radius: QuantityValue | None = None
    output_pulley_radius: QuantityValue | None = None
    rope_diameter: QuantityValue | None = None
    bend_radius: QuantityValue | None = None
    backlash: QuantityValue | None = None

    @property
    def lengths(self) -> dict[str, QuantityValue | None]:
        """All its lengths by name."""
        return {name: getattr(self, name) for name in type(self).model_fields if name != "kind"}

    @property
    def sharp_bend(self) -> str:
        """A warning where the rope is bent more sharply than its makers recommend; empty otherwise."""
        if self.rope_diameter is None or self.bend_radius is None:
            return ""
        ratio = self.bend_radius.to("length") / self.rope_diameter.to("length")
        if ratio >= LEAST_BEND_RATIO:
            return ""
        return (
            f"the smallest bend radius is {ratio:.3g} rope diameters; makers recommend at least {LEAST_BEND_RATIO:g}, because "
            "a rope that is bent more sharply wears, and its friction grows with time."
        )
