"""From a data set to a model: the cable, its parameters and one term for each table."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jax import Array

from bowdenfit.cable.cable import ANGLE_NOISE, Cable, constant_angle_name
from bowdenfit.cable.elasticity import PRELOAD_NOISE, STRETCH_NOISE
from bowdenfit.cable.load_cells import (
    BLOCK_NOISE,
    DELAY_ERROR,
    FORCE_NOISE,
    GAIN_ERROR,
    INPUT_OFFSET,
    OUTPUT_OFFSET,
    RUN_SCATTER,
)
from bowdenfit.cable.noise import noise_law
from bowdenfit.dataset import Dataset
from bowdenfit.description import (
    Description,
    HalfNormalPrior,
    LogNormalPrior,
    NormalPrior,
    ParameterSetting,
    PriorChoice,
    PriorDefaults,
    QuantityValue,
    UniformPrior,
)
from bowdenfit.errors import DescriptionError, nearest
from bowdenfit.kinds.angles.term import angles_term
from bowdenfit.kinds.efficiencies.term import efficiencies_term
from bowdenfit.kinds.elastic_parameters import elastic_parameters
from bowdenfit.kinds.forces.term import force_terms
from bowdenfit.kinds.loop.term import loop_term
from bowdenfit.kinds.measured_cable import measured_cable
from bowdenfit.kinds.measurements import Measurements
from bowdenfit.kinds.recordings.blocks import RECORDED
from bowdenfit.kinds.recordings.term import recordings_term
from bowdenfit.kinds.stretch.term import preload_term, stretch_term
from bowdenfit.parameters.priors import HalfNormal, LogNormal, Normal, Prior, TruncatedNormal, Uniform
from bowdenfit.parameters.space import Parameter, ParameterSpace

EFFICIENCY_TERMS = ("efficiency", "run_efficiency", RECORDED)  # terms whose readings are efficiencies


@runtime_checkable
class Term(Protocol):
    """One table against one cable: what inference, predictions and reports need of it."""

    @property
    def cable(self) -> Cable:
        """The cable."""
        ...

    @property
    def data(self) -> dict[str, Any]:
        """Arrays that its functions take."""
        ...

    @property
    def labels(self) -> tuple[str, ...]:
        """Each reading in words."""
        ...

    @property
    def name(self) -> str:
        """Name of its readings in results."""
        ...

    @property
    def unit(self) -> str:
        """Unit of its readings in results."""
        ...

    @property
    def noise(self) -> str:
        """The noise scale that its residuals are standardized by."""
        ...

    @property
    def residual_blocks(self) -> tuple[tuple[int, int], ...]:
        """Its residuals by what makes them scatter, in order: how many there are, how many of them vary independently."""
        ...

    def log_likelihood(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Array:
        """Log likelihood of each reading."""
        ...

    def residuals(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Array:
        """Standardized residuals of the same likelihood."""
        ...

    def expected(self, values: Mapping[str, Array], data: Mapping[str, Any]) -> Array:
        """Expected readings in the term's unit."""
        ...

    def simulate(self, values: Mapping[str, Array], data: Mapping[str, Any], key: Array) -> Array:
        """Readings drawn at given parameters, in the term's unit."""
        ...

    def observed(self) -> np.ndarray:
        """Readings in the term's unit."""
        ...


@dataclass(frozen=True)
class Model:
    """Everything inference needs: the cable, the parameters, and the terms of the likelihood."""

    cable: Cable
    space: ParameterSpace
    terms: tuple[Term, ...]

    @property
    def description(self) -> Description:
        """What was said about the cable."""
        return self.cable.description


def build_model(dataset: Dataset) -> Model:
    """The model of a data set.

    Raises:
        DescriptionError: A curve family, contact law or parameter that the description names is unknown.
    """
    description, measurements = dataset.description, dataset.measurements
    cable = measured_cable(description, measurements)
    terms: list[Term] = []
    if measurements.angles is not None:
        terms.append(angles_term(cable, measurements.angles))
    if measurements.efficiencies is not None:
        terms.append(efficiencies_term(cable, measurements.efficiencies, measurements.angles))
    if measurements.forces is not None:
        terms += force_terms(cable, measurements.forces, measurements.angles)
    if measurements.recordings is not None:
        terms.append(recordings_term(cable, measurements.recordings, measurements.angles))
    if measurements.stretch is not None:
        terms.append(stretch_term(cable, measurements.stretch))
    if measurements.preload is not None:
        terms.append(preload_term(cable, measurements.preload))
    if measurements.loop is not None:
        terms.append(loop_term(cable, measurements.loop, measurements.angles))
    return Model(cable, _space(description, measurements, cable), tuple(terms))


