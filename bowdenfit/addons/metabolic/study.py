"""A study of what walking costs: metabolic.toml, a table of persons or what was printed, and Student's t for pairs.

References:
    Brockway 1987, "Derivation of formulae used to calculate energy expenditure in man" (Human Nutrition: Clinical Nutrition
    41C, 463-471); Student 1908, "The probable error of a mean" (Biometrika 6).
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from scipy import stats
from scipy.optimize import brentq

from bowdenfit.errors import DatasetError, DescriptionError
from bowdenfit.files.tables import read_table
from bowdenfit.inputs import read_toml_file
from bowdenfit.words import shown

FILE = "metabolic.toml"
_GAS = ("VO2_ml_per_min", "VCO2_ml_per_min", "mass_kg")
_NET = "net_W_per_kg"
LEVEL, POWER = 0.05, 0.8  # customary in the field
_OXYGEN, _CARBON_DIOXIDE, _NITROGEN = 16.58, 4.51, 5.90  # kJ/l, kJ/l and kJ/g (Brockway 1987)
_MAX_PERSONS = 100_000  # of a study; a judgement
Digits = Annotated[str, Field(pattern=r"^-?[0-9]{1,6}(\.[0-9]{1,12})?$")]
Name = Annotated[str, Field(min_length=1, max_length=120)]


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class PrintedCondition(_Frozen):
    """One condition as printed: mean net cost [W/kg] and its standard error, as written."""

    name: Name
    mean: Digits | None = None
    sem: Digits | None = None


class PrintedDifference(_Frozen):
    """A condition less another as printed: probability by chance, and change in percent, as written."""

    condition: Name
    less: Name
    p: Digits | None = None
    percent: Digits | None = None


class Study(_Frozen):
    """A study; keys of metabolic.toml.

    Args:
        name, source, license: Name, source and license of the data.
        persons: How many walked in every condition.
        order: Conditions in the order in which they were walked; empty where each person had an order of its own.
        rest: Condition that is taken off the others, in a table of gas.
        table: File with a row for each person and condition.
        condition: Published means and deviations of each condition.
        difference: Published differences of pairs.
    """

    schema_: int = Field(alias="schema", ge=1, le=1)
    name: Name
    source: str = ""
    license: str = ""
    persons: Annotated[int, Field(ge=2, le=10_000)] | None = None
    order: tuple[str, ...] = ()
    rest: str = ""
    table: str = ""
    condition: tuple[PrintedCondition, ...] = ()
    difference: tuple[PrintedDifference, ...] = ()


@dataclass(frozen=True)
class MetabolicCosts:
    """Net metabolic cost of every person [W/kg], (person, condition), NaN where a person did not walk in one."""

    persons: tuple[str, ...]
    conditions: tuple[str, ...]
    net: np.ndarray


def read_study(folder: Path) -> tuple[Study, MetabolicCosts | None]:
    """Read a study and, where it has them, the numbers of each person.

    Raises:
        DescriptionError: metabolic.toml is missing or wrong.
        DatasetError: The table is.
    """
    path = folder / FILE
    if not path.is_file():
        raise DescriptionError(f"{path} does not exist; it says what was measured. datasets/on-body-metabolic has one.")
    _, raw = read_toml_file(path)
    try:
        study = Study.model_validate(raw)
    except ValidationError as error:
        first = error.errors()[0]
        where = shown(".".join(map(str, first["loc"])))[1:-1] if first["loc"] else "the file"
        raise DescriptionError(
            f"{path.name}: {where} is wrong ({first['msg']}); numbers that were printed are written as text with all their "
            'digits, such as mean = "6.30", and datasets/on-body-metabolic shows every key.'
        ) from None
    if study.table:
        return study, _read_costs(study, folder / study.table)
    _refuse_incomplete(study, path.name)
    return study, None


def _refuse_incomplete(study: Study, file: str) -> None:
    """Refuse what was printed where it is not enough for one comparison."""
    names = [difference.name for difference in study.condition]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise DescriptionError(f"{file}: the condition {twice!r} appears twice; delete one.")
    for difference in study.difference:
        unknown = next((name for name in (difference.condition, difference.less) if name not in names), None)
        if unknown is not None:
            raise DescriptionError(f"{file}: a difference is of {unknown!r}, which no condition is called; correct the name.")
    if study.persons is None:
        raise DescriptionError(f"{file}: the number of persons is missing; write persons = 5, or name their table.")
    if len(names) < 2 or not study.difference:
        raise DescriptionError(f"{file}: nothing can be compared; write two [[condition]] and a [[difference]], or a table.")
    for difference in study.difference:
        if difference.p is not None and not 0 < float(difference.p) < 1:
            raise DescriptionError(f"{file}: p = {difference.p} is not a probability between 0 and 1; correct it.")


def _read_costs(study: Study, path: Path) -> MetabolicCosts:
    """Read the net cost of each person."""
    table = read_table(path)
    columns = {heading.strip(): i for i, heading in enumerate(table.header)}
    needed = ("person", "condition", *((_NET,) if _NET in columns else _GAS))
    missing = next((name for name in needed if name not in columns), None)
    if missing is not None:
        raise DatasetError(
            f"{table.file} has no column {missing}; write person, condition and {_NET}, or person, condition, "
            f"{', '.join(_GAS)}."
        )
    costs: dict[tuple[str, str], float] = {}
    for row in table.rows:
        cells = {name: row[columns[name]] for name in needed}
        person, condition = cells["person"].text.strip(), cells["condition"].text.strip()
        if (person, condition) in costs:
            raise cells["person"].refuse(f"{person} appears twice for {condition}; give each person one row a condition.")
        numbers = [cells[name].number() for name in needed[2:]]
        if not all(map(math.isfinite, numbers)) or (len(numbers) > 1 and min(numbers) <= 0):
            raise cells[needed[2]].refuse("a number here is blank, or not above 0; correct it, or leave the row out.")
        costs[person, condition] = numbers[0] if len(numbers) == 1 else _rate_per_kg(*numbers)
    persons, conditions = (tuple(dict.fromkeys(key[i] for key in costs)) for i in (0, 1))
    gross = np.array([[costs.get((person, condition), math.nan) for condition in conditions] for person in persons])
    if _NET not in columns:
        if study.rest not in conditions:
            raise DescriptionError(
                f"{FILE}: {table.file} has gas, and net cost is what walking costs more than rest; write rest = \"NAME\" with "
                "the condition in which persons rested."
            )
        resting = conditions.index(study.rest)
        gross = np.delete(gross - gross[:, [resting]], resting, axis=1)
        conditions = tuple(name for name in conditions if name != study.rest)
    if len(persons) < 2 or len(conditions) < 2:
        counts = f"{len(persons)} persons and {len(conditions)} conditions"
        raise DatasetError(f"{table.file} has {counts}; at least two of each are needed.")
    return MetabolicCosts(persons, conditions, gross)


def _rate_per_kg(oxygen: float, carbon_dioxide: float, mass: float) -> Any:
    """Return the metabolic rate per body mass [W/kg]."""
    return brockway(oxygen, carbon_dioxide) / mass


def brockway(oxygen: np.ndarray | float, carbon_dioxide: np.ndarray | float, nitrogen: float = 0.0) -> np.ndarray | float:
    r"""Return the metabolic rate [W], :math:`16.58 V_{O_2} + 4.51 V_{CO_2} - 5.90 N` in kJ (Brockway 1987).

    Args:
        oxygen: Taken up [ml/min].
        carbon_dioxide: Given off [ml/min].
        nitrogen: In urine [g/min]; hardly anybody who walks measures it.
    """
    return (_OXYGEN * oxygen + _CARBON_DIOXIDE * carbon_dioxide - 1000 * _NITROGEN * nitrogen) / 60


def mean_and_error(differences: np.ndarray) -> tuple[float, float]:
    """Return the mean difference and its standard error.

    Args:
        differences: A number for each person.
    """
    return float(np.mean(differences)), float(stats.sem(differences))


def two_sided_p(t: float, persons: int) -> float:
    """Return the probability of a t as far from 0 by chance.

    Args:
        t: Mean difference over its standard error.
        persons: How many.
    """
    return float(2 * stats.t.sf(abs(t), persons - 1))


def t_from_p(p: float, persons: float) -> float:
    """Return the t, without its sign, that has a two-sided probability."""
    return float(stats.t.isf(p / 2, persons - 1))


def half_width(error: float, persons: int, level: float = 1 - LEVEL) -> float:
    """Return the half-width of the difference's confidence interval at a level.

    Args:
        error: Standard error.
        persons: How many.
        level: The share of studies.
    """
    return float(stats.t.ppf((1 + level) / 2, persons - 1)) * error


def probability_below(mean: float, error: float, persons: int, prior_sd: float = math.inf) -> float:
    """Return the probability that the true difference is negative.

    Args:
        mean, error: Mean of the difference, and its standard error.
        persons: How many.
        prior_sd: Standard deviation of what differences were expected before, about 0; infinite where nothing was.
    """
    if math.isinf(prior_sd):
        return float(stats.t.cdf(-mean / error, persons - 1))
    grid = np.linspace(-12, 12, 200_001) * prior_sd
    weight = np.exp(-((grid / prior_sd) ** 2) / 2) * (1 + ((grid - mean) / error) ** 2 / (persons - 1)) ** (-persons / 2)
    return float((weight[grid < 0].sum() + weight[grid == 0].sum() / 2) / weight.sum())


def power(effect: float, persons: float, level: float = LEVEL) -> float:
    """Return the probability that a true difference is found.

    Args:
        effect: The difference over the standard deviation of persons' differences.
        persons: How many.
        level: Level of the two-sided test.
    """
    limit, shift = t_from_p(level, persons), abs(effect) * math.sqrt(persons)
    other_way = float(stats.nct.cdf(-limit, persons - 1, shift))  # NaN where it is too small to be computed
    return float(stats.nct.sf(limit, persons - 1, shift)) + (0.0 if math.isnan(other_way) else other_way)


def persons_needed(effect: float, share: float = POWER) -> int | None:
    """Return with how many persons a true difference is found in so many studies of all; None where they are too many.

    Args:
        effect: See `power`.
        share: The share.
    """
    largest = min(20 / max(effect**2, 1e-9) + 40, _MAX_PERSONS)  # with 20 over the square 99 % of all studies find it
    if power(effect, largest) < share:
        return None
    return 2 if power(effect, 2) >= share else math.ceil(brentq(lambda n: power(effect, n) - share, 2, largest))


def smallest_detectable(persons: int, share: float = POWER) -> float:
    """Return the difference, over the standard deviation of persons' differences, that is found in so many studies of all."""
    enough = 4 * t_from_p(LEVEL, persons) / math.sqrt(persons)
    return float(brentq(lambda effect: power(effect, persons) - share, 0.0, enough))
