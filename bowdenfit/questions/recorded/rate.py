"""Whether efficiency depends on speed, where the fit lets it: the difference between two speeds, draw by draw."""

from collections.abc import Mapping
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.inference.draws import for_each_value
from bowdenfit.inference.interval import Interval
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.kind import FrictionKind
from bowdenfit.recordings.recording import Recordings
from bowdenfit.results.record import Record, cached_per_fit, parameter_values
from bowdenfit.words import significant

_CLEAR = 0.99  # probability from which a dependence on speed is stated rather than hinted at
SHOWN_SPEED = {"rad/s": ("r/min", 30 / np.pi), "mm/s": ("mm/s", 1.0), "": ("", 1.0)}


@dataclass(frozen=True)
class RateEffect:
    """Efficiency at the highest speed less that at the lowest.

    Args:
        slow, fast: The speeds, in `unit`.
        unit: "r/min" or "mm/s".
        place: Route value in words; empty without a route.
        difference: Efficiency at `fast` less that at `slow` [1].
        probability_lower: Probability that efficiency is lower at `fast`.
    """

    slow: float
    fast: float
    unit: str
    place: str
    difference: Interval
    probability_lower: float

    def sentence(self) -> str:
        """The answer in words."""
        low, high = 100 * self.difference.q05, 100 * self.difference.q95
        way, sure = ("falls", self.probability_lower) if high < 0 else ("rises", 1 - self.probability_lower)
        verdict = (
            "so the data show no dependence on speed"
            if low <= 0 <= high
            else f"so efficiency {way} with speed"
            if sure > _CLEAR
            else f"a hint that efficiency {way} with speed, and no more than that"
        )
        where = f" {self.place}" if self.place else ""
        return (
            f"Efficiency{where} at {significant(self.fast)} {self.unit} less that at {significant(self.slow)} {self.unit}: "
            f"{100 * self.difference.median:+.2f} points (90 % interval {low:+.2f} to {high:+.2f}), {verdict}."
        )


@cached_per_fit
def rate_effect(fit: Record) -> RateEffect | None:
    """The effect of speed; None where the fit has none or no draws."""
    friction = fit.model.cable.friction
    if fit.sampled is None or not friction.depends_on_rate:
        return None
    unit, scale = SHOWN_SPEED[friction.conditions.velocity_unit]
    slow, fast = typical_speeds(fit)
    at, place = usual_length(fit)
    with jax.enable_x64(True):
        difference = _efficiency_differences(fit, at, slow, fast)
    interval = Interval.of(difference)
    return RateEffect(slow * scale, fast * scale, unit, place, interval, float(np.mean(difference < 0)))


def typical_speeds(fit: Record) -> tuple[float, float]:
    """The lowest and the highest typical speed of a recording or run, internal unit."""
    friction = [(kind, table) for kind, table in iterate_tables(fit.dataset.measurements) if isinstance(kind, FrictionKind)]
    speeds = [speed for kind, table in friction for speed in kind.typical_speeds(table)]
    return min(speeds), max(speeds)


def usual_length(fit: Record) -> tuple[float, str]:
    """Return the length with most recordings inside the range, else its middle, and its words."""
    route, recordings = fit.dataset.description.route, fit.dataset.measurements.table(Recordings)
    if route is None:
        return 0.0, ""
    recorded = recordings.items if recordings is not None else ()
    values = [r.route for r in recorded if route.range[0] <= r.route <= route.range[1]]
    at = max(set(values), key=values.count) if values else route.middle
    return at, f"at {at:g} {route.unit}"


def _efficiency_differences(fit: Record, at: float, slow: float, fast: float) -> np.ndarray:
    model, friction = fit.model, fit.model.cable.friction

    def difference(values: Mapping[str, jax.Array]) -> jax.Array:
        force = jnp.asarray(friction.conditions.reference_force)
        exponent = model.cable.exponent_at(values, jnp.asarray([at]))[0]
        shifts = exponent * friction.rate(values, jnp.asarray([slow, fast]))
        output = friction.output_force(values, force, shifts, jnp.ones(())) / force
        return output[1] - output[0]

    differences: np.ndarray = for_each_value(difference, parameter_values(fit))
    return differences
