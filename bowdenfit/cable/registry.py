"""Contact laws and curve families by name, where their classes stand, and names of the coefficients of groups.

Nothing is loaded before a cable needs it, so that a description can be judged without JAX. A new one is one line here, with
the place of its class as "module:Class".
"""

from collections.abc import Collection
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError, suggest_name


@dataclass(frozen=True)
class CurveFamily:
    """A family of curves.

    Args:
        place: Where its class stands.
        coefficients: How many a curve of it has.
    """

    place: str
    coefficients: int


CONTACT_LAWS = {"capstan": "bowdenfit.cable.laws:Capstan", "wobble": "bowdenfit.cable.laws:Wobble"}
CURVES = {
    "gaussian": CurveFamily("bowdenfit.cable.curves:GaussianCurve", 3),
    "line": CurveFamily("bowdenfit.cable.curves:LineCurve", 2),
    "logistic": CurveFamily("bowdenfit.cable.curves:LogisticCurve", 3),
}


def check_names(description: Description) -> None:
    """Refuse contacts whose law or curve does not exist.

    Raises:
        DescriptionError: One is unknown.
    """
    for contact in description.contact:
        named = (("law", contact.law, list(CONTACT_LAWS)), ("curve", contact.wrap_angle.curve, list(CURVES)))
        for what, name, known in named:
            if name is not None and name not in known:
                raise DescriptionError(
                    f"cable.toml, contact {contact.name!r}: the {what} {name!r} is unknown{suggest_name(name, known)}"
                )


def load_class(class_path: str) -> Any:
    """Return the class at a place such as "bowdenfit.cable.laws:Capstan"."""
    module, _, name = class_path.partition(":")
    return getattr(import_module(module), name)


def coefficient_of(friction: str, group: str) -> str:
    """Return the name of a group's coefficient, such as "mu[new rope]"."""
    return f"{friction}[{group}]"


def split_coefficient(name: str, whole: Collection[str]) -> tuple[str, str]:
    """Return the coefficient and the group of such a name; no group of one that is whole."""
    stem, _, group = name.removesuffix("]").partition("[")
    return (name, "") if name in whole else (stem, group)
