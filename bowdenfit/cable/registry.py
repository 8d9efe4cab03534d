"""Contact laws and curve families by name, and where their classes stand.

Nothing is loaded before a cable needs it, so that a description can be judged without JAX. A new one is one line here, of the
form "module:Class".
"""

from importlib import import_module
from typing import Any

from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError, nearest

CONTACT_LAWS = {"capstan": "bowdenfit.cable.laws:Capstan", "wobble": "bowdenfit.cable.laws:Wobble"}
CURVES = {"gaussian": "bowdenfit.cable.curves:GaussianCurve"}


def check_names(description: Description) -> None:
    """Every contact's law and curve exists.

    Raises:
        DescriptionError: One is unknown.
    """
    for contact in description.contact:
        for what, name, known in (("law", contact.law, CONTACT_LAWS), ("curve", contact.wrap_angle.curve, CURVES)):
            if name is not None and name not in known:
                raise DescriptionError(
                    f"cable.toml, contact {contact.name!r}: the {what} {name!r} is unknown{nearest(name, list(known))}"
                )


def class_at(place: str) -> Any:
    """The class at a place such as "bowdenfit.cable.laws:Capstan"."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
