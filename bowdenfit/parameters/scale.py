"""Sizes of what was measured, which default priors of quantities with a unit are in proportion to."""

from dataclasses import dataclass

from bowdenfit.words import significant


@dataclass(frozen=True)
class Scale:
    """Size of what was measured: whatever its unit, and however large a bench is, priors stand to it in one proportion.

    Args:
        value: Size in internal units, above 0.
        name: What it is, such as "median load".
        unit: Unit in which it is said.
    """

    value: float
    name: str
    unit: str

    def __str__(self) -> str:
        """Such as "the median load, 39.1 N"."""
        return f"the {self.name}, {significant(self.value)} {self.unit}"

    def describe_share(self, part: float) -> str:
        """Such as "5 % of the median load, 39.1 N"."""
        return f"{significant(100 * part)} % of {self}"
