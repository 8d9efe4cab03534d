"""Likelihood of one coefficient, or of two, with the others fitted again at each place: profiles and contours.

Rises are those of the sum of squares of standardized residuals, which is -2 log L but for the little by which the scatter of
runs depends on coefficients. Scales of noise are held at their posterior medians, or of a fit without draws at the medians of
their priors, and the priors of all other parameters do not count.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import jax
import numpy as np
from scipy.interpolate import RectBivariateSpline

from bowdenfit.display import Display, Rows
from bowdenfit.errors import UsageError, suggest_name
from bowdenfit.inference.least_squares import find_maximum_posterior
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import Problem, Solution, make_objective, total_squares
from bowdenfit.inference.profiles import Basin, Rise
from bowdenfit.inference.solver import QUICK
from bowdenfit.questions.identify import likelihood_figure
from bowdenfit.questions.identify.likelihood_figure import LEVEL_OF_ONE
from bowdenfit.results.record import Record
from bowdenfit.words import listed, significant

if TYPE_CHECKING:
    from bowdenfit.plots.layout import Figure

_SDS = 3.5  # standard deviations to each side: somewhat beyond the levels; a judgement
_POINTS, _GRID_POINTS, _FINER = 41, 17, 5  # of a profile, of each side of a contour, and drawn for one of these; judgements


@dataclass(frozen=True, repr=False)
class ProfileLikelihood(Display):
    """Rise of -2 log L along one parameter, all others fitted again.

    Args:
        name: Name of the parameter.
        unit: Its unit; "1" without one.
        values: Its values, ascending, in this unit.
        rise: Rise of -2 log L at each; NaN where it cannot be computed.
    """

    name: str
    unit: str
    values: np.ndarray
    rise: np.ndarray

    @property
    def limits(self) -> tuple[float, float]:
        """Where the rise crosses 2.71, the ends of a 90 % interval; NaN where it stays below."""
        lowest = int(np.nanargmin(self.rise))
        low = _crossing(self.values[: lowest + 1][::-1], self.rise[: lowest + 1][::-1])
        return low, _crossing(self.values[lowest:], self.rise[lowest:])

    def sentences(self) -> list[str]:
        """Say where the profile is lowest, and where it crosses."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        lowest, (low, high) = self.values[int(np.nanargmin(self.rise))], self.limits
        ends = f"{significant(low)} to {significant(high)}{unit}" if np.isfinite([low, high]).all() else "open at one end"
        return [
            f"The likelihood of {self.name} is highest near {significant(lowest)}{unit}; its 90 % interval, with the scatter "
            f"held, is {ends}. Intervals of the summary do not hold it, and so are wider."
        ]

    def plot(self) -> "Figure":
        """Return the profile as a figure."""
        return likelihood_figure.draw_profile(self.name, self.unit, self.values, self.rise)

    def _table(self) -> Rows:
        return {self.name: self.values, "rise": self.rise}, {self.name: self.unit, "rise": "1"}


@dataclass(frozen=True, repr=False)
class LikelihoodContour(Display):
    """Rise of -2 log L over two parameters, all others fitted again.

    Args:
        names: Names of the two.
        units: Their units; "1" without one.
        values: Values of each, ascending, in its unit.
        rise: Rise of -2 log L, a row for each value of the first; NaN where it cannot be computed.
    """

    names: tuple[str, str]
    units: tuple[str, str]
    values: tuple[np.ndarray, np.ndarray]
    rise: np.ndarray

    def sentences(self) -> list[str]:
        """Say where the likelihood is highest."""
        lowest = np.unravel_index(int(np.nanargmin(self.rise)), self.rise.shape)
        places = [f"{name} {significant(row[i])}" for name, row, i in zip(self.names, self.values, lowest, strict=True)]
        return [f"The likelihood is highest near {listed(places)}."]

    def plot(self) -> "Figure":
        """Return the contours of 68 and 90 % as a figure."""
        return likelihood_figure.draw_contour(self.names, self.units, self.values, self.rise)

    def edges(self, level: float) -> tuple[np.ndarray, np.ndarray]:
        """Return between which values of the second parameter the rise is below a level; NaN where it is nowhere.

        Args:
            level: The level, one of `likelihood_figure.LEVELS_OF_TWO`.

        Returns:
            Lower and upper edge for each value of the first parameter.
        """
        edges = np.full((len(self.values[0]), 2), np.nan)
        for i, rise in enumerate(self.rise):
            lowest = int(np.argmin(np.where(np.isfinite(rise), rise, np.inf)))
            if rise[lowest] < level:
                sides = slice(lowest, None, -1), slice(lowest, None)
                edges[i] = [_crossing(self.values[1][side], rise[side], level, at_end=True) for side in sides]
        return edges[:, 0], edges[:, 1]

    def _table(self) -> Rows:
        first, second = np.meshgrid(*self.values, indexing="ij")
        columns = {self.names[0]: first.ravel(), self.names[1]: second.ravel(), "rise": self.rise.ravel()}
        return columns, dict(zip(columns, (*self.units, "1"), strict=True))


