"""What can be turned on the page of a fit: the length or the bends, and the force; and what then arrives."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bowdenfit.arguments import Stroke
from bowdenfit.description import ContactSettings
from bowdenfit.finished_fit import Fit
from bowdenfit.questions.predict.measured_range import find_measured_range
from bowdenfit.units import conversion_factor

FORCE = "force"  # key of the dial of the force
_STEPS = 200  # of a dial; a judgement
_MOST_DEGREES = 360.0  # of a bend that is turned; a judgement
_USUAL_FORCE = 100.0  # N, where no table says at which forces the cable works; a judgement
_BEYOND = 1.5  # how far beyond the largest force measured the dial goes; a judgement


@dataclass(frozen=True)
class Dial:
    """A number that is turned.

    Args:
        key: By which it is named; of a bend the name of its contact.
        label: In words.
        unit: Its unit.
        low, high, step: Where it may stand.
        value: Where it stands at first.
    """

    key: str
    label: str
    unit: str
    low: float
    high: float
    step: float
    value: float


def list_dials(fit: Fit) -> tuple[Dial, ...]:
    """Return the dials of a fit with draws: its length, or the bend of each contact, and the force."""
    route, places = fit.dataset.description.route, tuple[Dial, ...]()
    if route is not None:
        low, high = route.range
        best = fit.optimal_length().length.median
        places = (_dial("length", route.variable.replace("_", " ").capitalize(), route.unit, low, high, best),)
    elif fit.model.cable.is_loop:
        places = (_dial("", "Wrap angle", "deg", 0.0, _MOST_DEGREES, _measured_bend(fit)),)
    else:
        contacts = fit.dataset.description.contact
        places = tuple(_dial(c.name, f"Wrap angle, {c.name}", "deg", 0.0, _MOST_DEGREES, _nominal_bend(c)) for c in contacts)
    most = _largest_force(fit)
    return (*places, _dial(FORCE, "Force", "N", 0.0, most, most / _BEYOND / 2))


def request_dials(fit: Fit, values: Mapping[str, float], is_input: bool, stroke: Stroke) -> dict[str, Any]:
    """Return what `predict` is asked of the fit where the dials stand.

    Args:
        fit: The fit.
        values: Values of the dials, by key.
        is_input: Whether the force is that at the motor, and what arrives is asked; else that which is wanted at the load.
        stroke: "pull" or "return".
    """
    force = f"{values[FORCE]:g}N"
    request: dict[str, Any] = {"input_force": force} if is_input else {"output_force": force}
    request["stroke"] = stroke
    places = {key: value for key, value in values.items() if key != FORCE}
    if "length" in places and fit.dataset.description.route is not None:
        request["lengths"] = [places["length"]]
    elif list(places) == [""]:
        request |= {"wrap_angles": [f"{places['']:g}deg"]}
    else:
        request |= {"wrap_angles": {name: f"{angle:g}deg" for name, angle in places.items()}}
    return request


def _dial(key: str, label: str, unit: str, low: float, high: float, value: float) -> Dial:
    """Return a dial whose steps are round."""
    rough = (high - low) / _STEPS
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= rough)
    least = math.ceil(low / step - 1e-9) * step if low > 0 else step
    most = math.floor(high / step + 1e-9) * step
    return Dial(key, label, unit, least, most, step, min(max(round(value / step) * step, least), most))


def _nominal_bend(contact: ContactSettings) -> float:
    """Return the wrap angle at which a contact is first shown [deg]."""
    source = contact.wrap_angle
    stated = source.constant or source.nominal
    return 90.0 if stated is None else math.degrees(stated.value * conversion_factor(stated.unit, "angle"))


def _measured_bend(fit: Fit) -> float:
    """Return a wrap angle at which a loop was measured [deg]."""
    bends = fit.elastic.measured_bends
    return float(np.rad2deg(np.median(bends))) if len(bends) else 90.0


def _largest_force(fit: Fit) -> float:
    """Return the largest force of the dial [N]: somewhat beyond those measured; where no table says any, a usual one."""
    loads = find_measured_range(fit).loads
    return _BEYOND * (_USUAL_FORCE if loads is None else loads[1])
