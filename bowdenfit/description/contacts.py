"""What a description says of the route and of the contacts along it."""

from pydantic import field_validator, model_validator

from bowdenfit.description.values import Finite, Frozen, Name, NonNegative, Positive, QuantityValue
from bowdenfit.words import capitalized


class Route(Frozen):
    """What the design question varies: a column of the tables, and where the angle curves hold."""

    variable: Name = "cable_length"
    unit: str = "mm"
    range: tuple[Finite, Finite]
    choices: tuple[Finite, ...] = ()

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
        """That the angle curves do not hold at a value, in words; empty where they do."""
        low, high = self.range
        return "" if low <= value <= high else f"outside the curves, {low:g} to {high:g} {self.unit}"


class WrapAngle(Frozen):
    """Where a contact's wrap angle comes from: a curve through the angle table, each row, or a constant."""

    curve: str | None = None
    column: Name | None = None
    published_range: tuple[Finite, Finite] | None = None
    nominal: QuantityValue | None = None
    value: NonNegative | None = None
    unit: str | None = None
    sd: Positive | None = None

    @model_validator(mode="after")
    def _one_source(self) -> "WrapAngle":
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
        if self.nominal is not None and self.curve is not None:
            raise ValueError("nominal belongs to an angle measured in each row, without a curve")
        return self

    @property
    def constant(self) -> QuantityValue | None:
        """The constant angle, if it is one."""
        if self.value is None or self.unit is None:
            return None
        return QuantityValue(value=self.value, unit=self.unit, sd=self.sd)


class Contact(Frozen):
    """One place where rope rubs; whether its coefficient may be another in each group of readings, if groups are asked for."""

    name: Name
    friction: Name
    law: str = "capstan"
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
