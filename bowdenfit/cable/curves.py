"""Curve families: how the wrap angle of a contact depends on the route variable.

A new family is one class here or in a file beside it, and one line in `bowdenfit.cable.registry`; the contract tests pick
it up.
"""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from bowdenfit.description import PriorDefaults, Route
from bowdenfit.parameters.priors import HalfNormal, Normal
from bowdenfit.parameters.space import Parameter
from bowdenfit.physics.geometry import gaussian_coefficients, log_quadratic_wrap_angle
from bowdenfit.types import Vector


@runtime_checkable
class Curve(Protocol):
    """What a curve family must offer; an instance is the curve of one contact."""

    def __init__(self, column: str, route: Route) -> None: ...

    def parameters(self, detected: Vector, defaults: PriorDefaults) -> tuple[Parameter, ...]:
        """Its parameters, with priors that may use the detected angles [rad]."""
        ...

    def wrap_angle(self, values: Mapping[str, Array], route: Float[Array, " rows"]) -> Float[Array, " rows"]:
        """Wrap angle [rad] at values of the route variable."""
        ...

    def derived(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Derived quantities by name, in the units of `derived_units`."""
        ...

    def derived_units(self) -> dict[str, tuple[str, str]]:
        """Unit and symbol of each derived quantity."""
        ...


class GaussianCurve:
    """`theta = A exp(-((l - B)/C)^2)` in log-quadratic coordinates (on-body paper, equation 8; see `physics.geometry`)."""

    def __init__(self, column: str, route: Route) -> None:
        self.column, self.middle, self.half_width, self.unit = column, route.middle, route.half_width, route.unit
        self.names = tuple(f"{column}_{letter}" for letter in "abc")

    def parameters(self, detected: Vector, defaults: PriorDefaults) -> tuple[Parameter, ...]:
        """Level a (log rad), slope b and curvature c >= 0 of the logarithm of the angle."""
        level = float(np.median(detected)) if len(detected) else np.deg2rad(defaults.curve_level_degrees_without_data)
        what, symbols = self.column.replace("_", " "), [rf"${x}_\mathrm{{{_short(self.column)}}}$" for x in "abc"]
        level_sd, slope_sd, curvature_sd = defaults.curve_level_sd, defaults.curve_slope_sd, defaults.curve_curvature_sd
        return (
            Parameter(
                self.names[0],
                symbols[0],
                f"logarithm of the {what} in the middle of the range",
                "curve",
                Normal(float(np.log(level)), level_sd),
                "log rad",
                prior_words=f"Normal(log {np.rad2deg(level):.3g} deg, {level_sd:g})",
            ),
            Parameter(self.names[1], symbols[1], f"slope of log {what}", "curve", Normal(0.0, slope_sd)),
            Parameter(self.names[2], symbols[2], f"curvature of log {what}", "curve", HalfNormal(curvature_sd)),
        )

    def wrap_angle(self, values: Mapping[str, Array], route: Float[Array, " rows"]) -> Float[Array, " rows"]:
        """exp(a + b z - c z^2)"""
        a, b, c = (values[name] for name in self.names)
        return log_quadratic_wrap_angle((route - self.middle) / self.half_width, a, b, c)

    def derived(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """A, B and C as papers print them; infinite where the curve is an exponential (c = 0)."""
        a, b, c = (values[name] for name in self.names)
        A, B, C = gaussian_coefficients(a, b, c, self.middle, self.half_width)
        return {f"{self.column}_A": jnp.rad2deg(A), f"{self.column}_B": B, f"{self.column}_C": C}

    def derived_units(self) -> dict[str, tuple[str, str]]:
        """A in degrees, B and C in the unit of the route."""
        units = {"A": "deg", "B": self.unit, "C": self.unit}
        return {f"{self.column}_{x}": (u, rf"${x}_\mathrm{{{_short(self.column)}}}$") for x, u in units.items()}


def _short(column: str) -> str:
    """First word of a column name, as a subscript."""
    return column.split("_")[0]
