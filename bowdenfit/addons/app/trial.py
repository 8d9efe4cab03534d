"""Coefficients tried by hand, and charts of the likelihood of a fit.

The model of the fit itself says what it expects of each reading at values of one's own, and how far that is off.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from bowdenfit.addons.app.points import Points, make_chart
from bowdenfit.cable_model import CableModel
from bowdenfit.dataset import Dataset
from bowdenfit.finished_fit import Fit
from bowdenfit.kinds.covariates import collect_covariates
from bowdenfit.kinds.term import Term
from bowdenfit.models import build_model
from bowdenfit.pages.section import Chart, Series, SeriesGroup
from bowdenfit.parameters.space import Parameter
from bowdenfit.questions.identify.likelihood_figure import LEVEL_OF_ONE, LEVELS_OF_TWO
from bowdenfit.reading import read
from bowdenfit.types import Vector

_FARTHEST = 3.0  # standard deviations of the prior to each side of its median; a judgement
_STEPS = 300  # of a slider; a judgement
_SDS = 8.0  # of the posterior, to each side of the median; a judgement
_CURVE_POINTS = 61  # of an efficiency along the route; a judgement
_REGIONS = (("90 %", LEVELS_OF_TWO[1], "sky"), ("68 %", LEVELS_OF_TWO[0], "blue"))
_FIRST_ROLES = ("friction", "friction_model")  # shown first


@dataclass(frozen=True)
class Slider:
    """A parameter that is tried.

    Args:
        name: Its name.
        meaning: What it is.
        unit: Its unit; "1" without one.
        low, high, start: Where it may stand, and stands at first [z].
        is_coefficient: Whether it is one of those that are shown first.
    """

    name: str
    meaning: str
    unit: str
    low: float
    high: float
    start: float
    is_coefficient: bool

    @property
    def step(self) -> float:
        """Distance of two positions [z]."""
        return (self.high - self.low) / _STEPS


@dataclass(frozen=True)
class Trial:
    """What the model says at values that are tried.

    Args:
        values: The values, by name, in shown units.
        squares: Sum of squares of the standardized residuals.
        log_likelihood: Log likelihood.
        expected: Expected readings, by kind of reading.
        efficiency: Efficiency along the route (%); empty without one.
    """

    values: Mapping[str, float]
    squares: float
    log_likelihood: float
    expected: Mapping[str, Vector]
    efficiency: Vector

    @property
    def misfit(self) -> str:
        """The misfit in words."""
        return f"Sum of squares {self.squares:.2f}, log likelihood {self.log_likelihood:.2f}"


class TrialModel:
    """The model of a data set, asked at values of one's own; loads and compiles it.

    Args:
        folder: The data set.
        fit: A fit of it, by whose draws the sliders stand at first; None for the medians of the priors.

    Raises:
        BowdenfitError: The data set is refused.
    """

    def __init__(self, folder: Path, fit: Fit | None = None) -> None:
        self.dataset: Dataset = read(folder)
        route = self.dataset.description.route
        self._lengths = np.linspace(*route.range, _CURVE_POINTS) if route is not None else np.zeros(0)
        with jax.enable_x64(True):
            self._model = build_model(self.dataset)
            self._functions = CableModel(self._model)
            self._evaluate = jax.jit(self._evaluate_at)
            self.sliders = tuple(self._list_sliders(fit))

    def _list_sliders(self, fit: Fit | None) -> Sequence[Slider]:
        """Return a slider for each free parameter, the coefficients first."""
        same = fit is not None and fit.sampled is not None and fit.model.space.index == self._model.space.index
        draws = fit.sampled.flat_z if same and fit is not None and fit.sampled is not None else None
        sliders = []
        for i, parameter in enumerate(self._model.space.free):
            middle, reach = 0.0, _FARTHEST
            if draws is not None:
                middle = float(np.median(draws[:, i]))
                reach = min(_SDS * float(np.std(draws[:, i])), _FARTHEST)
            sliders.append(_slider(parameter, middle, reach))
        return sorted(sliders, key=lambda slider: not slider.is_coefficient)

    def _evaluate_at(self, z: jax.Array) -> tuple[object, ...]:
        values = self._functions.constrain(z)
        residuals, lengths = self._functions.residuals(values), self._lengths
        efficiency = 100 * self._functions.efficiency(values, lengths) if len(lengths) else jnp.zeros(0)
        likelihood, expected = self._functions.log_likelihood(values), self._functions.expected(values)
        return values, jnp.sum(residuals**2), likelihood, expected, efficiency

    def ask(self, z: Mapping[str, float]) -> Trial:
        """Return what the model says.

        Args:
            z: Where each slider stands, by name.
        """
        with jax.enable_x64(True):
            vector = jnp.array([z[name] for name in self._functions.names])
            values, squares, likelihood, expected, efficiency = jax.tree.map(np.asarray, self._evaluate(vector))
        numbers = {name: float(value) for name, value in values.items()}
        return Trial(numbers, float(squares), float(likelihood), expected, efficiency)

    def draw(self, trial: Trial) -> list[Chart]:
        """Return a chart for each kind of reading, as measured and by the model; wrap angles, which stay as they are, last."""
        terms = sorted(self._model.terms, key=lambda term: term.name == "wrap_angle")
        return [self._draw_term(term, trial) for term in terms]

    def _draw_term(self, term: Term, trial: Trial) -> Chart:
        """Return the chart of one kind of reading."""
        covariates = collect_covariates(self.dataset.description, self.dataset.measurements, term)
        label, x = next(iter(covariates.numbers.items()))
        scale, unit = (100.0, "%") if term.unit == "1" else (1.0, term.unit)
        words, route = term.name.replace("_", " ").capitalize(), self.dataset.description.route
        measured, expected = scale * term.observed(), scale * trial.expected[term.name]
        points, lines = [Points("Measured", "blue", "points", x, measured)], list[SeriesGroup]()
        if term.unit == "1" and route is not None and label == route.label:
            lines.append(_line(self._lengths, trial.efficiency))
        groups, along_route = np.array(covariates.group or [""] * len(x)), bool(lines)
        for rows in (np.flatnonzero(groups == name) for name in dict.fromkeys(groups)):
            x_once, first, number = np.unique(x[rows], return_index=True, return_inverse=True)
            along_x = expected[rows][first]
            if not along_route and len(x_once) > 1 and np.allclose(along_x[number], expected[rows]):  # one curve
                lines.append(_line(x_once, along_x))
            else:
                points.append(Points("By the model", "vermillion", "hollow", x[rows], expected[rows]))
        return make_chart(words, label, f"{words} ({unit})", points, lines)

    def list_start(self, trial: Trial) -> dict[str, float]:
        """Return the values at which a fit can begin: all that are tried but the sizes of the noise, which its search holds."""
        names = (parameter.name for parameter in self._model.space.free if parameter.role != "noise")
        return {name: float(f"{trial.values[name]:.6g}") for name in names}

    def hold(self, name: str, value: float) -> str:
        """Return the setting of cable.toml that holds a parameter at a value, as `--set` takes it.

        Args:
            name: Name of the parameter.
            value: Value [its unit].
        """
        role = self._model.space.free[self._model.space.index[name]].role
        return f"{'friction' if role == 'friction' else 'prior'}.{name}.fixed={value:.6g}"


def _line(x: Vector, y: Vector) -> SeriesGroup:
    """Return what the model says as a line."""
    return SeriesGroup(x, (Series("By the model", "line", "vermillion", y),))


def _slider(parameter: Parameter, middle: float, reach: float) -> Slider:
    """Return the slider of a parameter."""
    is_coefficient = parameter.role in _FIRST_ROLES
    low, high = middle - reach, middle + reach
    return Slider(parameter.name, parameter.meaning, parameter.unit, low, high, middle, is_coefficient)


def draw_profile(fit: Fit, name: str) -> tuple[list[str], Chart]:
    """Return what `fit.profile` says, and its chart.

    Args:
        fit: The fit.
        name: Name of the parameter.

    Raises:
        UsageError: It has no profile.
    """
    profile = fit.profile(name)
    level = Series("Ends of a 90 % interval", "dashed", "gray", np.full(len(profile.values), LEVEL_OF_ONE))
    line = Series("Others fitted again", "line", "blue", profile.rise)
    groups = (SeriesGroup(profile.values, (level, line)),)
    return profile.sentences(), Chart(f"Profile of {name}", _label(name, profile.unit), "Rise of -2 log L", groups)


def draw_contour(fit: Fit, first: str, second: str) -> tuple[list[str], Chart]:
    """Return what `fit.contour` says, and its chart.

    Args:
        fit: The fit.
        first, second: Names of the parameters.

    Raises:
        UsageError: They have no contour.
    """
    contour, series = fit.contour(first, second), list[Series]()
    for label, level, color in _REGIONS:
        low, high = contour.edges(level)
        series += [Series(label, "low", color, low), Series(label, "high", color, high)]
    x_label, y_label = (_label(name, unit) for name, unit in zip(contour.names, contour.units, strict=True))
    groups = (SeriesGroup(contour.values[0], tuple(series)),)
    return contour.sentences(), Chart(f"{first} and {second}", x_label, y_label, groups)


def _label(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} ({unit})"
