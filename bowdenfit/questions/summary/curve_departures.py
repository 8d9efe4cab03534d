"""What readings reveal of smooth departures of wrap angles from their curves, in sentences."""

import numpy as np

from bowdenfit.cable.curves import Curve
from bowdenfit.results.record import Record

# The size counts as none where the prior has a tenth of its probability. A family is refuted where the readings leave a
# twentieth of that, which is a Bayes factor of 20 (Savage and Dickey), and supported where they leave more than that.
_SMALL_Z, _SMALL_PROBABILITY = -1.2816, 0.1
_REFUTED = 0.05


def describe_departures(fit: Record) -> list[str]:
    """Size of each departure, and whether the family alone would do; no sentences without departures or draws."""
    if fit.sampled is None:
        return []
    return [_describe_departure(fit, curve) for curve in fit.model.cable.curves.values() if curve.departs]


def describe_refuted_families(fit: Record) -> list[str]:
    """Sentence on the curves that angles do not follow without a departure; none where all might."""
    if fit.sampled is None:
        return []
    refuted = [curve for curve in fit.model.cable.curves.values() if curve.departs and _odds(fit, curve) < _REFUTED]
    return [
        f"A {_family(fit, curve)} alone would be wrong for {curve.what}, which departs from it by {_size(fit, curve)} deg, "
        "root mean square."
        for curve in refuted
    ]


def _describe_departure(fit: Record, curve: Curve) -> str:
    """Size of a departure, and what it means."""
    odds, family = _odds(fit, curve), _family(fit, curve)
    meaning = (
        f"a {family} alone would be wrong" if odds < _REFUTED
        else f"a {family} alone describes these readings as well" if odds > 1
        else f"whether a {family} alone would do is open"
    )  # fmt: skip
    return f"{curve.what.capitalize()} departs from its curve by {_size(fit, curve)} deg, root mean square; {meaning}."


def _family(fit: Record, curve: Curve) -> str:
    """Name of the family, such as "gaussian curve"."""
    contact = next(c for c in fit.dataset.description.curved if c.wrap_angle.column == curve.column)
    return f"{contact.wrap_angle.curve} curve"


def _size(fit: Record, curve: Curve) -> str:
    """Median and 90 % interval of the departure [deg]."""
    interval = fit.parameter(curve.rms_name)
    return f"{interval.median:z.{interval.digits}f} ({interval.range_text(interval.digits)})"


def _odds(fit: Record, curve: Curve) -> float:
    """How much likelier the readings are without than with a departure."""
    z = np.asarray(fit.draws().z[..., fit.model.space.index[curve.size_name]])
    return float(np.mean(z < _SMALL_Z)) / _SMALL_PROBABILITY
