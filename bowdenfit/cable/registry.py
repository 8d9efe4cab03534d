"""Contact laws and curve families by name, where their classes stand, and names of the coefficients of groups.

Nothing is loaded before a cable needs it, so that a description can be judged without JAX. A new one is one line here, with
the place of its class as "module:Class".
"""

from collections.abc import Collection
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from bowdenfit.description import ContactSettings, Description, QuantityValue
from bowdenfit.errors import DescriptionError, suggest_name
from bowdenfit.units import conversion_factor, dimension_of


@dataclass(frozen=True)
class CurveFamily:
    """A family of curves.

    Args:
        place: Where its class stands.
        coefficients: How many a curve of it has.
    """

    place: str
    coefficients: int


CONTACT_LAWS = {
    "capstan": "bowdenfit.cable.laws:Capstan",
    "wobble": "bowdenfit.cable.laws:Wobble",
    "wobble-per-length": "bowdenfit.cable.laws:WobblePerLength",
}
_OF_LENGTH = ("wobble-per-length",)
CURVES = {
    "gaussian": CurveFamily("bowdenfit.cable.curves:GaussianCurve", 3),
    "line": CurveFamily("bowdenfit.cable.curves:LineCurve", 2),
    "logistic": CurveFamily("bowdenfit.cable.curves:LogisticCurve", 3),
    "smooth": CurveFamily("bowdenfit.cable.curves:SmoothCurve", 6),
}


def check_names(description: Description) -> None:
    """Refuse contacts whose law or curve does not exist, or lacks a length.

    Raises:
        DescriptionError: One is unknown, or lacks it.
    """
    for number, contact in enumerate(description.contact):
        named = (("law", contact.law, list(CONTACT_LAWS)), ("curve", contact.wrap_angle.curve, list(CURVES)))
        for what, name, known in named:
            if name is not None and name not in known:
                raise DescriptionError(
                    f"cable.toml, contact {contact.name!r}: the {what} {name!r} is unknown{suggest_name(name, known)}",
                    key_path=("contact", number, *(("wrap_angle",) if what == "curve" else ()), what),
                )
        _check_length(description, contact)


def _check_length(description: Description, contact: ContactSettings) -> None:
    """Refuse a contact whose law depends on a length that is not known, and a length that its law does not depend on.

    Raises:
        DescriptionError: It is such a contact.
    """
    place, route = f"cable.toml, contact {contact.name!r}", description.route
    if contact.law not in _OF_LENGTH:
        if contact.length is not None:
            raise DescriptionError(
                f'{place}: length is that of the sheath, which only law = "wobble-per-length" depends on; add that, or leave '
                "length out."
            )
        return
    if contact.length is None:
        raise DescriptionError(
            f'{place}: the law {contact.law!r} needs the length of the sheath: length = {{ value = 1.2, unit = "m" }}, or '
            'length = "route" where the route variable is that length.'
        )
    if contact.friction == description.stretch.friction:
        raise DescriptionError(
            f"{place}: stretch.friction {contact.friction!r} acts here, and friction per length does not act on the stretch as "
            "friction per angle does; leave stretch.friction out, for a coefficient of its own."
        )
    if contact.length == "route" and (route is None or dimension_of(route.unit) != "length"):
        raise DescriptionError(
            f'{place}: length = "route" needs a [route] whose variable is the length of the sheath, in a unit of length.'
        )


def sheath_length(description: Description, contact: ContactSettings) -> tuple[float, float]:
    """Return the length of a contact's sheath: what is constant of it [m], and what a unit of the route variable adds [m]."""
    if isinstance(contact.length, QuantityValue):
        return contact.length.to("length") / 1000, 0.0
    if contact.length == "route" and description.route is not None:
        return 0.0, conversion_factor(description.route.unit, "length") / 1000
    return 0.0, 0.0


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
