"""YAML: friction and what may be fed forward, as parameters of a controller; ROS 2 reads the file as it is."""

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from bowdenfit.questions.export.transmission import Transmission
from bowdenfit.questions.export.words import comment, plain

NODES, PARAMETERS = "/**", "ros__parameters"  # of every node
_LEAST_FRICTION = "mounting_q05"
_OTHERS = {"yes", "no", "on", "off", "true", "false", "null"}  # words that YAML 1.1 takes for something else
_EXCEEDED = 0.95  # probability that one mounting has more friction than that


def parameters(found: Transmission, compensation: Mapping[str, Any] | None = None) -> str:
    """The file.

    Args:
        found: The tables.
        compensation: Answer of `bowdenfit compensate`, which is written beside them; None for none.
    """
    page = {NODES: {PARAMETERS: {"bowden": _page(found) | ({"compensation": compensation} if compensation else {})}}}
    return "\n".join([comment(found.sentences, "# "), *lines(page)]) + "\n"


def _page(found: Transmission) -> dict[str, Any]:
    """Everything by name; what a cable has not is left out."""
    about, places, levels = found.about, found.places, found.levels
    page: dict[str, Any] = {
        "cable": about.cable, "group": about.group, "version": about.version, "seed": about.seed, "fitted": about.created,
        "trusted": not about.distrust, "warning": about.distrust, "measured": list(about.measured),
        "kind": "loop" if found.is_loop else "rope",
        "place": {"variable": places.variable, "unit": places.unit, "values": places.at, "outside": "nearest end"},
        "friction_exponent": {
            "pull": {level.name: level.exponent[0] for level in levels},
            "return": {level.name: level.exponent[1] for level in levels},
        },
    }  # fmt: skip
    if found.is_loop:
        page["coulomb_N"] = {level.name: level.taut_loss for level in levels}
        least = next(level for level in levels if level.name == _LEAST_FRICTION).taut_loss
        page["feed_forward"] = {"coulomb_N": least, "probability_that_friction_exceeds_it": _EXCEEDED}
        if found.radii[1]:
            page["coulomb_N_m"] = {level.name: level.taut_loss * found.radii[1] / 1000 for level in levels}
            page["feed_forward"]["coulomb_N_m"] = least * found.radii[1] / 1000
    if found.of_load:
        page["load"] = {
            "reference_force_N": found.reference_force,
            "load_exponent": {level.name: level.load_exponent for level in levels},
            "drag_N": {level.name: level.drag for level in levels},
        }
    if found.of_rate:
        unit = found.speed_unit.replace("/", "_per_")
        names = ("stribeck", f"stribeck_speed_{unit}", f"viscous_per_{unit}")
        page["rate"] = {f"reference_speed_{unit}": found.reference_speed}
        page["rate"] |= {name: {level.name: level.rate[i] for level in levels} for i, name in enumerate(names)}
    return page


def lines(page: Mapping[str, Any], indent: str = "") -> Iterator[str]:
    """A mapping as lines of YAML; texts are in quotes, so that none is taken for anything else.

    Args:
        page: Texts, numbers, lists of them, and mappings of such, by name.
        indent: Blanks before each line.
    """
    for name, value in page.items():
        if isinstance(value, Mapping):
            if value:
                yield f"{indent}{_key(name)}:"
                yield from lines(value, indent + "  ")
        elif isinstance(value, list | tuple | np.ndarray):
            each = value.tolist() if isinstance(value, np.ndarray) else value
            if any(isinstance(one, Mapping) for one in each):
                yield f"{indent}{_key(name)}:"
                yield from lines({str(i + 1): one for i, one in enumerate(each)}, indent + "  ")
            elif each:
                yield f"{indent}{_key(name)}: [{', '.join(map(scalar, each))}]"
        elif value is not None:
            yield f"{indent}{_key(name)}: {scalar(value)}"


def _key(name: str) -> str:
    """A name, in quotes where it is more than letters, digits and underscores, or anything else to YAML."""
    is_word = name.isidentifier() and name.isascii() and len(name) > 1 and name.lower() not in _OTHERS
    return name if is_word else json.dumps(name if name == NODES else plain(name))


def scalar(value: object) -> str:
    """A number, a truth or a text as readers of YAML 1.1 and 1.2 take it alike."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, int | np.integer):
        return str(int(value))
    if not isinstance(value, float | np.floating):
        return json.dumps(plain(str(value)))
    text = repr(float(value))
    if text in ("inf", "-inf", "nan"):
        return text.replace("inf", ".inf").replace("nan", ".nan")
    number, e, power = text.partition("e")
    return text if not e or "." in number else f"{number}.0e{power}"