def _space(description: Description, measurements: Measurements, cable: Cable) -> ParameterSpace:
    defaults = PriorDefaults()
    parameters = [_friction(description, name, defaults.friction) for name in description.coefficients]
    if measurements.angles is not None:
        for column, curve in cable.curves.items():
            angle = measurements.angles.column(column)[0]
            parameters += curve.parameters(angle[np.isfinite(angle) & _in_range(description, measurements)], defaults)
    parameters += _uncertain_constants(description)
    parameters += cable.friction.parameters(defaults)
    parameters += elastic_parameters(description, measurements, defaults)
    parameters += _noise(description, measurements, defaults)
    parameters += _sensors(description, measurements, defaults)
    known = [p.name for p in parameters]
    for name in description.prior:
        if name not in known or name in description.coefficients:
            hint = f"; friction coefficients belong under [friction.{name}]." if name in known else nearest(name, known)
            raise DescriptionError(f"cable.toml, prior.{name}: no such parameter{hint}")
    settings = {**description.friction, **description.prior}
    space = ParameterSpace(tuple(_set(p, settings[p.name]) if p.name in settings else p for p in parameters))
    _check_run_scatter(space, measurements)
    return space


def _check_run_scatter(space: ParameterSpace, measurements: Measurements) -> None:
    """Mountings may be said to be all alike only where something else makes readings scatter."""
    for fixed in (p.fixed for p in space.fixed if p.name == RUN_SCATTER):
        if fixed is not None and fixed < 0:
            raise DescriptionError(
                f"cable.toml: {RUN_SCATTER} is fixed at {fixed:g}, and a standard deviation cannot be negative; "
                "write 0 for mountings that are all alike."
            )
        table = measurements.efficiencies
        if fixed == 0 and table is not None and not np.all(table.sd > 0):
            place = table.origin.place(int(np.argmin(table.sd > 0)))
            raise DescriptionError(
                f"cable.toml: {RUN_SCATTER} is fixed at 0, but {place} has no standard deviation of its own, so that "
                "nothing would make it scatter and no model could be right; state the sd of every efficiency, or leave "
                f"{RUN_SCATTER} free."
            )


def _in_range(description: Description, measurements: Measurements) -> np.ndarray:
    assert measurements.angles is not None and description.route is not None  # called with both
    low, high = description.route.range
    return (measurements.angles.route >= low) & (measurements.angles.route <= high)


def _friction(description: Description, name: str, prior: LogNormalPrior) -> Parameter:
    contacts = " and ".join(c.name for c in description.contact if c.friction == name)
    stem = name.rstrip("0123456789").rstrip("_")
    subscript = name[len(stem) :].strip("_")
    symbol = (
        rf"$\mu_{{{subscript}}}$"
        if stem == "mu" and subscript
        else r"$\mu$"
        if name == "mu"
        else rf"$\mu_\mathrm{{{name}}}$"
    )
    return Parameter(
        name, symbol.replace("_", " ") if " " in name else symbol, f"friction coefficient, {contacts}", "friction",
        LogNormal(prior.median, prior.log_sd),
    )  # fmt: skip


def _uncertain_constants(description: Description) -> list[Parameter]:
    """Constant wrap angles with a standard deviation: one value for all rows, so one parameter each."""
    parameters = []
    for contact in description.contact:
        constant = contact.wrap_angle.constant
        if constant is None or constant.sd is None:
            continue
        prior, degrees = TruncatedNormal(constant.to("angle"), constant.sd_to("angle") or 0.0), float(np.rad2deg(1.0))
        parameters.append(
            Parameter(
                constant_angle_name(contact),
                rf"$\theta_\mathrm{{{contact.name.replace(' ', chr(92) + ' ')}}}$",
                f"wrap angle, {contact.name}",
                "angle",
                prior,
                "deg",
                degrees,
                prior_words=prior.text("deg", degrees, 4),
            )
        )
    return parameters


def _noise(description: Description, measurements: Measurements, defaults: PriorDefaults) -> list[Parameter]:
    parameters, degree, law = [], float(np.rad2deg(1.0)), noise_law(description)
    if measurements.angles is not None:
        meaning = law.meaning("standard deviation of an angle reading")
        prior = HalfNormal(defaults.angle_noise_degrees / degree)
        parameters.append(Parameter(ANGLE_NOISE, r"$\sigma_\theta$", meaning, "noise", prior, "deg", degree))
    if any(t is not None for t in (measurements.efficiencies, measurements.forces, measurements.recordings)):
        meaning = law.meaning("scatter of the log ratio from mounting to mounting")
        parameters.append(Parameter(RUN_SCATTER, r"$\tau$", meaning, "noise", HalfNormal(defaults.run_scatter)))
    if measurements.forces is not None or measurements.loop is not None:
        meaning = "standard deviation of a force reading"
        meaning = law.meaning(meaning) if measurements.loop is not None else meaning  # inside a run readings are normal
        parameters.append(_force_noise(description.sensors.force_noise, defaults.force_noise_newtons, meaning))
    if measurements.recordings is not None:
        meaning, prior = "standard deviation of a block's mean force", HalfNormal(defaults.block_noise_newtons)
        parameters.append(Parameter(BLOCK_NOISE, r"$\sigma_B$", meaning, "noise", prior, "N"))
    for table, name, symbol, what, sd, unit in (
        (measurements.stretch, STRETCH_NOISE, r"$\sigma_L$", "stretch", defaults.stretch_noise_mm, "mm"),
        (measurements.preload, PRELOAD_NOISE, r"$\sigma_P$", "preload", defaults.preload_noise_newtons, "N"),
    ):
        if table is not None:
            meaning = law.meaning(f"standard deviation of a {what} reading")
            parameters.append(Parameter(name, symbol, meaning, "noise", HalfNormal(sd), unit))
    return parameters


