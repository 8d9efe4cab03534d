"""What a fit says on one page: the answer, whether to trust it, what to do next, and the numbers behind it."""

from collections.abc import Sequence
from dataclasses import dataclass

from bowdenfit.cable.sensors import RUN_SCATTER
from bowdenfit.inference.interval import NORMAL_90, Interval
from bowdenfit.inference.least_squares import Estimate
from bowdenfit.parameters.space import Parameter
from bowdenfit.questions.bends.words import elastic_overview
from bowdenfit.questions.check.answer import check_readings
from bowdenfit.questions.check.table_checks import CheckedReading
from bowdenfit.questions.groups import contrast_groups
from bowdenfit.questions.loss import loss_by_contact
from bowdenfit.questions.recorded.friction_effects import compare_speeds, compute_lost_force
from bowdenfit.questions.summary.sampled_quantities import BETWEEN_MOUNTINGS
from bowdenfit.results.record import Record
from bowdenfit.words import decimals, few

_KEY_ROLES = ("friction", "friction_model", "angle", "elastic")
_FEW = 3  # coefficients and contrasts that the answer names
_COEFFICIENT = "friction coefficient"


@dataclass(frozen=True)
class KeyQuantity:
    """One coefficient as it is shown.

    Args:
        name: As in cable.toml.
        description: What it is.
        unit: Its unit, empty without one.
        value: Median, or estimate of least squares.
        interval: 90 % interval; what is known instead where there is none.
    """

    name: str
    description: str
    unit: str
    value: str
    interval: str


def key_quantities(fit: Record) -> list[KeyQuantity]:
    """Coefficients of friction, of the rope, and the scatter of mountings; curves and noise are details."""
    selected = [p for p in fit.model.space.parameters if p.role in _KEY_ROLES or (p.name == RUN_SCATTER and p.fixed is None)]
    rows = [_key_quantity(fit, p) for p in sorted(selected, key=lambda p: p.name == RUN_SCATTER)]
    return [row for row in rows if row is not None]


def summary_sentences(fit: Record) -> list[str]:
    """The answer in sentences: the first says what to do, or what the coefficients are."""
    if fit.sampled is not None and fit.dataset.description.route is not None:
        best = fit.optimal_length()
        return [best.headline, *best.sentences(), *_loss_sentence(fit), *_option_sentences(fit)]
    return [_coefficient_sentence(fit), *_preload_advice(fit), *_loss_sentence(fit), *_option_sentences(fit)]


def checked_readings(fit: Record) -> tuple[CheckedReading, ...]:
    """Every reading beside what all the others say of it; none without draws."""
    checks = check_readings(fit)
    return checks.readings if checks else ()


def outlying_readings(fit: Record) -> Sequence[CheckedReading]:
    """Readings that lie farther from what all the others say than chance puts one, the farthest first."""
    checks = check_readings(fit)
    return checks.outliers if checks else ()


def _key_quantity(fit: Record, parameter: Parameter) -> KeyQuantity | None:
    is_run_scatter = parameter.name == RUN_SCATTER
    unit, scale = ("%", 100.0) if is_run_scatter else ("" if parameter.unit == "1" else parameter.unit, 1.0)
    description = BETWEEN_MOUNTINGS if is_run_scatter else _describe(parameter)
    if parameter.fixed is not None:
        return KeyQuantity(parameter.name, description, unit, f"{parameter.fixed * parameter.shown_scale:.4g}", "as stated")
    if fit.sampled is not None:
        return KeyQuantity(parameter.name, description, unit, *_format_posterior(fit.parameter(parameter.name).times(scale)))
    estimate = fit.least_squares.estimates.get(parameter.name)
    return KeyQuantity(parameter.name, description, unit, *_format_estimate(estimate)) if estimate is not None else None


def _describe(parameter: Parameter) -> str:
    """'friction, free sheath'; of the options what stands before the colon."""
    meaning = parameter.meaning.replace(_COEFFICIENT, "friction")
    return meaning.split(": ", 1)[-1] if parameter.role == "friction_model" else meaning


def _format_posterior(interval: Interval) -> tuple[str, str]:
    digits = interval.digits
    return f"{interval.median:z.{digits}f}", f"{interval.q05:z.{digits}f} to {interval.q95:z.{digits}f}"


def _format_estimate(estimate: Estimate) -> tuple[str, str]:
    if not estimate.identified:
        return "unknown", "not told"
    digits = decimals(2 * NORMAL_90 * estimate.standard_error)
    interval = f"{estimate.lower:z.{digits}f} to {estimate.upper:z.{digits}f}"
    return f"{estimate.value:z.{digits}f}", interval if "nan" not in interval and "inf" not in interval else "not known"


def _coefficient_sentence(fit: Record) -> str:
    """'Coefficient of friction 0.181 (90 % interval 0.177 to 0.185).'"""
    names = {p.name: p for p in fit.model.space.parameters}
    coefficients = [q for q in key_quantities(fit) if q.name != RUN_SCATTER]
    shown = [q for q in coefficients if names[q.name].role == "friction"] or coefficients
    if not shown:
        return "Nothing was to be found: every coefficient is stated."
    if len(shown) == 1:
        (only,) = shown
        what = (
            "Coefficient of friction"
            if names[only.name].role == "friction"
            else only.description[0].upper() + only.description[1:]
        )
        return f"{what} {_with_unit(only)} ({_interval_phrase(only)})."
    start = "Coefficients of friction: " if names[shown[0].name].role == "friction" else ""
    return f"{start}{few([f'{q.name} {_with_unit(q)}' for q in shown], _FEW)}."


def _with_unit(quantity: KeyQuantity) -> str:
    return f"{quantity.value} {quantity.unit}".rstrip()


def _interval_phrase(quantity: KeyQuantity) -> str:
    return f"90 % interval {quantity.interval}" if " to " in quantity.interval else quantity.interval


def _preload_advice(fit: Record) -> list[str]:
    """Which preload to set, of a cable that has one."""
    overview = elastic_overview(fit)
    return [overview.preload_window.advice] if overview is not None and overview.preload_window is not None else []


def _loss_sentence(fit: Record) -> list[str]:
    """Which contact takes how much of the loss, of a cable that has several."""
    loss = loss_by_contact(fit)
    return [loss.sentence()] if loss is not None else []


def _option_sentences(fit: Record) -> list[str]:
    """What was found of drag, of speed and of groups, where the fit asked for them."""
    groups = contrast_groups(fit)
    contrasts = [f"Friction {c.coefficient}, {c.sentence()}." for c in (groups.contrasts if groups else ())[:_FEW]]
    return [effect.sentence() for effect in (compute_lost_force(fit), compare_speeds(fit)) if effect is not None] + contrasts
