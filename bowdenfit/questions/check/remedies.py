"""With which settings the model would describe losses of force that it does not: each is tried by least squares.

A zero, a gain, drag and friction that changes with the load or the speed all make losses depend on the load, on the wrap angle,
and on the order in which these were read. Fits tell many of them apart, where the shape of one departure does not.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import jax
import numpy as np

from bowdenfit.cable.conditions import Conditions
from bowdenfit.dataset import Dataset
from bowdenfit.description import Description
from bowdenfit.description.values import QuantityValue
from bowdenfit.errors import DescriptionError
from bowdenfit.inference.least_squares import LeastSquares, fit_least_squares
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.models import Model, build_model
from bowdenfit.results.record import Record, cached_per_fit
from bowdenfit.words import significant

_LARGE_ZERO = 0.3  # of the median load: standard deviation of a zero that is tried; a judgement
_LARGE_GAIN = 0.1  # the same of a relative error of gain
_CLEAR = 3.0  # standard errors by which something that is not in the fit must be off; a judgement
_ZEROS, _GAINS = "the zeros of the load cells fitted", "the gains of the load cells fitted"
_FRICTION = {
    "drag": "hidden tension",
    "load-dependent": "friction that falls with the load",
    "rate-dependent": "friction that changes with the speed",
    "stroke-dependent": "friction that is not the same both ways",
}
_ADVICE = {
    _ZEROS: "Tare the cells with the rope slack; a loss that is the same at every bend looks like a zero.",
    _GAINS: "Calibrate the cells, and look for a bend that nobody measured: it looks the same.",
}


@dataclass(frozen=True)
class _Trial:
    """A setting that is tried.

    Args:
        words: What it is.
        option: How it is written on the command line.
        description: The description with it.
    """

    words: str
    option: str
    description: Description


@cached_per_fit
def describe_remedies(fit: Record) -> str:
    """Describe the settings with which no residual departs from the model any more; empty where none of them helps."""
    described: list[str] = []
    advice: list[str] = []
    for trial in _trials(fit.dataset.description, fit.model.cable.friction.conditions):
        values = _try(fit, trial.description)
        if values:
            described.append(f"with {trial.words} ({trial.option}; {values})")
            advice += [_ADVICE[trial.words]] if trial.words in _ADVICE else []
    if not described:
        return ""
    which = " Which is true these readings cannot tell." if len(described) > 1 else ""
    return " ".join([f"It describes them {'; or '.join(described)}.{which}", *advice])


def _trials(description: Description, conditions: Conditions) -> Iterator[_Trial]:
    """Yield the settings that a description does not have."""
    sensors, friction = description.sensors, description.friction_model
    if not description.fits_offsets:
        zero = f"{float(significant(_LARGE_ZERO * conditions.load.value, 1)):g}"
        changed = sensors.model_copy(update={"offset_sd": QuantityValue(value=float(zero), unit="N")})
        option = f"--set 'sensors.offset_sd={{value={zero},unit=\"N\"}}'"
        yield _Trial(_ZEROS, option, description.model_copy(update={"sensors": changed}))
    if sensors.gain_sd is None or sensors.gain_sd < _LARGE_GAIN:
        names = ("input_gain_error_sd", "output_gain_error_sd")
        changed = sensors.model_copy(update=dict.fromkeys(names, _LARGE_GAIN))
        option = " ".join(f"--set sensors.{name}={_LARGE_GAIN:g}" for name in names)
        yield _Trial(_GAINS, option, description.model_copy(update={"sensors": changed}))
    for model, words in _FRICTION.items():
        if model not in friction and description.cable.kind != "loop":
            more = model if friction == "capstan" else f"{friction}+{model}"
            yield _Trial(words, f"--friction {more}", description.model_copy(update={"friction_model": more}))


def fit_anew(dataset: Dataset) -> tuple[LeastSquares, Model]:
    """Return least squares of a data set without intervals, and its model.

    Raises:
        DescriptionError: The readings lack what the model needs.
    """
    with jax.enable_x64(True):
        posterior = LogDensity(build_model(dataset))
        start = np.zeros(posterior.model.space.size)
        return fit_least_squares(posterior, make_objective(posterior), start, intervals=False), posterior.model


def _try(fit: Record, description: Description) -> str:
    """Return the coefficients of friction, and what the fit did not have, such as 'mu 0.119, output_offset 3.6 N'.

    Empty where residuals depart from the model still, or where the readings do not determine what is new.
    """
    try:
        solved, model = fit_anew(replace(fit.dataset, description=description))
    except DescriptionError:  # the readings lack what it needs, such as speeds
        return ""
    present = {p.name for p in fit.model.space.parameters}
    determined = {name: estimate for name, estimate in solved.estimates.items() if estimate.identified}
    clear = [abs(e.value) > _CLEAR * e.standard_error for name, e in determined.items() if name not in present]
    if not (solved.converged and any(clear)) or any(departure.is_noticeable for departure in solved.departures):
        return ""
    friction = {p.name for p in model.space.parameters if p.role == "friction"}
    units = {name: "" if unit == "1" else unit for name, unit in (solved.units or {}).items()}
    return ", ".join(
        f"{name} {significant(estimate.value, 3)} {units.get(name, '')}".strip()
        for name, estimate in determined.items()
        if name in friction or name not in present
    )
