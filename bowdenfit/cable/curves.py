"""Curve families: how the wrap angle of a contact depends on the route variable.

A new family is one class here or in a file beside it, and one line in `bowdenfit.cable.registry`; the contract tests pick
it up. Every family works in z, the route variable from -1 to 1 over the range, where data can see its coefficients.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.cable.departure import DEPARTURE_SHARES, SMOOTH_SHARES, smooth_functions
from bowdenfit.description import PriorDefaults, Route
from bowdenfit.parameters.priors import HalfCauchy, HalfNormal, JohnsonSU, Normal, Prior, Uniform
from bowdenfit.parameters.space import Parameter
from bowdenfit.parameters.symbols import make_symbol
from bowdenfit.physics.geometry import (
    gaussian_coefficients,
    line_wrap_angle,
    log_quadratic_wrap_angle,
    logistic_coefficients,
    logistic_wrap_angle,
)
from bowdenfit.types import Vector

_DEGREE = float(np.deg2rad(1.0))  # [rad]


class Curve(ABC):
    """The curve of one contact; a family says its coefficients, its angle, and how people read it.

    Args:
        column: Column of its angles.
        route: Route variable and the range over which the curve holds.
        departs: Whether the angle departs smoothly from the family's curve.
    """

    coefficients: ClassVar[tuple[str, ...]]
    """Endings of the names of its parameters, after the column."""
    heading: ClassVar[str]
    """What the summary calls a table of its derived quantities."""
    not_limited: ClassVar[str] = ""
    """What it means that a derived quantity goes to infinity; empty where none can."""
    example: ClassVar[tuple[float, ...]] = ()
    """Coefficients of a typical curve, for a small picture of the family; empty without one."""
    has_family: ClassVar[bool] = True
    """Whether the curve is of a family that an angle may depart from."""

    def __init__(self, column: str, route: Route, departs: bool = False) -> None:
        self.column, self.middle, self.half_width, self.unit = column, route.middle, route.half_width, route.unit
        self.what = column.replace("_", " ")
        self.names = tuple(f"{column}_{ending}" for ending in self.coefficients)
        self.departs = departs
        self.rms_name = f"{column}_departure_rms"
        self.weight_names = tuple(f"{column}_departure_{number}" for number in range(1, 1 + len(DEPARTURE_SHARES)) if departs)

    @abstractmethod
    def parameters(self, detected: Vector, defaults: PriorDefaults) -> tuple[Parameter, ...]:
        """Parameters of the family's curve, with priors that may use the detected angles [rad]."""

    def departure_parameters(self, detected: Vector, defaults: PriorDefaults) -> tuple[Parameter, ...]:
        """Weights of the functions of the departure [rad], with priors of heavy tails; none if it does not depart.

        Most weights are far below the scale of their prior and a few far above it, so that a departure vanishes where the
        family fits; no parameter for its size is needed, which would be a funnel.
        """
        if not self.departs:
            return ()
        scale = defaults.departure_share * _median(detected, defaults)
        return self._weights(
            self.weight_names, f"the departure of the {self.what} from its curve", scale, DEPARTURE_SHARES
        )

    def departure(self, values: Mapping[str, Array], z: Float[Array, " rows"]) -> Float[Array, " rows"]:
        """Departure from the family's curve [rad] at z."""
        functions = smooth_functions(z, DEPARTURE_SHARES)
        return sum((values[name] * functions[..., i] for i, name in enumerate(self.weight_names)), jnp.zeros_like(z))

    def departure_rms(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Root mean square of the departure over the range [deg], by name; none if it does not depart."""
        if not self.departs:
            return {}
        return {self.rms_name: jnp.rad2deg(jnp.linalg.norm(jnp.stack([values[name] for name in self.weight_names])))}

    def departure_units(self) -> dict[str, tuple[str, str]]:
        """Unit and symbol of what `departure_rms` gives."""
        return {self.rms_name: ("deg", self._symbol("D"))} if self.departs else {}

    @abstractmethod
    def at(self, z: Float[Array, " rows"], *coefficients: Array) -> Float[Array, " rows"]:
        """Return the wrap angle [rad] at z, -1 to 1 over the range, for its coefficients."""

    def derived(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Return derived quantities by name, in the units of `derived_units`."""
        del values
        return {}

    def derived_units(self) -> dict[str, tuple[str, str]]:
        """Return the unit and symbol of each derived quantity."""
        return {}

    def wrap_angle(self, values: Mapping[str, Array], route: Float[Array, " rows"]) -> Float[Array, " rows"]:
        """Wrap angle [rad] at values of the route variable; 0 where a departure would make it negative."""
        z = (route - self.middle) / self.half_width
        angle = self.at(z, *(values[name] for name in self.names))
        return jnp.maximum(angle + self.departure(values, z), 0.0) if self.departs else angle

    def _parameter(
        self, ending: str, letter: str, meaning: str, prior: Prior, unit: str = "1", scale: float = 1.0, words: str = ""
    ) -> Parameter:
        name, symbol = f"{self.column}_{ending}", self._symbol(letter)
        return Parameter(name, symbol, meaning, "curve", prior, unit, scale, prior_words=words)

    def _weights(
        self, names: Sequence[str], meaning: str, scale: float, shares: Mapping[int, float]
    ) -> tuple[Parameter, ...]:
        """Weights of polynomials [rad] with these shares of the variance of what has a scale, and the priors of heavy tails."""
        return tuple(
            Parameter(
                name, self._symbol(f"w{number}"), f"weight {number} of {meaning}", "departure",
                JohnsonSU(scale * root), "deg", 1 / _DEGREE,
            )
            for number, (name, root) in enumerate(zip(names, np.sqrt(list(shares.values())), strict=True), 1)
        )  # fmt: skip

    def _symbol(self, letter: str) -> str:
        """Return the letter with the first word of the column."""
        return make_symbol(letter, self.column.split("_")[0] or self.column)

    def _level(self, detected: Vector, defaults: PriorDefaults) -> Parameter:
        """Return the logarithm of the angle in the middle of the range, about that of the median angle."""
        level, sd = _median(detected, defaults), defaults.curve_level_sd
        words = f"Normal(log {np.rad2deg(level):.3g} deg, {sd:g})"
        meaning = f"logarithm of the {self.what} in the middle of the range"
        return self._parameter("a", "a", meaning, Normal(float(np.log(level)), sd), "log rad", words=words)


class GaussianCurve(Curve):
    """A bell, `A exp(-((l - B)/C)^2)`, in log-quadratic coordinates (on-body paper, equation 8; see `physics.geometry`)."""

    coefficients = ("a", "b", "c")
    example = (0.0, 0.8, 3.0)
    heading = "Gaussian curves A exp(-((l - B)/C)^2)"
    not_limited = "the data also allow an exponential, for which A, B and C are infinite; use a, b and c above."

    def parameters(self, detected: Vector, defaults: PriorDefaults) -> tuple[Parameter, ...]:
        """Return the level a (log rad), slope b and curvature c >= 0 of the logarithm of the angle.

        The prior of c is one on how many C half of the range is: as many bells are wider than half the range as narrower.
        """
        slope = Normal(0.0, defaults.curve_slope_sd)
        curvature = HalfCauchy(defaults.curve_half_ranges, power=2.0)
        return (
            self._level(detected, defaults),
            self._parameter("b", "b", f"slope of log {self.what}", slope),
            self._parameter("c", "c", f"curvature of log {self.what}", curvature),
        )

    def at(self, z: Float[Array, " rows"], *coefficients: Array) -> Float[Array, " rows"]:
        """exp(a + b z - c z^2)"""
        return log_quadratic_wrap_angle(z, *coefficients)

    def derived(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Return a, B and C as papers print them; infinite where the curve is an exponential (c = 0)."""
        a, b, c = (values[name] for name in self.names)
        A, B, C = gaussian_coefficients(a, b, c, self.middle, self.half_width)
        return {f"{self.column}_A": jnp.rad2deg(A), f"{self.column}_B": B, f"{self.column}_C": C}

    def derived_units(self) -> dict[str, tuple[str, str]]:
        """Return a in degrees, B and C in the unit of the route."""
        units = {"A": "deg", "B": self.unit, "C": self.unit}
        return {f"{self.column}_{x}": (unit, self._symbol(x)) for x, unit in units.items()}


class LineCurve(Curve):
    """A straight line between the angles at both ends of the range, neither of which is negative."""

    coefficients = ("start", "end")
    example = (0.15, 1.0)
    heading = "Straight lines: angle in the middle of the range, and slope"

    def parameters(self, detected: Vector, defaults: PriorDefaults) -> tuple[Parameter, ...]:
        """Return the angle at the start and at the end of the range."""
        prior, unit = HalfNormal(defaults.curve_end_over_median * _median(detected, defaults)), ("deg", 1 / _DEGREE)
        words, ends = prior.text(*unit, digits=3), (self.middle - self.half_width, self.middle + self.half_width)
        return tuple(
            self._parameter(
                ending, rf"\theta^\mathrm{{{ending}}}", f"{self.what} at {end:g} {self.unit}", prior, *unit, words
            )
            for ending, end in zip(self.coefficients, ends, strict=True)
        )

    def at(self, z: Float[Array, " rows"], *coefficients: Array) -> Float[Array, " rows"]:
        """Return the start (1 - z)/2 + end (1 + z)/2, and 0 where that is negative, outside the range."""
        return line_wrap_angle(z, *coefficients)

    def derived(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Return the angle in the middle [deg] and the slope [deg per unit of the route]."""
        start, end = (jnp.rad2deg(values[name]) for name in self.names)
        slope = (end - start) / (2 * self.half_width)
        return {f"{self.column}_middle": (start + end) / 2, f"{self.column}_slope": slope}

    def derived_units(self) -> dict[str, tuple[str, str]]:
        """Degrees, and degrees per unit of the route."""
        return {
            f"{self.column}_middle": ("deg", self._symbol("M")),
            f"{self.column}_slope": (f"deg/{self.unit}", self._symbol("S")),
        }


class LogisticCurve(Curve):
    """A rise or fall between 0 and a plateau, `A / (1 + exp(-(l - B)/C))` (Verhulst 1838; see `physics.geometry`)."""

    coefficients = ("a", "k", "s")
    example = (0.0, 5.0, 0.5)
    heading = "Logistic curves A / (1 + exp(-(l - B)/C))"
    not_limited = "the data also allow an exponential, for which A and B are infinite; use a, k and s above."

    def parameters(self, detected: Vector, defaults: PriorDefaults) -> tuple[Parameter, ...]:
        """Return the level a (log rad), steepness k, and the share s of the plateau reached in the middle of the range."""
        steepness = Normal(0.0, defaults.curve_steepness_sd)
        return (
            self._level(detected, defaults),
            self._parameter("k", "k", f"steepness of the {self.what}", steepness),
            self._parameter(
                "s", "s", f"share of its plateau that the {self.what} has in the middle", Uniform(0.0, 1.0)
            ),
        )

    def at(self, z: Float[Array, " rows"], *coefficients: Array) -> Float[Array, " rows"]:
        """exp(a) / (s + (1 - s) exp(-k z))"""
        return logistic_wrap_angle(z, *coefficients)

    def derived(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Plateau A, place B of half of it and length C of the e-fold; A and B infinite of an exponential (s = 0)."""
        a, k, s = (values[name] for name in self.names)
        A, B, C = logistic_coefficients(a, k, s, self.middle, self.half_width)
        return {f"{self.column}_A": jnp.rad2deg(A), f"{self.column}_B": B, f"{self.column}_C": C}

    def derived_units(self) -> dict[str, tuple[str, str]]:
        """Return a in degrees, B and C in the unit of the route."""
        units = {"A": "deg", "B": self.unit, "C": self.unit}
        return {f"{self.column}_{x}": (unit, self._symbol(x)) for x, unit in units.items()}


class SmoothCurve(Curve):
    """A smooth curve of no family: a mean angle over the range, and polynomials about it (see `cable.departure`)."""

    coefficients = ("mean", *(f"departure_{degree}" for degree in SMOOTH_SHARES))
    example = (0.6, 0.1, -0.05, 0.2, 0.05, 0.0)
    heading = "Smooth curves"
    has_family = False

    def __init__(self, column: str, route: Route, departs: bool = False) -> None:
        del departs  # by whatever it departed would be part of it
        super().__init__(column, route)

    def parameters(self, detected: Vector, defaults: PriorDefaults) -> tuple[Parameter, ...]:
        """Return the mean angle over the range, and weights of polynomials about as large as the angles themselves."""
        median, unit = _median(detected, defaults), ("deg", 1 / _DEGREE)
        prior, meaning = HalfNormal(defaults.curve_end_over_median * median), f"the smooth curve of the {self.what}"
        return (
            self._parameter("mean", "m", f"mean {self.what} over the range", prior, *unit, prior.text(*unit, digits=3)),
            *self._weights(self.names[1:], meaning, defaults.smooth_over_median * median, SMOOTH_SHARES),
        )

    def at(self, z: Float[Array, " rows"], *coefficients: Array) -> Float[Array, " rows"]:
        """Return the mean plus the weighted polynomials, and 0 where that is negative."""
        mean, *weights = coefficients
        return jnp.maximum(mean + smooth_functions(z, SMOOTH_SHARES) @ jnp.stack(weights), 0.0)


def _median(detected: Vector, defaults: PriorDefaults) -> float:
    """Return the median detected angle [rad], or a usual one where none above 0 was detected."""
    detected = detected[detected > 0]
    return float(np.median(detected)) if len(detected) else defaults.curve_level_degrees_without_data * _DEGREE