def _crossing(values: np.ndarray, rise: np.ndarray, level: float = LEVEL_OF_ONE, at_end: bool = False) -> float:
    """Return where the rise first exceeds a level, going along it; NaN, or the last value, where it never does."""
    above = np.flatnonzero(rise > level)
    if not len(above) or above[0] == 0:
        return float(values[-1]) if at_end else float("nan")
    i = int(above[0])
    return float(np.interp(level, rise[i - 1 : i + 1], values[i - 1 : i + 1]))


def profile_parameter(fit: Record, name: str) -> ProfileLikelihood:
    """Return the profile likelihood of a parameter.

    Args:
        fit: The fit.
        name: Name of the parameter.

    Raises:
        UsageError: There is no such free parameter, or it is a scale of noise.
    """
    with jax.enable_x64(True):
        (index,), basin, sd = _find_basin(fit, name)
        rise, center = Rise(basin, index), float(basin.solution["z"][index])
        pins = center + sd[index] * np.linspace(-_SDS, _SDS, _POINTS)
        rises = {pin: rise(float(pin)) for pin in sorted(pins, key=lambda pin: abs(pin - center))}  # outward
        values = np.array([basin.value(index, float(pin)) for pin in pins])
    return ProfileLikelihood(name, basin.parameters[index].unit, values, np.array([rises[pin] for pin in pins]))


def contour_parameters(fit: Record, first: str, second: str) -> LikelihoodContour:
    """Return the likelihood over two parameters.

    Args:
        fit: The fit.
        first, second: Names of the parameters.

    Raises:
        UsageError: There is no such free parameter, one is a scale of noise, or both are the same.
    """
    if first == second:
        raise UsageError(f"a contour is of two different parameters, and both are {first}; name another.")
    with jax.enable_x64(True):
        indices, basin, sd = _find_basin(fit, first, second)
        steps = np.linspace(-_SDS, _SDS, _GRID_POINTS)
        pins = [basin.solution["z"][i] + sd[i] * steps for i in indices]
        rise = _compute_rises(basin, indices, pins)
        if np.isfinite(rise).all():
            pins, rise = _refine(pins, rise)
        values = [np.array([basin.value(i, float(pin)) for pin in row]) for i, row in zip(indices, pins, strict=True)]
    units = [basin.parameters[i].unit for i in indices]
    return LikelihoodContour((first, second), (units[0], units[1]), (values[0], values[1]), rise)


def _compute_rises(basin: Basin, indices: list[int], pins: list[np.ndarray]) -> np.ndarray:
    """Return the rise at each pair of pins, outward from the middle, each solve from its neighbor's solution."""
    n, size = len(pins[0]), len(basin.solution["z"])
    mask = np.isin(np.arange(size), indices)
    solutions, middle = dict[tuple[int, int], Solution](), n // 2
    for i, j in sorted(np.ndindex(n, n), key=lambda at: max(abs(at[0] - middle), abs(at[1] - middle))):
        inward = (i - int(np.sign(i - middle)), j - int(np.sign(j - middle)))
        pin = basin.solution["z"].copy()
        pin[indices] = pins[0][i], pins[1][j]
        solutions[i, j] = basin.problem.solve(solutions.get(inward, basin.solution)["z"], mask, pin, QUICK)
    squares = np.array([[total_squares(solutions[i, j]) for j in range(n)] for i in range(n)])
    return np.where(np.isfinite(squares), squares - total_squares(basin.solution), np.nan)


def _refine(pins: list[np.ndarray], rise: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """Return pins closer together, with the rise from a bicubic spline through the others, for smooth edges."""
    finer = [np.linspace(row[0], row[-1], _FINER * (len(row) - 1) + 1) for row in pins]
    return finer, np.maximum(RectBivariateSpline(*pins, rise)(*finer), 0.0)


def _find_basin(fit: Record, *names: str) -> tuple[list[int], Basin, np.ndarray]:
    """Return positions of parameters, the minimum of the sum of squares, and the standard deviations there [z]."""
    space = fit.model.space
    for name in names:
        if name not in space.index:
            free = [p.name for p in space.free if p.role != "noise"]
            suggested = suggest_name(name, free).rstrip("?")
            raise UsageError(f"there is no free parameter {name!r}{suggested}; there are {listed(free)}.")
        if space.free[space.index[name]].role == "noise":
            raise UsageError(f"{name} is a scale of noise, which is held while others are fitted; name a coefficient.")
    posterior = LogDensity(fit.model)
    objective = make_objective(posterior)
    noise_z = 0.0 if fit.sampled is None else np.median(fit.sampled.flat_z, axis=0)
    problem = Problem(posterior, objective, noise_z=noise_z)
    solution = problem.solve(find_maximum_posterior(posterior, objective).z)
    information = solution["jacobian"].T @ solution["jacobian"] + np.eye(space.size)
    basin = Basin(problem, solution, np.zeros_like(problem.noise))
    return [space.index[name] for name in names], basin, np.sqrt(np.diag(np.linalg.inv(information)))
