"""Whether friction falls with speed, so that a compliant drive sticks and slips: its probability, where rate was fitted."""

from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Array, Float

from bowdenfit.cable.friction import STRIBECK, STRIBECK_SPEED, VISCOUS
from bowdenfit.inference.draws import for_each_value
from bowdenfit.physics.friction import rate_slope
from bowdenfit.questions.recorded.rate import SHOWN_SPEED, typical_speeds
from bowdenfit.results.record import Record, cached_per_fit, parameter_values
from bowdenfit.words import percent, significant

_N_SPEEDS = 5  # speeds


@dataclass(frozen=True)
class StickSlip:
    r"""Probability that friction falls with speed, from the lowest speed measured to the highest.

    Args:
        speeds: In `unit`.
        unit: "r/min" or "mm/s".
        probabilities: That :math:`d\mu/dv < 0` there, by speed.
    """

    speeds: tuple[float, ...]
    unit: str
    probabilities: tuple[float, ...]

    def sentence(self) -> str:
        """'Probability that friction falls with speed, ...: 84 % at 3 r/min, 2 % at 60 r/min.'"""
        ends = dict.fromkeys((0, len(self.speeds) - 1))
        probabilities = ", ".join(
            f"{percent(self.probabilities[i], 0)} at {significant(self.speeds[i])} {self.unit}" for i in ends
        )
        return (
            f"Probability that friction falls with speed, so that a compliant drive sticks and slips: {probabilities}."
        )


@cached_per_fit
def stick_slip(fit: Record) -> StickSlip | None:
    """At speeds from the lowest to the highest measured; None where the fit has no rate, or no draws."""
    friction = fit.model.cable.friction
    if fit.sampled is None or not friction.depends_on_rate:
        return None
    unit, scale = SHOWN_SPEED[friction.conditions.velocity_unit]
    slow, fast = typical_speeds(fit)
    speeds = np.unique(np.geomspace(max(slow, 1e-9), max(fast, 1e-9), _N_SPEEDS))
    falls = np.mean(friction_slopes(fit, speeds) < 0, axis=0)
    return StickSlip(tuple(float(speed * scale) for speed in speeds), unit, tuple(float(p) for p in falls))


def friction_slopes(fit: Record, speeds: np.ndarray) -> np.ndarray:
    """Slope of the friction coefficient by the speed, over the coefficient at speed 0 without Stribeck's rise, draws by speeds.

    Args:
        fit: A fit whose friction depends on the rate.
        speeds: In the internal unit of its velocities.
    """

    def slope(values: dict[str, Array], at: Float[Array, " speeds"]) -> Float[Array, " speeds"]:
        return rate_slope(at, *(values[name] for name in (STRIBECK, STRIBECK_SPEED, VISCOUS)))

    with jax.enable_x64(True):
        slope_draws: np.ndarray = for_each_value(slope, parameter_values(fit), np.asarray(speeds, dtype=float))
    return slope_draws
