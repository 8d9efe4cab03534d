"""Values of a description: quantities with units, priors, and what may be said of one parameter."""

import unicodedata
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from bowdenfit.units import LARGEST, conversion_factor

LONGEST_NAME = 80  # characters, a line of a terminal


def _nameable(name: str) -> str:
    """Return a name that can be printed and told apart."""
    if not name.strip():
        raise ValueError("the name is empty; write one that differs from the others")
    if len(name) > LONGEST_NAME:
        raise ValueError(f"the name has {len(name)} characters; at most {LONGEST_NAME} fit into tables and figures")
    hidden = [letter for letter in name if unicodedata.category(letter) in {"Cc", "Cf", "Cs", "Zl", "Zp"}]
    if hidden:
        raise ValueError(f"the name holds a character that cannot be printed, {hidden[0]!a}; leave it out")
    return name.strip()


Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, le=LARGEST, allow_inf_nan=False)]
Finite = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Name = Annotated[str, AfterValidator(_nameable)]
Choice = Annotated[str, Field(max_length=200)]
"""A word of ours, or several with signs between them, such as those of a model of friction."""
Text = Annotated[str, Field(max_length=10_000)]
"""Free text, which every report repeats; a page has some 3,000 characters."""
Code = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False, strict=True)] | Text
"""What stands in a cell whose reading is missing."""


class Frozen(BaseModel):
    """Base of all parts: immutable, and strict about names."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)


class QuantityValue(Frozen):
    """A number with its unit, and its standard deviation where it is known."""

    value: Finite
    unit: str
    sd: Positive | None = None

    def to(self, dimension: str) -> float:
        """Return the value in the internal unit of a kind of quantity."""
        return self.value * conversion_factor(self.unit, dimension)

    def sd_to(self, dimension: str) -> float | None:
        """Return the standard deviation in the internal unit."""
        return None if self.sd is None else self.sd * conversion_factor(self.unit, dimension)


class LogNormalPrior(Frozen):
    """Prior of a positive quantity that is known to a factor."""

    median: Positive
    log_sd: Positive


class NormalPrior(Frozen):
    """Prior of a quantity of either sign."""

    mean: Finite
    sd: Positive


class HalfNormalPrior(Frozen):
    """Prior of a scale."""

    sd: Positive


class HalfCauchyPrior(Frozen):
    """Prior of a scale of which little more than its size is known."""

    scale: Positive


class UniformPrior(Frozen):
    """Prior between limits."""

    low: Finite
    high: Finite

    @model_validator(mode="after")
    def _ordered(self) -> "UniformPrior":
        if not self.low < self.high:
            raise ValueError("low must be below high")
        return self


def _stated(model: BaseModel) -> int:
    """Return how many of a model's fields say something; a stored description writes the others as null."""
    return sum(getattr(model, name) is not None for name in type(model).model_fields)


class PriorChoice(Frozen):
    """Exactly one kind of prior."""

    lognormal: LogNormalPrior | None = None
    normal: NormalPrior | None = None
    half_normal: HalfNormalPrior | None = None
    half_cauchy: HalfCauchyPrior | None = None
    uniform: UniformPrior | None = None

    @model_validator(mode="after")
    def _one(self) -> "PriorChoice":
        if _stated(self) != 1:
            raise ValueError("write exactly one of lognormal, normal, half_normal, half_cauchy, uniform")
        return self


class Measured(Frozen):
    """A value measured separately, with its standard deviation; a Normal cut off at 0."""

    value: NonNegative
    sd: Positive


class ParameterSetting(Frozen):
    """What the user says of one parameter: measured separately, another prior, or fixed. Numbers in the shown unit."""

    measured: Measured | None = None
    prior: PriorChoice | None = None
    fixed: Finite | None = None

    @model_validator(mode="after")
    def _one(self) -> "ParameterSetting":
        if _stated(self) != 1:
            raise ValueError("write exactly one of measured, prior, fixed")
        return self


class FrictionSetting(ParameterSetting):
    """The same for a friction coefficient, which cannot be negative."""

    fixed: NonNegative | None = None
