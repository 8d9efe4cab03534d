"""YAML parameters of a controller, in the layout of ROS 2: friction, feed-forward torque and the limits of compensation."""

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from bowdenfit.questions.export.tables import TransmissionTables
from bowdenfit.questions.export.text import ascii_text, format_comment

NODES, PARAMETERS = "/**", "ros__parameters"  # of every node
_LEAST_FRICTION = "mounting_q05"
_YAML_KEYWORDS = {"yes", "no", "on", "off", "true", "false", "null"}  # words that YAML 1.1 takes for something else
_EXCEEDED = 0.95  # probability that one mounting has more friction than `_LEAST_FRICTION`


def yaml_parameters(tables: TransmissionTables, compensation: Mapping[str, Any] | None = None) -> str:
    """Return friction, and optionally compensation, as YAML.

    Args:
        tables: The tables.
        compensation: Answer of `bowdenfit compensate`, which is written beside them; None for none.
    """
    page = {
        NODES: {
            PARAMETERS: {"bowden": _build_parameter_tree(tables) | ({"compensation": compensation} if compensation else {})}
        }
    }
    return "\n".join([format_comment(tables.sentences, "# "), *yaml_lines(page)]) + "\n"


def _build_parameter_tree(tables: TransmissionTables) -> dict[str, Any]:
    """Return all parameters by name; those that a cable lacks are left out."""
    about, points, levels = tables.about, tables.points, tables.levels
    page: dict[str, Any] = {
        "cable": about.cable, "group": about.group, "version": about.version, "seed": about.seed, "fitted": about.created,
        "trusted": not about.distrust, "warning": about.distrust, "measured": list(about.measured),
        "kind": "loop" if tables.is_loop else "rope",
        "place": {"variable": points.variable, "unit": points.unit, "values": points.values, "outside": "nearest end"},
        "friction_exponent": {
            "pull": {level.name: level.exponent[0] for level in levels},
            "return": {level.name: level.exponent[1] for level in levels},
        },
    }  # fmt: skip
    if tables.is_loop:
        page["coulomb_N"] = {level.name: level.taut_loss for level in levels}
        least = next(level for level in levels if level.name == _LEAST_FRICTION).taut_loss
        page["feed_forward"] = {"coulomb_N": least, "probability_that_friction_exceeds_it": _EXCEEDED}
        if tables.radii[1]:
            page["coulomb_N_m"] = {level.name: level.taut_loss * tables.radii[1] / 1000 for level in levels}
            page["feed_forward"]["coulomb_N_m"] = least * tables.radii[1] / 1000
    if tables.depends_on_load:
        page["load"] = {
            "reference_force_N": tables.reference_force,
            "load_exponent": {level.name: level.load_exponent for level in levels},
            "drag_N": {level.name: level.drag for level in levels},
        }
    if tables.depends_on_rate:
        unit = tables.speed_unit.replace("/", "_per_")
        names = ("stribeck", f"stribeck_speed_{unit}", f"viscous_per_{unit}")
        page["rate"] = {f"reference_speed_{unit}": tables.reference_speed}
        page["rate"] |= {name: {level.name: level.rate[i] for level in levels} for i, name in enumerate(names)}
    return page


def yaml_lines(page: Mapping[str, Any], indent: str = "") -> Iterator[str]:
    """Yield a mapping as lines of YAML; texts are in quotes, so that none is taken for anything else.

    Args:
        page: Texts, numbers, lists of them, and mappings of such, by name.
        indent: Blanks before each line.
    """
    for name, value in page.items():
        if isinstance(value, Mapping):
            if value:
                yield f"{indent}{_format_key(name)}:"
                yield from yaml_lines(value, indent + "  ")
        elif isinstance(value, list | tuple | np.ndarray):
            items = value.tolist() if isinstance(value, np.ndarray) else value
            if any(isinstance(item, Mapping) for item in items):
                yield f"{indent}{_format_key(name)}:"
                yield from yaml_lines({str(i + 1): item for i, item in enumerate(items)}, indent + "  ")
            elif items:
                yield f"{indent}{_format_key(name)}: [{', '.join(map(yaml_scalar, items))}]"
        elif value is not None:
            yield f"{indent}{_format_key(name)}: {yaml_scalar(value)}"


def _format_key(name: str) -> str:
    """Return a name, in quotes where it is more than letters, digits and underscores, or anything else to YAML."""
    is_word = name.isidentifier() and name.isascii() and len(name) > 1 and name.lower() not in _YAML_KEYWORDS
    return name if is_word else json.dumps(name if name == NODES else ascii_text(name))


def yaml_scalar(value: object) -> str:
    """Return a number, a truth or a text as readers of YAML 1.1 and 1.2 take it alike."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, int | np.integer):
        return str(int(value))
    if not isinstance(value, float | np.floating):
        return json.dumps(ascii_text(str(value)))
    text = repr(float(value))
    if text in ("inf", "-inf", "nan"):
        return text.replace("inf", ".inf").replace("nan", ".nan")
    number, e, power = text.partition("e")
    return text if not e or "." in number else f"{number}.0e{power}"
