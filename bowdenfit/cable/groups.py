"""What coefficients are called that each group of readings has for itself, such as a new and an old rope."""

from collections.abc import Collection


def coefficient_of(friction: str, group: str) -> str:
    """Name of a group's coefficient, such as "mu[new rope]"."""
    return f"{friction}[{group}]"


def split_coefficient(name: str, whole: Collection[str]) -> tuple[str, str]:
    """The coefficient and the group of such a name; no group of one that is whole."""
    stem, _, group = name.removesuffix("]").partition("[")
    return (name, "") if name in whole else (stem, group)
