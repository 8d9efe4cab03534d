"""The parameters of a fit in a table: draws beside least squares, and what least squares could not tell."""

from math import isfinite

from bowdenfit.inference.interval import Interval
from bowdenfit.inference.least_squares import KINKED, Estimate
from bowdenfit.parameters.space import Parameter
from bowdenfit.results.record import Record
from bowdenfit.words import decimals, filled, listed, table

_HEADS = (
    "parameter", "median", "90 % interval", "mean ± sd", "least squares ± s.e.", "90 % profile interval", "prior", "unit",
)  # fmt: skip
_ALWAYS = (0, 4, 6)  # columns that are shown even where they are empty
_WIDE = 2.5  # standard errors to each side beyond which an interval needs a word; of many readings it is 1.6


def parameters_text(fit: Record) -> str:
    """Every parameter, and remarks on least squares."""
    estimates, drawn = fit.least_squares.estimates, drawn_intervals(fit)
    rows = [_row(p, drawn.get(p.name), estimates.get(p.name), bool(drawn)) for p in fit.model.space.parameters]
    keep = [i for i in range(len(_HEADS)) if i in _ALWAYS or any(row[i] for row in rows)]
    shown = table([_HEADS[i] for i in keep], [[row[i] for i in keep] for row in rows])
    notes = [
        filled(f"{name} is {_trouble(estimate)}: {estimate.remark}.")
        for name, estimate in estimates.items()
        if not estimate.identified
    ]
    condition = fit.least_squares.condition_number
    number = f"{condition:.3g}" if isfinite(condition) else "infinite"
    notes.append(f"Condition number of the least-squares problem: {number}.")
    kinked = [] if drawn else [name for name, estimate in estimates.items() if estimate.remark == KINKED]
    if kinked:
        why = f"{'have' if kinked[1:] else 'has'} {KINKED}. Sampling gets past kinks: fit without --no-mcmc."
        notes.append(filled(f"{listed(kinked)} {why}"))
    wide = [] if drawn else [name for name, estimate in estimates.items() if _is_wide(estimate)]
    if wide:
        notes.append(
            filled(
                f"The intervals of {listed(wide)} are wider than their standard errors suggest: hardly more readings than "
                "unknowns leave little to tell the scatter from, or the sum of squares is lopsided."
            )
        )
    by = [f"{p.name} by {p.scaled_by}" for p in fit.model.space.parameters if p.scaled_by]
    notes += [filled(f"Priors that follow the measurements: {'; '.join(by)}.")] if by else []
    return "\n".join([shown, *notes])


def drawn_intervals(fit: Record) -> dict[str, Interval]:
    """Of every parameter that was sampled; empty without draws."""
    return {p.name: fit.parameter(p.name) for p in fit.model.space.free} if fit.sampled is not None else {}


def _row(parameter: Parameter, known: Interval | None, estimate: Estimate | None, sampled: bool) -> tuple[str, ...]:
    drawn = _moments(known) if known is not None else ("", "", "")
    # Beside a posterior's intervals there is no room for others; those are in summary.json.
    profiled = "" if sampled or estimate is None else _profiled(estimate)
    squares = "" if estimate is None else _with_error(estimate)
    if parameter.fixed is not None:
        squares = f"{parameter.fixed * parameter.shown_scale:.4g} (fixed)"
    return parameter.name, *drawn, squares, profiled, parameter.prior_text, _unit(parameter)


def _unit(parameter: Parameter) -> str:
    return "" if parameter.unit == "1" else parameter.unit


def _moments(known: Interval) -> tuple[str, str, str]:
    """Median, interval, and mean with standard deviation."""
    median, low, high, mean, sd = (
        f"{value:z.{decimals(known.sd)}f}" for value in (known.median, known.q05, known.q95, known.mean, known.sd)
    )
    return median, f"{low} to {high}", f"{mean} ± {sd}"


def _with_error(estimate: Estimate) -> str:
    if not estimate.identified:
        return _without_value(estimate)
    digits = _digits(estimate, abs(estimate.value) / 1000)
    return f"{estimate.value:z.{digits}f} ± {estimate.standard_error:z.{digits}f}"


def _without_value(estimate: Estimate) -> str:
    return "at bound" if estimate.at_bound else "not identified"


def _digits(estimate: Estimate, otherwise: float) -> int:
    """Decimals that go with its standard error, where there is one."""
    error = estimate.standard_error
    return decimals(error if isfinite(error) and error else otherwise)


def _profiled(estimate: Estimate) -> str:
    """Profile interval of least squares; empty where it was not computed."""
    finite = [limit for limit in (estimate.lower, estimate.upper) if isfinite(limit)]
    if not finite:
        return "not limited" if estimate.open else ""
    digits = _digits(estimate, (finite[-1] - finite[0]) / 3 or 1.0)
    shown = [f"{limit:z.{digits}f}" for limit in finite]
    if estimate.open:
        return f"{shown[0]} or more" if "upper" in estimate.open else f"{shown[0]} or less"
    return " to ".join(shown)


def _is_wide(estimate: Estimate) -> bool:
    """Whether the interval is much wider than the standard error says."""
    width, error = estimate.upper - estimate.lower, estimate.standard_error
    return estimate.identified and isfinite(width) and isfinite(error) and width > 2 * _WIDE * error


def _trouble(estimate: Estimate) -> str:
    return "at its bound in least squares" if estimate.at_bound else "not identified by least squares"
