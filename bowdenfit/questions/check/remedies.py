"""With which settings the model would describe pairs of forces that it does not: each is tried by least squares.

A zero, a gain, drag and friction that falls with the load all make losses depend on the load or on the wrap angle, and on the
order in which these were read. Fits tell many of them apart, where the shape of one departure does not.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import jax
import numpy as np

from bowdenfit.dataset import Dataset
from bowdenfit.description import Description
from bowdenfit.description.values import QuantityValue
from bowdenfit.inference.least_squares import LeastSquares, fit_least_squares
from bowdenfit.inference.log_density import LogDensity
from bowdenfit.inference.objective import make_objective
from bowdenfit.kinds.forces.table import ForceTable
from bowdenfit.models import build_model
from bowdenfit.results.record import Record, cached_per_fit
from bowdenfit.words import significant

PAIRS = "run_efficiency"  # name of the readings of pairs of forces in results
_LARGE_ZERO = 0.2  # of the largest load: standard deviation of a zero that is tried; a judgement
_LARGE_GAIN = 0.1  # the same of a relative error of gain
_ZEROS, _GAINS = "the zeros of the load cells fitted", "the gains of the load cells fitted"
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
    for trial in _trials(fit):
        solved = _fit(replace(fit.dataset, description=trial.description))
        if solved.converged and not any(departure.is_noticeable for departure in solved.departures):
            described.append(f"with {trial.words} ({trial.option}; {_values(fit, solved)})")
            advice += [_ADVICE[trial.words]] if trial.words in _ADVICE else []
    if not described:
        return ""
    which = " Which is true these readings cannot tell." if len(described) > 1 else ""
    return " ".join([f"It describes them {'; or '.join(described)}.{which}", *advice])


def _trials(fit: Record) -> Iterator[_Trial]:
    """Yield the settings that the fit does not have."""
    description, table = fit.dataset.description, fit.dataset.measurements.table(ForceTable)
    if table is None:
        return
    sensors, friction = description.sensors, description.friction_model
    if not description.fits_offsets:
        zero = f"{float(significant(_LARGE_ZERO * float(max(table.input_force.max(), table.output_force.max())), 1)):g}"
        changed = sensors.model_copy(update={"offset_sd": QuantityValue(value=float(zero), unit="N")})
        option = f"--set 'sensors.offset_sd={{value={zero},unit=\"N\"}}'"
        yield _Trial(_ZEROS, option, description.model_copy(update={"sensors": changed}))
    if sensors.gain_sd is None or sensors.gain_sd < _LARGE_GAIN:
        names = ("input_gain_error_sd", "output_gain_error_sd")
        changed = sensors.model_copy(update=dict.fromkeys(names, _LARGE_GAIN))
        option = " ".join(f"--set sensors.{name}={_LARGE_GAIN:g}" for name in names)
        yield _Trial(_GAINS, option, description.model_copy(update={"sensors": changed}))
    for model, words in (("drag", "hidden tension"), ("load-dependent", "friction that falls with the load")):
        if model not in friction and len(np.unique(np.round(np.log(table.input_force), 1))) > 1:
            more = model if friction == "capstan" else f"{friction}+{model}"
            yield _Trial(words, f"--friction {more}", description.model_copy(update={"friction_model": more}))


def _fit(dataset: Dataset) -> LeastSquares:
    with jax.enable_x64(True):
        posterior = LogDensity(build_model(dataset))
        start = np.zeros(posterior.model.space.size)
        return fit_least_squares(posterior, make_objective(posterior), start, intervals=False)


def _values(fit: Record, solved: LeastSquares) -> str:
    """Return coefficients of friction and what the fit did not have, such as 'mu 0.119, output_offset 3.6 N'."""
    friction = [p.name for p in fit.model.space.free if p.role == "friction"]
    units = {name: "" if unit == "1" else unit for name, unit in (solved.units or {}).items()}
    names = [name for name in solved.estimates if name in friction or name not in fit.model.space.index]
    estimates = {name: solved.estimates[name] for name in names if solved.estimates[name].identified}
    return ", ".join(f"{name} {significant(e.value, 3)} {units.get(name, '')}".strip() for name, e in estimates.items())
