"""The answer that the next measurement is to narrow: the best length, an efficiency or a parameter."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bowdenfit.errors import UsageError, suggest_name
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH, Record


@dataclass(frozen=True)
class TargetQuantity:
    """What is to be known better.

    Args:
        name: As the user writes it.
        words: In a sentence.
        unit: Unit of its standard deviation, empty where there is none.
        draws: Its value for each draw of the posterior.
    """

    name: str
    words: str
    unit: str
    draws: np.ndarray

    JSON: ClassVar = ("name", "words", "unit", "sd")

    @property
    def sd(self) -> float:
        """Standard deviation as things are."""
        return float(np.std(self.draws))

    def sd_after(self, share: float) -> float:
        """Standard deviation once a measurement has taken away this share of the variance."""
        return self.sd * float(np.sqrt(max(1.0 - share, 0.0)))


def choose_target(fit: Record, name: str | None) -> TargetQuantity:
    """The answer that is to be known better.

    Args:
        fit: The fit.
        name: "optimal-length", "optimal-efficiency", "efficiency@470", or a parameter. If omitted the optimal length where
            there is a route, else the friction coefficient, or with several the efficiency at the nominal wrap angles.

    Raises:
        UsageError: There is no such answer, or no posterior.
    """
    draws, route = fit.draws(), fit.dataset.description.route
    if name is None:
        coefficients = [p.name for p in fit.model.space.free if p.role == "friction"]
        name = "optimal-length" if route else coefficients[0] if len(coefficients) == 1 else "efficiency"
    what, _, where = name.partition("@")
    if name in draws.values:
        return _parameter_target(fit, name)
    if what == "efficiency":
        return _efficiency_target(fit, name, where)
    if name in ("optimal-length", "optimal-efficiency"):
        best = fit.optimal_length()  # refuses cables without a route
        variable = best.variable.replace("_", " ")
        if name == "optimal-length":
            return TargetQuantity(name, f"the best {variable}", best.unit, draws.optimum[OPTIMAL_LENGTH].ravel())
        return TargetQuantity(
            name, f"the efficiency at the best {variable}", "points", 100 * draws.optimum[OPTIMAL_EFFICIENCY].ravel()
        )
    known = ["optimal-length", "optimal-efficiency", "efficiency@..."] if route else ["efficiency"]
    raise UsageError(f"--for {name!r} is no answer of this fit{suggest_name(name, [*known, *draws.values])}")


def _parameter_target(fit: Record, name: str) -> TargetQuantity:
    """A parameter, or a coefficient of a curve."""
    units = {p.name: p.unit for p in fit.model.space.free}
    draws = fit.draws().values[name].ravel()
    if not np.all(np.isfinite(draws)):
        raise UsageError(
            f"--for {name}: some draws have no finite {name}, so its variance is none that could be reduced; ask for another "
            "parameter of the same curve."
        )
    unit = units.get(name, "1")
    return TargetQuantity(name, name, "" if unit == "1" else unit, draws)


def _efficiency_target(fit: Record, name: str, where: str) -> TargetQuantity:
    """Efficiency at a length, or without a route at the nominal wrap angles, in points of percent."""
    route = fit.dataset.description.route
    if route is None:
        if where:
            raise UsageError(
                f"--for {name!r}: this cable has no route, and its efficiency is that at its nominal wrap angles; write "
                "--for efficiency."
            )
        return TargetQuantity(
            name, "the efficiency at the nominal wrap angles", "points", 100 * fit.efficiency_draws(0.0)[:, 0]
        )
    try:
        at = float(where.removesuffix(route.unit))
    except ValueError:
        raise UsageError(
            f"--for {name!r} does not say where; write it as efficiency@{route.middle:g}, in {route.unit}."
        ) from None
    if not route.range[0] <= at <= route.range[1]:
        low, high = route.range
        raise UsageError(
            f"--for {name!r}: {at:g} {route.unit} lies outside the range {low:g} to {high:g} {route.unit}."
        )
    return TargetQuantity(name, f"the efficiency at {at:g} {route.unit}", "points", 100 * fit.efficiency_draws(at)[:, 0])
