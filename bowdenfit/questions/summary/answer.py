"""What a fit says on one page: the answer, whether to trust it, what to do next, and the numbers behind it."""

from collections.abc import Sequence
from dataclasses import dataclass

from bowdenfit.cable.load_cells import RUN_SCATTER
from bowdenfit.inference.interval import NORMAL_90, Interval
from bowdenfit.inference.least_squares import Estimate
from bowdenfit.parameters.space import Parameter
from bowdenfit.questions.bends.overview import elastic_overview
from bowdenfit.questions.check.answer import checks_of
from bowdenfit.questions.check.table_checks import CheckedReading
from bowdenfit.questions.groups.answer import contrast_groups
from bowdenfit.questions.loss.answer import loss_by_contact
from bowdenfit.questions.recorded.lost_force import lost_force
from bowdenfit.questions.recorded.rate import rate_effect
from bowdenfit.questions.summary.quantities import BETWEEN_MOUNTINGS
from bowdenfit.results.record import Record
from bowdenfit.words import decimals, few

_ROLES = ("friction", "friction_model", "angle", "elastic")
_FEW = 3  # coefficients and contrasts that the answer names
_COEFFICIENT = "friction coefficient"


@dataclass(frozen=True)
class Quantity:
    """One coefficient as it is shown.

    Args:
        name: As in cable.toml.
        what: What it is.
        unit: Its unit, empty without one.
        value: Median, or estimate of least squares.
        interval: 90 % interval; what is known instead where there is none.
    """

    name: str
    what: str
    unit: str
    value: str
    interval: str


def quantities(fit: Record) -> list[Quantity]:
    """Coefficients of friction, of the rope, and the scatter of mountings; curves and noise are details."""
    shown = [p for p in fit.model.space.parameters if p.role in _ROLES or (p.name == RUN_SCATTER and p.fixed is None)]
    found = [_quantity(fit, p) for p in sorted(shown, key=lambda p: p.name == RUN_SCATTER)]
    return [each for each in found if each is not None]


def answer(fit: Record) -> list[str]:
    """The answer in sentences: the first says what to do, or what the coefficients are."""
    if fit.sampled is not None and fit.dataset.description.route is not None:
        best = fit.optimal_length()
        return [best.headline, *best.sentences(), *_loss(fit), *_of_options(fit)]
    return [_coefficients(fit), *_preload(fit), *_loss(fit), *_of_options(fit)]


def checked_readings(fit: Record) -> tuple[CheckedReading, ...]:
    """Every reading beside what all the others say of it; none without draws."""
    found = checks_of(fit)
    return found.readings if found else ()


def readings_off(fit: Record) -> Sequence[CheckedReading]:
    """Readings that lie farther from what all the others say than chance puts one, the farthest first."""
    found = checks_of(fit)
    return found.outliers if found else ()


def _quantity(fit: Record, parameter: Parameter) -> Quantity | None:
    percent = parameter.name == RUN_SCATTER
    unit, scale = ("%", 100.0) if percent else ("" if parameter.unit == "1" else parameter.unit, 1.0)
    what = BETWEEN_MOUNTINGS if percent else _what(parameter)
    if parameter.fixed is not None:
        return Quantity(parameter.name, what, unit, f"{parameter.fixed * parameter.shown_scale:.4g}", "as stated")
    if fit.sampled is not None:
        return Quantity(parameter.name, what, unit, *_drawn(fit.parameter(parameter.name).times(scale)))
    estimate = fit.least_squares.estimates.get(parameter.name)
    return Quantity(parameter.name, what, unit, *_estimated(estimate)) if estimate is not None else None


def _what(parameter: Parameter) -> str:
    """'friction, free sheath'; of the options what stands before the colon."""
    meaning = parameter.meaning.replace(_COEFFICIENT, "friction")
    return meaning.split(": ", 1)[-1] if parameter.role == "friction_model" else meaning


def _drawn(known: Interval) -> tuple[str, str]:
    digits = known.digits
    return f"{known.median:z.{digits}f}", f"{known.q05:z.{digits}f} to {known.q95:z.{digits}f}"


def _estimated(estimate: Estimate) -> tuple[str, str]:
    if not estimate.identified:
        return "unknown", "not told"
    digits = decimals(2 * NORMAL_90 * estimate.standard_error)
    interval = f"{estimate.lower:z.{digits}f} to {estimate.upper:z.{digits}f}"
    return f"{estimate.value:z.{digits}f}", interval if "nan" not in interval and "inf" not in interval else "not known"


def _coefficients(fit: Record) -> str:
    """'Coefficient of friction 0.181 (90 % interval 0.177 to 0.185).'"""
    names = {p.name: p for p in fit.model.space.parameters}
    every = [q for q in quantities(fit) if q.name != RUN_SCATTER]
    shown = [q for q in every if names[q.name].role == "friction"] or every
    if not shown:
        return "Nothing was to be found: every coefficient is stated."
    if len(shown) == 1:
        (one,) = shown
        what = "Coefficient of friction" if names[one.name].role == "friction" else one.what[0].upper() + one.what[1:]
        return f"{what} {_with_unit(one)} ({_interval(one)})."
    start = "Coefficients of friction: " if names[shown[0].name].role == "friction" else ""
    return f"{start}{few([f'{q.name} {_with_unit(q)}' for q in shown], _FEW)}."


def _with_unit(one: Quantity) -> str:
    return f"{one.value} {one.unit}".rstrip()


def _interval(one: Quantity) -> str:
    return f"90 % interval {one.interval}" if " to " in one.interval else one.interval


def _preload(fit: Record) -> list[str]:
    """Which preload to set, of a cable that has one."""
    found = elastic_overview(fit)
    return [found.preload_window.advice] if found is not None and found.preload_window is not None else []


def _loss(fit: Record) -> list[str]:
    """Which contact takes how much of the loss, of a cable that has several."""
    found = loss_by_contact(fit)
    return [found.sentence()] if found is not None else []


def _of_options(fit: Record) -> list[str]:
    """What was found of drag, of speed and of groups, where the fit asked for them."""
    groups = contrast_groups(fit)
    contrasts = [f"Friction {c.coefficient}, {c.sentence()}." for c in (groups.contrasts if groups else ())[:_FEW]]
    return [found.sentence() for found in (lost_force(fit), rate_effect(fit)) if found is not None] + contrasts