def _sensors(description: Description, measurements: Measurements, defaults: PriorDefaults) -> list[Parameter]:
    """What the load cells may add: a relative gain error between the two, and an offset of each."""
    parameters = []
    gain = description.sensors.gain_error_sd
    if gain is not None:
        meaning = "relative gain error between the two load cells"
        parameters.append(Parameter(GAIN_ERROR, "$g$", meaning, "sensor", Normal(0.0, gain)))
    if description.fits_offsets and any(
        table is not None for table in (measurements.forces, measurements.recordings, measurements.loop)
    ):
        stated = description.sensors.offset_sd
        sd = stated.to("force") if stated is not None else defaults.offset_newtons
        for name, symbol, end in ((INPUT_OFFSET, "in", "input"), (OUTPUT_OFFSET, "out", "output")):
            meaning = f"offset of the {end} load cell"
            parameters.append(Parameter(name, f"$b_\\mathrm{{{symbol}}}$", meaning, "sensor", Normal(0.0, sd), "N"))
    if measurements.recordings is not None and measurements.recordings.delay_sd > 0:
        meaning, sd = "error of the estimated delay between the load cells' channels", measurements.recordings.delay_sd
        parameters.append(
            Parameter(
                DELAY_ERROR, r"$\delta$", meaning, "sensor", Normal(0.0, sd), "ms", 1000.0,
                prior_words=f"Normal(0, {1000 * sd:.3g} ms)",
            )
        )  # fmt: skip
    return parameters


def _force_noise(stated: QuantityValue | None, scale: float, meaning: str) -> Parameter:
    """Noise of a force reading: free, or as the data sheet says, with its standard deviation or without."""
    free = Parameter(FORCE_NOISE, r"$\sigma_F$", meaning, "noise", HalfNormal(scale), "N")
    if stated is None:
        return free
    if stated.sd is None:
        return replace(free, fixed=stated.to("force"), prior_words="fixed (data sheet)")
    return replace(free, prior=TruncatedNormal(stated.to("force"), stated.sd_to("force") or 0.0))


def _set(parameter: Parameter, setting: ParameterSetting) -> Parameter:
    """The parameter as the user wants it; numbers are in its shown unit."""
    scale = parameter.shown_scale
    if setting.fixed is not None:
        return replace(parameter, fixed=setting.fixed / scale, prior_words="")
    if setting.measured is not None:
        value, sd = setting.measured.value, setting.measured.sd
        words = f"measured {value:g} +- {sd:g}" + ("" if parameter.unit == "1" else f" {parameter.unit}")
        return replace(parameter, prior=TruncatedNormal(value / scale, sd / scale), fixed=None, prior_words=words)
    assert setting.prior is not None  # a setting has exactly one of the three
    _check_support(parameter, setting.prior)
    return replace(parameter, prior=_prior(setting.prior, scale), fixed=None, prior_words="")


def _prior(choice: PriorChoice, scale: float) -> Prior:
    match choice.lognormal or choice.normal or choice.half_normal or choice.uniform:
        case LogNormalPrior(median=median, log_sd=log_sd):
            return LogNormal(median / scale, log_sd)
        case NormalPrior(mean=mean, sd=sd):
            return Normal(mean / scale, sd / scale)
        case HalfNormalPrior(sd=sd):
            return HalfNormal(sd / scale)
        case UniformPrior(low=low, high=high):
            return Uniform(low / scale, high / scale)
    raise AssertionError("a choice of a prior has exactly one of the four")


def _check_support(parameter: Parameter, choice: PriorChoice) -> None:
    """A parameter that cannot be negative must not be given a prior that can be."""
    may_be_negative = choice.normal is not None or (choice.uniform is not None and choice.uniform.low < 0)
    if may_be_negative and not isinstance(parameter.prior, Normal):
        raise DescriptionError(
            f"cable.toml: {parameter.name} cannot be negative, but its prior can; use lognormal, half_normal, a uniform "
            "from 0 upward, or measured = { value = ..., sd = ... }."
        )
