"""What readings reveal of smooth departures of wrap angles from their curves, in sentences."""

import numpy as np

from bowdenfit.cable.curves import Curve
from bowdenfit.results.record import Record

# A departure counts as none where it is smaller than nine tenths of the prior's. A family is refuted where the readings leave a
# twentieth of that probability, which is a Bayes factor of 20 (Savage and Dickey), and supported where they leave more than it.
_SMALL_PROBABILITY = 0.1
_N_PRIOR_DRAWS = 10_000
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
    interval = fit.parameter_of_draws(curve.rms_name)
    return f"{interval.median:z.{interval.digits}f} ({interval.range_text(interval.digits)})"


def _odds(fit: Record, curve: Curve) -> float:
    """How much likelier the readings are without than with a departure."""
    weights = [p for p in fit.model.space.free if p.name in curve.weight_names]
    prior_z = np.random.default_rng(0).standard_normal((len(weights), _N_PRIOR_DRAWS))
    prior_sizes = np.linalg.norm(
        [np.asarray(p.prior.constrain(z)) * p.shown_scale for p, z in zip(weights, prior_z, strict=True)], axis=0
    )
    sizes = fit.draws().values[curve.rms_name]
    return float(np.mean(sizes < np.quantile(prior_sizes, _SMALL_PROBABILITY))) / _SMALL_PROBABILITY
