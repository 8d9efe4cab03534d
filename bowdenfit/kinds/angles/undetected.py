"""Angles too small to detect: how a description takes them, and which events readings are with that."""

from collections.abc import Mapping

from bowdenfit.description import Description
from bowdenfit.kinds.angles.table import AngleSettings
from bowdenfit.kinds.term import Events, Term


def _way(description: Description) -> str:
    """Either "censored", "zero" or "dropped"."""
    settings = description.table(AngleSettings)
    if description.geometry == "published":
        return "zero"
    return settings.undetected if settings is not None else "censored"


def count(term: Term, description: Description) -> str:
    """How many readings the curves were fitted to, and how those too small to detect entered."""
    entered, censored = len(term.data["angle"]), len(term.data["limit"])
    how = {
        "censored": "",
        "zero": ", those too small to detect taken as 0",
        "dropped": ", those too small to detect left out",
    }
    below = f" and {censored} too small to detect (known to be below the limit)" if censored else how[_way(description)]
    return f"{entered} wrap angles{below}"


def _why_not_alike(_: str, descriptions: Mapping[str, Description]) -> str:
    """Why not all fits have the same readings."""
    taken = {"censored": "below the limit", "zero": "zeros", "dropped": "dropped"}
    ways = [
        f"{name}: {'zeros, in the published regions' if one.geometry == 'published' else taken[_way(one)]}"
        for name, one in descriptions.items()
    ]
    return (
        "angles too small to detect, and angles where a curve does not hold, are not the same readings in all fits "
        f"({', '.join(ways)})"
    )


def _choice(description: Description) -> str:
    """What sets a description apart, where it is not as usual."""
    if description.geometry == "published":
        return ""
    return {"censored": "", "zero": "undetected angles as zeros", "dropped": "undetected angles dropped"}[
        _way(description)
    ]


EVENTS = Events(why_not_alike=_why_not_alike, choice=_choice, chosen=True)
