"""Plan of a calibration: data set, quantities, and true values that a file states in place of the priors.

    mu1 = 0.1
    tau = [0.002, 0.3]

A number is the true value of every replication. Of two numbers each replication draws its own: so that every doubling is as
likely as the next where the parameter can be any positive number (coefficients, noise scales, drag), else uniformly. Both
are in the units in which results are shown. What is not named is drawn from its prior.

A calibration with truths from the priors cannot see a bad prior; one with stated truths can.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.errors import DescriptionError, UsageError, suggest_name
from bowdenfit.inference.scalar_priors import value_at, z_at
from bowdenfit.inputs import read_toml_file
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.terms import iterate_term_kinds
from bowdenfit.models import build_model
from bowdenfit.parameters.space import Parameter, ParameterSpace
from bowdenfit.questions.calibrate.answer import QuantityLabel
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH
from bowdenfit.words import shown

_UNBOUNDED = (
    1e60  # a range that reaches beyond has no end: the largest quantile of a half-Cauchy prior is 1e88 of its scale
)


@dataclass(frozen=True)
class StatedTruth:
    """Source of the true values of a parameter: one value, or a range.

    Args:
        parameter: Which.
        low, high: The range [shown unit]; the same for one value.
        log_uniform: Whether every doubling within the range is as likely as the next.
    """

    parameter: Parameter
    low: float
    high: float
    log_uniform: bool

    @property
    def text(self) -> str:
        """The truth as people read it."""
        unit = "" if self.parameter.unit == "1" else f" {self.parameter.unit}"
        if self.low == self.high:
            return f"{self.parameter.name} {self.low:g}{unit}"
        distribution = "log-uniform" if self.log_uniform else "uniform"
        return f"{self.parameter.name} {distribution} from {self.low:g} to {self.high:g}{unit}"

    def draw_z(self, generator: np.random.Generator) -> float:
        """Draw a true value, where the parameter's prior is a standard normal."""
        share = generator.uniform()
        value = self.low + share * (self.high - self.low)
        if self.log_uniform:
            value = self.low * (self.high / self.low) ** share
        return z_at(self.parameter.prior, value / self.parameter.shown_scale)


@dataclass(frozen=True)
class CalibrationPlan:
    """Plan of a calibration.

    Args:
        stated: The data set whose description and design are replicated; its readings give way to simulated ones.
        assumed: The data set with the description that is fitted; the same for a calibration proper.
        seed: Seed; replication i is the same whatever else is run.
        truths: True values that do not come from the priors.
    """

    stated: Dataset
    assumed: Dataset
    seed: int
    truths: tuple[StatedTruth, ...] = ()


def make_plan(stated: Dataset, assumed: Dataset, seed: int, truth: str | Path | None) -> CalibrationPlan:
    """Return what is replicated, with the truths of a file.

    Args:
        stated: The data set as it is described, which is simulated.
        assumed: The data set as the fits take it to be.
        seed: Seed of the replications.
        truth: File of true values; None if all come from the priors.

    Raises:
        UsageError: The file states no true value that this cable can have.
    """
    if truth is None:
        return CalibrationPlan(stated, assumed, seed)
    page = read_truths(Path(truth))
    with jax.enable_x64(True):
        return CalibrationPlan(stated, assumed, seed, parse_truths(page, build_model(stated).space, str(truth)))


def list_quantities(plan: CalibrationPlan) -> dict[str, QuantityLabel]:
    """Return what will be ranked, once it is clear that the data set can be replicated.

    Args:
        plan: Plan of the replications.

    Raises:
        DescriptionError, DatasetError, UsageError: It cannot; says why.
    """
    stated, assumed = plan.stated.description, plan.assumed.description
    for kind, table in iterate_term_kinds(plan.stated.measurements):
        kind.check_drawable(stated, table)
    if stated.angle_columns != assumed.angle_columns or _list_kinds(plan.stated) != _list_kinds(plan.assumed):
        raise DescriptionError(
            "--assume changes which tables or columns the data set has; the fits must read what is simulated, so change "
            "only how it is modeled."
        )
    with jax.enable_x64(True):
        space = build_model(plan.assumed).space
    if not space.size:
        raise UsageError(
            "every parameter of the description is fixed, so there is nothing to calibrate; leave one free."
        )
    quantities = {p.name: QuantityLabel(p.symbol, p.role == "friction", p.meaning) for p in space.free}
    return quantities | {
        OPTIMAL_LENGTH: QuantityLabel(r"$l^*$", meaning="best length"),
        OPTIMAL_EFFICIENCY: QuantityLabel(r"$\eta^*$", meaning="efficiency at the best length"),
    }


def _list_kinds(dataset: Dataset) -> list[str]:
    return [kind.name for kind, _ in iterate_tables(dataset.measurements)]


def read_truths(path: Path) -> dict[str, Any]:
    """Read values and ranges by name, as a TOML file has them.

    Raises:
        UsageError: There is no such file, or it is none.
    """
    try:
        _, page = read_toml_file(path)
    except DescriptionError as error:
        raise UsageError(f"--truth: {error} Write lines such as tau = [0.002, 0.3].") from None
    if not page:
        raise UsageError(f"{path} states no true value; write lines such as mu = 0.1, or leave --truth out.")
    return page


def parse_truths(page: Mapping[str, Any], space: ParameterSpace, file: str) -> tuple[StatedTruth, ...]:
    """Return what a file says of the parameters of a model.

    Args:
        page: Its values and ranges by name.
        space: The parameters.
        file: Its name.

    Raises:
        UsageError: A name is no free parameter, or what is said of it can be no true value.
    """
    parameters = {p.name: p for p in space.parameters}
    for name in page:
        if name not in parameters:
            raise UsageError(f"{file}: {shown(name)} is not a parameter of this cable{suggest_name(name, list(parameters))}")
        if parameters[name].fixed is not None:
            raise UsageError(f"{file}: {name} is fixed in cable.toml, so there is no truth to look for; leave it out.")
    return tuple(_parse_truth(parameters[name], value, f"{file}, {name}") for name, value in page.items())


def _parse_truth(parameter: Parameter, value: Any, location: str) -> StatedTruth:
    numbers = value if isinstance(value, list) else [value, value]
    if len(numbers) != 2 or not all(_is_number(number) for number in numbers):
        raise UsageError(f"{location}: {shown(value)} is neither a number nor a range; write 0.1 or [0.05, 0.2].")
    low, high = (float(number) for number in numbers)
    if isinstance(value, list) and not low < high:
        raise UsageError(f"{location}: the range [{low:g}, {high:g}] is upside down or empty; write its lower end first.")
    ends = (value_at(parameter.prior, z) * parameter.shown_scale for z in (-np.inf, np.inf))
    smallest, largest = (math.inf if end > _UNBOUNDED else end for end in ends)
    if low < smallest or high > largest:
        outside = low if low < smallest else high
        raise UsageError(
            f"{location}: {outside:g} is outside what the parameter can be, {smallest:g} to {largest:g}"
            f"{'' if parameter.unit == '1' else f' {parameter.unit}'}; truths are stated in that unit."
        )
    is_positive_range = smallest == 0 and largest == math.inf and low < high
    if is_positive_range and low == 0:
        raise UsageError(f"{location}: a range of factors cannot start at 0; write the smallest value that matters.")
    return StatedTruth(parameter, low, high, is_positive_range)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
