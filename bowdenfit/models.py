"""From a data set to a model: the cable, its parameters and one term for each table."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bowdenfit.cable.cable import CableContacts, constant_angle_name
from bowdenfit.cable.registry import split_coefficient
from bowdenfit.cable.sensors import RUN_SCATTER
from bowdenfit.dataset import Dataset
from bowdenfit.description import (
    Description,
    HalfCauchyPrior,
    HalfNormalPrior,
    LogNormalPrior,
    NormalPrior,
    ParameterSetting,
    PriorChoice,
    PriorDefaults,
    UniformPrior,
)
from bowdenfit.display import Display, Rows
from bowdenfit.errors import DescriptionError, suggest_name
from bowdenfit.kinds import iterate_tables
from bowdenfit.kinds.bench_error import BenchError
from bowdenfit.kinds.covariates import Covariates, collect_covariates
from bowdenfit.kinds.runs import RunsData, RunsTerm
from bowdenfit.kinds.tables import AngleTable, Measurements
from bowdenfit.kinds.term import Term
from bowdenfit.kinds.terms import TERMS, collect_parameters, iterate_term_kinds, make_measured_cable
from bowdenfit.parameters.priors import HalfCauchy, HalfNormal, LogNormal, Normal, Prior, TruncatedNormal, Uniform
from bowdenfit.parameters.space import Parameter, ParameterSpace
from bowdenfit.parameters.symbols import make_symbol
from bowdenfit.words import listed

_WEIGHTS = ("weight", "log_sd")  # arrays of terms that weigh readings by forces or efficiencies


@dataclass(frozen=True, repr=False)
class Model(Display):
    """Everything inference needs: cable, parameters, terms of the likelihood, and where readings were taken."""

    cable: CableContacts
    space: ParameterSpace
    terms: tuple[Term, ...]
    covariates: Mapping[str, Covariates] = field(default_factory=dict, compare=False)
    measurements: Measurements = field(default_factory=Measurements, compare=False)

    @property
    def description(self) -> Description:
        """The description of the cable."""
        return self.cable.description

    @property
    def is_slow(self) -> bool:
        """Whether one log density takes milliseconds; see `Term`."""
        return any(getattr(term, "is_slow", False) for term in self.terms)

    def terms_with_error(self, error: BenchError) -> tuple[Any, ...]:
        """Return all terms with the data that a bench with a systematic error would have given."""
        tables = {kind.name: kind.with_bench_error(table, error) for kind, table in iterate_tables(self.measurements)}
        angles = Measurements(tuple(tables.values())).table(AngleTable)
        changed: list[Any] = [t for name, table in tables.items() for t in TERMS[name].terms(self.cable, table, angles)]
        terms = [_weighed_alike(term, other) for term, other in zip(self.terms, changed, strict=True)]
        return tuple(replace(term, data=_with_constant_angles(term.data, self.cable, error)) for term in terms)

    def sentences(self) -> list[str]:
        """Free parameters and readings by table."""
        terms = listed([f"{len(term.labels)} of {term.name.replace('_', ' ')}" for term in self.terms])
        return [f"Model of {self.description.name}: {self.space.size} free parameters; readings: {terms}."]

    def _table(self) -> Rows:
        every = self.space.parameters
        rows = [{"parameter": p.name, "unit": p.unit, "prior": p.prior_text, "meaning": p.meaning} for p in every]
        return rows, {p.name: p.unit for p in every}


def build_model(dataset: Dataset) -> Model:
    """Build the model of a data set.

    Raises:
        DescriptionError: A curve family, contact law or parameter that the description names is unknown.
    """
    description, measurements = dataset.description, dataset.measurements
    cable = make_measured_cable(description, measurements)
    kinds = list(iterate_term_kinds(measurements))
    terms = [term for kind, table in kinds for term in kind.terms(cable, table, measurements.table(AngleTable))]
    space = _build_space(cable, measurements)
    for kind, table in kinds:
        kind.check(table, space)
    places = {term.name: collect_covariates(description, measurements, term) for term in terms}
    return Model(cable, space, tuple(terms), places, measurements)


def _weighed_alike(term: Any, changed: Any) -> Any:
    """Return a changed term with cells and weights of the original: an error moves readings, and their noise stays as it is."""
    if isinstance(term, RunsTerm) and changed.rows is not None:
        return term.with_rows(changed.rows)
    weights = {name: getattr(term.data, name) for name in _WEIGHTS if hasattr(term.data, name)}
    return replace(changed, data=replace(changed.data, **weights))


def _with_constant_angles(data: Any, cable: CableContacts, error: BenchError) -> Any:
    """Return data of a term whose rows also hold the constant wrap angles of cable.toml, those without a stated error."""
    if isinstance(data, RunsData):
        return replace(data, cells=_with_constant_angles(data.cells, cable, error))
    name = "run_angles" if hasattr(data, "run_angles") else "angles"
    angles = getattr(data, name, None)
    if angles is None:
        return data
    own_angles, is_own = np.array(angles.own, dtype=float), np.array(angles.is_own)
    for k, contact in enumerate(cable.description.contact):
        constant = contact.wrap_angle.constant
        if constant is not None and constant.sd is None:
            own_angles[..., k] = error.apply_to_angles(np.array(constant.to("angle")))
            is_own[..., k] = True
    return replace(data, **{name: replace(angles, own=own_angles, is_own=is_own)})


def _build_space(cable: CableContacts, measurements: Measurements) -> ParameterSpace:
    """Return all parameters as the user has set them; their order is that of z."""
    description, defaults = cable.description, PriorDefaults()
    requested = collect_parameters(cable, measurements)
    parameters = [
        *(_make_friction_parameter(description, name, defaults.friction) for name in cable.coefficients),
        *(p for p in requested if p.role == "curve"),
        *_make_angle_parameters(description),
        *cable.law_parameters(defaults),
        *cable.friction.parameters(defaults),
        *(p for p in requested if p.role != "curve"),
    ]
    known = [p.name for p in parameters]
    for name in description.friction:
        if name not in known and name not in description.coefficients:
            raise DescriptionError(f"cable.toml, friction.{name}: no such coefficient{suggest_name(name, cable.coefficients)}")
    for name in description.prior:
        if name not in known or name in cable.coefficients:
            hint = f"; friction coefficients belong under [friction.{name}]." if name in known else suggest_name(name, known)
            raise DescriptionError(f"cable.toml, prior.{name}: no such parameter{hint}")
    of_groups = {name: split_coefficient(name, description.coefficients)[0] for name in cable.coefficients}
    settings: dict[str, ParameterSetting] = {
        name: description.friction[stem] for name, stem in of_groups.items() if stem in description.friction
    }
    settings |= {**description.friction, **description.prior}
    space = ParameterSpace(tuple(_apply_setting(p, settings[p.name]) if p.name in settings else p for p in parameters))
    for fixed in (p.fixed for p in space.fixed if p.name == RUN_SCATTER):
        if fixed is not None and fixed < 0:
            raise DescriptionError(
                f"cable.toml: {RUN_SCATTER} is fixed at {fixed:g}, and a standard deviation cannot be negative; "
                "write 0 for mountings that are all alike."
            )
    return space


def _make_friction_parameter(description: Description, name: str, prior: LogNormalPrior) -> Parameter:
    whole, group = split_coefficient(name, description.coefficients)
    contacts = " and ".join(c.name for c in description.contact if c.friction == whole)
    subscript = whole.removeprefix("mu").strip("_ ") if whole.startswith("mu") else whole
    subscript = ", ".join(part for part in (subscript, group) if part)
    symbol = make_symbol(r"\mu", subscript) if subscript else r"$\mu$"
    return Parameter(
        name, symbol, f"friction coefficient, {contacts}{f', {group}' if group else ''}", "friction",
        LogNormal(prior.median, prior.log_sd),
    )  # fmt: skip


def _make_angle_parameters(description: Description) -> list[Parameter]:
    """Return parameters for constant wrap angles with a standard deviation: one value for all rows."""
    parameters = []
    for contact in description.contact:
        constant = contact.wrap_angle.constant
        if constant is None or constant.sd is None:
            continue
        prior, degrees = TruncatedNormal(constant.to("angle"), constant.sd_to("angle") or 0.0), float(np.rad2deg(1.0))
        parameters.append(
            Parameter(
                constant_angle_name(contact),
                make_symbol(r"\theta", contact.name),
                f"wrap angle, {contact.name}",
                "angle",
                prior,
                "deg",
                degrees,
                prior_words=prior.text("deg", degrees, 4),
            )
        )
    return parameters


def _apply_setting(default: Parameter, setting: ParameterSetting) -> Parameter:
    """Return a parameter as the user has set it; numbers are in its shown unit."""
    parameter, scale = replace(default, scaled_by=""), default.shown_scale
    if setting.fixed is not None:
        return replace(parameter, fixed=setting.fixed / scale, prior_words="")
    if setting.measured is not None:
        value, sd = setting.measured.value, setting.measured.sd
        words = f"measured {value:g} ± {sd:g}" + ("" if parameter.unit == "1" else f" {parameter.unit}")
        return replace(parameter, prior=TruncatedNormal(value / scale, sd / scale), fixed=None, prior_words=words)
    assert setting.prior is not None  # a setting has exactly one of the three
    _check_support(parameter, setting.prior)
    return replace(parameter, prior=_make_prior(setting.prior, scale), fixed=None, prior_words="")


def _make_prior(choice: PriorChoice, scale: float) -> Prior:
    match choice.lognormal or choice.normal or choice.half_normal or choice.half_cauchy or choice.uniform:
        case LogNormalPrior(median=median, log_sd=log_sd):
            return LogNormal(median / scale, log_sd)
        case NormalPrior(mean=mean, sd=sd):
            return Normal(mean / scale, sd / scale)
        case HalfNormalPrior(sd=sd):
            return HalfNormal(sd / scale)
        case HalfCauchyPrior(scale=half):
            return HalfCauchy(half / scale)
        case UniformPrior(low=low, high=high):
            return Uniform(low / scale, high / scale)
    raise AssertionError("a choice of a prior has exactly one of the five")


def _check_support(parameter: Parameter, choice: PriorChoice) -> None:
    """Refuse a prior that can be negative for a parameter that cannot."""
    may_be_negative = choice.normal is not None or (choice.uniform is not None and choice.uniform.low < 0)
    if may_be_negative and not isinstance(parameter.prior, Normal):
        raise DescriptionError(
            f"cable.toml: {parameter.name} cannot be negative, but its prior can; use lognormal, half_normal, half_cauchy, a "
            "uniform from 0 upward, or measured = { value = ..., sd = ... }."
        )
